"""Short passes err more than long ones, by a ratio that depends on the noise's memory."""

from __future__ import annotations

import numpy as np

from agent.identify.friction.curve import CurveFit, SteadyMeans
from agent.identify.friction.law_fit import fit_law
from agent.identify.friction.pass_noise import PassNoise
from agent.identify.result import FrictionCurve
from agent.physics.friction import STRIBECK

COUNT = 24
SPEED = np.geomspace(1.0, 140.0, COUNT)
WHITE_NM = 7e-4 * np.geomspace(1.0, 3.0, COUNT)  # the fast passes are short
REMEMBERED_NM = np.full(COUNT, 1.2e-3)  # noise that lasts for a pass, whatever its length


def width(noise: PassNoise | None, *, shared_gravity: bool = False) -> float:
    """Return how wide the interval of viscous friction is."""
    friction = 0.6 + 0.0107 * SPEED + 0.4 * np.exp(-((SPEED / 12.0) ** 1.3))
    friction += WHITE_NM * np.random.default_rng(4).standard_normal(COUNT)
    ends = np.stack((friction - 2e-3, friction + 2e-3), axis=-1)
    samples = np.full(COUNT, 400, dtype=np.int64)
    curve = FrictionCurve(SPEED, friction, ends, np.zeros(COUNT), samples)
    means = SteadyMeans(np.append(SPEED, -SPEED), np.append(friction, -friction))
    error = REMEMBERED_NM * (3.0 if shared_gravity else 1.0)
    told = CurveFit(curve, error, np.full(COUNT, 50.0), means, (), noise, shared_gravity)
    low, high = fit_law(STRIBECK, told).fit.parameters["viscous_nm_s_per_rad"].ci95 or (0.0, 0.0)
    return high - low


def passes_noise(white: float) -> PassNoise:
    """Return noise that is white with this weight, and else has a memory."""
    both = np.stack((np.diag(WHITE_NM**2), np.diag(REMEMBERED_NM**2)))
    return PassNoise((), np.array([white, 1.0 - white]), both, 100.0)


def test_an_interval_holds_white_noise_as_long_as_the_passes_allow_it() -> None:
    assert width(passes_noise(0.3)) > 1.15 * width(None)
    assert width(passes_noise(0.01)) == width(None)


def test_an_error_of_gravity_that_points_share_is_in_the_interval_though_no_residual_shows_it() -> (
    None
):
    assert width(None, shared_gravity=True) > 2.0 * width(None)
