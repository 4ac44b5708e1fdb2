"""False alarms of healthy robots and the rise at which wear is found, every detector in one run.

Healthy robots live a year after the 60th night: 15 to 45 degC over the seasons, random payloads,
bad and missing nights; the whole chain, compensation included. An H0 is counted each time that it
begins, and so is a fall of friction; at the year's end it is asked whether the baseline is said not
to be settled. Then robots wear from a night on: how far low-speed friction had risen at the first
alarm.
``cusum`` is the product as a user gets it, whose baseline the rule chooses and whose health goes on
growing; the other detectors, and ``cusum, not grown``, keep the first baseline.

Each robot may be one line of a file, so that a long run goes on where it was ended; a file belongs
to one state of the code.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from functools import partial
from os import devnull
from pathlib import Path
from typing import Any

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.baseline import Baseline, baseline_of, compensated, series_of
from agent.monitor.baseline.first_cycles import running_in, watch_of
from agent.monitor.baseline.growth import watched
from agent.monitor.detection.decision import Marks
from agent.monitor.detection.detectors import DEFAULT, DETECTORS, detector
from agent.monitor.detection.series import FeatureSeries, Judgement, State
from tests.science.monitor_fleet import Life, Nights, episodes, live, low_speed_share

LIFE = Life()
ONSET = 90  # night
YOUNG = (30, 1)  # nights on which wear begins with hardly a baseline, and with none: fewer joints
RATES_PER_YEAR = (0.05, 0.1, 0.3, 1.0)
WORN = 60
FIRST_SEED, WORN_SEED = 5_000, 200_000  # apart from those that were looked at while designing
FIXED, TWENTY_LINES = "cusum, not grown", "20-line, not compensated"

Outcome = dict[str, Any]


def twenty_lines(series: FeatureSeries) -> tuple[State, ...]:
    """Return the states of a textbook CUSUM: mean and deviation of the baseline, k 0.5, h 5."""
    y = series.values["low_integral_w"]
    mean, deviation = np.mean(y[: series.healthy]), np.std(y[: series.healthy])
    g, states = 0.0, []
    for i, z in enumerate((y - mean) / deviation):
        g = max(0.0, g + z - 0.5) if i >= series.healthy else 0.0
        states.append(State.INCREASED if g > 5.0 else State.NO_FAULT)
    return tuple(states)


def judged(
    nights: Nights, healthy: int | None, words: Sequence[str] = tuple(DETECTORS)
) -> dict[str, Sequence[State]]:
    """Return the states that the product and other detectors give a robot's nights."""
    table = nights.table()
    baseline = baseline_of(table, healthy)
    states: dict[str, Sequence[State]] = {
        DEFAULT: _product(nights, baseline, healthy)[1].states,
        TWENTY_LINES: twenty_lines(nights.raw(baseline.cycles)),
    }
    return states | _others(nights, baseline, words)


def _others(nights: Nights, baseline: Baseline, words: Sequence[str]) -> dict[str, Sequence[State]]:
    """Return the states of detectors that keep the first baseline."""
    series = series_of(nights.time_s, compensated(nights.table(), baseline), baseline)
    return {
        FIXED if word == DEFAULT else word: detector(word).judge(series).states for word in words
    }


def _product(nights: Nights, baseline: Baseline, healthy: int | None) -> tuple[Baseline, Judgement]:
    """Return what a user gets: the first cycles are asked by themselves as well."""
    table, time_s = nights.table(), nights.time_s
    watch = watch_of(table, time_s, detector()) if healthy is None else None
    last, _, judgement = watched(table, time_s, baseline, detector(), watch)
    return last, judgement


def healthy_year(healthy: int | None, words: Sequence[str], seed: int) -> Outcome:
    """Return how many times a healthy robot entered H0 and H1, by detector.

    And of the product how many alarms were the first cycles', how many times friction was said to
    have fallen, and whether the baseline was said not to be settled.
    """
    nights = live(LIFE, seed)
    first = baseline_of(nights.table(), healthy)
    last, product = _product(nights, first, healthy)
    states: dict[str, Sequence[State]] = {
        DEFAULT: product.states,
        TWENTY_LINES: twenty_lines(nights.raw(first.cycles)),
        **_others(nights, first, words),
    }
    start = slice(0, last.cycles)
    unsettled = running_in(nights.table().take(start), nights.time_s[start], detector())
    return {
        "seed": seed,
        "rate": 0.0,
        "onset": 0,
        "first": first.cycles,
        "rising": _begun(product.rising),
        "fallen": _begun(product.fallen),
        "unsettled": unsettled is not None,
        "found": {
            name: [episodes(s, State.INCREASED), episodes(s, State.HIGH)]
            for name, s in states.items()
        },
    }


def _begun(marks: Marks | None) -> int:
    """Return how many times marks were set."""
    return 0 if marks is None else int(np.count_nonzero(np.diff(marks.astype(int), prepend=0) == 1))


