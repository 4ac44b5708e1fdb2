"""`stribeck verify-map`: whether a register map fits the device that answers."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import typer

from agent.cli.terminal.exits import BAD_NEWS
from agent.cli.terminal.talk import talker
from agent.wire.devices import MapCheck, check_map, register_map_named
from drivers.modbus.connection import Endpoint, SerialEndpoint, TcpEndpoint
from drivers.modbus.plausibility import Finding, RegisterVerdict


@dataclass(frozen=True)
class VerifyRequest:
    """What to verify, and where.

    Parameters
    ----------
    map_name : str
        A shipped map or a file.
    tcp, rtu : str or None
        HOST:PORT or a serial port; exactly one of the two.
    baudrate, parity, stopbits
        Of the serial line.
    device_id : int
        Unit or station.
    registers : sequence of str
        Only these; empty means all.
    rounds : int
        How often to read.
    interval_s, timeout_s : float
        Between rounds, and for each request.
    """

    map_name: str
    tcp: str | None
    rtu: str | None
    baudrate: int
    parity: str
    stopbits: int
    device_id: int
    registers: Sequence[str]
    rounds: int
    interval_s: float
    timeout_s: float


def run_verify_map(request: VerifyRequest, *, as_json: bool) -> None:
    """Read the map, judge it, print a table or JSON; exit code 1 where something is odd.

    Raises
    ------
    typer.BadParameter
        The device's place is not said, or is none.
    agent.errors.InputError
        The map cannot be used.
    drivers.errors.DriverError
        Nobody answers.
    """
    register_map = register_map_named(request.map_name)
    endpoint = _endpoint(request)
    talker().print(
        f"{register_map.device} at {endpoint}; the map says: {register_map.source} "
        f"({register_map.confirmed})."
    )
    if register_map.trap:
        talker().print(f"Known trap: {register_map.trap}.")
    verdicts = check_map(
        MapCheck(
            register_map,
            endpoint,
            device_id=request.device_id,
            registers=tuple(request.registers),
            rounds=request.rounds,
            interval_s=request.interval_s,
            timeout_s=request.timeout_s,
        )
    )
    bad = [v for v in verdicts if v.finding.is_bad]
    nothing = bool(verdicts) and all(v.finding is Finding.NO_VALUE for v in verdicts)
    if as_json:
        document = {
            "schema": "stribeck.verify-map/1",
            "device": register_map.device,
            "endpoint": str(endpoint),
            "plausible": not bad and not nothing,
            "registers": [v.to_json() for v in verdicts],
        }
        typer.echo(json.dumps(document, indent=2, allow_nan=False))
    else:
        typer.echo(table(verdicts))
    if bad or nothing:
        raise typer.Exit(BAD_NEWS)


def table(verdicts: Sequence[RegisterVerdict]) -> str:
    """Return the verdicts as aligned lines, reasons below the register that they are about."""
    width = max((len(v.name) for v in verdicts), default=8)
    lines = [f"{'register':<{width}}  {'raw':<20} {'value':>12}  {'unit':<6} finding"]
    for v in verdicts:
        raw = " ".join(f"{word:04X}" for word in v.raw) or "-"
        shown = "-" if v.value != v.value else f"{v.value:.6g}"
        unsure = "  (map entry unconfirmed)" if v.confirmed == "unconfirmed" else ""
        lines.append(
            f"{v.name:<{width}}  {raw:<20} {shown:>12}  {v.unit:<6} {v.finding.value}{unsure}"
        )
        lines += [f"{'':<{width}}    {reason}" for reason in v.reasons]
    return "\n".join(lines)


def _endpoint(request: VerifyRequest) -> Endpoint:
    if (request.tcp is None) == (request.rtu is None):
        raise typer.BadParameter("give the device's place: either --tcp HOST:PORT or --rtu PORT")
    if request.tcp is not None:
        host, colon, port = request.tcp.rpartition(":")
        if not colon:
            host, port = request.tcp, "502"
        if not port.isdigit() or not 0 < int(port) < 65536 or not host:
            raise typer.BadParameter(f"--tcp expects HOST:PORT, got {request.tcp!r}")
        return TcpEndpoint(host, int(port))
    if not str(request.rtu).strip():
        raise typer.BadParameter("--rtu expects the name of a serial port, got ''")
    if request.parity not in ("N", "E", "O") or request.stopbits not in (1, 2):
        raise typer.BadParameter("--parity is N, E or O, --stopbits 1 or 2")
    parity: Literal["N", "E", "O"] = "N"
    if request.parity != "N":
        parity = "E" if request.parity == "E" else "O"
    return SerialEndpoint(
        str(request.rtu), request.baudrate, parity, 1 if request.stopbits == 1 else 2
    )
