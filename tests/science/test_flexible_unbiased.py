"""The motion's noise is taken back along the valley, and where it leaves no valley nothing is."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from agent.identify.flexible.attenuation import moved_by_noise
from agent.identify.flexible.chain import Chain, shape_of
from agent.identify.flexible.descent import Bounds, bounds_of, descend
from agent.identify.flexible.intervals import physical
from agent.identify.flexible.preparation import prepare, tracks_of
from agent.identify.flexible.projection import Point, Problem
from agent.identify.flexible.straight import bend_of, stepped
from agent.identify.flexible.unbiased import without_motion_noise
from agent.identify.result import Floats
from agent.physics.friction import COULOMB_VISCOUS
from tests.science.flexible_chain import THREE, Robot, run
from tests.science.flexible_plant import triangle_wave

LIGHT = Robot(dict(THREE)).with_(
    gear_inertia_kg_m2=0.001, gear_spring_nm_per_rad=32.0, arm_spring_nm_per_rad=20.0
)
"""A gear of 6 % of all inertia, whose mode at 37 Hz the motion hardly excites."""


def true_search() -> Floats:
    masses = LIGHT.masses[1:]
    links = (tuple(LIGHT.links(f"{kind}_per_rad")) for kind in ("spring_nm", "damper_nm_s"))
    return np.append(shape_of(Chain(tuple(masses), *links)), 0.0)


@cache
def minimum(bits: int) -> tuple[Problem, Point, Bounds]:
    """Return the least squares' minimum, reversals in, behind an encoder of so many bits."""
    wave = triangle_wave(3, peak_rad_s=60.4)
    cycle = run(wave, robot=LIGHT).measured(1, noise_nm=0.002, counts=1 << bits)
    stretch = prepare(tracks_of(cycle)[0], 75.0)
    assert stretch is not None
    problem = Problem((stretch.through_reversals(),), "three-mass", COULOMB_VISCOUS, False)
    box = bounds_of(problem, 1.0, 75.0, problem.fastest_rad_s)
    return problem, descend(problem, true_search(), box)[0], box


def errors(problem: Problem, search: Floats, linear: Floats) -> dict[str, float]:
    """Return by how large a part of itself every number misses the truth."""
    values = physical(problem, search, linear)
    return {n: values[n] / t - 1.0 for n, t in LIGHT.truth.items() if t != 0.0}


def test_noise_is_taken_back_along_a_valley_that_bends() -> None:
    problem, point, box = minimum(16)
    size = point.linear.shape[0]
    straight = np.concatenate((point.linear, point.search)) + moved_by_noise(problem, point)
    left = errors(problem, straight[size:], straight[:size])
    assert abs(left["antiresonance_1_hz"]) > 1e-3, "ten intervals"
    found = without_motion_noise(problem, point, box)
    assert found is not None
    kept = errors(problem, found.point.search, found.point.linear)
    assert abs(kept["antiresonance_1_hz"]) < 2e-4
    assert abs(kept["resonance_1_hz"]) < 1e-3
    for name in ("motor_inertia_kg_m2", "gear_spring_nm_per_rad", "arm_spring_nm_per_rad"):
        before = errors(problem, point.search, point.linear)[name]
        assert abs(kept[name]) < 0.3 * abs(before), f"{name}: the noise had pulled at it"
    larger = np.linalg.eigvals(found.amplified).real
    assert 1.05 < larger.max() < 2.0, "what was taken back scatters, too"


def test_noise_that_tells_as_much_as_the_motion_leaves_no_minimum() -> None:
    assert without_motion_noise(*minimum(13)) is None


@pytest.mark.parametrize("seed", range(5))
def test_a_step_of_modes_is_a_chain_again(seed: int) -> None:
    search = true_search()
    search[:5] += np.random.default_rng(seed).normal(0.0, 0.5, 5)
    step = np.zeros(6)
    np.testing.assert_allclose(stepped("three-mass", search, step), search, rtol=1e-9)
    step[[0, 2]] = 0.1
    both = stepped("three-mass", search, step)
    # All frequencies by a tenth: springs stiffen alike, and no mass moves.
    np.testing.assert_allclose(both - search, [0.1, 0.0, 0.1, 0.0, 0.0, 0.0], atol=1e-9)
    tiny = 1e-5 * np.array([1.0, 0.0, -1.0, 0.0, 2.0, 0.0])
    moved = stepped("three-mass", search, tiny) - search
    np.testing.assert_allclose(moved, bend_of("three-mass", search) @ tiny, rtol=1e-3, atol=1e-9)
