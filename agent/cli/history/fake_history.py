"""`stribeck fake-history`: months of recordings of a joint that is not there, to try things on."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import typer

from agent.cli.terminal.talk import progress_bar, talker
from agent.errors import InputError

if TYPE_CHECKING:
    from fakes.history import CycleRun, HistoryPlan


@dataclass(frozen=True)
class HistoryRequest:
    """What the command line asks for; days count from the first cycle, None is never."""

    cycles: int
    every_days: float
    seed: int
    wear_day: float | None
    wear_nm: float
    wear_days: float
    oil_day: float | None
    swap_day: float | None
    payloads_kg: tuple[float, ...]
    robot: str


def run_fake_history(out: Path, request: HistoryRequest, *, work: bool) -> None:
    """Write a history into a folder; with `work`, recordings of ordinary work beside it.

    Raises
    ------
    agent.errors.InputError
        The request makes no history, or the folder holds one already.
    """
    from agent.record.atomic import check_folder
    from fakes.history import cycles, ordinary_runs

    plan = _plan(request)
    check_folder(out)
    if out.exists() and any(out.iterdir()):
        raise InputError(f"{out} is not empty.", "Name a new folder.")
    written = _write(cycles(plan), out, request.cycles)
    if work:
        _write(ordinary_runs(plan), out / "work", request.cycles)
    last = written[-1]
    talker().print(f"{len(written)} cycles of a simulated joint, up to {last.name}.")
    typer.echo(str(out))


def _plan(request: HistoryRequest) -> HistoryPlan:
    from fakes.history import HistoryPlan, OilChange, Swap, Wear

    try:
        events: list[Wear | OilChange | Swap] = []
        if request.wear_day is not None:
            events.append(Wear(request.wear_day, request.wear_days, request.wear_nm))
        if request.oil_day is not None:
            events.append(OilChange(request.oil_day))
        if request.swap_day is not None:
            events.append(Swap(request.swap_day))
        return HistoryPlan(
            cycles=request.cycles,
            every_days=request.every_days,
            seed=request.seed,
            payloads_kg=request.payloads_kg or (0.0,),
            robot=request.robot,
            events=tuple(events),
        )
    except ValueError as error:
        raise InputError(f"No history can be made of that: {error}.") from error


def _write(runs: Iterable[CycleRun], folder: Path, total: int) -> list[Path]:
    from agent.record.atomic import make_folder
    from agent.record.metadata import Metadata
    from agent.record.recording import Recording
    from agent.record.writing import write

    out = []
    with progress_bar("simulating") as show:
        for number, run in enumerate(runs, start=1):
            metadata = Metadata.from_json(dict(run.metadata), run.name)
            make_folder(folder)  # not before it is known that there is something to write
            path = folder / f"{run.name}.parquet"
            out.append(write(Recording(run.columns, metadata, str(path)), path))
            show(run.name, number / total)
    return out
