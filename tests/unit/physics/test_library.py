"""The library's table: every id of the contract, what is said of each, and twins as text."""

from __future__ import annotations

import datetime
import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.physics.effects import LIBRARY, Form, Motion, Parameter, numbers_of
from agent.physics.effects.look_alikes import PAIRS
from agent.physics.twin import Effect, Twin, TwinError, format_twin, parse_twin
from tests.unit.physics.effect_ids import CONTRACT

AXES = {
    "time_s",
    "velocity_rad_s",
    "acceleration_rad_s2",
    "arm_position_rad",
    "load_torque_nm",
    "recording",
    "order_per_motor_rev",
    "order_per_arm_rev",
    "frequency_hz",
    "after_reversal_s",
    "gearbox_temperature_degc",
    "motor_temperature_degc",
}
COLUMNS = {"position_rad", "gearbox_temperature_degc", "motor_temperature_degc"}
FORMS = [(effect, form) for effect, card in LIBRARY.items() for form in card.forms]
NAMED = pytest.mark.parametrize(
    ("effect", "form"), FORMS, ids=[f"{effect}: {form.name}" for effect, form in FORMS]
)
REFERENCE = "1970-01-01T01:00:00Z"

TIME = np.linspace(0.0, 4.0, 801)
MOTION = Motion(
    30.0 * np.cos(2.0 * TIME),
    -60.0 * np.sin(2.0 * TIME),
    np.sign(np.cos(2.0 * TIME)),
    15.0 * np.sin(2.0 * TIME),
    TIME,
    np.linspace(31.0, 45.0, 801),
    np.linspace(31.0, 45.0, 801),
    7200.0,
    3.0,
    payload_kg=2.0,
    position_arm_rad=0.125 * np.sin(2.0 * TIME) + 1e-4 * np.sin(40.0 * TIME),
)


def typical(form: Form) -> dict[str, Any]:
    """Return numbers that every law takes, and that change the torque."""
    special = {
        "limit_nm": 0.4,
        "factor": 0.8,
        "cos_rad": 0.02,
        "sin_rad": 0.03,
        "decay_k": 15.0,
        "coulomb_nm_per_k": 0.002,
        "coulomb_nm_per_h": 0.05,
        "coulomb_nm_per_run": 0.02,
        "coulomb_change_nm": 0.05,
        "viscous_nm_s_per_rad_per_h": 1e-4,
        "viscous_nm_s_per_rad_per_run": 1e-4,
        "viscous_change_nm_s_per_rad": 1e-3,
        "order_per_arm_rev": 3.0,
        "arm_inertia_kg_m2": 0.01,
        "stiffness_nm_per_rad": 20.0,
        "reference_degc": 35.0,
        "shape_exponent": 1.5,
        "torque_delay_s": 0.0123,
        "velocity_delay_s": 0.0123,
        "half_gap_rad": 0.05,
        "stribeck_velocity_rad_s_per_k": 0.4,
        "reference_run": 1.0,
        "settling_1000_turns": 3.0,
    }
    one = {
        name: REFERENCE if parameter.instant else special.get(name, 0.11)
        for name, parameter in form.parameters.items()
    }
    return {name: [x] if form.parameters[name].several else x for name, x in one.items()}


def twin(*effects: Effect) -> Twin:
    return Twin("r", 1, 50.0, 0.02, 0.5, 0.004, 0.3, 0.2, effects)


def entries(effect: str, form: Form, **other: Any) -> tuple[Effect, ...]:
    """Return an effect, with the spring that a gap in a flexible gear is in."""
    one = Effect(effect, {**typical(form), **other})
    if form.name != "gap in a flexible gear":
        return (one,)
    spring = LIBRARY["joint-flexibility"].forms[0]
    return one, Effect("joint-flexibility", typical(spring))


def test_the_library_has_the_contracts_ids_and_no_others() -> None:
    assert sorted(LIBRARY) == sorted(CONTRACT)


