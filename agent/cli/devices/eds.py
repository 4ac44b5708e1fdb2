"""`stribeck eds`: what of a profile a drive's EDS decides, and which lines of the file are bad."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import typer

from agent.cli.terminal.talk import talker
from agent.errors import InputError
from drivers.cia402.eds import Decided, Eds, decide, read_eds
from drivers.errors import why_unreadable

SCHEMA = "stribeck.eds/1"
LARGEST_BYTES = 20_000_000


def run_eds(path: Path, *, as_json: bool) -> None:
    """Read the file, print what it decides; its bad lines go to stderr, or into the JSON.

    Raises
    ------
    agent.errors.InputError
        The file cannot be read, or describes no object at all.
    """
    try:
        if path.stat().st_size > LARGEST_BYTES:
            raise InputError(f"{path} is larger than {LARGEST_BYTES // 1_000_000} MB: no EDS is.")
        data = path.read_bytes()
    except OSError as error:
        raise InputError(f"The EDS {path} cannot be read: {why_unreadable(error)}.") from error
    eds = read_eds(data)
    if not eds.objects:
        raise InputError(f"{path} describes no object of a device: it is no EDS.")
    decided = decide(eds)
    if as_json:
        typer.echo(json.dumps(_document(eds, decided), indent=2))
    else:
        console = talker()
        for warned in eds.warnings:
            console.print(f"{path.name}: {warned}", markup=False)
        typer.echo("\n".join(_lines(eds, decided)))


def _lines(eds: Eds, decided: Decided) -> list[str]:
    """Return what the file decides, a line each."""
    name = " ".join(
        eds.device.get(key, "") for key in ("vendorname", "productname") if eds.device.get(key)
    )
    modes = "not said" if decided.modes is None else ", ".join(decided.modes) or "none"
    rows = [
        ("device", name or "not said"),
        ("objects", str(len(eds.objects))),
        ("modes (0x6502)", modes),
        ("abort connection option (0x6007)", _ships(decided.abort_connection)),
        ("consumer heartbeat (0x1016)", _ships(decided.heartbeat_consumer)),
        ("rated torque (0x6076)", _ships(decided.rated_torque, " mN m")),
        ("software limits (0x607D)", "there" if decided.software_limits else "missing"),
    ]
    lines = [f"{what:<34}{value}" for what, value in rows]
    for entry in decided.temperatures:
        mapped = "can be mapped" if entry.mappable else "by SDO only"
        lines.append(f"{'temperature':<34}{entry.key} {entry.type_name}, {mapped}: {entry.name}")
    return [*lines, *(f"  - {text}" for text in decided.warnings)]


def _ships(value: int | None, unit: str = "") -> str:
    return "missing" if value is None else f"ships as {value}{unit if value else ''}"


def _document(eds: Eds, decided: Decided) -> dict[str, Any]:
    """Return the same as JSON."""
    return {
        "schema": SCHEMA,
        "device": dict(eds.device),
        "objects": len(eds.objects),
        "modes": None if decided.modes is None else list(decided.modes),
        "abort_connection_0x6007": decided.abort_connection,
        "heartbeat_consumer_0x1016": decided.heartbeat_consumer,
        "rated_torque_mnm_0x6076": decided.rated_torque,
        "software_limits_0x607D": decided.software_limits,
        "temperatures": [
            {
                "object": entry.key,
                "name": entry.name,
                "type": entry.type_name,
                "mappable": entry.mappable,
                "line": entry.line,
            }
            for entry in decided.temperatures
        ],
        "warnings": list(decided.warnings),
        "bad_lines": [{"line": w.line, "text": w.text} for w in eds.warnings],
    }
