"""Recordings that no joint can have made are refused by what is wrong with them, not explained."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.numbers.wrong import WrongNumber
from agent.explain.plausible import (
    another_joint,
    contradiction,
    far_off,
    of_two_units,
    runs_backwards,
    turned_gravity,
)
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.explain.undecidable import undecidable
from agent.identify.estimate import estimate
from agent.identify.result import Floats, Parameter
from agent.identify.signals.arrays import Signals
from tests.science.explain_joint import GEAR_RATIO, TWIN, Conditions, record, stair
from trajectories import SetPoints

Change = Callable[[Signals], Signals]


def _nothing(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.zeros_like(points.position_rad)


def _position(signals: Signals, factor: float) -> Signals:
    assert signals.position_rad is not None
    return replace(signals, position_rad=factor * signals.position_rad)


def _in_degrees(signals: Signals) -> Signals:
    assert signals.velocity_rad_s is not None
    moved = _position(signals, 57.2958)
    return replace(moved, velocity_rad_s=57.2958 * signals.velocity_rad_s)


MISTAKES: dict[str, tuple[Change, str]] = {
    "degrees": (lambda s: _position(s, 57.2958), "moves 57.3 times as far as the velocity says"),
    "arm": (lambda s: _position(s, 1.0 / s.gear_ratio), "or on the other side of the gear"),
    "mirrored": (lambda s: _position(s, -1.0), "the position counts against the velocity"),
    "all in degrees": (_in_degrees, "as if its motion were in degrees"),
    "frozen": (lambda s: replace(s, torque_nm=0.0 * s.torque_nm), "the torque never changes"),
    "turned": (lambda s: replace(s, torque_nm=-s.torque_nm), "come out negative"),
}


def _wrapped(run: Run) -> Run:
    assert run.signals.position_rad is not None
    turn = np.mod(run.signals.position_rad, 2.0 * np.pi)
    return replace(run, signals=replace(run.signals, position_rad=turn))


@pytest.fixture(scope="module")
def run() -> Run:
    return record(stair((6.0, 20.0, 50.0)), _nothing, Conditions(), 0)


@pytest.mark.parametrize("mistake", MISTAKES)
def test_a_mistake_in_the_columns_is_said_and_nothing_is_named(run: Run, mistake: str) -> None:
    change, says = MISTAKES[mistake]
    answer = explain(TWIN, [replace(run, signals=change(run.signals))])
    assert says in answer.sentence
    assert answer.findings == ()


def test_gravity_without_an_angle_is_no_missing_physics(run: Run) -> None:
    """It had been left out of the prediction in silence: 42 mN m had no name, of a right twin."""
    blind = replace(run, signals=replace(run.signals, position_rad=None))
    heavy = replace(TWIN, gravity_cos_nm=0.4)
    answer = explain(heavy, [blind])
    assert "gravity, up to 0.40 N m, depends on the arm's angle" in answer.sentence
    light = tabulate(replace(TWIN, gravity_cos_nm=1e-3), [blind])
    assert undecidable(light, replace(TWIN, gravity_cos_nm=1e-3)) == ""


def test_what_a_drive_reports_passes(run: Run) -> None:
    """A tachometer that is 5 % off, a position that wraps at a turn, no velocity."""
    position, velocity = run.signals.position_rad, run.signals.velocity_rad_s
    assert position is not None
    assert velocity is not None
    wrapped = replace(run.signals, position_rad=position % (40.0 * np.pi))
    alone = replace(run.signals, velocity_rad_s=None)
    for signals in (replace(run.signals, velocity_rad_s=1.05 * velocity), wrapped, alone):
        assert contradiction([replace(run, signals=signals)]) == ""
    assert not runs_backwards(tabulate(TWIN, [run]))


@pytest.mark.parametrize(
    ("factor", "says"),
    [
        (1.002, ""),
        (-1.0, "position_arm_rad counts against position_rad"),
        (GEAR_RATIO, "position_rad counts on the arm's side"),
        (1.3, "moves 1.3 times as far as position_rad over the gear ratio"),
    ],
)
def test_an_arms_encoder_that_tells_of_another_motion_is_asked_about(
    run: Run, factor: float, says: str
) -> None:
    """Positions on the arm's side made viscous friction a hundred times the twin's."""
    position = run.signals.position_rad
    assert position is not None
    signals = replace(run.signals, position_arm_rad=factor * position / GEAR_RATIO + 0.3)
    said = contradiction([replace(run, signals=signals)])
    assert says in said if says else said == ""


@pytest.mark.parametrize(
    ("factor", "says"), [(1.0, ""), (1.03, "3.0 % more"), (0.97, "3.0 % less")]
)
def test_a_velocity_that_is_scaled_wrong_is_told(run: Run, factor: float, says: str) -> None:
    """It was an inertia that is 3 % wrong, and the twin worse with it."""
    velocity = run.signals.velocity_rad_s
    assert velocity is not None
    scaled = replace(run, signals=replace(run.signals, velocity_rad_s=factor * velocity))
    reasons = [r for r in explain(TWIN, [scaled], []).reasons if "than the position's rate" in r]
    assert len(reasons) == bool(says)
    assert all(says in reason for reason in reasons)
    notes = [
        note for note in estimate([scaled.signals]).notes if "than the position's rate" in note
    ]
    assert notes == reasons


@pytest.mark.parametrize(
    ("factor", "says"),
    [
        (1.5, ""),
        (4.0, ""),
        (20.0, "20 times the inertia"),
        (0.0173, "in degrees"),
        (100.0, "as if positions and veloc"),
        (0.97e6, "as if time were in milliseconds"),
    ],
)
def test_only_numbers_far_from_the_twins_ask_whether_it_is_this_joint(
    factor: float, says: str
) -> None:
    extra = (factor - 1.0) * TWIN.inertia_kg_m2
    number = WrongNumber(
        "inertia-error", 1.0, {"inertia_extra_kg_m2": Parameter(extra, (extra, extra))}
    )
    said, before_all = far_off((number,), TWIN), another_joint((number,), TWIN)
    assert says in said if says else said == ""
    assert before_all.lower().rstrip(".") == said.lower()


@pytest.mark.parametrize(("coulomb", "first"), [(6.0, True), (1.1, False)])
def test_friction_alone_that_is_far_off_is_said_and_does_not_come_first(
    coulomb: float, first: bool
) -> None:
    extras = {
        "viscous_extra_nm_s_per_rad": 6.0 * TWIN.viscous_nm_s_per_rad,
        "coulomb_extra_nm": (coulomb - 1.0) * TWIN.coulomb_nm,
    }
    known = {name: Parameter(value, (value, value)) for name, value in extras.items()}
    number = WrongNumber("wrong-number", 1.0, known)
    assert "7 times the viscous friction" in far_off((number,), TWIN)
    assert bool(another_joint((number,), TWIN)) is first


def test_milliseconds_show_in_viscous_friction_where_no_change_of_speed_does() -> None:
    extra = 951.0 * TWIN.viscous_nm_s_per_rad
    parameters = {"viscous_extra_nm_s_per_rad": Parameter(extra, (extra, extra))}
    assert "time were in milliseconds" in far_off(
        (WrongNumber("wrong-number", 1.0, parameters),), TWIN
    )


@pytest.mark.parametrize(("factor", "says"), [(0.93, ""), (0.0072, "percent of the rated one")])
def test_a_torque_in_percent_is_no_torque_constant(factor: float, says: str) -> None:
    """It was "explained": the real torque is the reported one times 0.0072."""
    number = WrongNumber("torque-constant-error", 1.0, {"factor": Parameter(factor, (0.0, 1.0))})
    assert says in far_off((number,), TWIN)
    assert bool(far_off((number,), TWIN)) is bool(says)


@pytest.mark.parametrize(
    ("true", "says"),
    [
        ((-1.5, 0.8), "opposite sign"),
        ((0.8, 1.5), "turned by 90°"),
        ((2.0, -1.1), ""),  # a payload, and its arm's angle
        ((1.5, -0.7), ""),
    ],
)
def test_gravity_that_is_as_strong_and_turned_asks_for_signs_and_zeros_first(
    true: tuple[float, float], says: str
) -> None:
    twin = replace(TWIN, gravity_sin_nm=1.5, gravity_cos_nm=-0.8)
    parts = (("gravity_sin_nm", true[0] - 1.5), ("gravity_cos_nm", true[1] + 0.8))
    extra = {name: Parameter(value, (value - 0.01, value + 0.01)) for name, value in parts}
    said = turned_gravity((WrongNumber("gravity-imbalance", 1.0, extra),), twin)
    assert says in said if says else said == ""


def _arm_side(signals: Signals) -> Signals:
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    gear = signals.gear_ratio
    return replace(
        signals,
        position_rad=signals.position_rad / gear,
        velocity_rad_s=signals.velocity_rad_s / gear,
        torque_nm=signals.torque_nm * gear,
    )


@pytest.mark.parametrize(
    ("change", "says"),
    [
        (lambda s: replace(s, torque_nm=100.0 * s.torque_nm), "odd.csv shows friction of 70 N m"),
        (lambda s: replace(s, torque_nm=-s.torque_nm), "odd.csv shows friction of"),
        (_arm_side, "odd.csv is as the others if its motion is the arm's, and not the motor's"),
        (lambda s: replace(s, torque_nm=2.0 * s.torque_nm), ""),  # worn, or cold
    ],
)
def test_one_recording_in_another_unit_is_named_and_nothing_else(
    run: Run, change: Change, says: str
) -> None:
    """It had been located "from recording 1 to 2", or made a bump of 40 N m."""
    odd = replace(run, signals=replace(change(run.signals), name="odd.csv"))
    table = tabulate(TWIN, [run, odd, run])
    assert says in undecidable(table, TWIN)
    assert bool(undecidable(table, TWIN)) is bool(says)


@pytest.mark.parametrize("column", ["position_rad", "velocity_rad_s"])
def test_a_column_without_a_number_is_none(run: Run, column: str) -> None:
    """Beside one that tells the motion it had taken every sample with it."""
    signals = run.signals
    columns = {
        "time_s": signals.time_s,
        "torque_nm": signals.torque_nm,
        "position_rad": signals.position_rad,
        "velocity_rad_s": signals.velocity_rad_s,
        column: np.full(signals.time_s.shape, np.nan),
    }
    known = {name: value for name, value in columns.items() if value is not None}
    read = Signals.from_columns(known, signals.gear_ratio, name="log.csv")
    assert getattr(read, column) is None
    assert read.valid.all()


def test_a_slow_recording_among_fast_ones_is_in_the_same_unit() -> None:
    """In thick oil friction is in proportion to speed: nine times as much at sixty times it."""

    def oil(points: SetPoints, at: Conditions) -> Floats:
        del at
        return 0.04 * points.velocity_rad_s - 0.3 * np.sign(points.velocity_rad_s)

    slow = record(stair((1.0, 2.0), 20.0), oil, Conditions(), 1)
    fast = [record(stair((60.0, 90.0), 230.0), oil, Conditions(), k) for k in (2, 3)]
    assert of_two_units(tabulate(TWIN, [slow, *fast])) == ""
    assert of_two_units(tabulate(TWIN, [slow, fast[0]])) == ""


@pytest.mark.parametrize(
    ("level_nm", "said"),
    [(0.0, "is 0 N m all along"), (0.5, "is 0.500 N m all along"), (np.nan, "holds no number")],
)
def test_a_column_that_holds_no_simulation_is_not_questioned(level_nm: float, said: str) -> None:
    run = record(stair((2.0, 8.0)), _nothing, Conditions(), 0)
    columns = {**run.columns, "torque_simulated_nm": np.full_like(run.signals.torque_nm, level_nm)}
    answer = explain(TWIN, [replace(run, columns=columns)])
    assert answer.verdict == "unexplained"
    assert answer.sentence.startswith(f"Not decidable: run: torque_simulated_nm {said}")


def test_a_position_that_begins_anew_with_every_turn_loses_where_a_weight_hangs(run: Run) -> None:
    """It had been another zero of the torque in each recording; without a weight it is counted."""
    hanging = replace(TWIN, gravity_sin_nm=0.3)
    assert "a position that counts its turns" in explain(hanging, [_wrapped(run)]).sentence
    answer = explain(replace(TWIN, gravity_sin_nm=0.0, gravity_cos_nm=0.0), [_wrapped(run)] * 2)
    assert any("begins anew with every turn" in reason for reason in answer.reasons)
