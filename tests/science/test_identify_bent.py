"""A rigid body beside bent friction is as certain as a plan says, and friction is the law's."""

from __future__ import annotations

import numpy as np

from agent.identify.estimate import estimate, twin_from_estimate
from tests.science.design_cycles import BODY, GEAR, Truth, belief, cycle, noise, thesis_paired
from trajectories import expect


def test_intervals_are_those_that_a_plan_promises_and_friction_is_the_laws() -> None:
    """What a line leaves of the fall, taken for noise, made them four to six times as wide."""
    truth, promised = Truth(), expect(thesis_paired(), belief(), noise()).half_widths
    shares, inside = [], 0
    for seed in range(5):
        result = estimate([cycle(thesis_paired(), truth, seed)])
        assert result.rigid_body is not None
        assert result.selected_model is not None
        body, law = result.rigid_body.parameters, result.selected_model.parameters
        for name in BODY:
            low, high = body[name].ci95 or (np.nan, np.nan)
            shares.append((high - low) / 2.0 / promised[name])
            inside += low <= getattr(truth, name) <= high
        assert result.selected_model.model == "stribeck"
        assert body["coulomb_nm"] == law["coulomb_nm"]
        twin = twin_from_estimate(result, robot="R", axis=1, gear_ratio=GEAR)
        assert twin.coulomb_nm > law["coulomb_nm"].value + 0.02  # a straight line through the fall
        assert twin.inertia_kg_m2 in (
            body["inertia_kg_m2"].value,
            result.rigid_body.as_twin.get("inertia_kg_m2"),
        )
    # Of 20 intervals of 95 % at least 16 hold the truth in 997 of 1000 such tests.
    assert inside >= 16
    assert 0.9 < float(np.median(shares)) < 1.6
