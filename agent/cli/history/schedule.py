"""`stribeck schedule`: how often to test, and when the next comparable cycle can be run."""

from __future__ import annotations

import json
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import typer

from agent.cli.terminal.pictures import write_picture
from agent.cli.terminal.talk import progress_bar, talker
from agent.conclude.cycles import cache_folder, cycles_of, nothing_usable
from agent.errors import InputError
from agent.identify.thermal.cooling import Cooling, estimate_cooling
from agent.monitor.baseline.baseline import FEWEST_ASKED, Baseline, baseline_of
from agent.monitor.compensation.compensation import PRIORS, Law
from agent.monitor.history.history import JointHistory, histories
from agent.monitor.history.table import features_table
from agent.monitor.schedule.cooling import NextCycle, Warmth, next_comparable, warmth
from agent.monitor.schedule.rate import Rate, RatePlan, Site, Wish, plan_rate
from agent.numbers import signed
from agent.record.reading import find, read_all

SCHEMA = "stribeck.schedule/1"
_FEATURE = "integral_w"
_USUAL_SCATTER = 0.01


@dataclass(frozen=True)
class ScheduleRequest:
    """What the command line asks for; None is taken from the history, else from what is usual.

    `wish` has the values of `agent.monitor.schedule.rate.Wish`, in its order.
    """

    swing_degc: float
    wish: tuple[float, float, float, float]
    slope_percent_per_k: float | None
    scatter_percent: float | None
    ambient_degc: float | None
    cooling: Sequence[str]
    cache: bool = True


@dataclass(frozen=True)
class Schedule:
    """The plan, where its numbers are from, and how the last cycle was run."""

    plan: RatePlan
    sources: tuple[str, ...]
    last: Warmth | None
    following: NextCycle | None


def run_schedule(
    patterns: Sequence[str], request: ScheduleRequest, picture: Path | None, *, as_json: bool
) -> None:
    """Plan the rate of experiments and print it.

    Raises
    ------
    agent.errors.InputError
        The recordings are of several joints or cannot be used, or a number makes no sense.
    """
    try:
        found = _schedule(_history(patterns, request) if patterns else None, request)
    except ValueError as error:
        raise InputError(f"No schedule can be made of that: {error}.") from error
    if picture is not None:
        from agent.report.figures.rate import figure_rate

        write_picture(picture, figure_rate(found.plan))
    typer.echo(json.dumps(_document(found), indent=2) if as_json else schedule_text(found))


def _history(patterns: Sequence[str], request: ScheduleRequest) -> JointHistory:
    with progress_bar("estimating") as show:
        cycles, unreadable = cycles_of(
            find(patterns), cache_folder() if request.cache else None, show
        )
    if not cycles:
        raise nothing_usable(unreadable)
    for bad in unreadable:
        talker().print(f"Set aside: {bad.reason}")
    found = histories(cycles)
    if len(found) != 1:
        raise InputError(
            f"These recordings are of {len(found)} joints.", "Plan for each joint by itself."
        )
    return found[0]


def _schedule(history: JointHistory | None, request: ScheduleRequest) -> Schedule:
    """Take what the history knows, and the usual where it does not."""
    law, baseline, temperatures = None, None, np.zeros(0)
    if history is not None and history.segments:
        segment = history.segments[-1]
        own = slice(segment.start, segment.stop)
        features = features_table(history.cycles[own], history.features[own])
        baseline = baseline_of(features)
        if not baseline.enough and features.count >= FEWEST_ASKED:
            baseline = baseline_of(features, features.count)  # unsure, and as unsure as it says
        law = baseline.laws.get(_FEATURE)
        temperatures = features.conditions.temperature_degc
    told = 0 if history is None else sum(s.stop - s.start for s in history.segments[-1:])
    site, sources = _site(law, baseline, request, None if history is None else told)
    plan = plan_rate(site, Wish(*request.wish))
    if not temperatures.size or baseline is None:
        return Schedule(plan, sources, None, None)
    last = warmth(float(temperatures[-1]), temperatures[: max(baseline.cycles, 1)])
    ambient = math.nan if request.ambient_degc is None else request.ambient_degc
    return Schedule(plan, sources, last, next_comparable(last, ambient, _cooling(request.cooling)))


