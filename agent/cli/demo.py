"""`stribeck demo`: the whole story on a simulated joint, faster than real time."""

from __future__ import annotations

import secrets
from pathlib import Path

import typer

from agent.cell import parse_cell
from agent.cli.fake_cell import fake_cell_text
from agent.cli.outcome import conclude
from agent.cli.summary import summary
from agent.cli.talk import progress_bar, stop_on_signal, talker
from agent.errors import StorageError
from agent.record.reading import read
from agent.wire import CycleRequest, drive_cycle
from drivers.clock import SteppedClock
from fakes.can_drive import FakeDrive
from fakes.process import open_bus
from fakes.specification import FakeSpecification

INTERFACE = "virtual"


def run_demo(out: Path, seed: int) -> None:
    """Drive the stair and its reverse on the simulated joint, estimate, report, name the files."""
    try:
        out.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise StorageError(f"The folder {out} cannot be made: {error}.") from error
    specification = FakeSpecification()
    channel = f"stribeck-demo-{secrets.token_hex(4)}"
    cell = parse_cell(fake_cell_text(specification, interface=INTERFACE, channel=channel), "demo")
    axis = cell.axis_numbered(1)
    talker().print(
        "A simulated robot joint on a virtual CAN bus: CiA 402 drive, gear "
        f"{specification.joint.gear_ratio:g}, friction with Stribeck effect. Nothing real moves."
    )
    clock = SteppedClock()
    bus = open_bus(INTERFACE, channel)
    try:
        drive = FakeDrive(bus, node_id=axis.drive.node_id, specification=specification, seed=seed)
        clock.attach(drive.step_to)
        paths = []
        with stop_on_signal() as stop_requested:
            for name, reverse in (("stair", False), ("reversed stair", True)):
                with progress_bar(name) as progress:
                    result = drive_cycle(
                        CycleRequest(cell, axis, out, reverse),
                        clock,
                        stop_requested=stop_requested,
                        progress=progress,
                    )
                paths.append(result.recording)
    finally:
        bus.shutdown()
    stair, reverse_run = (read(path) for path in paths)
    conclusion = conclude([stair], reverse_run)
    json_path = conclusion.write_json(out / "demo.estimate.json")
    report_path = conclusion.write_report(out / "demo.report.html")
    typer.echo(summary(conclusion.estimate))
    typer.echo("\nOpen these files:")
    for what, path in (
        ("recording", paths[0]),
        ("reversed run", paths[1]),
        ("estimate", json_path),
        ("report", report_path),
    ):
        typer.echo(f"  {what:<13} {path}")
