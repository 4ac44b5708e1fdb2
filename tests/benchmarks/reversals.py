"""Coverage and choice of the laws of reversals: ``python -m tests.benchmarks.reversals [seeds]``.

Truths are integrated apart from the product; a seed draws the motion, torque noise, the encoders'
phase and the sampling's phase. The encoder has 2^20 counts a turn, as servo motors' have, or
2^BITS with ``--bits``. The bound is Cramer and Rao's for white noise of the torque and the
encoder's steps. Every seed has a speed of its own, and errors are in units of its own bound. The
choice among four laws (at every tenth seed) is tried with 2^16 counts. ``--law`` takes one law
alone, ``--law clearance`` the clearance from the arm's encoder, whose own counts are 2^ARM_BITS,
of all gears or of one ``--gear``.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.identify.result import Floats
from agent.identify.reversals.arm import arm_clearance
from agent.identify.reversals.data import Data, columns_of, data_of
from agent.identify.reversals.laws import LAWS, range_of
from agent.identify.reversals.parameters import parameters_of
from agent.identify.reversals.search import Solution, solve
from agent.identify.reversals.selection import select
from agent.identify.reversals.turns import Motion, Track, Turn, read_tracks
from tests.science.backlash_bound import clearance_bound
from tests.science.reversal_plant import (
    ARM_COULOMB,
    FINE_S,
    SAMPLE_S,
    VISCOUS,
    bristled,
    geared,
    own_swings,
    sampled,
    swings,
)
from tests.science.test_reversals_recovery import TRUTH
from trajectories import Trajectory

SEEDS = 500
NOISE_NM = 0.01
FIRST = 10_000  # seeds that no test and no choice of a constant has seen
GEARS = {"stiff": (0.03, 400.0), "soft": (0.03, 30.0), "no-gap": (0.0, 20.0)}  # rad, N m/rad


def presliding(seeds: int, laws: Sequence[str], counts: int, first: int) -> None:
    """Print coverage, error against each seed's own bound, and bias of every parameter."""
    print(
        f"{'law':<15}{'parameter':<26}{'given':>6}{'covered':>10}{'rmse/truth':>12}{'/ bound':>9}"
    )
    for law in laws:
        truth = TRUTH[law]
        alike = bounds(law, None, swings())
        dearer = {name: b / alike[name] for name, b in bounds(law, counts, swings()).items()}
        rows: dict[str, list[tuple[bool, float, float]]] = {name: [] for name in truth}
        spent = 0.0
        for seed in range(first, first + seeds):
            swung = own_swings(seed)
            bound = {name: dearer[name] * b for name, b in bounds(law, None, swung).items()}
            motion = read_tracks([sampled(bristled(law, swung), seed, counts=counts)])
            began, range_ = time.process_time(), range_of(motion)
            for name, parameter in parameters_of(
                solve(LAWS[law], data_of(motion), range_), range_
            ).items():
                if name in truth and parameter.ci95 is not None:
                    low, high = parameter.ci95
                    error = parameter.value - truth[name]
                    rows[name].append((low <= truth[name] <= high, error, error / bound[name]))
            spent += time.process_time() - began
        for name, seen in rows.items():
            covered, error, share = np.array(seen, dtype=np.float64).T
            rmse, own = np.sqrt(np.mean(np.stack((error, share)) ** 2, axis=1)), truth[name]
            print(
                f"{law:<15}{name:<26}{covered.size:>6}{100.0 * covered.mean():8.1f} %"
                f"{100.0 * rmse[0] / own:10.2f} %{rmse[1]:9.2f}"
                f"   bias {100.0 * error.mean() / own:+.2f} %",
                flush=True,
            )
        print(f"{law:<15}{spent / seeds:.2f} s of a processor each", flush=True)


def choice(seeds: int) -> None:
    """Print how often each true law was chosen among four."""
    for law in TRUTH:
        chosen = 0
        for seed in range(FIRST, FIRST + seeds):
            motion = read_tracks([sampled(bristled(law), seed)])
            range_, data = range_of(motion), data_of(motion)
            found = [solve(one, data, range_) for one in LAWS.values() if one.presliding]
            chosen += select(found, data, range_)[0].law.name == law
        print(f"{law:<15}chosen in {chosen} of {seeds}", flush=True)


