"""Torque that swings at a frequency of its own: found where it is, and nowhere else."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from agent.explain.rows.lines import Line, lines_of
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.identify.result import Floats
from tests.science.explain_joint import NOISE_NM, TWIN, Conditions, Missing, record, stair
from trajectories import SetPoints, Trajectory

SPEEDS = (3.0, 11.0, 27.0, 60.0, 90.0)


@cache
def cycle(scale: float) -> Trajectory:
    return stair([scale * speed for speed in SPEEDS])


def recorded(missing: Missing, seed: int, *, alike: bool = False) -> list[Run]:
    """Return three recordings, at other speeds each, or all of the same cycle."""
    scales = (1.0, 1.0, 1.0) if alike else (1.0, 0.93, 0.88)
    return [
        record(cycle(scale), missing, Conditions(started_s=600.0 * k), seed + k, name=f"run {k}")
        for k, scale in enumerate(scales)
    ]


def lines_in(runs: list[Run]) -> tuple[Line, ...]:
    table = tabulate(TWIN, runs)
    return lines_of(table, refit(table)[1])


def swinging(hertz: float, amplitude_nm: float, *, bursts_s: float = math.inf) -> Missing:
    def missing(points: SetPoints, at: Conditions) -> Floats:
        time = np.arange(points.velocity_rad_s.shape[0]) / 250.0
        wave = amplitude_nm * np.sin(2.0 * math.pi * hertz * time + at.started_s)
        if math.isfinite(bursts_s):
            wave = wave * np.maximum(np.sin(2.0 * math.pi * time / bursts_s), 0.0)
        return np.asarray(wave)

    return missing


@pytest.mark.parametrize("hertz", [2.3, 7.11, 18.2, 49.97, 87.3])
def test_a_swing_of_its_own_is_found_at_its_frequency(hertz: float) -> None:
    amplitude_nm = 1.0 * NOISE_NM
    (line,) = lines_in(recorded(swinging(hertz, amplitude_nm), seed=5))
    assert line.frequency_hz == pytest.approx(hertz, abs=0.03)
    assert line.matters
    assert line.p_value < 0.01
    # Hann's window sees the middle of a recording best, and edges are masked: a third is near.
    assert line.energy_nm2 == pytest.approx(0.5 * amplitude_nm**2, rel=0.35)


def shaken(hertz: float, moves_nm: float, *, motor_nm: float = 0.0) -> list[Run]:
    """Return recordings in which the inertia swings by a torque, the motor's own part of it too."""
    out = []
    for run in recorded(swinging(hertz, 0.0), seed=5):
        signals, phase = run.signals, 2.0 * math.pi * hertz * run.signals.time_s + run.started_s
        assert signals.velocity_rad_s is not None
        size = moves_nm / (TWIN.inertia_kg_m2 * 2.0 * math.pi * hertz)
        moved = replace(
            signals,
            velocity_rad_s=signals.velocity_rad_s + size * np.sin(phase),
            torque_nm=signals.torque_nm + motor_nm * np.cos(phase),
        )
        out.append(replace(run, signals=moved))
    return out


@pytest.mark.parametrize("motor_nm", [0.0, 2.5 * NOISE_NM])
def test_a_swing_that_shakes_the_joint_is_its_own_though_the_velocity_shows_it(
    motor_nm: float,
) -> None:
    """A loop too slow to hold the motor leaves the shaking to it; one that rings adds to that."""
    hertz = 17.3
    (line,) = lines_in(shaken(hertz, motor_nm + 2.0 * NOISE_NM, motor_nm=motor_nm))
    assert line.frequency_hz == pytest.approx(hertz, abs=0.03)
    assert line.matters


def test_a_swing_above_the_band_that_the_inertia_takes_is_the_motions() -> None:
    """A staircase's even steps ring with their drive's loop at a frequency that is a line."""
    hertz, size_nm = 87.3, 3.0 * NOISE_NM
    assert lines_in(shaken(hertz, size_nm, motor_nm=size_nm)) == ()
    (line,) = lines_in(shaken(hertz, 0.0, motor_nm=size_nm))
    assert line.frequency_hz == pytest.approx(hertz, abs=0.03)


def test_bursts_are_found_with_their_sidebands() -> None:
    (line,) = lines_in(recorded(swinging(5.3, 4.0 * NOISE_NM, bursts_s=6.0), seed=5))
    assert line.frequency_hz == pytest.approx(5.3, abs=0.05)
    assert 1.0 / 6.0 <= line.half_width_hz <= 3.0 / 6.0
    assert line.share > 0.3


@pytest.mark.parametrize("alike", [False, True])
def test_a_wave_of_the_position_is_no_line_of_time(alike: bool) -> None:
    """Even where every recording drives the same speeds, so that its frequencies repeat."""

    def ripple(points: SetPoints, at: Conditions) -> Floats:
        del at
        return np.asarray(5.0 * NOISE_NM * np.sin(3.0 * points.position_rad))

    assert lines_in(recorded(ripple, seed=5, alike=alike)) == ()


def test_what_repeats_with_the_cycle_is_no_line_of_time() -> None:
    """A wrong friction curve is driven through again and again: its lines are the motion's own."""

    def bent(points: SetPoints, at: Conditions) -> Floats:
        del at
        velocity = points.velocity_rad_s
        return np.asarray(0.2 * np.sign(velocity) * np.exp(-np.abs(velocity) / 10.0))

    assert lines_in(recorded(bent, seed=5, alike=True)) == ()


def test_noise_has_no_lines() -> None:
    """At a false rate of 1 % for each band, two lines in 16 draws are a chance of one in 25."""

    def nothing(points: SetPoints, at: Conditions) -> Floats:
        del at
        return np.zeros_like(points.velocity_rad_s)

    found = [len(lines_in(recorded(nothing, seed=100 + 10 * k))) for k in range(16)]
    assert sum(found) <= 1
