"""A gear's wobble and a resolver's error: the same order, told apart by the spring between them."""

from __future__ import annotations

import functools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from agent.explain.choosing.choice import choose
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.forms import cable
from agent.explain.forms import order as forms_order
from agent.explain.forms import ripple as forms_ripple
from agent.explain.forms.form import Form
from agent.explain.forms.hidden_arm import inertia_of
from agent.explain.forms.quantities import as_in_twin
from agent.explain.numbers.intervals import with_intervals
from agent.explain.numbers.model import fit_model
from agent.explain.numbers.resting import at_own_numbers, settled_beside
from agent.explain.numbers.short_stroke import without_gravity
from agent.explain.rows.evidence import weigh
from agent.explain.rows.orders import orders_of
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, Table, tabulate
from agent.identify.result import Floats, Parameter
from tests.science.explain_joint import GEAR_RATIO, NOISE_NM, RATE_HZ, TWIN, stair

ORDER, ERROR_RAD = 2.0, 0.004
ARM_SHARE, SPRING_HZ, DAMPING = 0.6, 30.0, 0.08
WEIGHT_NM = 0.3
_STEPS = 8  # a sample


@functools.cache
def sampled(scale: float) -> tuple[Floats, Floats, Floats, Floats]:
    """Return time, true angle, velocity and acceleration of the motor at 8 times the rate."""
    trajectory = stair([scale * v for v in (6.0, 20.0, 45.0, 70.0, 95.0)])
    time = np.arange(int(trajectory.duration_s * RATE_HZ) * _STEPS) / (RATE_HZ * _STEPS)
    points = trajectory.sample(time)
    return time, points.position_rad, points.velocity_rad_s, points.acceleration_rad_s2


def sprung(velocity: Floats, spring_hz: float) -> Floats:
    """Return the torque of an arm behind a spring over its inertia; semi-implicit Euler."""
    omega, dt = 2.0 * math.pi * spring_hz, 1.0 / (RATE_HZ * _STEPS)
    out = np.empty_like(velocity)
    arm, twist = float(velocity[0]), 0.0
    for k, motor in enumerate(velocity.tolist()):
        twist += dt * (motor - arm)
        out[k] = omega**2 * twist + 2.0 * DAMPING * omega * (motor - arm)
        arm += dt * out[k]
    return out


@dataclass(frozen=True)
class Joint:
    """What a joint has beside TWIN; torque that is late by less than zero is early."""

    gear_wobbles: bool
    weight_nm: float = WEIGHT_NM
    error_rad: float = ERROR_RAD
    ripple_nm: float = 0.0
    ripple_growth_per_nm: float = 0.0
    ripple_share: float = 0.0
    torque_late_s: float = 0.0
    cable_nm_per_rad: float = 0.0
    spring_hz: float = SPRING_HZ


def recorded(scale: float, seed: int, joint: Joint) -> Run:
    """Return a recording of a joint whose gear wobbles, or whose motor angle is misread.

    The motor bears what the gear carries times the ratio of this moment.
    """
    time, position, velocity, acceleration = sampled(scale)
    rng = np.random.default_rng(seed)
    slope = ORDER * joint.error_rad * np.cos(ORDER * position)
    arm = ARM_SHARE * TWIN.inertia_kg_m2
    geared = 1.0 + slope if joint.gear_wobbles else np.ones_like(slope)
    borne = arm * sprung(velocity * geared, joint.spring_hz) + joint.weight_nm * np.sin(
        position / GEAR_RATIO
    )
    borne = borne + joint.cable_nm_per_rad * position / GEAR_RATIO
    torque = (
        (TWIN.inertia_kg_m2 - arm) * acceleration
        + borne * geared
        + TWIN.viscous_nm_s_per_rad * velocity
        + TWIN.coulomb_nm * np.sign(velocity)
    )
    grown = 1.0 + joint.ripple_growth_per_nm * np.abs(torque)
    torque = (
        torque
        - joint.ripple_nm * grown * np.sin(ORDER * position)
        + joint.ripple_share * torque * np.cos(ORDER * position)
    )
    torque = np.interp(time - joint.torque_late_s, time, torque)
    if not joint.gear_wobbles:
        position = position + joint.error_rad * np.sin(ORDER * position)
        velocity = velocity * (1.0 + slope)
    torque = torque + NOISE_NM * rng.standard_normal(time.shape[0])
    names = ("time_s", "position_rad", "velocity_rad_s", "torque_nm")
    columns = (time, position, velocity + 0.01 * rng.standard_normal(time.shape[0]), torque)
    return Run.from_columns(
        {n: c[::_STEPS] for n, c in zip(names, columns, strict=True)},
        GEAR_RATIO,
        name=f"run {seed}",
    )


