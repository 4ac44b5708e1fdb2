"""Reversals are taken in where the model explains them, and noise scatters what it should."""

from __future__ import annotations

import dataclasses
import math
from functools import cache

import numpy as np
import pytest

from agent.identify.flexible.attenuation import covariance_of
from agent.identify.flexible.chain import Chain, shape_of
from agent.identify.flexible.descent import bounds_of, descend
from agent.identify.flexible.preparation import Prepared, Track, prepare, tracks_of
from agent.identify.flexible.projection import Point, Problem, evaluate
from agent.identify.flexible.reversals import through_reversals
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass
from agent.physics.friction import COULOMB_VISCOUS
from tests.science.flexible_chain import NOISE_NM, TWO, run
from tests.science.flexible_plant import triangle_wave

CUTOFF_HZ = 50.0
SHAPE = shape_of(
    Chain((TWO["arm_inertia_kg_m2"],), (TWO["spring_nm_per_rad"],), (TWO["damper_nm_s_per_rad"],))
)


@cache
def recorded() -> Track:
    return tracks_of(run(triangle_wave(4)).measured(1))[0]


def problem_of(track: Track) -> Problem:
    stretch = prepare(track, CUTOFF_HZ)
    assert stretch is not None
    return Problem((stretch,), "two-mass", COULOMB_VISCOUS, has_gravity=False)


def minimum(problem: Problem) -> tuple[Problem, Point, bool]:
    """Return what becomes of the reversals, from the minimum without them."""
    box = bounds_of(problem, 1.0, CUTOFF_HZ, problem.fastest_rad_s)
    point, _ = descend(problem, np.append(SHAPE, 0.0), box)
    wider, lowest = through_reversals(problem, point, box)
    return wider, lowest, wider is not problem


def disturbed(track: Track, reach: int, height_nm: float) -> Track:
    """Return the track with a torque on so many samples from every reversal on."""
    torque = track.torque_nm.copy()
    stretch = prepare(track, CUTOFF_HZ)
    assert stretch is not None
    for k in stretch.reversal:
        torque[k : k + reach] += height_nm * math.copysign(1.0, track.velocity_rad_s[k + 20])
    return dataclasses.replace(track, torque_nm=torque)


def test_reversals_that_the_law_explains_are_taken_in() -> None:
    wider, lowest, taken = minimum(problem_of(recorded()))
    assert taken
    stretch = problem_of(recorded()).stretches[0]
    assert wider.stretches[0].usable.sum() > stretch.usable.sum()
    coulomb = dict(zip(wider.linear_names, lowest.linear.tolist(), strict=False))["coulomb_nm"]
    assert coulomb == pytest.approx(TWO["coulomb_nm"], rel=0.005)


def test_friction_that_no_law_explains_leaves_reversals_out() -> None:
    # 0.15 N m over 15 ms: a quarter of the Coulomb level, as presliding would do.
    assert not minimum(problem_of(disturbed(recorded(), 15, 0.15)))[2]


def test_the_moment_of_a_reversal_moves_nothing() -> None:
    search = np.append(SHAPE, 0.0)

    def solved(track: Track) -> Floats:
        problem = problem_of(track)
        through = tuple(p.through_reversals() for p in problem.stretches)
        return evaluate(dataclasses.replace(problem, stretches=through), search).linear[:5]

    np.testing.assert_allclose(
        solved(disturbed(recorded(), 1, 5.0)), solved(recorded()), rtol=1e-6, atol=1e-9
    )


def test_known_noise_scatters_as_it_does_when_drawn() -> None:
    problem = problem_of(recorded())
    point = evaluate(problem, np.append(SHAPE, 0.0))
    stretch: Prepared = problem.stretches[0]
    rng = np.random.default_rng(0)
    draws = NOISE_NM * rng.standard_normal((400, stretch.direction.shape[0]))
    noise = lowpass(draws, stretch.track.period_s, CUTOFF_HZ)[:, :: stretch.stride]
    rows = np.asarray(np.linalg.pinv(point.columns)[:5], dtype=np.float64)
    drawn = np.std(noise[:, stretch.usable] @ rows.T, axis=0)
    # The motion's own noise comes on top: little of it here, and never less than none.
    known = np.sqrt(np.diag(covariance_of(problem, point, rows)))
    np.testing.assert_allclose(known, drawn, rtol=0.15)
