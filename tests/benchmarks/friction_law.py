"""How often the right friction law is selected: ``python -m tests.benchmarks.friction_law``.

Paired stairs of a few speeds from 4 to 80 rad/s on a joint without and with a Stribeck fall (0.15
N m at rest, 6 rad/s), under three kinds of noise. The plant is apart from every law of the product.
"""

from __future__ import annotations

import argparse
from collections import Counter

import numpy as np

from agent.identify.estimate import estimate
from tests.science.identify_plant import Joint, Motion, record
from trajectories import spaced_speeds, stair_paired

RATE_HZ = 500.0
PLAIN = Joint(gravity_sin_nm=0.3)
FALLING = Joint(gravity_sin_nm=0.3, static_extra_nm=0.15, stribeck_velocity_rad_s=6.0, exponent=1.3)
STAIRS = ((5, 12.0), (6, 12.0), (7, 20.0), (8, 20.0), (11, 40.0))
NOISES = ((0.02, 0.02), (0.02, 0.2), (0.05, 0.02))


def stair(speeds: int, seconds: float) -> Motion:
    """Return a paired stair from 4 to 80 rad/s."""
    trajectory = stair_paired(
        -60.0,
        60.0,
        speeds_rad_s=spaced_speeds(4.0, 80.0, speeds),
        duration_s=seconds,
        acceleration_rad_s2=150.0,
        jerk_rad_s3=8000.0,
    )
    points = trajectory.sample(np.arange(0.0, trajectory.duration_s, 1.0 / RATE_HZ))
    return Motion(
        points.time_s, points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2
    )


def selected(joint: Joint, motion: Motion, seed: int, noise_nm: float, memory_s: float) -> str:
    """Return the name of the law that one recording's estimate selects."""
    memory = float(np.exp(-1.0 / (RATE_HZ * memory_s)))
    models = estimate(
        [record(joint, motion, seed=seed, noise_nm=noise_nm, memory=memory)]
    ).friction_models
    return next((m.model for m in models if m.selected), "none")


def main() -> None:
    """Print the rates."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=200)
    seeds = parser.parse_args().seeds
    print(f"{seeds} seeds each way")
    print(f"{'speeds':<8}{'noise':>9}{'memory':>9}{'false fall':>12}{'fall found':>12}   as")
    for speeds, seconds in STAIRS:
        motion = stair(speeds, seconds)
        for noise_nm, memory_s in NOISES:
            plain, falling = (
                Counter(selected(joint, motion, s, noise_nm, memory_s) for s in range(seeds))
                for joint in (PLAIN, FALLING)
            )
            false, found = (100.0 * (1.0 - c["coulomb-viscous"] / seeds) for c in (plain, falling))
            print(
                f"{speeds:<8}{noise_nm:>5} N m{memory_s:>7} s{false:>10.1f} %{found:>10.1f} %"
                f"   {dict(falling)}",
                flush=True,
            )


if __name__ == "__main__":
    main()
