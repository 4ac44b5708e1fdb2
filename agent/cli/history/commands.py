"""The commands on histories of one joint: how they are asked for. Heavy imports are inside."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from agent.cli.terminal.options import Picture, place


def add_commands(app: typer.Typer) -> None:
    """Add the commands to the application."""
    app.command("fake-history", short_help="months of a simulated joint, to try the monitor on")(
        fake_history
    )
    app.command("self-test", short_help="would the monitor catch a rise of this joint?")(self_test)
    app.command(short_help="how often to test, and when the next comparable cycle can be")(schedule)
    app.command(short_help="friction on ordinary work; asks for a dedicated cycle")(watch)
    app.command(short_help="friction from ordinary work, where it excites enough")(ordinary)


def fake_history(
    out: Annotated[Path, typer.Argument(parser=place, metavar="OUT", help="A new folder.")],
    cycles: Annotated[int, typer.Option(min=1, max=5000, help="How many cycles.")] = 60,
    every_days: Annotated[
        float, typer.Option(min=0.01, max=366.0, help="Days from cycle to cycle; 1: nightly.")
    ] = 1.0,
    seed: Annotated[int, typer.Option(min=0, help="The same seed gives the same recordings.")] = 1,
    wear_day: Annotated[
        float | None,
        typer.Option(
            min=-36500.0, max=36500.0, help="Day on which wear begins; without it, never."
        ),
    ] = None,
    wear_nm: Annotated[
        float | None,
        typer.Option(min=0.0, max=1000.0, help="Its friction at low speed, N m; else 0.3."),
    ] = None,
    wear_days: Annotated[
        float | None,
        typer.Option(min=0.01, max=36500.0, help="Days until it has grown to that; else 60."),
    ] = None,
    oil_day: Annotated[
        float | None, typer.Option(min=-36500.0, max=36500.0, help="Day of an oil change.")
    ] = None,
    swap_day: Annotated[
        float | None, typer.Option(min=-36500.0, max=36500.0, help="Day of a gearbox swap.")
    ] = None,
    payload_kg: Annotated[
        list[float] | None,
        typer.Option(min=0.0, max=10000.0, help="One of these is carried each night; repeatable."),
    ] = None,
    robot: Annotated[str, typer.Option(help="The robot's name in the recordings.")] = "simulated",
    work: Annotated[
        bool, typer.Option("--work", help="Write ordinary work cycles, too (OUT/work).")
    ] = False,
) -> None:
    """Simulate a joint over months, a stair cycle a night, and write its recordings."""
    from agent.cli.history.fake_history import HistoryRequest, run_fake_history

    if wear_day is None and not (wear_nm is None and wear_days is None):
        raise typer.BadParameter("--wear-nm and --wear-days belong to --wear-day")
    wear = (0.3 if wear_nm is None else wear_nm, 60.0 if wear_days is None else wear_days)
    request = HistoryRequest(
        cycles, every_days, seed, wear_day, *wear, oil_day, swap_day, tuple(payload_kg or ()), robot
    )
    run_fake_history(out, request, work=work)


def watch(
    work: Annotated[
        list[str], typer.Argument(metavar="WORK...", help="Recordings of ordinary work.")
    ],
    dedicated: Annotated[
        list[str],
        typer.Option(metavar="RECORDING", help="A dedicated cycle of the healthy joint; several."),
    ],
    healthy: Annotated[
        int, typer.Option(min=5, help="How many of the first recordings are held to be healthy.")
    ] = 10,
    false_rate: Annotated[
        float, typer.Option(help="How often a healthy recording may ask, as a share.")
    ] = 0.01,
    picture: Picture = None,
    json: Annotated[
        bool, typer.Option("--json", help="Write the result to stdout as JSON.")
    ] = False,
) -> None:
    """Follow friction on ordinary work with an observer; ask for a dedicated cycle when it must."""
    from agent.cli.history.watch import run_watch

    run_watch(work, dedicated, healthy, false_rate, picture, as_json=json)


def ordinary(
    work: Annotated[
        list[str], typer.Argument(metavar="WORK...", help="Recordings of ordinary work.")
    ],
    dedicated: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="A dedicated cycle to compare with; several."),
    ] = None,
    json: Annotated[
        bool, typer.Option("--json", help="Write the result to stdout as JSON.")
    ] = False,
) -> None:
    """Estimate friction from ordinary work, or say why it is not decidable from it."""
    from agent.cli.history.ordinary import run_ordinary

    run_ordinary(work, dedicated or [], as_json=json)


def self_test(
    history: Annotated[
        list[str], typer.Argument(metavar="HISTORY...", help="Recordings of healthy cycles.")
    ],
    rise: Annotated[
        float, typer.Option(help="The rise that must be caught, % of low-speed friction.")
    ] = 10.0,
    within: Annotated[int, typer.Option(min=1, help="Cycles in which it must be caught.")] = 20,
    replays: Annotated[int, typer.Option(min=20, max=2000, help="How many replays.")] = 120,
    seed: Annotated[int, typer.Option(min=0, help="What the replays are drawn by.")] = 1,
    baseline: Annotated[
        int | None, typer.Option(min=3, help="Healthy cycles to learn from, as for `monitor`.")
    ] = None,
    detector: Annotated[str, typer.Option(help="As for `monitor`.")] = "cusum",
    cache: Annotated[
        bool, typer.Option("--cache/--no-cache", help="Keep what each recording came to.")
    ] = True,
    json: Annotated[
        bool, typer.Option("--json", help="Write the result to stdout as JSON.")
    ] = False,
) -> None:
    """Inject a known friction rise into replays of a joint's history and say if it is caught."""
    from agent.cli.history.self_test import SelfTestRequest, run_self_test

    request = SelfTestRequest(rise, within, replays, seed, baseline, detector, cache)
    run_self_test(history, request, as_json=json)


