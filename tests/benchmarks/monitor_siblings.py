"""What a young joint gains from its grown siblings, and what a joint unlike them pays.

Joints of one kind differ: their oil, their boundary friction and how it grows with the payload, how
far their nights scatter and how alike neighbouring ones are. In the fleet every tenth joint is of
another kind without anybody knowing, and so is one of the ten grown siblings that each ten joints
learn from. Wear is of joints of the kind alone.

``python -m tests.benchmarks.monitor_siblings`` prints false alarms in healthy robot-years (with
``--kept`` it goes on where it was ended), the rise at which wear is found with and without
siblings, and delays after a step against the optimum and the best that is told the scatter.
"""

from __future__ import annotations

import argparse
import functools
import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.baseline import baseline_of
from agent.monitor.baseline.first_cycles import watch_of
from agent.monitor.baseline.growth import grown, watched
from agent.monitor.baseline.siblings import kinds_of
from agent.monitor.compensation.compensation import Conditions
from agent.monitor.compensation.kind import Kind
from agent.monitor.detection.cusum import DECIDING, Cusum
from agent.monitor.detection.detectors import detector
from agent.monitor.detection.series import FeatureSeries, Judgement, State
from agent.monitor.detection.tuning import YEAR_S, Target
from agent.monitor.history.table import Features
from tests.benchmarks.monitor_delay import (
    DAY_S,
    FIRST,
    LEVEL,
    known,
    optimum_threshold,
    series_of,
)
from tests.benchmarks.monitor_reference import known_scatter_odds
from tests.science.monitor_fleet import Life, Nights, episodes, live, low_speed_share
from tests.science.monitor_joint import Joint
from tests.science.run_length_chain import brook_evans

KIND = Life()
OTHER = Life(
    noise=0.02,
    tilt=0.01,
    memory=0.5,
    joint=Joint(coulomb_nm=0.35, viscous_nm_s_per_rad=0.02, vogel_k=1400.0, load_share=0.35),
)
GROWN = 10
FIRST_SEED, SIBLING_SEED, WORN_SEED = 6_000, 900_000, 210_000


def like(life: Life, seed: int) -> Life:
    """Return a joint's life: as its kind's, and as different as joints of one kind are."""
    rng = np.random.default_rng([77, seed])

    def about(value: float, share: float) -> float:
        return value * float(np.exp(share * rng.standard_normal()))

    kind = life.joint
    joint = replace(
        kind,
        coulomb_nm=about(kind.coulomb_nm, 0.1),
        viscous_nm_s_per_rad=about(kind.viscous_nm_s_per_rad, 0.1),
        static_extra_nm=about(kind.static_extra_nm, 0.1),
        vogel_k=about(kind.vogel_k, 0.05),
        load_share=about(kind.load_share, 0.15),
    )
    memory = float(np.clip(life.memory + 0.05 * rng.standard_normal(), 0.0, 0.8))
    noise, tilt = about(life.noise, 0.1), about(life.tilt, 0.1)
    return replace(life, noise=noise, tilt=tilt, memory=memory, joint=joint)


@functools.cache
def siblings(group: int, others: int = 1, joints: int = GROWN) -> Mapping[str, Kind]:
    """Return what a group's grown siblings show, `others` of them being of another kind."""
    seeds = range(SIBLING_SEED + 1000 * group, SIBLING_SEED + 1000 * group + joints)
    lives = [like(OTHER if k < others else KIND, seed) for k, seed in enumerate(seeds)]
    lived = [live(life, seed) for life, seed in zip(lives, seeds, strict=True)]
    return kinds_of([(nights.table(), nights.time_s) for nights in lived])


def judged(nights: Nights, kinds: Mapping[str, Kind]) -> Judgement:
    """Return what the product says of a joint's nights beside what its siblings show."""
    table = replace(nights.table(), kinds=kinds)
    watch, baseline = watch_of(table, nights.time_s, detector()), baseline_of(table)
    if not baseline.enough:
        assert watch is not None
        return watch.alone(detector().name)
    return watched(table, nights.time_s, baseline, detector(), watch)[2]


