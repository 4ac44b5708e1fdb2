"""The commands. Heavy imports are inside them, so that `--help` is instant."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.app_history import add_commands
from agent.cli.app_monitor import add_commands as add_monitor_command
from agent.cli.app_night import add_commands as add_night_commands
from agent.cli.app_page import add_commands as add_page_commands
from agent.cli.app_record import add_commands as add_record_commands
from agent.cli.app_stop import add_commands as add_stop_command
from agent.cli.fleet import fleet_app

app = typer.Typer(
    name="stribeck",
    help="Friction of industrial robot joints: drive the stair, record, estimate, explain.",
    no_args_is_help=True,
    pretty_exceptions_enable=False,
    add_completion=False,
    rich_markup_mode=None,
)

Json = Annotated[bool, typer.Option("--json", help="Write the result to stdout as JSON.")]
Recordings = Annotated[
    list[str], typer.Argument(metavar="RECORDING...", help="Files, folders or globs.")
]


@app.callback()
def options(
    debug: Annotated[bool, typer.Option("--debug", help="Show a traceback on errors.")] = False,
) -> None:
    """Friction of industrial robot joints: drive the stair, record, estimate, explain."""


@app.command(short_help="the whole story on a simulated joint, no hardware")
def demo(
    out: Annotated[Path, typer.Option(help="Where the files go.")] = Path("stribeck-demo"),
    seed: Annotated[int, typer.Option(help="Seed of the simulated robot.")] = 1,
) -> None:
    """Show the whole story on a simulated robot joint on a virtual CAN bus; no hardware."""
    from agent.cli.demo import run_demo

    run_demo(out, seed)


@app.command(short_help="one cycle on a real axis, up to the verdict")
def run(
    cell: Annotated[Path, typer.Argument(metavar="CELL.toml", help="The cell's description.")],
    axis: Annotated[int, typer.Option(help="Number of the axis.")],
    out: Annotated[
        Path | None, typer.Option(help="Where the files go; else the cell's folder.")
    ] = None,
    reverse: Annotated[
        bool, typer.Option("--reverse", help="Drive the reversed stair (validation run).")
    ] = False,
    trajectory: Annotated[
        Path | None,
        typer.Option(metavar="PLAN.json", help="Drive this (`plan --out`), or `triangle`."),
    ] = None,
    contour: Annotated[
        bool,
        typer.Option("--contour", help="Creep over the travel instead: is the way free, and even?"),
    ] = False,
    torque_nm: Annotated[
        float | None, typer.Option(help="Torque limit of --contour; else from what is expected.")
    ] = None,
    dry_run: Annotated[
        bool, typer.Option("--dry-run", help="Say what would be driven; open no bus.")
    ] = False,
    json: Json = False,
) -> None:
    """Drive one cycle on a real axis: preflight, stair, recording, estimate, verdict."""
    from agent.cli.run import dry_run_axis, run_axis

    if torque_nm is not None and not contour:
        raise typer.BadParameter("--torque-nm belongs to --contour")
    if contour:
        from agent.cli.contour import dry_run_contour, run_contour

        if reverse or trajectory is not None:
            raise typer.BadParameter("--contour drives its own way")
        if dry_run:
            dry_run_contour(cell, axis, torque_nm)
        else:
            run_contour(cell, axis, out, torque_nm, as_json=json)
    elif dry_run:
        dry_run_axis(cell, axis, reverse=reverse, trajectory_path=trajectory)
    else:
        run_axis(cell, axis, out, reverse=reverse, as_json=json, trajectory_path=trajectory)


@app.command(short_help="the best stair for the time there is")
def plan(
    cell: Annotated[Path, typer.Argument(metavar="CELL.toml", help="The cell's description.")],
    axis: Annotated[int, typer.Option(help="Number of the axis.")],
    seconds: Annotated[
        float | None, typer.Option(help="How long the stair may last; not needed for --aliases.")
    ] = None,
    out: Annotated[
        Path, typer.Option(help="Folder for plan.json (for `run --trajectory`) and the picture.")
    ] = Path("stribeck-plan"),
    noise_nm: Annotated[
        float, typer.Option(help="Torque noise to reckon with: white, and as much coloured.")
    ] = 0.02,
    dwell_s: Annotated[
        float, typer.Option(help="No speed is held for less; 0.7 and more where the arm is soft.")
    ] = 0.5,
    aliases: Annotated[
        bool,
        typer.Option(
            "--aliases",
            help="Say what the cycle cannot tell apart; without --seconds, the cell's own.",
        ),
    ] = False,
    json: Json = False,
) -> None:
    """Design the stair that tells most in the time there is; say what it can and cannot see."""
    from agent.cli.plan import run_plan

    run_plan(
        cell,
        axis,
        seconds,
        out,
        noise_nm=noise_nm,
        dwell_s=dwell_s,
        as_json=json,
        with_aliases=aliases,
    )


@app.command(short_help="friction and rigid body from recordings")
def estimate(
    recordings: Recordings,
    validation: Annotated[
        str | None,
        typer.Option(metavar="RECORDING", help="A run of its own (reversed stair) to predict."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(help="Write the offline HTML report to this file.")
    ] = None,
    json: Json = False,
) -> None:
    """Estimate friction curve, friction models and rigid body from anybody's recordings."""
    from agent.cli.estimate import run_estimate

    run_estimate(recordings, validation, report, as_json=json)


