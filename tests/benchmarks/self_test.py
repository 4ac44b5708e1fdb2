"""Does the self-test's promise hold? `python -m tests.benchmarks.self_test [--joints N]`.

Joints whose features scatter by a known law from night to night (temperature's effect included):
the self-test sees some healthy cycles and names the smallest rise that is caught with 95 %; then
fresh histories of the same joint are given that very rise, and what is caught is counted.
"""

from __future__ import annotations

import argparse

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline import Features, baseline_of, compensated, series_of
from agent.monitor.compensation import Conditions
from agent.monitor.detectors import detector
from agent.monitor.features import SpeedGrid
from agent.monitor.injection import LOW_SPEED, rise_of
from agent.monitor.injection_replay import self_test
from agent.monitor.injection_result import Healthy
from agent.monitor.series import FEATURES, State

GRID = SpeedGrid(np.array([3.0, 7.0, 14.0, 25.0, 40.0, 60.0, 85.0, 115.0, 155.0, 200.0]), 66.0)
HEALTHY, WITHIN, FRESH = 40, 20, 150


def _history(rng: np.random.Generator, count: int, scatter: float) -> tuple[Features, Floats]:
    """Return a joint's healthy features: viscosity thins with heat, nights differ."""
    night = np.arange(count, dtype=np.float64)
    phase = rng.uniform(0.0, 2.0 * np.pi)
    degc = 25.0 + 4.0 * np.sin(2.0 * np.pi * night / 365.25 + phase) + rng.normal(0.0, 1.5, count)
    thinning = 0.3 + 0.7 * np.exp(-(degc - 25.0) / 20.0)
    curve = 0.6 + 0.15 * np.exp(-((GRID.speed_rad_s / 6.0) ** 1.3))
    friction = curve[:, np.newaxis] + 0.0107 * GRID.speed_rad_s[:, np.newaxis] * thinning
    friction *= 1.0 + scatter * rng.standard_normal(count)
    own = 0.003 * friction
    friction = friction + own * rng.standard_normal(friction.shape)
    rows = GRID.rows()
    values = dict(zip(FEATURES, rows @ friction, strict=True))
    deviations = dict(zip(FEATURES, np.sqrt(rows**2 @ own**2), strict=True))
    given = Conditions(degc, np.zeros(count), np.full(count, 0.1))
    return Features(values, deviations, given), 86_400.0 * night


def _caught(rng: np.random.Generator, scatter: float, share: float, low_nm: float) -> bool | None:
    """Return whether a fresh joint's rise is caught in time; None where it alarms before."""
    features, time_s = _history(rng, 120, scatter)
    baseline = baseline_of(features)
    onset = baseline.cycles + 5
    if not baseline.enough or onset + WITHIN > 120:
        return None
    rise = rise_of(LOW_SPEED, share * low_nm, GRID)
    added = GRID.rows() @ rise.torque_nm(GRID.speed_rad_s)
    late = np.arange(120) >= onset
    risen = {
        name: values + late * more
        for (name, values), more in zip(features.values.items(), added.tolist(), strict=True)
    }
    drawn = Features(risen, features.deviations, features.conditions)
    found = compensated(drawn, baseline)
    states = detector().judge(series_of(time_s, found, baseline)).states[: onset + WITHIN]
    alarm = next((i for i, s in enumerate(states) if s is not State.NO_FAULT), None)
    if alarm is not None and alarm < onset:
        return None
    return alarm is not None


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--joints", type=int, default=6)
    asked = parser.parse_args()
    print("scatter  promised, %   caught of fresh histories, %   at the interval's upper end, %")
    shares, upper = [], []
    for joint in range(asked.joints):
        rng = np.random.default_rng([7, joint])
        scatter = (0.003, 0.006, 0.01)[joint % 3]
        features, time_s = _history(rng, HEALTHY, scatter)
        healthy = Healthy(time_s, features, GRID)
        found = self_test(healthy, detector(), within=WITHIN, seed=joint)
        if found.reason:
            print(f"{scatter:7.3f}  not decidable: {found.reason}")
            continue
        catch = found.catches[1]
        low_nm = healthy.low_mean_nm
        each = [
            [_caught(rng, scatter, percent / 100.0, low_nm) for _ in range(FRESH)]
            for percent in (catch.smallest_percent, min(catch.ci95_percent[1], 200.0))
        ]
        share, best = (100.0 * np.mean([f for f in one if f is not None]) for one in each)
        shares.append(share)
        upper.append(best)
        print(
            f"{scatter:7.3f}  {catch.smallest_percent:6.2f} to {catch.ci95_percent[1]:.2f}"
            f"  {share:28.1f}  {best:29.1f}"
        )
    if shares:
        print(f"mean {np.mean(shares):.1f} % where 95 % was promised, {np.mean(upper):.1f} % there")


if __name__ == "__main__":
    main()