def bounds(law: str, counts: int | None, swung: Trajectory) -> dict[str, float]:
    """Return the smallest deviation of every parameter; slopes are those of the law itself.

    Without counts the motion is known: what an encoder's steps add takes 8 s of a processor.
    """
    run, every = bristled(law, swung), round(SAMPLE_S / FINE_S)
    clean = sampled(run, 0, noise_nm=0.0, counts=1 << 34)
    (track,) = read_tracks([clean]).tracks
    index = np.arange(0, run.time_s.size, every)[: track.time_s.size]
    velocity = run.velocity_rad_s
    exact = replace(
        track,
        position_rad=run.position_rad[index],
        velocity_rad_s=velocity[index],
        driving_rad_s=velocity[index],
        acceleration_rad_s2=np.gradient(velocity, FINE_S)[index],
        torque_nm=run.torque_nm[index],
        cutoff_hz=1.0 / SAMPLE_S,
    )
    data = data_of(Motion((exact,), (True, True), 1.0 / SAMPLE_S))
    found = solve(LAWS[law], data, range_of(data.motion))
    columns = columns_of(found.law, data, found.x)
    steps = 1e-4 * np.eye(found.x.size)
    own = len(found.law.levels)
    slopes = [
        (columns_of(found.law, data, found.x + h) - columns_of(found.law, data, found.x - h))[
            :, :own
        ]
        @ found.weights[:own]
        / 2e-4
        for h in steps
    ]
    jacobian = np.column_stack((*slopes, columns))
    covariance = np.linalg.inv(_information(found, data, jacobian, counts))
    return {name: float(np.sqrt(g @ covariance @ g)) for name, g in _gradients(found, law).items()}


def _information(found: Solution, data: Data, jacobian: Floats, counts: int | None) -> Floats:
    """Return what torque and position tell of the parameters, the true motion being unknown.

    An error e of the position is one of the torque that the motion needs, ``G e``: around a turn
    the covariance is ``s_torque^2 + s_position^2 G G^T``. The encoder's steps count as white noise
    of variance ``step^2/12``.
    """
    if counts is None:
        return jacobian.T @ jacobian / NOISE_NM**2
    (track,) = data.motion.tracks
    error_rad = 2.0 * np.pi / counts / np.sqrt(12.0)
    total = np.zeros((jacobian.shape[1], jacobian.shape[1]))
    for number, turn in enumerate(track.turns):
        own = data.turn == number
        shaken = _shaken(found, track, turn)[data.kept[0][own] - turn.start]
        covariance = error_rad**2 * shaken @ shaken.T
        covariance[np.diag_indices_from(covariance)] += NOISE_NM**2
        total += jacobian[own].T @ np.linalg.solve(covariance, jacobian[own])
    return total


def _shaken(found: Solution, track: Track, turn: Turn) -> Floats:
    """Return how the torque about a turn follows each position there, N m/rad, shape (n, n)."""
    window, shift = slice(turn.start, turn.stop), 1e-6

    def torque(position: Floats) -> Floats:
        velocity = np.gradient(position, SAMPLE_S)
        part = replace(
            track, time_s=track.time_s[window], velocity_rad_s=velocity, driving_rad_s=velocity
        )
        own = found.law.columns(part, np.exp(found.x)) @ found.weights[: len(found.law.levels)]
        own += found.value("viscous_nm_s_per_rad") * velocity
        return np.asarray(
            own + found.value("inertia_kg_m2") * np.gradient(velocity, SAMPLE_S), dtype=np.float64
        )

    position = track.position_rad[window]
    still = torque(position)
    shaken = [(torque(position + shift * e) - still) / shift for e in np.eye(position.size)]
    return np.stack(shaken, axis=-1)


