"""How recordings are asked for numbers: friction, rigid body, gear, ripple, warmth.

Heavy imports are inside the commands.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import Json, Picture, Recordings, place


def add_commands(app: typer.Typer) -> None:
    """Add the commands to the application, as `--help` lists them."""
    app.command(short_help="friction and rigid body from recordings")(estimate)
    app.command(short_help="the plain twin from recordings")(twin)
    app.command(short_help="torque that is periodic in the motor's position")(ripple)
    app.command(short_help="what the rigid-body regression is worth, and what it leaves")(study)
    app.command(short_help="how the gearbox cools; friction over temperature")(thermal)
    app.command(short_help="the spring behind the gear: resonances, stiffness, damping")(flexible)
    app.command(short_help="what the joint does where it turns round")(reversals)


def estimate(
    recordings: Recordings,
    validation: Annotated[
        str | None,
        typer.Option(metavar="RECORDING", help="A run of its own (reversed stair) to predict."),
    ] = None,
    report: Annotated[
        Path | None, typer.Option(parser=place, help="Write the offline HTML report to this file.")
    ] = None,
    json: Json = False,
) -> None:
    """Estimate friction curve, friction models and rigid body from anybody's recordings."""
    from agent.cli.identify.estimate import run_estimate

    run_estimate(recordings, validation, report, as_json=json)


def twin(
    recordings: Recordings,
    out: Annotated[Path, typer.Option(parser=place, help="The twin to write (TOML).")],
) -> None:
    """Identify the plain twin (rigid body, gravity, Coulomb, viscous) from recordings."""
    from agent.cli.identify.estimate import run_twin

    run_twin(recordings, out)


def ripple(
    recordings: Recordings,
    highest_order: Annotated[
        float | None, typer.Option(help="Highest order per motor turn to look for.")
    ] = None,
    picture: Picture = None,
    json: Json = False,
) -> None:
    """Find the orders and amplitudes of torque ripple from slow passes at constant velocity."""
    from agent.cli.identify.ripple import run_ripple

    run_ripple(recordings, highest_order, picture, as_json=json)


def study(
    recordings: Recordings,
    out: Annotated[Path, typer.Option(parser=place, help="Where study.html and study.json go.")],
    validation: Annotated[
        str | None,
        typer.Option(metavar="RECORDING", help="Judge the residual on this run (reversed stair)."),
    ] = None,
    json: Json = False,
) -> None:
    """Study the rigid body's regression: acceleration thresholds, residual correlations."""
    from agent.cli.identify.study import run_study

    run_study(recordings, out, as_json=json, validation=validation)


def thermal(
    recordings: Recordings,
    until: Annotated[
        float,
        typer.Option(
            min=-100.0, max=300.0, help="Say when the gearbox will be at this temperature, degC."
        ),
    ] = 30.0,
    oil: Annotated[str, typer.Option(help="Name of the oil that the surface is of.")] = "",
    picture: Picture = None,
    json: Json = False,
) -> None:
    """Identify how the gearbox cools, and its friction over velocity and temperature."""
    from agent.cli.identify.thermal import run_thermal

    run_thermal(recordings, until, oil, picture, as_json=json)


def flexible(
    recordings: Recordings,
    kind: Annotated[
        str, typer.Option(metavar="KIND", help="two-mass, three-mass, or auto: what the data ask.")
    ] = "auto",
    validation: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="A run that the fit has not seen; repeatable."),
    ] = None,
    picture: Picture = None,
    json: Json = False,
) -> None:
    """Identify a flexible joint from motor torque and motion; a triangle wave shows most."""
    from agent.cli.identify.flexible import run_flexible

    run_flexible(recordings, kind, validation or [], picture, as_json=json)


def reversals(
    recordings: Recordings,
    picture: Picture = None,
    json: Json = False,
) -> None:
    """Identify presliding (Dahl, Bliman-Sorine, LuGre) and the gear's clearance from reversals."""
    from agent.cli.identify.reversals import run_reversals

    run_reversals(recordings, picture, as_json=json)