@app.command(short_help="the plain twin from recordings")
def twin(
    recordings: Recordings,
    out: Annotated[Path, typer.Option(help="The twin to write (TOML).")],
) -> None:
    """Identify the plain twin (rigid body, gravity, Coulomb, viscous) from recordings."""
    from agent.cli.estimate import run_twin

    run_twin(recordings, out)


@app.command(short_help="what a simulation leaves out: located, named, modelled, proven")
def explain(
    twin: Annotated[Path, typer.Argument(metavar="TWIN.toml", help="What the simulation knows.")],
    recordings: Recordings,
    out: Annotated[Path, typer.Option(help="Where report, explanation and extended twin go.")],
    holdout: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="Prove it on these; repeatable."),
    ] = None,
    cell: Annotated[
        Path | None,
        typer.Option(metavar="CELL.toml", help="Plan the next experiment within its limits."),
    ] = None,
    json: Json = False,
) -> None:
    """Say where simulation and recordings differ, what physics is missing, and prove it."""
    from agent.cli.explain import run_explain

    run_explain(twin, recordings, holdout or [], out, as_json=json, cell=cell)


@app.command(short_help="conceals effects, explains them blind, prints the score")
def prove(
    cases: Annotated[int, typer.Option(help="How many cases; 12 take about two minutes.")] = 12,
    seed: Annotated[
        int, typer.Option(help="First seed; below 10000 is for development and no score.")
    ] = 10000,
    full: Annotated[
        bool, typer.Option("--full", help="All 120 cases (docs/proof.md): a quarter of an hour.")
    ] = False,
    processes: Annotated[int, typer.Option(help="How many cases at a time.")] = 2,
    json: Json = False,
) -> None:
    """Conceal effects in simulated recordings, explain them blind, open the labels, score."""
    from agent.cli.prove import run_prove

    run_prove(cases, seed, full=full, processes=processes, as_json=json)


@app.command(short_help="a twin's torque beside a recording's own")
def simulate(
    twin: Annotated[Path, typer.Argument(metavar="TWIN.toml", help="The twin.")],
    recording: Annotated[str, typer.Argument(metavar="RECORDING", help="One recording.")],
    out: Annotated[Path, typer.Option(help="The recording to write (.parquet or .csv).")],
) -> None:
    """Add torque_simulated_nm: what the twin predicts for the recording's own motion."""
    from agent.cli.simulate import run_simulate

    run_simulate(twin, recording, out)


@app.command(short_help="torque that is periodic in the motor's position")
def ripple(
    recordings: Recordings,
    highest_order: Annotated[
        float | None, typer.Option(help="Highest order per motor turn to look for.")
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Write the picture to this file (.svg or .png).")
    ] = None,
    json: Json = False,
) -> None:
    """Find the orders and amplitudes of torque ripple from slow passes at constant velocity."""
    from agent.cli.ripple import run_ripple

    run_ripple(recordings, highest_order, picture, as_json=json)


@app.command(short_help="what the rigid-body regression is worth, and what it leaves")
def study(
    recordings: Recordings,
    out: Annotated[Path, typer.Option(help="Where study.html and study.json go.")],
    validation: Annotated[
        str | None,
        typer.Option(metavar="RECORDING", help="Judge the residual on this run (reversed stair)."),
    ] = None,
    json: Json = False,
) -> None:
    """Study the rigid body's regression: acceleration thresholds, residual correlations."""
    from agent.cli.study import run_study

    run_study(recordings, out, as_json=json, validation=validation)


@app.command(short_help="how the gearbox cools; friction over temperature")
def thermal(
    recordings: Recordings,
    until: Annotated[
        float, typer.Option(help="Say when the gearbox will be at this temperature, degC.")
    ] = 30.0,
    oil: Annotated[str, typer.Option(help="Name of the oil that the surface is of.")] = "",
    picture: Annotated[
        Path | None, typer.Option(help="Write the picture to this file (.svg or .png).")
    ] = None,
    json: Json = False,
) -> None:
    """Identify how the gearbox cools, and its friction over velocity and temperature."""
    from agent.cli.thermal import run_thermal

    run_thermal(recordings, until, oil, picture, as_json=json)


