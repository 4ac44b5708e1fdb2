"""What an encoder's steps tell, beside even noise: ``python -m tests.benchmarks.steps [motions]``.

The bound of Cramer and Rao in `tests/science/backlash_bound.py` and `tests.benchmarks.reversals`
takes an encoder's steps for white noise of variance ``step^2 / 12``. A reading says more: the angle
lies in this step and in no other. Here a motion goes on at about 1 rad/s and is shaken as a torque
that is known to 0.01 N m leaves it unknown; its posterior is simulated with particles that every
reading keeps or throws away (Gordon, Salmond and Smith 1993), and stands beside Kalman's of white
noise. Where the ratio is 1 the bound holds; below it an estimate may come below the bound.
"""

from __future__ import annotations

import argparse
import math

import numpy as np
from numpy.typing import NDArray

Floats = NDArray[np.float64]

PERIOD_S = 1e-3
SHAKEN_RAD_S2 = (
    0.01 / 0.003
)  # torque noise over the motor's inertia, `tests.science.reversal_plant`
SPEED_RAD_S, SPEED_ERROR = 1.0, 0.05
SAMPLES, MEAN_OF = 160, 64
FEWEST = 50
ENCODERS = {"motor, 2^16": 2.0**-16, "motor, 2^20": 2.0**-20, "arm, 2^22, gear 100": 100 * 2.0**-22}
MOVES = np.array([[1.0, PERIOD_S, 0.0], [0.0, 1.0, 0.0], [1.0, PERIOD_S, 1.0]])
PUSHED = np.array([0.5 * PERIOD_S**2, PERIOD_S, 0.5 * PERIOD_S**2])
"""How angle, velocity and the sum of angles go on, and how an acceleration moves them."""


def white(step_rad: float) -> Floats:
    """Return the deviations of the last angle, rad, of the velocity and of the mean of angles."""
    spread = np.diag([step_rad**2 / 12.0, SPEED_ERROR**2, 0.0])
    for k in range(SAMPLES):
        if k == SAMPLES - MEAN_OF:
            spread[2] = spread[:, 2] = 0.0
        spread = MOVES @ spread @ MOVES.T + SHAKEN_RAD_S2**2 * np.outer(PUSHED, PUSHED)
        gain = spread[:, 0] / (spread[0, 0] + step_rad**2 / 12.0)
        spread = spread - np.outer(gain, spread[0])
    return np.asarray(np.sqrt(np.diag(spread)) / np.array([1.0, 1.0, MEAN_OF]))


def stepped(step_rad: float, particles: int, seed: int) -> Floats | None:
    """Return the same variances for readings in steps; None where too few particles are left."""
    rng = np.random.default_rng(seed)
    state = np.zeros((3, particles + 1))  # the true motion comes first
    state[0] = rng.uniform(0.0, step_rad, particles + 1)
    state[1] = SPEED_RAD_S + SPEED_ERROR * rng.standard_normal(particles + 1)
    for k in range(SAMPLES):
        if k == SAMPLES - MEAN_OF:
            state[2] = 0.0
        shaken = SHAKEN_RAD_S2 * rng.standard_normal(particles + 1)
        state = MOVES @ state + PUSHED[:, np.newaxis] * shaken
        count = np.floor(state[0] / step_rad)
        left = 1 + np.flatnonzero(count[1:] == count[0])
        if left.size < FEWEST:
            return None
        state[:, 1:] = state[:, rng.choice(left, particles)]
    return np.asarray(np.var(state[:, 1:], axis=1) / np.array([1.0, 1.0, MEAN_OF**2]))


def main() -> None:
    """Print how well a motion is known by steps, over how well by even noise of their strength."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("motions", type=int, nargs="?", default=60)
    parser.add_argument("--particles", type=int, default=40_000)
    asked = parser.parse_args()
    print(f"{'encoder':<22}{'motions':>9}{'angle':>8}{'velocity':>10}{'mean of 64 ms':>15}")
    for name, turns in ENCODERS.items():
        step_rad = 2.0 * math.pi * turns
        runs = (stepped(step_rad, asked.particles, seed) for seed in range(asked.motions))
        known = [run for run in runs if run is not None]
        angle, velocity, mean = np.sqrt(np.mean(known, axis=0)) / white(step_rad)
        print(f"{name:<22}{len(known):>9}{angle:>8.2f}{velocity:>10.2f}{mean:>15.2f}", flush=True)


if __name__ == "__main__":
    main()