def schedule(
    history: Annotated[
        list[str] | None,
        typer.Argument(metavar="HISTORY", help="A joint's cycles, to learn its numbers from."),
    ] = None,
    swing: Annotated[
        float,
        typer.Option(min=0.0, max=100.0, help="Half of the gearbox's swing over the year, degC."),
    ] = 10.0,
    wear: Annotated[
        float, typer.Option(min=0.01, max=1000.0, help="Wear to be found, % of friction a month.")
    ] = 5.0,
    limit: Annotated[
        float, typer.Option(min=0.01, max=1000.0, help="Rise by which it must be found, %.")
    ] = 15.0,
    minutes: Annotated[
        float, typer.Option(min=0.01, max=1440.0, help="That one experiment stops the robot.")
    ] = 1.5,
    false_alarms: Annotated[
        float, typer.Option(min=0.001, max=365.0, help="That are accepted in a year.")
    ] = 0.1,
    slope: Annotated[
        float | None,
        typer.Option(
            min=-100.0, max=100.0, help="Change of friction, % a degree; else of the history."
        ),
    ] = None,
    scatter: Annotated[
        float | None,
        typer.Option(min=0.001, max=100.0, help="From cycle to cycle, %; else of the history."),
    ] = None,
    ambient: Annotated[
        float | None, typer.Option(min=-100.0, max=100.0, help="The hall's temperature now, degC.")
    ] = None,
    cooling: Annotated[
        list[str] | None,
        typer.Option(metavar="RECORDING", help="The joint at rest until now; repeatable."),
    ] = None,
    picture: Picture = None,
    cache: Annotated[
        bool, typer.Option("--cache/--no-cache", help="Keep what each recording came to.")
    ] = True,
    json: Annotated[
        bool, typer.Option("--json", help="Write the result to stdout as JSON.")
    ] = False,
) -> None:
    """Say how often to test: what each rate costs and sees at the site's temperature swing."""
    from agent.cli.history.schedule import ScheduleRequest, run_schedule

    if not history and (cooling or ambient is not None):
        raise typer.BadParameter("--ambient and --cooling say when the joint of a HISTORY is due")
    wish = (wear / 100.0, limit / 100.0, false_alarms, minutes)
    request = ScheduleRequest(swing, wish, slope, scatter, ambient, tuple(cooling or ()), cache)
    run_schedule(history or [], request, picture, as_json=json)