@pytest.mark.parametrize("effect", CONTRACT)
def test_every_card_speaks_in_sentences_of_effects_that_exist(effect: str) -> None:
    card = LIBRARY[effect]
    assert card.id == effect
    assert card.summary.endswith(".")
    assert card.axes
    assert set(card.axes) <= AXES
    assert set(card.needs) <= COLUMNS
    assert card.look_alikes
    for other in card.look_alikes:
        assert other.effect in set(LIBRARY) - {effect}
        assert other.told_apart_by.endswith(".")
        assert other.because
        assert other.because[0].islower()
        assert not other.because.endswith(".")


def test_every_pair_of_look_alikes_is_written_once() -> None:
    pairs = [frozenset(pair[:2]) for pair in PAIRS]
    assert len(set(pairs)) == len(pairs)
    assert all(len(pair) == 2 for pair in pairs)


@NAMED
def test_every_form_predicts_a_torque_of_its_own(effect: str, form: Form) -> None:
    given_numbers = entries(effect, form)[0].parameters
    chosen, numbers = numbers_of(effect, given_numbers)
    assert chosen is form
    assert {name.partition("[")[0] for name in numbers} == set(form.parameters)
    assert sum(f is not None for f in (form.corrected or form.added_nm, form.reported_nm)) == 1
    carried = entries(effect, form)[1:]
    with_it, without = twin(*entries(effect, form)), twin(*carried)
    difference = with_it.predict(MOTION) - without.predict(MOTION)
    known = np.isfinite(difference)
    assert np.mean(known) > 0.95
    assert np.max(np.abs(difference[known])) > 1e-3


@NAMED
def test_parts_add_up_and_pass_a_filter_one_by_one(effect: str, form: Form) -> None:
    law = twin(*entries(effect, form))
    parts = law.predict_parts(MOTION)
    assert list(parts)[:3] == ["rigid-body", "gravity", "friction"]
    assert effect in parts
    whole = law.predict(MOTION)
    assert np.sum(list(parts.values()), axis=0) == pytest.approx(whole, nan_ok=True)
    halved = law.predict(MOTION, lambda torque_nm: 0.5 * torque_nm)
    assert halved == pytest.approx(0.5 * whole, nan_ok=True)


@pytest.mark.parametrize(
    ("effect", "form"), [(effect, form) for effect, form in FORMS if form.added_nm is not None]
)
def test_linear_means_that_the_torque_is_proportional(effect: str, form: Form) -> None:
    linear = [name for name, parameter in form.parameters.items() if parameter.linear]
    once = typical(form)
    twice = {**once, **{name: 2.0 * once[name] for name in linear}}
    small = dict.fromkeys(linear, 1e-9)
    one, two, none = (
        twin(*entries(effect, form, **numbers)).predict_parts(MOTION)[effect]
        for numbers in (once, twice, {**once, **small})
    )
    assert (two == pytest.approx(2.0 * one, rel=1e-3, abs=1e-7)) is bool(linear)
    assert (none == pytest.approx(np.zeros_like(one), abs=1e-5)) is bool(linear)


@NAMED
def test_every_parameter_has_a_meaning_a_unit_and_bounds_that_hold(effect: str, form: Form) -> None:
    for name, parameter in form.parameters.items():
        assert form.meaning(name), name
        if parameter.instant or not math.isfinite(parameter.lower):
            continue
        beyond: Any = parameter.lower if parameter.above else parameter.lower - 1e-6
        listed = r"\[0\]" if parameter.several else ""
        wrong = twin(*entries(effect, form, **{name: [beyond] if parameter.several else beyond}))
        with pytest.raises(TwinError, match=f"{effect}: {name}{listed}: expected a number"):
            wrong.predict(MOTION)


