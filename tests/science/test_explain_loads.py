"""Recordings that carry different payloads: what a kilogram adds is learnt, and hides nothing."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from agent.explain import proof
from agent.explain.carrying import studied, with_load
from agent.explain.findings import findings_of
from agent.explain.numbers.loads import (
    differs_unsaid,
    loads_of,
    said_of,
    without_unknown_loads,
)
from agent.explain.rows.run import Run
from agent.explain.rows.table import Table, tabulate
from agent.identify.result import Floats
from agent.physics.twin import Twin, format_twin, parse_twin
from tests.science.explain_joint import GEAR_RATIO, NOISE_NM, TWIN, Conditions, record, stair
from trajectories import SetPoints

SIN, COS = 0.30, 0.10  # of gravity, without payload
PER_KG = {
    "inertia_kg_m2_per_kg": 0.001,
    "gravity_sin_nm_per_kg": 0.15,
    "gravity_cos_nm_per_kg": -0.05,
}
KNOWN = replace(TWIN, gravity_sin_nm=SIN, gravity_cos_nm=COS)
HEAVIER = replace(
    TWIN,
    inertia_kg_m2=TWIN.inertia_kg_m2 + 0.002,
    gravity_sin_nm=SIN + 0.30,
    gravity_cos_nm=COS - 0.10,
)
CYCLE = stair((3, 10, 30, 60), 200.0, 14.0)


def carrying(*payloads: float, said: bool = True) -> list[Run]:
    """Return recordings under payloads, of a joint that has the Stribeck effect as well."""
    runs = []
    for index, kg in enumerate(payloads):

        def missing(points: SetPoints, at: Conditions, kg: float = kg) -> Floats:
            del at
            arm, velocity = points.position_rad / GEAR_RATIO, points.velocity_rad_s
            inertia, sine, cosine = PER_KG.values()
            weight = (SIN + kg * sine) * np.sin(arm) + (COS + kg * cosine) * np.cos(arm)
            faded = 0.06 * np.sign(velocity) * np.exp(-np.abs(velocity) / 8.0)
            return np.asarray(weight + kg * inertia * points.acceleration_rad_s2 + faded)

        run = record(CYCLE, missing, Conditions(), index, name=f"run-{index}")
        runs.append(replace(run, payload_kg=kg if said else math.nan))
    return runs


def table_of(twin: Twin, *payloads: float, said: bool = True) -> Table:
    return tabulate(twin, carrying(*payloads, said=said))


def test_a_known_difference_of_payload_hides_no_smaller_effect() -> None:
    light, heavy, unseen = carrying(0.0, 2.0, 3.0)
    found, given = studied(KNOWN, tabulate(KNOWN, (light, heavy)))
    load, other = with_load(findings_of(found), found, given)
    assert (load.effect, other.effect) == ("gravity-imbalance", "stribeck")
    assert other.energy_share > 0.9
    assert "beyond 0 kg every kilogram adds" in load.sentence
    for name, truth in PER_KG.items():
        assert load.parameters[name].value == pytest.approx(truth, rel=0.06), name
    twin = parse_twin(format_twin(found.extended))
    for runs in ((unseen,), (light, heavy)):
        compared, _ = proof.compare_runs(KNOWN, KNOWN, twin, runs, given.table)
        assert np.std(compared.extended) < 0.7 * NOISE_NM < 0.2 * np.std(compared.given)
    assert loads_of(twin, tabulate(twin, (light, heavy))) is None


@pytest.mark.parametrize(
    ("twin", "held_for"),
    [
        (KNOWN, 0.0),
        (HEAVIER, 2.0),  # silent: by what its numbers agree with
        (replace(KNOWN, extra={"payload_kg": 0.0}), 0.0),
        (replace(HEAVIER, extra={"rigid_body": {"payload_kg": 1.0}}), 1.0),
    ],
)
def test_a_twins_numbers_hold_for_the_payload_that_it_says_or_else_agrees_with(
    twin: Twin, held_for: float
) -> None:
    loads = loads_of(twin, table_of(twin, 0.0, 2.0))
    assert loads is not None
    assert loads.reference_kg == held_for
    assert loads.numbers["gravity_sin_nm_per_kg"].value == pytest.approx(0.15, rel=0.06)


def test_one_payload_says_nothing_of_another() -> None:
    light, other, heavy = carrying(0.0, 0.0, 2.0)
    kept, why = without_unknown_loads(KNOWN, (light,), (other, heavy))
    assert (len(kept), kept[0].name) == (1, "run-1")
    assert "run-2 was left out of the proof: it carries 2 kg" in why[0]
    stated = replace(KNOWN, extra={"payload_kg": 0.0})
    assert "for 0 kg, and the recordings carry 2 kg" in said_of((heavy,), stated, None)[0]
    assert not said_of((heavy,), KNOWN, None)


def test_payloads_that_nobody_states_are_asked_for() -> None:
    assert "payload_kg" in differs_unsaid(table_of(KNOWN, 0.0, 2.0, said=False))
    assert not differs_unsaid(table_of(KNOWN, 2.0, 2.0, said=False))


def test_payloads_are_learnt_where_a_law_does_not_say_all_of_a_recording() -> None:
    """A torque that is early is unknown at a recording's end: the fit had met NaN there."""
    table = table_of(KNOWN, 0.0, 2.0)
    nothing = np.zeros(table.used.shape[0])
    unsaid = np.where(np.arange(nothing.size) % 2000 < 40, np.nan, 0.0)
    whole, part = loads_of(KNOWN, table, nothing), loads_of(KNOWN, table, unsaid)
    assert whole is not None
    assert part is not None
    for name, number in part.numbers.items():
        assert number.value == pytest.approx(whole.numbers[name].value, rel=0.02)
