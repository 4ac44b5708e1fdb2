"""A rigid joint whose velocity is noisy had a soft gear: five of ten in Fourier motion.

It followed the noisy motion less than the joint's inertia does, and so predicted better, on unseen
recordings too. No speed was held in any of them, so that nothing was known of the noise.
"""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.choosing.choice import Choice
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.forms import arm
from agent.explain.numbers.smoothing import only_smooths
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR

RATE_HZ, GEAR_INERTIA, COULOMB, VISCOUS = 500.0, 0.033, 0.74, 0.01
TWIN = Twin("plant", 1, GEAR, GEAR_INERTIA, COULOMB, VISCOUS, 0.0, 0.0)
NOISE_RAD_S, NOISE_NM = 0.02, 0.05
ARM_SHARE, SWING_HZ, DAMPING = 0.5, 8.0, 0.1
"""Of the soft joint."""


def fourier(seed: int, *, soft: bool) -> Run:
    """Return 30 s of five harmonics of a rigid joint, or of one with half of its inertia behind."""
    rng = np.random.default_rng(seed)
    time = np.arange(round(30.0 * RATE_HZ)) / RATE_HZ
    position, velocity, acceleration = (np.zeros(time.size) for _ in range(3))
    behind: Floats = np.zeros(time.size)
    for k in range(1, 6):
        w, phase = 2.0 * np.pi * 0.2 * k, rng.uniform(0.0, 2.0 * np.pi)
        size = 60.0 / k
        # The arm's own acceleration, as a damped spring passes on every harmonic of the motor's.
        s = 1j * w / (2.0 * np.pi * SWING_HZ)
        passes = (1.0 + 2.0 * DAMPING * s) / (1.0 + 2.0 * DAMPING * s + s * s)
        wave = np.exp(1j * (w * time + phase))
        position += np.real(size / (1j * w) * wave)
        velocity += np.real(size * wave)
        acceleration += np.real(size * 1j * w * wave)
        behind += np.real((passes - 1.0) * size * 1j * w * wave)
    torque = GEAR_INERTIA * acceleration + COULOMB * np.sign(velocity) + VISCOUS * velocity
    if soft:
        torque = torque + ARM_SHARE * GEAR_INERTIA * behind
    return Run.from_columns(
        {
            "time_s": np.asarray(time),
            "position_rad": position,
            "velocity_rad_s": velocity + NOISE_RAD_S * rng.standard_normal(time.size),
            "torque_nm": torque + NOISE_NM * rng.standard_normal(time.size),
        },
        GEAR,
        name=f"fourier {seed}",
    )


@pytest.mark.parametrize("soft", [False, True])
def test_a_spring_that_the_motions_noise_alone_would_show_is_none(soft: bool) -> None:
    table = tabulate(TWIN, [fourier(seed, soft=soft) for seed in (1, 2)])
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta)
    library = Library.of(scene, weigh(table, left), arm.FORMS)
    (best, *_) = library.rank([])
    assert best.error < 0.95 * float(library.errors([]).sum())
    choice = Choice((Term(best, 0.0),), library.errors([]), best.blocks)
    refused = {effect for effect, _ in only_smooths(library, choice)}
    assert refused == (set() if soft else {"joint-flexibility"})