def test_two_of_one_kind_add_up_and_are_told_apart() -> None:
    orders = [
        Effect("torque-ripple", {"cos_nm": 0.1, "sin_nm": 0.0, "order_per_motor_rev": n})
        for n in (2.0, 14.0)
    ]
    parts = twin(*orders).predict_parts(MOTION)
    assert parts["torque-ripple"] == pytest.approx(0.1 * np.cos(30.0 * np.sin(2.0 * TIME)))
    assert parts["torque-ripple 2"] == pytest.approx(0.1 * np.cos(210.0 * np.sin(2.0 * TIME)))


def test_an_unknown_weight_loads_gear_and_spring_as_the_twins_own_does() -> None:
    weight = Effect("gravity-imbalance", {"gravity_sin_nm": 0.4, "gravity_cos_nm": -0.1})
    heavier = Twin("r", 1, 50.0, 0.02, 0.5, 0.004, 0.7, 0.1)
    per_kg = {"gravity_sin_nm_per_kg": 0.4, "gravity_cos_nm_per_kg": -0.1}
    payload = Effect("gravity-imbalance", {**per_kg, "reference_payload_kg": 1.0})
    spring = Effect("joint-flexibility", typical(LIBRARY["joint-flexibility"].forms[0]))
    load = Effect("load-dependent-friction", {"load_coefficient": 0.2})
    for effect in (spring, load):
        own = Twin(**{**vars(heavier), "effects": (effect,)})
        assert twin(weight, effect).predict(MOTION) == pytest.approx(own.predict(MOTION))
        assert twin(payload, effect).predict(MOTION) == pytest.approx(own.predict(MOTION))
        assert twin(payload, effect).predict(replace(MOTION, payload_kg=None)) == pytest.approx(
            twin(effect).predict(MOTION)
        )


def test_numbers_of_two_forms_at_once_are_refused() -> None:
    both = {"stiffness_nm_per_rad": 10.0, "sliding_travel_rad": 0.1}
    with pytest.raises(TwinError, match="got also"):
        twin(Effect("presliding-hysteresis", both)).predict(MOTION)


def drawn(parameter: Parameter) -> st.SearchStrategy[Any]:
    if parameter.several:
        return st.lists(drawn(replace(parameter, several=False)), min_size=1, max_size=3)
    if parameter.instant:
        instants = st.datetimes(
            datetime.datetime(1971, 1, 1),
            datetime.datetime(2200, 1, 1),
            timezones=st.just(datetime.UTC),
        )
        return instants | instants.map(lambda at: at.isoformat())
    numbers = st.floats(
        parameter.lower if math.isfinite(parameter.lower) else None,
        parameter.upper if math.isfinite(parameter.upper) else None,
        allow_nan=False,
        allow_infinity=False,
        exclude_min=parameter.above,
    )
    most = int(min(9, parameter.upper))
    return numbers | st.integers(1, most) if most else numbers


@st.composite
def twins(draw: st.DrawFn) -> Twin:
    chosen = draw(st.lists(st.sampled_from(FORMS), max_size=5))
    effects = []
    for effect, form in chosen:
        kept = [
            name
            for name, parameter in form.parameters.items()
            if parameter.default is None or draw(st.booleans())
        ]
        effects.append(Effect(effect, {name: draw(drawn(form.parameters[name])) for name in kept}))
    name = draw(st.text(min_size=1).filter(lambda text: text.isprintable()))
    inertia, coulomb, viscous, sine, cosine = (draw(st.floats(0.0, 1e6)) for _ in range(5))
    axis, ratio = draw(st.integers(1, 9)), draw(st.floats(1.0, 1e4))
    return Twin(name, axis, ratio, inertia, coulomb, viscous, sine, -cosine, tuple(effects))


@given(twins())
def test_words_and_values_are_the_same_twin(law: Twin) -> None:
    again = parse_twin(format_twin(law))
    assert again == law
    for before, after in zip(law.effects, again.effects, strict=True):
        assert numbers_of(after.id, after.parameters) == numbers_of(before.id, before.parameters)
