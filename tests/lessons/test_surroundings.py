"""A neighbouring axis that swings in its servo is no soft gear: it is too light for the weight."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.answer.result import Finding
from agent.explain.answer.said import Said
from agent.explain.forms.quantities import NOT_NEEDED
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import tabulate
from agent.explain.surroundings import (
    beside_the_joint,
    least_inertia_kg_m2,
    not_needed,
    swing_sentence,
    verdict_beside,
)
from agent.identify.result import Parameter
from tests.science.explain_joint import TWIN, Conditions, nothing, record, stair

WEIGHT_NM = 1.5  # on the motor, behind a gear of 100


def joint(weight_nm: float) -> Scene:
    table = tabulate(TWIN, [record(stair((2.0, 20.0)), nothing, Conditions(), 0)], 30.0)
    theta = np.array([TWIN.inertia_kg_m2, 0.01, 0.5, 0.0, -weight_nm])
    return Scene(table, theta, np.zeros(table.used.shape[0]))


def swinging(inertia_kg_m2: float, hertz: float = 12.0) -> Finding:
    numbers = {
        "arm_inertia_kg_m2": Parameter(inertia_kg_m2, None),
        "stiffness_nm_per_rad": Parameter(inertia_kg_m2 * (2.0 * np.pi * hertz) ** 2, None),
    }
    return Finding("joint-flexibility", 1, 0.97, 0.8, (), Said("An arm swings."), numbers, (), 0.1)


def test_nothing_that_weighs_so_much_has_less_inertia_than_a_ball_of_steel() -> None:
    mass = np.geomspace(1e-2, 1e4, 20001)
    radius = (3.0 * mass / (4.0 * np.pi * 7850.0)) ** (1.0 / 3.0)
    distance = 150.0 / (9.81 * mass)
    every = mass * distance**2 + 0.4 * mass * radius**2
    assert least_inertia_kg_m2(150.0) == pytest.approx(every.min(), rel=1e-6)
    assert least_inertia_kg_m2(0.0) == 0.0


def test_what_is_too_light_for_the_weight_is_not_the_gears_arm() -> None:
    scene, neighbour = joint(WEIGHT_NM), swinging(1.8e-4)
    assert beside_the_joint(scene, [neighbour, swinging(6e-3)]) == (neighbour,)
    assert beside_the_joint(joint(0.0), [neighbour]) == ()  # a weightless arm may be as light
    assert "swings at 12 Hz" in swing_sentence(neighbour, scene)
    assert verdict_beside("explained", [], [neighbour]) == "unexplained"
    other = replace(neighbour, effect="torque-ripple", energy_share=0.2)
    assert verdict_beside("tied", [other], [neighbour]) == "partly-explained"
    assert verdict_beside("tied", [other], []) == "tied"


def test_a_weak_swing_that_need_not_be_there_has_no_name_beside_a_stronger_effect() -> None:
    scene, sure = joint(0.0), replace(swinging(4e-3), energy_share=0.09)
    maybe = Parameter.not_identified(NOT_NEEDED, 23.0)
    unsure = replace(sure, parameters={**sure.parameters, "stiffness_nm_per_rad": maybe})
    offset = replace(sure, effect="torque-offset", energy_share=0.92, parameters={})
    assert not_needed(scene, [offset, unsure]) == (unsure,)
    assert not_needed(scene, [offset, sure]) == ()
    assert not_needed(scene, [unsure]) == ()  # alone, it is the best account of what is missing
    for half, there in ((2e-3, False), (1e-3, True)):
        inertia = Parameter(4e-3, (4e-3 - half, 4e-3 + half))
        sized = replace(unsure, parameters={**unsure.parameters, "arm_inertia_kg_m2": inertia})
        assert (not_needed(scene, [offset, sized]) == ()) is there
    assert "there need be none" in swing_sentence(unsure, scene)


def test_a_weak_swing_above_the_band_without_a_number_has_no_name() -> None:
    """A real axis, every twentieth row kept: a gear of 13 Hz in a band of 5, beside asymmetry."""
    scene = joint(0.0)
    within, above = (
        replace(swinging(4e-3, factor * scene.table.cutoff_hz), energy_share=0.03)
        for factor in (0.8, 2.6)
    )
    unknown = {n: Parameter.not_identified("", p.value) for n, p in above.parameters.items()}
    alike = replace(above, parameters=unknown)
    stiffness = unknown["stiffness_nm_per_rad"].value / 10.0
    slower = {"stiffness_nm_per_rad": Parameter.not_identified("", stiffness)}
    other = replace(above, effect="direction-asymmetry", energy_share=0.92, parameters={})
    assert not_needed(scene, [other, above]) == ()
    assert not_needed(scene, [other, within]) == ()
    assert not_needed(scene, [other, replace(alike, parameters={**unknown, **slower})]) == ()
    assert not_needed(scene, [other, alike]) == (alike,)
    assert "Hz that are compared" in swing_sentence(alike, scene)
