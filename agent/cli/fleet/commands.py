"""`stribeck fleet ...`: a lake of recordings pushed by cells, and the answers over all of it.

Heavy imports are inside the commands: this module is loaded for every `--help`.
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from agent.cli.terminal.options import Json, place

if TYPE_CHECKING:
    from agent.fleet.cluster import Opened
    from agent.fleet.lake import Lake

fleet_app = typer.Typer(
    name="fleet",
    help="Recordings of many robots: push, estimate, monitor, explain, report.",
    no_args_is_help=True,
    rich_markup_mode=None,
)

Where = Annotated[str, typer.Argument(metavar="LAKE", help="A folder, or s3://bucket/prefix.")]
Scheduler = Annotated[
    str, typer.Option(metavar="ADDRESS", help="A Dask scheduler; else workers on this machine.")
]
Workers = Annotated[int, typer.Option(min=1, max=256, help="Worker processes on this machine.")]
Memory = Annotated[
    float, typer.Option(min=0.25, max=4096.0, help="GiB that each of them may take.")
]


@fleet_app.command(short_help="put recordings into the lake")
def push(
    lake: Where,
    recordings: Annotated[
        list[str], typer.Argument(metavar="RECORDING...", help="Files, folders or globs.")
    ],
    site: Annotated[str, typer.Option(help="The site that they are from.")],
    json: Json = False,
) -> None:
    """Put recordings into the lake: each once, whole or not at all; again is harmless."""
    from agent.record.reading import find

    there = _lake(lake, may_be_new=True)
    new: list[str] = []
    again = 0
    for path in find(recordings):
        entry, is_new = there.push(path, site)
        if is_new:
            new.append(entry.path)
        else:
            again += 1
    from agent.cli.terminal.talk import talker

    talker().print(f"{len(new)} pushed, {again} were there already.")
    _answer({"pushed": new, "already": again}, "\n".join(new), as_json=json)


@fleet_app.command(short_help="estimate every recording that is new")
def estimate(
    lake: Where,
    scheduler: Scheduler = "",
    workers: Workers = 2,
    memory: Memory = 2.0,
    json: Json = False,
) -> None:
    """Estimate what is new, or what this version of the code has not estimated yet."""
    from agent.fleet.estimates import estimate_all

    there = _lake(lake)
    opened = _cluster(scheduler, workers, memory)
    with _progress("estimating") as show:
        tally = estimate_all(there, opened, show)
    poisoned = [*tally.failed, *(f"{p}: is no recording of a lake" for p in tally.others)]
    counts = f"{tally.done} recordings estimated, {tally.already} were before"
    text = f"{counts}, {len(poisoned)} cannot be."
    _answer(
        {"estimated": tally.done, "already": tally.already, "unusable": poisoned},
        "\n".join([text, *(f"  - {p}" for p in poisoned)]),
        as_json=json,
    )


@fleet_app.command(short_help="pack the months that are complete")
def pack(
    lake: Where,
    before: Annotated[
        str,
        typer.Option(metavar="YYYY-MM", help="Pack the months before it; else before this one."),
    ] = "",
    json: Json = False,
) -> None:
    """Pack complete months into large files, byte for byte; ending it at any time loses nothing.

    The months' results are put together too. Recordings are deleted only when they were read back
    whole from a pack.
    """
    from agent.fleet.packs import pack_all
    from agent.fleet.tidy import tidy_all

    there = _lake(lake)
    month = _month(before)
    with _progress("packing") as show:
        done = pack_all(there, month, show)
        tidied = tidy_all(there, month)
    text = (
        f"{done.recordings} recordings of {len(done.months)} months packed, the results of "
        f"{tidied} months put together; {len(done.unusable)} recordings cannot be packed."
    )
    _answer(
        {
            "packed": done.recordings,
            "months": list(done.months),
            "tidied": tidied,
            "unusable": list(done.unusable),
        },
        "\n".join([text, *(f"  - {u}" for u in done.unusable)]),
        as_json=json,
    )


@fleet_app.command(short_help="what the models' twins leave out, on every robot")
def explain(
    lake: Where,
    scheduler: Scheduler = "",
    workers: Workers = 2,
    memory: Memory = 2.0,
    json: Json = False,
) -> None:
    """Question each model's twin (fleet.toml) on every joint, and say where they agree."""
    from agent.fleet.explanations import agreements, answers, explain_all, in_words, questions
    from agent.fleet.roster import FILE, roster_of

    there = _lake(lake)
    asked = list(questions(there, roster_of(there)))
    if not asked:
        from agent.cli.terminal.talk import talker

        talker().print(
            f"No joint has a twin in {FILE} and three estimated recordings: nothing is explained."
        )
    opened = _cluster(scheduler, workers, memory)
    with _progress("explaining") as show:
        put = explain_all(there, opened, asked, show)
    already = len(asked) - put.done - len(put.failed)
    agreed = agreements(answers(there, asked))
    lines = [f"{put.done} joints explained, {already} were before.", *map(in_words, agreed)]
    lines += [f"  - {f}" for f in put.failed]
    document = {
        "explained": put.done,
        "already": already,
        "unusable": list(put.failed),
        "agreements": [
            {
                "model": a.model,
                "axis": a.axis,
                "joints": a.asked,
                "without_mismatch": a.without_mismatch,
                "effects": dict(a.effects),
                "sentence": in_words(a),
            }
            for a in agreed
        ],
    }
    _answer(document, "\n".join(lines), as_json=json)


