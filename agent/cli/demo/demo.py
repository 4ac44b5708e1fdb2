"""`stribeck demo`: the whole story on a simulated joint, faster than real time."""

from __future__ import annotations

import secrets
from collections.abc import Iterable
from pathlib import Path

import typer

from agent.cell.cell import Axis, Cell, parse_cell
from agent.cli.demo.concealed import opened, secrets_of, simulation_of
from agent.cli.devices.fake_cell import fake_cell_text
from agent.cli.explain.explain import run_explain
from agent.cli.identify.summary import summary
from agent.cli.terminal.talk import progress_bar, stop_on_signal, talker
from agent.conclude.outcome import conclude
from agent.physics.twin import format_twin
from agent.record.atomic import make_folder, publish
from agent.record.reading import read
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.clock import SteppedClock
from fakes.can_drive import FakeDrive
from fakes.process import open_bus
from fakes.specification import FakeSpecification

INTERFACE = "virtual"


def run_demo(out: Path, seed: int) -> None:
    """Drive, estimate, report, explain what a simulation of the joint lacks, name the files."""
    make_folder(out)
    specification = FakeSpecification()
    channel = f"stribeck-demo-{secrets.token_hex(4)}"
    cell = parse_cell(fake_cell_text(specification, interface=INTERFACE, channel=channel), "demo")
    axis = cell.axis_numbered(1)
    talker().print(
        "A simulated robot joint on a virtual CAN bus: CiA 402 drive, gear "
        f"{specification.joint.gear_ratio:g}, friction with Stribeck effect. Nothing real moves."
    )
    stair, reverse = _drive(specification, cell, axis, out, channel, seed)
    typer.echo(_chapter(1, "What the joint is like: the stair, estimated"))
    files = [("recording", stair), ("reversed run", reverse), *_estimate(stair, reverse, out)]
    typer.echo(_chapter(2, "What a simulation of this joint leaves out"))
    files += _explain(specification, cell, axis, (stair, reverse), out)
    typer.echo("\nOpen these files:")
    for what, path in files:
        typer.echo(f"  {what:<13} {path}")


def _drive(
    specification: FakeSpecification, cell: Cell, axis: Axis, out: Path, channel: str, seed: int
) -> tuple[Path, Path]:
    """Drive the stair and its reverse over the bus; return their recordings."""
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
    return paths[0], paths[1]


def _estimate(stair: Path, reverse: Path, out: Path) -> Iterable[tuple[str, Path]]:
    """Estimate the stair, predict its reverse, print and write both; yield the files."""
    conclusion = conclude([read(stair)], read(reverse))
    typer.echo(summary(conclusion.estimate))
    yield "estimate", conclusion.write_json(out / "demo.estimate.json")
    yield "report", conclusion.write_report(out / "demo.report.html")


def _explain(
    specification: FakeSpecification,
    cell: Cell,
    axis: Axis,
    recordings: tuple[Path, Path],
    out: Path,
) -> Iterable[tuple[str, Path]]:
    """Explain the stair to a plain simulation, prove it on the reverse; yield the files."""
    stair, reverse = recordings
    simulation, folder = out / "simulation.toml", out / "explanation"
    twin = simulation_of(specification, robot=cell.robot, axis=axis.number)
    publish({simulation: format_twin(twin).encode()}, overwrite=True)
    typer.echo(
        "A plain simulation knows this joint's inertia, Coulomb and viscous friction, and\n"
        "they are right. Nobody tells `stribeck explain` what it lacks. It learns\n"
        "from the stair, and the reversed stair, which it has not seen, is the proof.\n"
    )
    run_explain(simulation, [str(stair)], [str(reverse)], folder, as_json=False)
    typer.echo(f"\n{opened(secrets_of(specification), folder / 'explanation.json')}")
    yield "simulation", simulation
    yield "explanation", folder / "report.html"
    yield "better twin", folder / "twin.toml"


def _chapter(number: int, title: str) -> str:
    return f"\n{number}. {title}\n{'-' * (len(title) + 3)}\n"
