"""Register maps as TOML files: read whole or refused whole, with every mistake named at once.

Shipped maps are in `drivers/profiles/maps`.
"""

from __future__ import annotations

import tomllib
from importlib.resources import files
from pathlib import Path
from typing import Any

from pydantic import ValidationError

from drivers.modbus.register_map import RegisterMap

MAPS = "drivers.profiles.maps"


class RegisterMapError(ValueError):
    """A register map cannot be used; the message names every mistake."""


def parse_map(text: str, source: str = "the register map") -> RegisterMap:
    """Parse and validate a register map.

    Raises
    ------
    RegisterMapError
        With every mistake on a line of its own.
    """
    try:
        return RegisterMap.model_validate(tomllib.loads(text))
    except tomllib.TOMLDecodeError as error:
        raise RegisterMapError(f"{source} is not TOML: {error}.") from error
    except ValidationError as error:
        mistakes = [_mistake(e) for e in error.errors()]
        head = f"{source} has {len(mistakes)} mistake{'s' if len(mistakes) > 1 else ''}:"
        raise RegisterMapError("\n  - ".join([head, *mistakes])) from error


def shipped_maps() -> tuple[str, ...]:
    """Return the names of the maps that come with the product."""
    names = (entry.name for entry in files(MAPS).iterdir())
    return tuple(sorted(n.removesuffix(".toml") for n in names if n.endswith(".toml")))


def load_map(name_or_path: str, folder: Path | None = None) -> RegisterMap:
    """Return a shipped map by its name, or one from a file.

    Parameters
    ----------
    name_or_path : str
        A name of `shipped_maps`, or the path of a TOML file.
    folder : pathlib.Path, optional
        What a relative path is relative to.

    Raises
    ------
    RegisterMapError
        Where there is no such map, or with every mistake in it.
    """
    if name_or_path in shipped_maps():
        entry = files(MAPS).joinpath(f"{name_or_path}.toml")
        return parse_map(entry.read_text(encoding="utf-8"), f"the shipped map {name_or_path}")
    path = Path(name_or_path) if folder is None else folder / name_or_path
    try:
        return parse_map(path.read_text(encoding="utf-8"), str(path))
    except (OSError, UnicodeDecodeError) as error:
        raise RegisterMapError(
            f"The register map {path} cannot be read: {error}. Shipped maps: "
            f"{', '.join(shipped_maps())}."
        ) from error


def _mistake(error: Any) -> str:
    """Return one of pydantic's errors as a line that names the key as TOML has it."""
    where = ""
    for part in error["loc"]:
        where += f"[{part + 1}]" if isinstance(part, int) else f".{part}" if where else str(part)
    if error["type"] == "extra_forbidden":
        return f"{where}: unknown key"
    if error["type"] == "missing":
        return f"{where}: is missing"
    given = error.get("input")
    shown = "" if isinstance(given, dict | list | tuple) else f" (given: {given!r})"
    message = error["msg"].removeprefix("Value error, ")
    return f"{where or 'the map'}: {message}{shown}"
