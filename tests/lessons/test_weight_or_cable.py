"""A weight that the simulation does not know, beside friction: no cable copies its sine."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.search import Library
from agent.explain.explain import explain
from agent.explain.forms.library import FORMS
from agent.explain.numbers.short_stroke import pulled_and_offset
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats
from tests.science.textbook_joint import TWIN, Driven, recorded, stair

SPEEDS_RAD_S = (4.0, 8.0, 15.0, 28.0, 40.0)


def falling(driven: Driven) -> Floats:
    """Return friction that falls with speed."""
    speed = driven.velocity_rad_s
    return np.asarray(0.12 * np.exp(-np.abs(speed) / 6.0) * np.sign(speed))


def test_a_weight_beside_stribeck_is_no_cable() -> None:
    known = replace(TWIN, gravity_sin_nm=0.0, gravity_cos_nm=0.0)
    weighs = replace(TWIN, gravity_sin_nm=0.3, gravity_cos_nm=0.0)
    *fit, held_out = (
        recorded(stair([k * v for v in SPEEDS_RAD_S]), falling, 0.03, seed, weighs)
        for seed, k in enumerate((1.0, 1.07, 1.15, 0.93))
    )
    answer = explain(known, fit, [held_out])
    weight, friction = answer.findings
    assert (weight.effect, friction.effect) == ("gravity-imbalance", "stribeck")
    assert not weight.alternatives


def cable_and_offset(driven: Driven) -> Floats:
    arm = driven.position_rad / TWIN.gear_ratio - 0.64  # of the middle of the stroke
    return np.asarray(0.2 * arm + 0.3 * arm**3 + 0.1)


def payload(driven: Driven) -> Floats:
    arm = driven.position_rad / TWIN.gear_ratio
    return np.asarray(0.2 * np.sin(arm) - 0.1 * np.cos(arm))


@pytest.mark.parametrize(("missing", "is_pair"), [(cable_and_offset, True), (payload, False)])
def test_a_cable_that_stiffens_beside_an_offset_is_told_from_any_weight(
    missing: Callable[[Driven], Floats], is_pair: bool
) -> None:
    """A weight's sine and cosine took both, for certain, though they bend less well."""
    runs = [
        recorded(stair([k * v for v in SPEEDS_RAD_S]), missing, 0.03, seed)
        for seed, k in enumerate((1.0, 1.07, 1.15))
    ]
    table = tabulate(TWIN, runs, 30.0)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    forms = [f for f in FORMS if f.effect in ("cable-force", "torque-offset")]
    library = Library.of(Scene(table, theta, left), weigh(table, left), forms)
    rest, weight = library.base[:, :3], library.base[:, 3:]
    assert pulled_and_offset(library, rest, weight, ()) is is_pair


@pytest.mark.parametrize("fastest_rad_s", [50.0, 80.0])
def test_an_offset_beside_a_weight_that_is_a_percent_off_is_no_cable(fastest_rad_s: float) -> None:
    """Held as the simulation has it, the weight left a line over the angle: a cable, for sure."""

    def missing(driven: Driven) -> Floats:
        speed = driven.velocity_rad_s
        return np.asarray(0.05 * np.exp(-np.abs(speed) / 5.0) * np.sign(speed) - 0.03)

    weighs = replace(TWIN, gravity_sin_nm=3.4, gravity_cos_nm=-0.34)
    known = replace(weighs, gravity_sin_nm=0.992 * 3.4, gravity_cos_nm=-0.986 * 0.34)
    speeds = (2.0, 6.0, 16.0, 0.5 * fastest_rad_s, fastest_rad_s)
    *fit, held_out = (
        recorded(stair([k * v for v in speeds]), missing, 0.02, seed, weighs)
        for seed, k in enumerate((1.0, 1.07, 1.15, 0.93))
    )
    found = explain(known, fit, [held_out]).findings
    constant, friction = sorted(found, key=lambda finding: finding.effect == "stribeck")
    assert friction.effect == "stribeck"
    named = {constant.effect, *(other.effect for other in constant.alternatives)}
    assert named == {"torque-offset", "direction-asymmetry"}
