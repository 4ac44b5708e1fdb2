"""Does the self-test's promise hold? `python -m tests.benchmarks.self_test [--joints N]`.

Joints whose features scatter by a known law from night to night (temperature's effect included):
the self-test sees their first healthy cycles and names the smallest rise that is caught with 95 %.
Then each joint lives again, through the same season and through another, with nights of its own;
from some night after the seen ones on it has that very rise, and what the whole chain catches in
time is counted. What was promised and what is caught may differ for one joint, for so few cycles
know their own scatter only roughly; over many joints the share is to be 95 %.
"""

from __future__ import annotations

import argparse
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline import Features, baseline_of
from agent.monitor.compensation import Conditions
from agent.monitor.detectors import detector
from agent.monitor.features import SpeedGrid
from agent.monitor.growth import LAG, watched
from agent.monitor.injection import LOW_SPEED, rise_of
from agent.monitor.injection_replay import self_test
from agent.monitor.injection_result import Healthy
from agent.monitor.series import FEATURES, State

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


def caught(rng: np.random.Generator, kind: Kind, rise_nm: float) -> bool | None:
    """Return whether a life's rise is caught in time; None where it alarms before."""
    onset = HEALTHY + int(rng.integers(LAG, 2 * LAG))
    features, time_s = _history(rng, onset + WITHIN, kind)
    baseline = baseline_of(features.take(slice(0, onset)))
    if not baseline.enough:
        return None
    rise = rise_of(LOW_SPEED, rise_nm, GRID)
    added = GRID.rows() @ rise.torque_nm(GRID.speed_rad_s)
    late = np.arange(time_s.size) >= onset
    risen = {
        name: values + late * more
        for (name, values), more in zip(features.values.items(), added.tolist(), strict=True)
    }
    states = watched(replace(features, values=risen), time_s, baseline, detector())[2].states
    alarm = next((i for i, s in enumerate(states) if s is not State.NO_FAULT), None)
    if alarm is not None and alarm < onset:
        return None
    return alarm is not None


def joint(number: int, lives: int) -> tuple[float, float, float, list[float]] | None:
    """Return scatter, promise and its upper end, and the shares caught, season by season."""
    rng = np.random.default_rng([FIRST, number])
    kind = Kind(SCATTERS[number % len(SCATTERS)], rng.uniform(0.0, 2.0 * np.pi))
    features, time_s = _history(rng, HEALTHY, kind)
    healthy = Healthy(time_s, features, GRID)
    found = self_test(healthy, detector(), within=WITHIN, seed=number)
    if found.reason:
        print(f"joint {number}: not decidable: {found.reason}")
        return None
    catch = found.catches[1]
    shares = []
    for other in (False, True):
        lived = []
        for _ in range(lives):
            phase = rng.uniform(0.0, 2.0 * np.pi) if other else kind.phase
            lived.append(caught(rng, replace(kind, phase=phase), catch.smallest_nm))
        shares.append(float(np.mean([one for one in lived if one is not None])))
    return kind.scatter, catch.smallest_percent, catch.ci95_percent[1], shares


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--joints", type=int, default=60)
    parser.add_argument("--lives", type=int, default=20)
    asked = parser.parse_args()
    rows = [row for k in range(asked.joints) if (row := joint(k, asked.lives)) is not None]
    print("scatter  joints  promised, %  upper end  caught, same season  caught, another season")
    for scatter in (*SCATTERS, None):
        some = [row for row in rows if scatter in (None, row[0])]
        if some:
            _, promised, upper, shares = (np.array(part) for part in zip(*some, strict=True))
            name = "all" if scatter is None else f"{scatter:.1%}"
            means = f"{np.mean(promised):12.2f} {np.mean(upper):10.2f}"
            print(f"{name:>7s} {len(some):7d} {means}", *(_cell(one) for one in shares.T))


def _cell(shares: Floats) -> str:
    """Return a mean over joints with its 95 % interval, in percent."""
    half = 1.96 * float(np.std(shares, ddof=1)) / np.sqrt(shares.size)
    return f"{100.0 * np.mean(shares):12.1f} +-{100.0 * half:4.1f}"


if __name__ == "__main__":
    main()