def tabulated(joint: Joint) -> Table:
    return tabulate(TWIN, [recorded(s, k, joint) for k, s in enumerate((1.0, 0.9))])


WAVES = (*forms_ripple.FORMS, *forms_order.FORMS)


def library_of(table: Table, forms: Sequence[Form] = WAVES) -> Library:
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta)
    return Library.of(scene, weigh(table, left), forms)


def named(joint: Joint) -> tuple[Term, Scene]:
    library = library_of(tabulated(joint))
    return choose(library).terms[0], library.scene


@pytest.mark.parametrize(
    ("per_nm", "share", "form"),
    [
        (0.0, 0.0, "one order"),
        (2.0, 0.0, "one order that grows with the torque"),
        (0.0, 0.06, "one order, in part in proportion to the torque"),
    ],
)
def test_a_ripple_grows_with_the_torque_only_where_it_does(
    per_nm: float, share: float, form: str
) -> None:
    """Magnets on slots pulsate whatever the torque is; phases of unequal gain in proportion."""
    joint = Joint(
        gear_wobbles=False,
        weight_nm=0.6,
        error_rad=0.0,
        ripple_nm=0.03,
        ripple_growth_per_nm=per_nm,
        ripple_share=share,
    )
    found, _ = named(joint)
    assert found.scored.form.name == form
    values = found.scored.values()
    assert math.hypot(values["cos_nm"], values["sin_nm"]) == pytest.approx(0.03, rel=0.1)
    assert values.get("load_growth_per_nm", 0.0) == pytest.approx(per_nm, rel=0.1)
    assert values.get("cos_share", 0.0) == pytest.approx(share, rel=0.1)


@pytest.mark.parametrize("weight_nm", [0.0, WEIGHT_NM])
def test_a_wobble_that_comes_through_a_spring_is_the_gears(weight_nm: float) -> None:
    term, scene = named(Joint(gear_wobbles=True, weight_nm=weight_nm))
    assert term.scored.form.effect == "kinematic-error"
    values = term.scored.values()
    assert values["order_per_motor_rev"] == pytest.approx(ORDER, abs=0.01)
    assert values["antiresonance_hz"] == pytest.approx(SPRING_HZ, rel=0.05)
    found = math.hypot(values["cos_rad"], values["sin_rad"])
    behind = values["arm_inertia_share"] * inertia_of(scene)
    assert found * behind == pytest.approx(ARM_SHARE * TWIN.inertia_kg_m2 * ERROR_RAD, rel=0.2)


def with_its_intervals(joint: Joint) -> Mapping[str, Parameter]:
    """Return the numbers of the one wobble that a joint has, as a twin has them."""
    library = library_of(tabulated(joint))
    library, choice = settled_beside(library, choose(library))
    model = with_intervals(library, fit_model(library, TWIN, choice.terms))
    ((term, own),) = zip(model.terms, model.parameters, strict=True)
    return as_in_twin(term.scored.form, library.scene, own)


@pytest.mark.parametrize("weight_nm", [0.0, WEIGHT_NM])
def test_where_its_arm_is_not_known_a_wobble_is_known_as_a_product(weight_nm: float) -> None:
    """It had been three times too small, with an interval."""
    told = with_its_intervals(Joint(gear_wobbles=True, weight_nm=weight_nm))
    assert told["order_per_motor_rev"].identified
    for name in ("cos_rad", "sin_rad", "arm_inertia_kg_m2"):
        assert not told[name].identified


def test_a_weight_tells_a_wobble_from_its_arms_inertia() -> None:
    told = with_its_intervals(
        Joint(gear_wobbles=True, weight_nm=10.0, error_rad=0.02, spring_hz=60.0)
    )
    for name, true in (
        ("cos_rad", 0.0),  # next to nothing, and known as well as the other part
        ("sin_rad", 0.02),
        ("arm_inertia_kg_m2", ARM_SHARE * TWIN.inertia_kg_m2),
    ):
        low, high = told[name].ci95 or (math.nan, math.nan)
        assert low < true < high
        assert high - low < 0.3 * (true or 0.02)


@pytest.mark.parametrize("weight_nm", [0.0, WEIGHT_NM])
def test_an_error_of_the_measured_angle_is_the_resolvers(weight_nm: float) -> None:
    term, _ = named(Joint(gear_wobbles=False, weight_nm=weight_nm))
    assert term.scored.form.effect == "resolver-error"
    values = term.scored.values()
    found = math.hypot(values["cos_rad"], values["sin_rad"])
    assert found == pytest.approx(ERROR_RAD, rel=0.1)


