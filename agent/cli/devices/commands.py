"""How devices are simulated and looked at, and their descriptions checked.

Heavy imports are inside the commands.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import Json, place


def add_commands(app: typer.Typer) -> None:
    """Add the commands to the application, as `--help` lists them."""
    app.command(short_help="a simulated servo drive as a process")(fake)
    app.command("verify-map", short_help="does a Modbus register map fit the device?")(verify_map)
    app.command(short_help="what a drive's EDS or DCF says of it")(eds)
    app.command(short_help="who talks on a cell's CAN bus, and how full it is")(bus)


def fake(
    interface: Annotated[
        str, typer.Option(help="python-can interface: udp_multicast, socketcan, ...")
    ] = "udp_multicast",
    channel: Annotated[str, typer.Option(help="Channel of that interface.")] = "239.74.163.2",
    node: Annotated[int, typer.Option(min=1, max=127, help="CANopen node id.")] = 1,
    seed: Annotated[int, typer.Option(min=0, help="Seed of its noise.")] = 1,
    bus_option: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="Option of the interface; repeatable."),
    ] = None,
    joint: Annotated[
        Path | None,
        typer.Option(
            parser=place, help="Description of the joint (TOML or JSON); else the default."
        ),
    ] = None,
    write_cell: Annotated[
        Path | None,
        typer.Option(parser=place, help="Write a CELL.toml that drives this very joint."),
    ] = None,
    short: Annotated[
        bool, typer.Option("--short", help="Let that cell ask for a stair of 12 s, not 40 s.")
    ] = False,
) -> None:
    """Start a simulated servo drive with its joint, in real time, as a process of its own."""
    from agent.cli.devices.fake import FakeRequest, run_fake

    request = FakeRequest(interface, channel, tuple(bus_option or ()), node, seed, joint)
    run_fake(request, write_cell, short=short)


def verify_map(
    map_name: Annotated[str, typer.Argument(metavar="MAP", help="A shipped map, or MAP.toml.")],
    tcp: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="Modbus TCP.")] = None,
    rtu: Annotated[str | None, typer.Option(metavar="PORT", help="Modbus RTU.")] = None,
    baudrate: Annotated[
        int, typer.Option(min=300, max=20_000_000, help="Of the serial line.")
    ] = 19_200,
    parity: Annotated[str, typer.Option(help="Of the serial line: N, E or O.")] = "E",
    stopbits: Annotated[int, typer.Option(min=1, max=2, help="Of the serial line.")] = 1,
    device: Annotated[int, typer.Option(min=0, max=255, help="Unit or station.")] = 1,
    register: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Only this one; repeatable.")
    ] = None,
    rounds: Annotated[int, typer.Option(min=1, max=1000, help="How often to read.")] = 5,
    interval_s: Annotated[float, typer.Option(min=0.0, max=3600.0, help="Between rounds.")] = 0.2,
    timeout_s: Annotated[float, typer.Option(min=0.01, max=3600.0, help="For each request.")] = 1.0,
    json: Json = False,
) -> None:
    """Read a Modbus device by a register map and say which of its values make no sense."""
    from agent.cli.devices.verify_map import VerifyRequest, run_verify_map

    request = VerifyRequest(
        map_name,
        tcp,
        rtu,
        baudrate,
        parity,
        stopbits,
        device,
        tuple(register or ()),
        rounds,
        interval_s,
        timeout_s,
    )
    run_verify_map(request, as_json=json)


def eds(
    file: Annotated[
        Path, typer.Argument(parser=place, metavar="FILE", help="An EDS or DCF (CiA 306).")
    ],
    json: Json = False,
) -> None:
    """Say what of a drive's profile its EDS decides, and which lines of it are bad."""
    from agent.cli.devices.eds import run_eds

    run_eds(file, as_json=json)


def bus(
    cell: Annotated[Path, typer.Argument(parser=place, metavar="CELL.toml")],
    seconds: Annotated[float, typer.Option(min=0.1, max=3600.0, help="How long to listen.")] = 5.0,
    json: Json = False,
) -> None:
    """Listen to a cell's bus: identifiers, rates, jitter, load. Nothing is sent."""
    from agent.cli.devices.bus import run_bus

    run_bus(cell, seconds, as_json=json)
