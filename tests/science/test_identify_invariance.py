"""Units and directions are conventions: the answer must follow them and nothing else."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import least_squares

from agent.identify.estimate import estimate
from agent.identify.friction import separable
from agent.identify.result import Estimate, Floats
from agent.physics.friction import FEENY_MOON, STRIBECK
from tests.science.identify_plant import Joint, record, stair

SIGNALS = record(
    Joint(static_extra_nm=0.3, gravity_sin_nm=0.3, gear_ratio=20.0, offset_nm=0.1),
    stair((2.0, 5.0, 9.0, 16.0, 30.0, 60.0, 100.0), rate_hz=125.0),
)
REFERENCE = estimate([SIGNALS])


def values(result: Estimate) -> dict[str, float]:
    assert result.rigid_body is not None
    assert result.selected_model is not None
    out = {f"body.{k}": p.value for k, p in result.rigid_body.parameters.items()}
    return out | {f"law.{k}": p.value for k, p in result.selected_model.parameters.items()}


@settings(max_examples=12, deadline=None)
@given(factor=st.floats(1e-4, 1e4))
def test_torque_in_another_unit(factor: float) -> None:
    scaled = values(estimate([replace(SIGNALS, torque_nm=SIGNALS.torque_nm * factor)]))
    for name, value in values(REFERENCE).items():
        same = name.endswith(("stribeck_velocity_rad_s", "exponent"))
        assert scaled[name] == pytest.approx(value if same else factor * value, rel=1e-4)


def test_positive_direction_the_other_way() -> None:
    assert SIGNALS.position_rad is not None
    assert SIGNALS.velocity_rad_s is not None
    mirrored = values(
        estimate(
            [
                replace(
                    SIGNALS,
                    position_rad=-SIGNALS.position_rad,
                    velocity_rad_s=-SIGNALS.velocity_rad_s,
                    torque_nm=-SIGNALS.torque_nm,
                )
            ]
        )
    )
    for name, value in values(REFERENCE).items():
        odd = name in ("body.gravity_cos_nm", "body.torque_offset_nm")
        assert mirrored[name] == pytest.approx(-value if odd else value, rel=1e-5, abs=1e-9)


def test_time_may_start_anywhere_and_order_does_not_matter() -> None:
    late = replace(SIGNALS, time_s=SIGNALS.time_s + 1e4)
    assert values(estimate([late])) == pytest.approx(values(REFERENCE), rel=1e-3)
    other = record(Joint(static_extra_nm=0.3, gear_ratio=20.0), stair(), seed=4)
    one, two = estimate([SIGNALS, other]), estimate([other, SIGNALS])
    assert values(one) == pytest.approx(values(two), rel=1e-3)


def curve(seed: int) -> tuple[np.ndarray, np.ndarray]:
    rng = np.random.default_rng(seed)
    speed = np.geomspace(0.5, 60.0, 16)
    truth = {
        "coulomb_nm": 0.6,
        "viscous_nm_s_per_rad": 0.01,
        "mu": rng.uniform(0.5, 0.9),
        "beta_s_per_rad": rng.uniform(0.1, 0.5),
    }
    return speed, FEENY_MOON.torque(speed, truth) + 0.003 * rng.standard_normal(16)


@pytest.mark.parametrize("seed", range(5))
def test_search_agrees_with_the_exhaustive_search_of_the_thesis(seed: int) -> None:
    """Section 4.4.3: vary mu and beta over a range, solve for fv and fc by linear regression."""
    speed, friction = curve(seed)
    best, at = np.inf, (0.0, 0.0)
    low, high = separable.domain(FEENY_MOON, speed)[1]
    for mu in np.linspace(0.05, 1.0, 120):
        for beta in np.geomspace(low, high, 200):
            phi = np.stack([speed, mu + (1.0 - mu) / np.cosh(beta * speed)], axis=1)
            theta, *_ = np.linalg.lstsq(phi, friction, rcond=None)
            error = float(np.sum((friction - phi @ theta) ** 2))
            if error < best:
                best, at = error, (mu, beta)
    bounds = separable.domain(FEENY_MOON, speed)
    _, fine = separable.search(FEENY_MOON, speed, friction, np.ones(16), bounds)
    assert fine.sse[fine.best] <= best * (1.0 + 1e-9)
    # The thesis's grid is finite: the search may be better by what lies between its points.
    near = FEENY_MOON.columns(speed, *fine.nonlinear[fine.best])
    theta, *_ = np.linalg.lstsq(near, friction, rcond=None)
    there = FEENY_MOON.columns(speed, *at)
    theta_there, *_ = np.linalg.lstsq(there, friction, rcond=None)
    np.testing.assert_allclose(near @ theta, there @ theta_there, atol=0.002)
    np.testing.assert_allclose(fine.nonlinear[fine.best], at, rtol=0.1, atol=0.02)


@pytest.mark.parametrize("seed", range(5))
def test_search_is_the_best_of_many_local_searches(seed: int) -> None:
    speed, friction = curve(seed)
    bounds = separable.domain(STRIBECK, speed)
    _, fine = separable.search(STRIBECK, speed, friction, np.ones(16), bounds)

    def residual(nonlinear: np.ndarray) -> np.ndarray:
        columns = STRIBECK.columns(speed, *nonlinear)
        theta, *_ = np.linalg.lstsq(columns, friction, rcond=None)
        return np.asarray(friction - columns @ theta)

    rng = np.random.default_rng(seed)
    starts = np.exp(rng.uniform(np.log(bounds[:, 0]), np.log(bounds[:, 1]), (25, 2)))
    costs = [
        2.0 * least_squares(residual, s, bounds=(bounds[:, 0], bounds[:, 1])).cost for s in starts
    ]
    assert fine.sse[fine.best] <= min(costs) * (1.0 + 1e-6)


@pytest.mark.parametrize("noise_nm", [1e-5, 1e-3])
def test_a_profile_reaches_as_far_as_theory_however_precise_the_points(noise_nm: float) -> None:
    """On one grid for every noise, a precise curve's interval was that of a few grid points."""
    speed = np.geomspace(1.0, 140.0, 24)
    truth = np.array([0.6, 0.0107, 0.4, 12.0, 1.3])
    law, weight = STRIBECK, np.ones(24)

    def torque(x: Floats) -> Floats:
        return np.asarray(law.torque(speed, dict(zip(law.parameters, x.tolist(), strict=True))))

    value = torque(truth) + noise_nm * np.random.default_rng(0).standard_normal(24)
    bounds = separable.domain(law, speed)
    coarse, fine = separable.search(law, speed, value, weight, bounds)
    limit = float(fine.sse[fine.best]) + (2.0 * noise_nm) ** 2
    region, at_bound = separable.profile_region(
        law, speed, value, weight, bounds, (coarse, fine), limit
    )
    found = np.ptp(region.nonlinear[region.sse <= limit], axis=0) / 2.0
    steps = 1e-5 * np.diag(truth)
    slopes = [(torque(truth + h) - torque(truth - h)) / (2.0 * h.max()) for h in steps]
    columns = np.stack(slopes, axis=1)
    theory = 2.0 * noise_nm * np.sqrt(np.diag(np.linalg.inv(columns.T @ columns)))
    places = [law.parameters.index(name) for name in law.nonlinear]
    assert not at_bound.any()
    np.testing.assert_allclose(found, theory[places], rtol=0.2)