def _gradients(found: Solution, law: str) -> dict[str, Floats]:
    """Return how every named parameter follows logarithms of the shape, and weights."""

    def along(**slopes: float) -> Floats:
        out = np.zeros(found.shifts.shape[1])
        for name, slope in slopes.items():
            out[found.place(name)] = slope
        return out

    out = {}
    for name in TRUTH[law]:
        if name == "stiffness_nm_per_rad":
            length = found.value("space_constant_rad")
            level = found.value("coulomb_nm")
            out[name] = along(coulomb_nm=1.0 / length, space_constant_rad=-level / length)
        elif name == "static_extra_nm":
            share, level = found.value("static_extra_share"), found.value("coulomb_nm")
            out[name] = along(coulomb_nm=share, static_extra_share=share * level)
        elif name == "fast_share":
            ratio = found.value("fast_ratio")
            out[name] = along(fast_ratio=ratio / (1.0 + ratio) ** 2)
        else:
            out[name] = along(**{name: found.value(name) if name in found.law.shape else 1.0})
    return out


def clearance(seeds: int, counts: int, arm_counts: int, first: int, gears: Sequence[str]) -> None:
    """Print coverage, error and bias of what the arm's encoder tells, each seed in its bounds."""
    late_s = 0.002
    for gap, stiffness in map(GEARS.__getitem__, gears):
        truth = {
            "backlash_rad": gap,
            "lost_motion_rad": gap + 2.0 * ARM_COULOMB / stiffness,
            "compliance_rad_per_nm": 1.0 / stiffness,
            "encoder_skew_s": late_s,
        }
        rows: dict[str, list[tuple[bool, float]]] = {name: [] for name in truth}
        for seed in range(first, first + seeds):
            swung = own_swings(seed)
            signals = sampled(
                geared(gap, stiffness, swung),
                seed,
                noise_nm=NOISE_NM,
                counts=counts,
                arm_counts=arm_counts,
                with_arm=True,
                arm_late_s=late_s,
            )
            motion = read_tracks([signals])
            found = arm_clearance(motion, range_of(motion), VISCOUS)
            assert found is not None
            bound = clearance_bound(gap, stiffness, NOISE_NM, arm_counts, counts, swung)
            for name, parameter in found.named().items():
                if parameter.ci95 is not None and name in bound:
                    low, high = parameter.ci95
                    error = (parameter.value - truth[name]) / bound[name]
                    rows[name].append((low <= truth[name] <= high, error))
        print(f"gap {1e3 * gap:g} mrad, {stiffness:g} N m/rad, {seeds} seeds, in bounds")
        for name, seen in rows.items():
            if not seen:
                print(f"  {name:<24}{0:>6} given")
                continue
            covered, error = np.array(seen, dtype=np.float64).T
            print(
                f"  {name:<24}{covered.size:>6} given, covered {100.0 * covered.mean():.1f} %, "
                f"rmse {np.sqrt(np.mean(error**2)):.2f}, median {np.median(np.abs(error)):.2f}, "
                f"bias {error.mean():+.2f}",
                flush=True,
            )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("seeds", type=int, nargs="?", default=SEEDS)
    parser.add_argument("--bits", type=int, default=20, help="of the encoder, a turn")
    parser.add_argument("--arm-bits", type=int, default=22, help="of the arm's encoder, a turn")
    parser.add_argument("--first", type=int, default=FIRST, help="first seed")
    parser.add_argument("--law", choices=[*TRUTH, "clearance"], help="one law alone")
    parser.add_argument("--gear", choices=list(GEARS), help="one gear of the clearance alone")
    asked = parser.parse_args()
    gears = list(GEARS) if asked.gear is None else [asked.gear]
    if asked.law == "clearance":
        clearance(asked.seeds, 1 << asked.bits, 1 << asked.arm_bits, asked.first, gears)
        return
    if asked.law is not None:
        presliding(asked.seeds, [asked.law], 1 << asked.bits, asked.first)
        return
    clearance(asked.seeds, 1 << asked.bits, 1 << asked.arm_bits, asked.first, gears)
    presliding(asked.seeds, list(TRUTH), 1 << asked.bits, asked.first)
    choice(max(asked.seeds // 10, 1))


if __name__ == "__main__":
    main()