@pytest.mark.parametrize("gear_wobbles", [True, False])
def test_neither_stands_for_a_ripple_of_its_order_and_an_early_torque(gear_wobbles: bool) -> None:
    # Before, each of the two was called the other. The arm's own swing would have a name below.
    joint = Joint(
        gear_wobbles, error_rad=0.002, ripple_nm=0.012, torque_late_s=-0.0005, spring_hz=45.0
    )
    term, _ = named(joint)
    names = {True: "kinematic-error", False: "resolver-error"}
    assert term.scored.form.effect == names[gear_wobbles]
    assert [r.scored.form.effect for r in term.rivals] == [names[not gear_wobbles]]


def test_a_misread_angle_is_no_larger_for_the_inertia_that_it_had_bent() -> None:
    # The refit without it has the inertia 5 % low, too little of the torque to rank all again.
    library = library_of(tabulated(Joint(gear_wobbles=False, error_rad=0.003, spring_hz=400.0)))
    choice = choose(library, rivals=False)
    assert choice.terms[0].scored.form.effect == "resolver-error"
    assert math.hypot(*choice.terms[0].scored.coefficients) > 1.03 * 0.003
    library, choice = at_own_numbers(library, choice)
    assert math.hypot(*choice.terms[0].scored.coefficients) == pytest.approx(0.003, rel=0.01)
    assert library.scene.theta[0] == pytest.approx(TWIN.inertia_kg_m2, rel=0.005)


def test_a_wobble_asks_how_much_of_the_dry_friction_its_arm_has() -> None:
    # Here it has none: with three tenths taken for granted it had left 4 times as much.
    term, scene = named(Joint(gear_wobbles=True, error_rad=0.02, spring_hz=400.0))
    assert term.scored.form.effect == "kinematic-error"
    assert term.scored.values()["arm_friction_share"] < 0.02
    (told,) = term.scored.form.to_twin(scene, term.scored.values())
    assert told["arm_coulomb_nm"] < 0.02 * TWIN.coulomb_nm


def test_a_wobbling_gear_bears_the_cable_that_was_found_beside_it() -> None:
    joint = Joint(gear_wobbles=True, weight_nm=0.0, cable_nm_per_rad=0.8)
    rigid = [f for f in forms_order.FORMS if f.effect == "kinematic-error" and not f.together]
    library = library_of(without_gravity(tabulated(joint)), (*rigid, *cable.FORMS[:1]))
    library, choice = settled_beside(library, choose(library, rivals=False))
    assert {t.scored.form.effect for t in choice.terms} == {"kinematic-error", "cable-force"}
    pull = library.scene.held_nm
    assert pull is not None
    assert np.polyfit(library.scene.arm_rad, pull, 1)[0] == pytest.approx(0.8, rel=0.02)


def test_an_axis_in_metres_has_waves_in_a_twentieth_of_a_turn() -> None:
    """A screw's wave every 26 mm had been six local faults: orders ended at 64 a turn."""
    position_rad = np.abs(np.linspace(-0.25, 0.25, 4000))
    torque_nm = 0.4 * np.sin(237.0 * position_rad + 0.7)
    found = orders_of(position_rad, torque_nm, np.ones_like(torque_nm), 1e4, 1.0, 1)
    assert found == pytest.approx((237.0,), rel=0.02)


def test_a_peak_beside_a_whole_order_in_its_line_is_a_resolver_s_too(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    scene = Scene.__new__(Scene)  # only what is found in it counts
    monkeypatch.setattr(forms_order, "strong_orders", lambda *_: (2.034, 3.4, 1.98, 0.4))
    monkeypatch.setattr(forms_order, "highest_order", lambda _: 4.0)
    monkeypatch.setattr(forms_order, "half_a_line", lambda _: (0.033,))
    resolver = next(f for f in forms_order.FORMS if f.name == "whole order of the motor")
    assert list(resolver.grid(scene)) == [(2.0,)]


def test_the_overtone_of_the_strongest_order_is_tried_though_its_line_hides_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A misread angle's second order was a ripple that grows with the torque."""
    scene = Scene.__new__(Scene)  # only what is found in it counts
    monkeypatch.setattr(forms_order, "strong_orders", lambda *_: (3.99, 3.85, 4.16))
    monkeypatch.setattr(forms_order, "half_a_line", lambda _: (0.05,))
    monkeypatch.setattr(forms_order, "highest_order", lambda _: 20.0)
    grids = {form.name: form.grid(scene) for form in forms_order.FORMS if len(form.nonlinear) < 3}
    assert {order for (order,) in grids["whole order of the motor"]} == {4.0, 8.0}
    assert 7.98 in {point[0] for point in grids["one order"]}