def worn_year(healthy: int | None, words: Sequence[str], case: tuple[float, int, int]) -> Outcome:
    """Return the rise in percent at the first alarm, null where there is none, by detector."""
    rate, onset, seed = case
    risen = rate / 365.0 * np.maximum(0.0, np.arange(LIFE.nights) - onset)
    nights = live(LIFE, seed, risen / low_speed_share(LIFE.joint))
    asked = [word for word in words if onset == ONSET or word == DEFAULT]
    found = {
        name: rise_found(states, nights.day, risen, onset)
        for name, states in judged(nights, healthy, asked).items()
    }
    return {"seed": seed, "rate": rate, "onset": onset, "found": found}


def rise_found(states: Sequence[State], day: Floats, risen: Floats, onset: int) -> float | None:
    """Return the rise in percent at the first alarm from the onset on.

    An alarm that stands already at that moment counts as found without a rise.
    """
    for state, night in zip(states, day.astype(int).tolist(), strict=True):
        if state is not State.NO_FAULT and night >= onset:
            return 100.0 * float(risen[night])
    return None


def outcomes(
    robots: int,
    healthy: int | None,
    kept: Path | None,
    jobs: int,
    words: Sequence[str] = tuple(DETECTORS),
) -> list[Outcome]:
    """Return every robot's outcome, those that the file does not hold yet simulated.

    `words` are the detectors beside the product and the twenty lines.
    """
    lines = kept.read_text().splitlines() if kept is not None and kept.exists() else []
    done = {(o["rate"], o["onset"], o["seed"]): o for o in map(json.loads, lines)}
    wanted = [(ONSET, k) for k in range(WORN)]
    wanted += [(onset, k) for onset in YOUNG for k in range(WORN // 2)]
    seeds = [s for s in range(FIRST_SEED, FIRST_SEED + robots) if (0.0, 0, s) not in done]
    cases = [
        (rate, onset, WORN_SEED + k)
        for rate in RATES_PER_YEAR
        for onset, k in wanted
        if (rate, onset, WORN_SEED + k) not in done
    ]
    with ProcessPoolExecutor(jobs) as pool, Path(kept or devnull).open("a") as file:
        for made in (
            pool.map(partial(worn_year, healthy, words), cases, chunksize=5),
            pool.map(partial(healthy_year, healthy, words), seeds, chunksize=5),
        ):
            for outcome in made:
                done[outcome["rate"], outcome["onset"], outcome["seed"]] = outcome
                file.write(json.dumps(outcome) + "\n")
                file.flush()
    return list(done.values())


def table(found: Sequence[Outcome], title: str) -> Iterator[str]:
    """Yield the lines of the table."""
    well = [o["found"] for o in found if not o["rate"]]
    yield f"\nfleet: {len(well)} healthy robot-years, {title}"
    heads = " ".join(f"{100 * r:.0f} %/a".rjust(13) for r in RATES_PER_YEAR)
    counts = f"{'H0/10 a':>8s} {'robots':>7s} {'H1/100 a':>8s}"
    yield f"{'':24s} {counts}  wear from night {ONSET}: {heads}"
    for name in well[0]:
        h0, h1 = (np.array([w[name][k] for w in well]) for k in (0, 1))
        yield (
            f"{name:24s} {10 * h0.mean():8.2f} {np.mean(h0 + h1 > 0):7.1%} "
            f"{100 * h1.mean():8.2f}  {'':20s} {_cells(found, ONSET, name)}"
        )
    for onset in YOUNG:
        yield f"{f'wear from night {onset}':71s} {heads}"
        for name in (DEFAULT, FIXED):
            if name in well[0]:
                yield f"{name:71s} {_cells(found, onset, name)}"
    kept = [o for o in found if not o["rate"]]
    rising, fallen, unsettled = (sum(o[k] for o in kept) for k in ("rising", "fallen", "unsettled"))
    robots = sum(o["fallen"] > 0 for o in kept)
    firsts = sorted(o["first"] for o in kept)
    yield (
        f"the product: {rising} alarms of the first cycles, friction said to have fallen {fallen} "
        f"times in {robots} robots, the baseline not to be settled in {unsettled}; first baselines "
        f"of {firsts[0]} to {firsts[-1]} nights"
    )
    yield "wear: median and 90 % quantile of the rise in percent when it was found; inf: not found"


def _cells(found: Sequence[Outcome], onset: int, name: str) -> str:
    pairs = (_quantiles(found, onset, rate, name) for rate in RATES_PER_YEAR)
    return " ".join(f"{median:6.1f} {most:6.1f}" for median, most in pairs)


def _quantiles(found: Sequence[Outcome], onset: int, rate: float, name: str) -> tuple[float, float]:
    some = [o["found"][name] for o in found if (o["rate"], o["onset"]) == (rate, onset)]
    rises = [np.inf if rise is None else rise for rise in some]
    median, most = np.quantile(rises, (0.5, 0.9), method="higher")
    return float(median), float(most)