@app.command(short_help="the spring behind the gear: resonances, stiffness, damping")
def flexible(
    recordings: Recordings,
    kind: Annotated[
        str, typer.Option(metavar="KIND", help="two-mass, three-mass, or auto: what the data ask.")
    ] = "auto",
    validation: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="A run that the fit has not seen; repeatable."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Write the picture to this file (.svg or .png).")
    ] = None,
    json: Json = False,
) -> None:
    """Identify a flexible joint from motor torque and motion; a triangle wave shows most."""
    from agent.cli.flexible import run_flexible

    run_flexible(recordings, kind, validation or [], picture, as_json=json)


@app.command(short_help="what the joint does where it turns round")
def reversals(
    recordings: Recordings,
    picture: Annotated[
        Path | None, typer.Option(help="Write the picture to this file (.svg or .png).")
    ] = None,
    json: Json = False,
) -> None:
    """Identify presliding (Dahl, Bliman-Sorine, LuGre) and the gear's clearance from reversals."""
    from agent.cli.reversals import run_reversals

    run_reversals(recordings, picture, as_json=json)


@app.command(short_help="a simulated servo drive as a process")
def fake(
    interface: Annotated[
        str, typer.Option(help="python-can interface: udp_multicast, socketcan, ...")
    ] = "udp_multicast",
    channel: Annotated[str, typer.Option(help="Channel of that interface.")] = "239.74.163.2",
    node: Annotated[int, typer.Option(help="CANopen node id.")] = 1,
    seed: Annotated[int, typer.Option(help="Seed of its noise.")] = 1,
    bus_option: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="Option of the interface; repeatable."),
    ] = None,
    joint: Annotated[
        Path | None, typer.Option(help="Description of the joint (TOML or JSON); else the default.")
    ] = None,
    write_cell: Annotated[
        Path | None, typer.Option(help="Write a CELL.toml that drives this very joint.")
    ] = None,
    short: Annotated[
        bool, typer.Option("--short", help="Let that cell ask for a stair of 12 s, not 40 s.")
    ] = False,
) -> None:
    """Start a simulated servo drive with its joint, in real time, as a process of its own."""
    from agent.cli.fake import FakeRequest, run_fake

    request = FakeRequest(interface, channel, tuple(bus_option or ()), node, seed, joint)
    run_fake(request, write_cell, short=short)


@app.command("verify-map", short_help="does a Modbus register map fit the device?")
def verify_map(
    map_name: Annotated[str, typer.Argument(metavar="MAP", help="A shipped map, or MAP.toml.")],
    tcp: Annotated[str | None, typer.Option(metavar="HOST:PORT", help="Modbus TCP.")] = None,
    rtu: Annotated[str | None, typer.Option(metavar="PORT", help="Modbus RTU.")] = None,
    baudrate: Annotated[int, typer.Option(min=300, help="Of the serial line.")] = 19_200,
    parity: Annotated[str, typer.Option(help="Of the serial line: N, E or O.")] = "E",
    stopbits: Annotated[int, typer.Option(min=1, max=2, help="Of the serial line.")] = 1,
    device: Annotated[int, typer.Option(min=0, max=255, help="Unit or station.")] = 1,
    register: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Only this one; repeatable.")
    ] = None,
    rounds: Annotated[int, typer.Option(min=1, max=1000, help="How often to read.")] = 5,
    interval_s: Annotated[float, typer.Option(min=0.0, help="Between rounds.")] = 0.2,
    timeout_s: Annotated[float, typer.Option(min=0.01, help="For each request.")] = 1.0,
    json: Json = False,
) -> None:
    """Read a Modbus device by a register map and say which of its values make no sense."""
    from agent.cli.verify_map import VerifyRequest, run_verify_map

    request = VerifyRequest(
        map_name, tcp, rtu, baudrate, parity, stopbits, device, tuple(register or ()), rounds,
        interval_s, timeout_s,
    )  # fmt: skip
    run_verify_map(request, as_json=json)


@app.command(short_help="what a drive's EDS or DCF says of it")
def eds(
    file: Annotated[Path, typer.Argument(metavar="FILE", help="An EDS or DCF (CiA 306).")],
    json: Json = False,
) -> None:
    """Say what of a drive's profile its EDS decides, and which lines of it are bad."""
    from agent.cli.eds import run_eds

    run_eds(file, as_json=json)


@app.command(short_help="finish what a kill or power cut left")
def recover(
    recordings: Annotated[
        list[Path], typer.Argument(metavar="FOLDER|FILE...", help="Where a run was cut off.")
    ],
) -> None:
    """Finish the recordings that a kill or a power cut has left behind."""
    from agent.cli.recover import run_recover

    run_recover(recordings)


@app.command("example-cell", short_help="an example CELL.toml, every key explained")
def example_cell() -> None:
    """Print an example CELL.toml with every key explained; it is not commissioned."""
    from importlib.resources import files

    typer.echo(files("agent.examples").joinpath("cell.toml").read_text(encoding="utf-8"), nl=False)


add_commands(app)
add_monitor_command(app)
add_stop_command(app)
add_page_commands(app)
add_record_commands(app)
app.add_typer(fleet_app, short_help="recordings of many robots, on one machine or many")
add_night_commands(app)
