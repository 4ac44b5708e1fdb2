"""A twin has no constant torque and no inertia below zero: its numbers come of a fit without."""

from __future__ import annotations

import numpy as np
import pytest

from agent.identify.rigid.body import fit_rigid_body
from agent.identify.rigid.rows import Rows
from agent.physics.rigid_body import PARAMETERS

TRUE = {
    "inertia_kg_m2": 0.006,
    "viscous_nm_s_per_rad": 0.003,
    "coulomb_nm": 0.4,
    "gravity_sin_nm": 1.5,
    "gravity_cos_nm": -0.9,
}


def _rows(offset_nm: float, *, inertia_kg_m2: float = 0.006, seed: int = 11) -> Rows:
    """Return a swing of 0.8 rad, over which gravity's cosine is nearly a constant."""
    true = TRUE | {"inertia_kg_m2": inertia_kg_m2}
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 60.0, 0.01)
    angle_rad = 0.8 * np.sin(0.7 * time_s)
    velocity = 161.0 * 0.8 * 0.7 * np.cos(0.7 * time_s)
    of = {
        "inertia_kg_m2": -0.49 * 161.0 * angle_rad,
        "viscous_nm_s_per_rad": velocity,
        "coulomb_nm": np.sign(velocity),
        "gravity_sin_nm": np.sin(angle_rad),
        "gravity_cos_nm": np.cos(angle_rad),
        "torque_offset_nm": np.ones_like(time_s),
    }
    of["inertia_kg_m2"] += rng.normal(0.0, 20.0, time_s.shape)  # speeds change beside the swing
    torque = sum(true[name] * of[name] for name in true) + offset_nm
    torque = torque + np.convolve(rng.normal(0.0, 0.15, time_s.shape), np.ones(20) / 20.0, "same")
    columns = np.column_stack([of[name] for name in PARAMETERS])
    return Rows(columns, np.asarray(torque), time_s, np.zeros_like(time_s), "", 1.6)


def test_gravity_of_a_twin_holds_no_part_of_an_offset_that_is_not_there() -> None:
    fit = fit_rigid_body(_rows(0.0))
    assert fit is not None
    beside, bare = fit.parameters["gravity_cos_nm"].value, fit.as_twin["gravity_cos_nm"]
    assert abs(beside - TRUE["gravity_cos_nm"]) > 5.0 * abs(bare - TRUE["gravity_cos_nm"])
    assert fit.as_twin == pytest.approx(TRUE, rel=0.05)


def test_an_offset_that_is_there_keeps_its_place() -> None:
    fit = fit_rigid_body(_rows(0.5))
    assert fit is not None
    assert fit.as_twin == {}
    assert fit.parameters["gravity_cos_nm"].value == pytest.approx(-0.9, abs=0.1)


def test_an_inertia_that_chance_makes_negative_is_none_of_a_twins() -> None:
    below = 0
    for seed in range(6):
        fit = fit_rigid_body(_rows(0.0, inertia_kg_m2=0.0, seed=seed))
        assert fit is not None
        numbers = fit.as_twin or {name: p.value for name, p in fit.parameters.items()}
        assert numbers.get("inertia_kg_m2", 0.0) >= 0.0
        assert numbers["coulomb_nm"] == pytest.approx(TRUE["coulomb_nm"], rel=0.05)
        below += fit.parameters["inertia_kg_m2"].value < 0.0
    assert 1 <= below <= 5
