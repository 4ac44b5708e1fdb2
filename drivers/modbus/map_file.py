"""Register maps as TOML files; the shipped ones are in `drivers/profiles/maps`."""

from __future__ import annotations

from pathlib import Path

from drivers.described import Shelf
from drivers.modbus.register_map import RegisterMap


class RegisterMapError(ValueError):
    """A register map cannot be used; the message names every mistake."""


_SHELF = Shelf(RegisterMap, "drivers.profiles.maps", "register map", RegisterMapError)


def parse_map(text: str, source: str = "the register map") -> RegisterMap:
    """Parse and validate a register map.

    Raises
    ------
    RegisterMapError
        With every mistake on a line of its own.
    """
    return _SHELF.parse(text, source)


def shipped_maps() -> tuple[str, ...]:
    """Return the names of the maps that come with the product."""
    return _SHELF.shipped()


def load_map(name_or_path: str, folder: Path | None = None) -> RegisterMap:
    """Return a shipped map by its name, or one from a file (`drivers.described.Shelf.load`).

    Raises
    ------
    RegisterMapError
        Where there is no such map, or with every mistake in it.
    """
    return _SHELF.load(name_or_path, folder)
