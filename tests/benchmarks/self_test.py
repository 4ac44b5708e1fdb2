"""Does the self-test's promise hold? `python -m tests.benchmarks.self_test [--joints N]`.

Joints whose features scatter by a known law from night to night (temperature's effect included):
the self-test sees their first healthy cycles and names the smallest rise that is caught with 95 %.
Then each joint lives on, many times, with nights that nobody has seen: within the next ten nights
it gets that very rise, and what the whole chain catches in time is counted. Beside it a new joint
of the same kind lives in another season, with a baseline of its own nights. What was promised and
what is caught may differ for one joint, for so few cycles know their own scatter only roughly; over
many joints the share is to be 95 %. Its interval is over joints.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.baseline import baseline_of
from agent.monitor.baseline.first_cycles import watch_of
from agent.monitor.baseline.growth import LAG, watched
from agent.monitor.compensation.compensation import Conditions
from agent.monitor.detection.detectors import detector
from agent.monitor.detection.series import FEATURES, State
from agent.monitor.history.features import SpeedGrid
from agent.monitor.history.table import Features
from agent.monitor.self_test.injection import LOW_SPEED, rise_of
from agent.monitor.self_test.replay import self_test
from agent.monitor.self_test.result import Healthy

GRID = SpeedGrid(np.array([3.0, 7.0, 14.0, 25.0, 40.0, 60.0, 85.0, 115.0, 155.0, 200.0]), 66.0)
HEALTHY, WITHIN, FIRST = 40, 20, 7
SCATTERS = (0.003, 0.006, 0.01)


@dataclass(frozen=True)
class Kind:
    """A joint: its scatter from night to night, and where in the year its history begins."""

    scatter: float
    phase: float


def _history(rng: np.random.Generator, count: int, kind: Kind) -> tuple[Features, Floats]:
    """Return a joint's healthy features: viscosity thins with heat, nights differ."""
    night = np.arange(count, dtype=np.float64)
    season = 4.0 * np.sin(2.0 * np.pi * night / 365.25 + kind.phase)
    degc = 25.0 + season + rng.normal(0.0, 1.5, count)
    thinning = 0.3 + 0.7 * np.exp(-(degc - 25.0) / 20.0)
    curve = 0.6 + 0.15 * np.exp(-((GRID.speed_rad_s / 6.0) ** 1.3))
    friction = curve[:, np.newaxis] + 0.0107 * GRID.speed_rad_s[:, np.newaxis] * thinning
    friction *= 1.0 + kind.scatter * rng.standard_normal(count)
    own = 0.003 * friction
    friction = friction + own * rng.standard_normal(friction.shape)
    rows = GRID.rows()
    values = dict(zip(FEATURES, rows @ friction, strict=True))
    deviations = dict(zip(FEATURES, np.sqrt(rows**2 @ own**2), strict=True))
    given = Conditions(degc, np.zeros(count), np.full(count, 0.1))
    return Features(values, deviations, given), 86_400.0 * night


def caught(features: Features, onset: int, rise_nm: float) -> bool | None:
    """Return whether a rise from night `onset` on is caught in time; None where it alarms before.

    The features are those without the rise, and end with the last night that is in time.
    """
    baseline = baseline_of(features.take(slice(0, onset)))
    if not baseline.enough:
        return None
    rise = rise_of(LOW_SPEED, rise_nm, GRID)
    added = GRID.rows() @ rise.torque_nm(GRID.speed_rad_s)
    night = np.arange(features.count, dtype=np.float64)
    risen = {
        name: values + (night >= onset) * more
        for (name, values), more in zip(features.values.items(), added.tolist(), strict=True)
    }
    lived, time_s = replace(features, values=risen), 86_400.0 * night
    watch = watch_of(lived, time_s, detector())
    judged = watched(lived, time_s, baseline, detector(), watch)[2]
    alarm = next((i for i, s in enumerate(judged.states) if s is not State.NO_FAULT), None)
    if alarm is not None and alarm < onset:
        return None
    return alarm is not None