def _site(
    law: Law | None, baseline: Baseline | None, request: ScheduleRequest, cycles: int | None
) -> tuple[Site, tuple[str, ...]]:
    """Return the site's numbers and where each is from; `cycles` is None without recordings."""
    prior = PRIORS[_FEATURE]
    slope, deviation = prior.slope_per_k, prior.slope_deviation_per_k
    scatter, sources = _USUAL_SCATTER, []
    if law is not None and baseline is not None:
        own = law.slope_per_k
        if all(math.isfinite(x) for x in own):
            slope, deviation = own
            sources.append(f"slope over temperature: learned from {law.cycles} healthy cycles")
        scatter = max(law.scatter / law.level, 1e-4)
        sources.append(f"scatter from cycle to cycle: of {law.cycles} healthy cycles")
    if request.slope_percent_per_k is not None:
        slope, deviation = request.slope_percent_per_k / 100.0, 0.0
        sources = [s for s in sources if not s.startswith("slope")]
        sources.append("slope over temperature: as given, taken to be exact")
    if request.scatter_percent is not None:
        scatter = request.scatter_percent / 100.0
        sources = [s for s in sources if not s.startswith("scatter")]
        sources.append("scatter from cycle to cycle: as given")
    for what in ("slope", "scatter"):
        if not any(s.startswith(what) for s in sources):
            more = "name its recordings"
            if cycles is not None:
                more = f"its usable cycles ({cycles}) do not tell; name more, warm and cold ones"
            sources.append(
                f"{what}: not known of this joint, a usual value is taken; {more}, or give --{what}"
            )
    return Site(request.swing_degc, slope, deviation, scatter), tuple(sources)


def _cooling(patterns: Sequence[str]) -> Cooling | None:
    """Return the cooling law of recordings at rest, the last of which ends now."""
    if not patterns:
        return None
    from agent.cli.identify.thermal_history import history_of

    history = history_of(read_all(patterns))
    if history.reason:
        return Cooling.not_identified(history.reason)
    return estimate_cooling(history.time_s, history.temperature_degc, history.ambient_degc)


def _document(found: Schedule) -> dict[str, Any]:
    plan = found.plan
    return {
        "schema": SCHEMA,
        "sentence": plan.sentence,
        "site": {
            "swing_degc": plan.site.swing_degc,
            "slope_per_k": plan.site.slope_per_k,
            "slope_deviation_per_k": plan.site.slope_deviation_per_k,
            "scatter": plan.site.scatter,
            "sources": list(found.sources),
        },
        "wish": {
            "wear_per_month": plan.wish.wear_per_month,
            "limit": plan.wish.limit,
            "false_alarms_per_year": plan.wish.false_alarms_per_year,
            "minutes": plan.wish.minutes,
        },
        "advised_interval_days": None if plan.advised is None else plan.advised.interval_days,
        "rates": [_rate_json(r) for r in plan.rates],
        "last_cycle": None
        if found.last is None
        else {"warmth": found.last.word, "sentence": found.last.sentence},
        "next_cycle": None
        if found.following is None
        else {
            "after_s": found.following.after_s.to_json(),
            "sentence": found.following.sentence,
        },
    }


def _rate_json(rate: Rate) -> dict[str, Any]:
    return {name: value if math.isfinite(value) else None for name, value in vars(rate).items()}


def schedule_text(found: Schedule) -> str:
    """Return what a technician reads."""
    plan = found.plan
    lines = [
        f"{plan.sentence}.",
        "",
        f"  {'every':>7} {'minutes':>9} {'friction between':>17} {'wear found':>11} "
        f"{'at a rise of':>13} {'95 % below':>11} {'sudden rise':>12}",
        f"  {'':>7} {'a year':>9} {'two, by weather':>17} {'after':>11} {'':>13} {'':>11} "
        f"{f'of {100.0 * plan.wish.limit:g} %':>12}",
    ]
    for r in plan.rates:
        sudden = f"{r.sudden_days:.1f} d" if math.isfinite(r.sudden_days) else "hidden"
        lines.append(
            f"  {f'{r.interval_days:g} d':>7} {r.minutes_per_year:>9.0f} "
            f"{f'{100.0 * r.between:.1f} %':>17} {f'{r.found_days:.0f} d':>11} "
            f"{f'{100.0 * r.risen:.1f} %':>13} {f'{100.0 * r.risen_95:.1f} %':>11} {sudden:>12}"
        )
    site = plan.site
    lines += [
        "",
        f"Friction changes by {signed(100.0 * site.slope_per_k, '+.2f')} % a degree (known to "
        f"±{196.0 * site.slope_deviation_per_k:.2f}) and by {100.0 * site.scatter:.2f} % from "
        f"cycle to cycle; the gearbox swings by ±{site.swing_degc:g} °C.",
        *(f"  {source}" for source in found.sources),
    ]
    if found.last is not None and found.following is not None:
        said = dict.fromkeys((found.last.sentence, found.following.sentence))
        lines += ["", f"The last cycle was {'; '.join(said)}."]
    return "\n".join(lines)