def healthy_year(number: int) -> dict[str, Any]:
    """Return how often a healthy robot is in false alarm: H0, H1, the first cycles', falls."""
    other, seed = number % 10 == 9, FIRST_SEED + number
    nights = live(like(OTHER if other else KIND, seed), seed)
    out: dict[str, Any] = {"number": number, "other": other}
    for word in ("with", "without") if other else ("with",):
        found = judged(nights, siblings(number // 10) if word == "with" else {})
        marks = [np.zeros(1, bool) if m is None else m for m in (found.rising, found.fallen)]
        begun = [int(np.count_nonzero(np.diff(m.astype(int), prepend=0) == 1)) for m in marks]
        out[word] = [episodes(found.states, s) for s in (State.INCREASED, State.HIGH)] + begun
    return out


def healthy(robots: int, kept: Path | None) -> None:
    """Print the false alarms of joints of the kind, and of those of another."""
    rows = {}
    if kept is not None and kept.exists():
        rows = {row["number"]: row for row in map(json.loads, kept.read_text().splitlines())}
    for number in range(robots):
        if number not in rows:
            rows[number] = healthy_year(number)
            if kept is not None:
                with kept.open("a", encoding="utf-8") as file:
                    file.write(json.dumps(rows[number]) + "\n")
    print("\nhealthy: false alarms in ten robot-years        H0     H1  first cycles'  falls")
    for words, other, which in (
        ("of the kind, with siblings", False, "with"),
        ("of another kind, with these siblings", True, "with"),
        ("of another kind, by themselves", True, "without"),
    ):
        some = np.array([rows[n][which] for n in range(robots) if rows[n]["other"] == other])
        rates = 10.0 * some.mean(axis=0)
        counts = ", ".join(str(c) for c in some.sum(axis=0))
        print(f"{words:40s} {len(some):5d}", *(f"{r:7.2f}" for r in rates), f"  ({counts})")


def worn(joints: int) -> None:
    """Print the rise at which wear is found, with and without siblings."""
    print("\nworn: rise in percent when found, median and 90 % quantile")
    print(f"{'wear from night':24s}" + "".join(f"{100.0 * r:10.0f} %/a" for r in _RATES))
    for onset in (1, 30):
        cells: dict[str, list[str]] = {"without": [], "with": []}
        for a_year in _RATES:
            for word, row in cells.items():
                found = [_rise(a_year, onset, k, with_=word == "with") for k in range(joints)]
                middle, most = np.quantile(found, (0.5, 0.9), method="higher")
                row.append(f"{middle:7.2f} {most:6.2f}")
        for word, row in cells.items():
            print(f"{onset:8d} {word:15s}", *row, flush=True)


_RATES = (0.05, 0.1, 0.3, 1.0)


def _rise(a_year: float, onset: int, number: int, *, with_: bool) -> float:
    """Return the rise of low-speed friction at the first alarm; infinite where there is none."""
    seed = WORN_SEED + number
    life = like(KIND, seed)
    risen = a_year / 365.0 * np.maximum(0.0, np.arange(life.nights) - onset)
    nights = live(life, seed, risen / low_speed_share(life.joint))
    states = judged(nights, siblings(number // 10) if with_ else {}).states
    days = nights.day.astype(int).tolist()
    seen = (d for s, d in zip(states, days, strict=True) if s is not State.NO_FAULT and d >= onset)
    return next((100.0 * float(risen[d]) for d in seen), np.inf)


@functools.cache
def flat_kind(noise: float, group: int) -> Mapping[str, Kind]:
    """Return what siblings show whose one feature scatters about a level, and nothing else."""
    told = []
    for seed in range(GROWN):
        rng = np.random.default_rng([99, group, seed])
        own = noise * float(np.exp(0.1 * rng.standard_normal()))
        values = LEVEL * (1.0 + own * rng.standard_normal(365))
        told.append((_flat(values), DAY_S * np.arange(365.0)))
    return kinds_of(told)


def _flat(values: Floats) -> Features:
    unknown = np.full(values.size, np.nan)
    names = ("coulomb_nm", "viscous_nm_s_per_rad", "integral_w", DECIDING)
    stated = np.full(values.size, 0.005 * LEVEL)
    conditions = Conditions(unknown, unknown, unknown)
    return Features(dict.fromkeys(names, values), dict.fromkeys(names, stated), conditions)


def _first_alarm(rule: Cusum, values: Floats, kinds: Mapping[str, Kind]) -> int | None:
    def series_for(n: int, _: object) -> FeatureSeries:
        return replace(series_of(values, n), kinds=kinds)

    states = grown(series_for, FIRST, rule)[1].states
    return next((i for i, s in enumerate(states) if s is not State.NO_FAULT), None)


def _joints(
    noise: float, joints: int, nights: int, seed: int
) -> Iterator[tuple[int, float, Floats]]:
    """Yield number, scatter and nights, in scatters, of joints that differ as siblings do."""
    for k in range(joints):
        rng = np.random.default_rng([seed, k])
        yield k, noise * float(np.exp(0.1 * rng.standard_normal())), rng.standard_normal(nights)


def delay(joints: int, rise: float = 0.03) -> None:
    """Print the delay after a step with siblings, the optimum's, and the best one's.

    That best is told each joint's own scatter, and learns its level alone.
    """
    print("\ndelay: mean nights to find a step of 3 %; siblings differ by 10 % in their scatter")
    print("noise  step on night  false/a   with  without  optimum  ratio  told scatter  ratio")
    rule, years = Cusum(Target(smallest_rise=rise)), 4
    for noise in (0.01, 0.02, 0.03):
        rates = {True: 0.0, False: 0.0}
        alarms, highest = 0, []
        for with_ in rates:
            count, lived = 0, 0
            for k, own, z in _joints(noise, joints, FIRST + 365 * years, 5):
                kinds = flat_kind(noise, k // 10) if with_ else {}
                at = _first_alarm(rule, LEVEL * (1.0 + own * z), kinds)
                count += at is not None
                lived += z.size - FIRST if at is None else at - FIRST + 1
                if with_:
                    highest.append(float(np.max(known_scatter_odds(z, rise / own, FIRST))))
            rates[with_] = max(count, 0.5) / (lived * DAY_S / YEAR_S)
            alarms = count if with_ else alarms
        line = sorted(highest)[-max(alarms, 1)]
        for night in (40, 90, 230):
            found: dict[str, list[float]] = {"with": [], "without": [], "optimum": [], "told": []}
            for k, own, z in _joints(noise, joints, night + 300, 10_000 + night):
                z[night:] += rise / own
                values = LEVEL * (1.0 + own * z)
                for word in ("with", "without"):
                    kinds = flat_kind(noise, k // 10) if word == "with" else {}
                    at = _first_alarm(rule, values, kinds)
                    if at is None or at >= night:
                        found[word].append(300.0 if at is None else at - night + 1.0)
                best = known(z, rise / own, rates[True], night)
                crossed = np.flatnonzero(known_scatter_odds(z, rise / own, FIRST) >= line)
                if crossed.size and crossed[0] >= night:
                    found["told"].append(float(crossed[0] - night + 1))
                if best is not None:
                    found["optimum"].append(best)
            d = {word: float(np.mean(some)) for word, some in found.items()}
            print(
                f"{noise:5.1%} {night:14d} {rates[True]:8.3f} {d['with']:6.2f} {d['without']:8.2f} "
                f"{d['optimum']:8.2f} {d['with'] / d['optimum']:6.2f} {d['told']:13.2f} "
                f"{d['with'] / d['told']:6.2f}",
                flush=True,
            )
        print(f"       false alarms a year without siblings: {rates[False]:.3f}")


_COUNTED = {0.01: 0.010, 0.02: 0.038, 0.03: 0.037}
"""False alarms a year beside siblings, as `delay` counts them."""


def from_zero(joints: int, rise: float = 0.03) -> None:
    """Print the delay in Lorden's sense beside siblings: from a sum that stands at zero."""
    print("\nzero: mean nights to find a step of 3 % from a sum of zero, beside siblings")
    print("noise  step on night  joints  from zero  optimum  ratio")
    rule = Cusum(Target(smallest_rise=rise))
    for noise, rate in _COUNTED.items():
        for night in (40, 90):
            delays, least = [], []
            for k, own, z in _joints(noise, joints, night + 300, 40_000 + night):
                kinds = flat_kind(noise, k // 10)
                past = LEVEL * (1.0 + own * z[:night])
                if _sum_after(rule, past, kinds) > 0.0:
                    continue
                z[night:] += rise / own
                at = _first_alarm(rule, LEVEL * (1.0 + own * z), kinds)
                if at is None or at >= night:
                    delays.append(300.0 if at is None else at - night + 1.0)
                size = round(rise / own, 2)
                least.append(brook_evans(0.5 * size, optimum_threshold(size, rate)))
            mean, optimum = float(np.mean(delays)), float(np.mean(least))
            print(
                f"{noise:5.1%} {night:14d} {len(delays):7d} {mean:10.2f} {optimum:8.2f} "
                f"{mean / optimum:6.2f}",
                flush=True,
            )


def _sum_after(rule: Cusum, past: Floats, kinds: Mapping[str, Kind]) -> float:
    def series_for(n: int, _: object) -> FeatureSeries:
        return replace(series_of(past, n), kinds=kinds)

    return float(grown(series_for, FIRST, rule)[1].traces[DECIDING].statistic[-1])


def main() -> None:
    """Print the tables that are asked for."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--robots", type=int, default=1000)
    parser.add_argument("--kept", type=Path, help="file of the healthy robots, to go on with")
    parser.add_argument("--worn", type=int, default=40, help="joints of each rate of wear")
    parser.add_argument("--joints", type=int, default=150, help="of each row of the delays")
    parser.add_argument("--part", choices=("healthy", "worn", "delay", "zero"))
    asked = parser.parse_args()
    if asked.part in (None, "healthy"):
        healthy(asked.robots, asked.kept)
    if asked.part in (None, "worn"):
        worn(asked.worn)
    if asked.part in (None, "delay"):
        delay(asked.joints)
    if asked.part in (None, "zero"):
        from_zero(asked.joints)


if __name__ == "__main__":
    main()