def gone_on(
    rng: np.random.Generator, seen: Features, kind: Kind, rise_nm: float, *, anew: bool
) -> bool | None:
    """Return whether the rise is caught as the joint lives on, or in a new one's life."""
    onset = HEALTHY + int(rng.integers(0, LAG))
    drawn, _ = _history(rng, onset + WITHIN, kind)
    later = drawn if anew else _followed(seen, drawn.take(slice(HEALTHY, onset + WITHIN)))
    return caught(later, onset, rise_nm)


def _followed(seen: Features, later: Features) -> Features:
    """Return the seen nights and the later ones after them."""
    own, others = seen.conditions, later.conditions
    return Features(
        {k: np.concatenate((v, later.values[k])) for k, v in seen.values.items()},
        {k: np.concatenate((v, later.deviations[k])) for k, v in seen.deviations.items()},
        Conditions(
            np.concatenate((own.temperature_degc, others.temperature_degc)),
            np.concatenate((own.payload_kg, others.payload_kg)),
            np.concatenate((own.load_nm, others.load_nm)),
        ),
    )


@dataclass(frozen=True)
class Kept:
    """One joint's promise in percent, its interval, and the shares that were caught."""

    scatter: float
    promised: float
    ci95: tuple[float, float]
    on: float
    anew: float


def joint(number: int, lives: int, replays: int) -> Kept | None:
    """Return what one joint's promise was worth; None where there was none."""
    rng = np.random.default_rng([FIRST, number])
    kind = Kind(SCATTERS[number % len(SCATTERS)], rng.uniform(0.0, 2.0 * np.pi))
    features, time_s = _history(rng, HEALTHY, kind)
    healthy = Healthy(time_s, features, GRID)
    found = self_test(healthy, detector(), within=WITHIN, replays=replays, seed=number)
    if found.reason:
        print(f"joint {number}: not decidable: {found.reason}")
        return None
    catch = found.catches[1]
    shares = []
    for anew in (False, True):
        other = replace(kind, phase=rng.uniform(0.0, 2.0 * np.pi)) if anew else kind
        lived = [gone_on(rng, features, other, catch.smallest_nm, anew=anew) for _ in range(lives)]
        judged = [one for one in lived if one is not None]
        shares.append(float(np.mean(judged)) if judged else float("nan"))
    return Kept(kind.scatter, catch.smallest_percent, catch.ci95_percent, *shares)


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--joints", type=int, default=36)
    parser.add_argument("--lives", type=int, default=20)
    parser.add_argument("--replays", type=int, default=60)
    asked = parser.parse_args()
    rows = []
    for number in range(asked.joints):
        kept = joint(number, asked.lives, asked.replays)
        if kept is not None:
            rows.append(kept)
            print(f"joint {number}: {kept}", file=sys.stderr, flush=True)
    print("scatter  joints  promised, %  interval, least and most     caught       caught anew")
    for scatter in (*SCATTERS, None):
        some = [row for row in rows if scatter in (None, row.scatter)]
        if len(some) > 1:
            promised = np.array([row.promised for row in some])
            name = "all" if scatter is None else f"{scatter:.1%}"
            ends = np.array([row.ci95 for row in some])
            print(
                f"{name:>7s} {len(some):7d} {promised.min():5.2f} to {promised.max():4.2f}"
                f"{np.min(ends[:, 0]):12.2f} to {np.max(ends[:, 1]):5.2f}",
                _cell(np.array([row.on for row in some])),
                _cell(np.array([row.anew for row in some])),
            )


def _cell(shares: Floats) -> str:
    """Return a mean over joints with its 95 % interval, in percent.

    A joint that has a false alarm within its seen nights has none to live on with.
    """
    shares = shares[np.isfinite(shares)]
    half = 1.96 * float(np.std(shares, ddof=1)) / np.sqrt(shares.size)
    return f"{100.0 * np.mean(shares):12.1f} +-{100.0 * half:4.1f}"


if __name__ == "__main__":
    main()