@fleet_app.command(short_help="judge every joint that has new cycles")
def monitor(
    lake: Where,
    detector: Annotated[
        str, typer.Option(help="cusum, thesis, 3-sigma and others (docs/detection.md).")
    ] = "cusum",
    scheduler: Scheduler = "",
    workers: Workers = 2,
    memory: Memory = 2.0,
    json: Json = False,
) -> None:
    """Judge each joint's history by itself; exit code 1 where one shows increased friction."""
    from agent.cli.terminal.exits import BAD_NEWS
    from agent.fleet.verdicts import by_risk, monitor_all

    there = _lake(lake)
    opened = _cluster(scheduler, workers, memory)
    with _progress("judging") as show:
        judged = monitor_all(there, opened, detector, show)
    ranked = by_risk(judged.rows)
    lines = [f"{judged.done} joints judged, {judged.already} were before."]
    lines += [f"{_joint_of(r)}: {r['sentence']}" for r in ranked if r["alarm"]]
    lines += [f"  - {f}" for f in judged.failed]
    document = {
        "judged": judged.done,
        "already": judged.already,
        "unusable": list(judged.failed),
        "joints": [{k: v for k, v in r.items() if k not in ("key", "finding")} for r in ranked],
    }
    if not ranked and not judged.failed:
        from agent.cli.terminal.talk import talker

        talker().print("No recording has an estimate by this version: `stribeck fleet estimate`.")
    _answer(document, "\n".join(lines), as_json=json)
    if any(r["alarm"] for r in ranked):
        raise typer.Exit(BAD_NEWS)


@fleet_app.command(short_help="ranking, models, twins: one offline page")
def report(
    lake: Where,
    out: Annotated[Path, typer.Option(parser=place, help="The HTML file to write.")] = Path(
        "fleet.html"
    ),
    detector: Annotated[str, typer.Option(help="Whose verdicts.")] = "cusum",
) -> None:
    """Write the page: joints by urgency with reasons, models compared, what their twins lack."""
    from agent.cli.fleet.report import page_of
    from agent.report.fleet import in_words, write_fleet_page

    page = page_of(_lake(lake), detector)
    write_fleet_page(out, page)
    typer.echo(in_words(page))
    from agent.cli.terminal.talk import talker

    talker().print(f"Open {out}.")


def _joint_of(row: dict[str, Any]) -> str:
    return f"{row['site']}, {row['robot']} axis {row['axis']}"


def _month(before: str) -> str:
    """Return the month before which to pack: one that is given, or this one."""
    import datetime
    import re

    from agent.errors import UsageError

    if not before:
        return f"{datetime.datetime.now(datetime.UTC):%Y-%m}"
    if not re.fullmatch(r"\d{4}-(0[1-9]|1[0-2])", before):
        raise UsageError(f"--before: expected a month such as 2026-11, got {before}.")
    return before


def _lake(url: str, *, may_be_new: bool = False) -> Lake:
    from agent.errors import InputError

    place(url)
    try:
        from agent.fleet.lake import Lake

        lake = Lake(url)
    except ModuleNotFoundError as error:
        raise InputError(
            f"A fleet needs {error.name}, which is not installed.", "Install stribeck[fleet]."
        ) from error
    if lake.is_folder and not may_be_new and not Path(lake.root).is_dir():
        raise InputError(f"{url} is no folder with a lake.", "`stribeck fleet push` makes one.")
    return lake


def _cluster(scheduler: str, workers: int, memory_gib: float) -> Opened:
    from agent.fleet.cluster import cluster

    return partial(cluster, scheduler, workers, int(memory_gib * (1 << 30)))


@contextmanager
def _progress(doing: str) -> Iterator[Callable[[int, int], None]]:
    from agent.cli.terminal.talk import progress_bar

    with progress_bar(doing) as show:
        yield lambda done, of: show(f"{done} of {of}", done / max(of, 1))


def _answer(document: dict[str, Any], text: str, *, as_json: bool) -> None:
    typer.echo(json.dumps(document, indent=2) if as_json else text)
