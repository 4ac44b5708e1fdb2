"""Coverage, information limit and search speed: ``python -m tests.benchmarks.identification``.

500 seeds of the thesis-like robot on a rigid joint: how often the 95 % intervals hold the truth,
and every parameter's error against its Cramer-Rao bound (of the curve: that of all steady samples,
and that of those which the steady windows kept).
Stribeck's law with a free exponent from 24 speeds. Then the curve's intervals under noise that
remembers for 0.02, 0.2 and 1 s in passes of 2 s, the width against what the error deserves. Then
the friction law of Feeny and Moon by variable projection beside the exhaustive search of thesis
section 4.4.3, on the same curves.
"""

from __future__ import annotations

import argparse
import time

import numpy as np

from agent.identify.estimate import estimate
from agent.identify.friction import separable
from agent.physics.friction import FEENY_MOON
from tests.science.identify_plant import Floats, Joint, record, stair
from tests.science.information import JOINT, MOTION, NOISE_NM, campaign, law_campaign

GRID = (400, 600)  # of the exhaustive search: mu and beta
CURVES = 5


def exhaustive(speed: Floats, friction: Floats, bounds: Floats) -> float:
    """Return the least squared error over the grid, one linear regression for every point."""
    best = np.inf
    (mu_low, mu_high), (beta_low, beta_high) = bounds.tolist()
    for mu in np.linspace(mu_low, mu_high, GRID[0]):
        for beta in np.geomspace(beta_low, beta_high, GRID[1]):
            columns = np.stack((speed, mu + (1.0 - mu) / np.cosh(beta * speed)), axis=1)
            gram, moment = columns.T @ columns, columns.T @ friction
            determinant = gram[0, 0] * gram[1, 1] - gram[0, 1] ** 2
            if determinant <= 0.0:
                continue
            fv = (gram[1, 1] * moment[0] - gram[0, 1] * moment[1]) / determinant
            fc = (gram[0, 0] * moment[1] - gram[0, 1] * moment[0]) / determinant
            error = friction - columns @ np.array((fv, fc))
            best = min(best, float(error @ error))
    return best


def memory_table(seeds: int) -> None:
    """Print how often the curve's intervals hold the truth when the noise is coloured."""
    joint = Joint(static_extra_nm=0.2)
    motion = stair(rate_hz=125.0, stroke_rad=1e9, longest_s=2.0, ramp_s=0.256)
    print(f"\n{'noise memory':<16}{'coverage':>10}{'worst speed':>13}{'rms error':>11}{'width':>8}")
    for memory_s in (0.02, 0.2, 1.0):
        memory = float(np.exp(-1.0 / (motion.rate_hz * memory_s)))
        errors, halves = [], []
        for seed in range(seeds):
            curve = estimate([record(joint, motion, seed=seed, memory=memory)]).friction_curve
            assert curve is not None
            errors.append(curve.friction_nm - joint.friction(curve.velocity_rad_s))
            halves.append(np.ptp(curve.ci95_nm, axis=1) / 2.0)
        error, half = np.array(errors), np.array(halves)
        inside = np.abs(error) <= half
        rms = float(np.sqrt(np.mean(error**2)))
        print(
            f"{memory_s:<5g}s          {100 * inside.mean():>9.1f}%"
            f"{100 * inside.mean(axis=0).min():>12.1f}%{rms:>11.3g}"
            f"{half.mean() / (1.96 * rms):>8.2f}"
        )


def search_table() -> None:
    """Print times and errors of both searches, side by side."""
    print(f"\n{'Feeny-Moon':<12}{'exhaustive':>12}{'projection':>12}{'faster':>9}{'error':>9}")
    for seed in range(CURVES):
        rng = np.random.default_rng(seed)
        speed = np.geomspace(0.5, 60.0, 16)
        truth = {
            "coulomb_nm": JOINT.coulomb_nm,
            "viscous_nm_s_per_rad": JOINT.viscous_nm_s_per_rad,
            "mu": rng.uniform(0.5, 0.9),
            "beta_s_per_rad": rng.uniform(0.1, 0.5),
        }
        friction = FEENY_MOON.torque(speed, truth) + 0.003 * rng.standard_normal(16)
        bounds = separable.domain(FEENY_MOON, speed)
        start = time.process_time()
        theirs = exhaustive(speed, friction, bounds)
        middle = time.process_time()
        _, fine = separable.search(FEENY_MOON, speed, friction, np.ones(16), bounds)
        took, ours = time.process_time() - middle, float(fine.sse[fine.best])
        print(
            f"curve {seed:<6}{middle - start:>11.2f}s{1e3 * took:>10.1f}ms"
            f"{(middle - start) / took:>8.0f}x{ours / theirs:>9.5f}"
        )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=500)
    seeds = parser.parse_args().seeds
    print(
        f"{seeds} seeds, {MOTION.time_s[-1]:.0f} s at {MOTION.rate_hz:.0f} Hz, torque noise "
        f"{NOISE_NM} N m (white), gear {JOINT.gear_ratio:g}"
    )
    print(
        f"{'fit':<16}{'parameter':<22}{'truth':>9}{'coverage':>10}{'rmse':>11}"
        f"{'/ bound':>9}{'/ kept':>9}"
    )
    for s in campaign(range(seeds)) + law_campaign(range(seeds)):
        print(
            f"{s.fit:<16}{s.parameter:<22}{s.truth:>9.4g}{100 * s.coverage:>9.1f}%"
            f"{s.rmse:>11.3g}{s.ratio:>9.3f}{s.ratio_of_used:>9.3f}",
            flush=True,
        )
    memory_table(seeds)
    search_table()


if __name__ == "__main__":
    main()
