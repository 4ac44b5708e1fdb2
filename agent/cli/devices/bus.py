"""`stribeck bus`: who talks on a cell's CAN bus, how regularly, and how full it is."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import typer

from agent.cell.cell import Bus, read_cell
from agent.cli.terminal.exits import BAD_NEWS
from agent.cli.terminal.talk import talker
from agent.errors import InputError
from agent.wire.drive import bus_config
from drivers.can.listening import Heard, listen
from drivers.can.traffic import BUSIEST_OVER_S, Stream, who_says
from drivers.clock import Clock, MonotonicClock
from trajectories import lasting

SCHEMA = "stribeck.bus/1"
SILENCE = (
    "nothing was heard. Drives that nobody asks may be silent; else check that they have power, "
    "the bitrate, the wiring and the termination"
)
FULL = 0.7
"""Of a bus with cyclic traffic; above it frames of low priority wait for several others."""

_MASTERS = (0x000, 0x080)


def run_bus(cell_path: Path, seconds: float, *, as_json: bool, clock: Clock | None = None) -> None:
    """Listen, print what was heard; exit code 1 where something is odd. Nothing is sent.

    A silent bus decides nothing: it may be a fault, or drives that nobody asks.

    Raises
    ------
    agent.errors.InputError
        The cell cannot be used, or plays a recording.
    drivers.errors.BusError
        The bus does not open, or stops working.
    """
    bus = read_cell(cell_path).bus
    if bus.replays:
        raise InputError("This cell plays a recording: there is no bus to listen to.")
    if not as_json:
        talker().print(f"Listening to {bus.interface}:{bus.channel} for {lasting(seconds)} ...")
    heard = listen(bus_config(bus), clock or MonotonicClock(), seconds)
    odd = remarks(heard, bus)
    if as_json:
        typer.echo(json.dumps(_document(heard, bus, odd), indent=2, allow_nan=False))
    else:
        typer.echo("\n".join([*_lines(heard, bus), *(f"  - {text}" for text in odd)]))
    if set(odd) - {SILENCE}:
        raise typer.Exit(BAD_NEWS)


def remarks(heard: Heard, bus: Bus) -> list[str]:
    """Return what is odd about a bus, and what to do about it; empty where nothing is."""
    traffic, found = heard.traffic, []
    spoken = {stream.cob_id for stream in traffic.streams()}
    if not (traffic.frames or traffic.extended or traffic.remote or traffic.error_frames):
        found.append(SILENCE)
    if traffic.error_frames:
        found.append(
            f"the adapter reports {traffic.error_frames} errors on the bus: check bitrate, wiring "
            "and termination before anything moves"
        )
    if heard.reception.dropped_by_kernel:
        found.append(
            f"this computer had no room for {heard.reception.dropped_by_kernel} frames: "
            "the counts are too low"
        )
    if traffic.malformed:
        found.append(f"{traffic.malformed} frames are longer than 8 bytes: no CANopen")
    if masters := [who_says(cob_id) for cob_id in _MASTERS if cob_id in spoken]:
        found.append(
            f"somebody sends {' and '.join(masters)}: unless a cycle of ours runs now, end that "
            "program or controller first, for drives would answer it, too"
        )
    busiest = traffic.busiest(bus.bitrate)
    if busiest > FULL:
        found.append(
            f"its busiest {BUSIEST_OVER_S:g} s were {busiest:.0%} full: lower a rate, or leave "
            "drives that are not under test PRE-OPERATIONAL"
        )
    return found


def _lines(heard: Heard, bus: Bus) -> list[str]:
    traffic = heard.traffic
    least, most = traffic.load(bus.bitrate, heard.duration_s)
    dropped = heard.reception.dropped_by_kernel
    lines = [
        f"{traffic.frames} frames in {lasting(heard.duration_s)}; of {bus.bitrate} bit/s "
        f"{least:.1%} in use, with the worst stuffing {most:.1%}, "
        f"over the busiest {BUSIEST_OVER_S:g} s {traffic.busiest(bus.bitrate):.1%}; "
        f"29-bit {traffic.extended}, remote {traffic.remote}, errors {traffic.error_frames}, "
        f"dropped by the kernel {'not known' if dropped is None else dropped}"
    ]
    streams = traffic.streams()
    if streams:
        lines.append(
            f"{'id':<7}{'who':<26}{'frames':>9}{'per s':>10}{'jitter':>12}{'longest gap':>14}"
        )
    for s in streams:
        rate = f"{s.frames / heard.duration_s:.1f}"
        lines.append(
            f"0x{s.cob_id:03X}  {who_says(s.cob_id):<26}{s.frames:>9}{rate:>10}"
            f"{_milliseconds(s.jitter_s):>12}{_milliseconds(s.longest_s):>14}"
        )
    return lines


def _milliseconds(seconds: float) -> str:
    return "-" if math.isnan(seconds) else f"{1e3 * seconds:.2f} ms"


def _document(heard: Heard, bus: Bus, odd: list[str]) -> dict[str, Any]:
    traffic, reception = heard.traffic, heard.reception
    least, most = traffic.load(bus.bitrate, heard.duration_s)
    return {
        "schema": SCHEMA,
        "interface": bus.interface,
        "channel": bus.channel,
        "duration_s": heard.duration_s,
        "frames": traffic.frames,
        "extended": traffic.extended,
        "remote": traffic.remote,
        "error_frames": traffic.error_frames,
        "malformed": traffic.malformed,
        "dropped_by_kernel": reception.dropped_by_kernel,
        "reader": reception.reader,
        "load": {"least": least, "most": most, "busiest": traffic.busiest(bus.bitrate)},
        "streams": [_stream(stream) for stream in traffic.streams()],
        "remarks": odd,
    }


def _stream(stream: Stream) -> dict[str, Any]:
    """Return one identifier's entry; what one frame alone does not tell is null."""
    times = {
        "period_s": stream.period_s,
        "jitter_s": stream.jitter_s,
        "longest_s": stream.longest_s,
    }
    return {
        "id": stream.cob_id,
        "who": who_says(stream.cob_id),
        "frames": stream.frames,
        **{key: None if math.isnan(value) else value for key, value in times.items()},
    }
