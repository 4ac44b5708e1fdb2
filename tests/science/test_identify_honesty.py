"""What the data do not carry is refused or left out, with the reason, and never given a number."""

from __future__ import annotations

import json
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import lfilter

from agent.acquisition import Acquisition
from agent.identify.diagnosis import refusals, unlikely_units
from agent.identify.estimate import estimate, identify, twin_from_estimate
from agent.identify.result import Estimate
from agent.identify.rigid.alike import mixed_units
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.physics.twin import format_twin, parse_twin
from tests.science.identify_plant import Joint, Motion, record, stair

JOINT = Joint(static_extra_nm=0.3)


def motion_of(velocity: NDArray[np.float64], period_s: float = 0.004) -> Motion:
    time_s: NDArray[np.float64] = np.arange(velocity.size, dtype=np.float64) * period_s
    return Motion(time_s, np.cumsum(velocity) * period_s, velocity, np.gradient(velocity, time_s))


def refused(result: Estimate, *words: str) -> None:
    assert not result.decidable
    assert result.reasons
    text = " ".join(result.reasons)
    assert all(word in text for word in words), text
    assert result.sentence.startswith("Not decidable")
    document = json.loads(json.dumps(result.to_json(), allow_nan=False))
    assert document["friction_curve"] is None
    assert document["friction_models"] == []
    assert document["rigid_body"] is None


def test_one_direction() -> None:
    refused(estimate([record(JOINT, stair(directions=(1,)))]), "one direction only")


def test_one_speed() -> None:
    refused(estimate([record(JOINT, stair([20.0] * 5))]), "one steady speed only", "20")


def test_frozen_torque() -> None:
    signals = record(JOINT, stair())
    frozen = replace(signals, torque_nm=np.full_like(signals.torque_nm, 0.3))
    refused(estimate([frozen]), "never changes")


def test_torque_at_its_limit() -> None:
    signals = record(JOINT, stair())
    cut = replace(signals, torque_nm=np.clip(signals.torque_nm, -0.8, 0.8))
    refused(estimate([cut]), "cut off at a limit")


def test_no_motion() -> None:
    still = record(JOINT, motion_of(np.zeros(5000)))
    refused(estimate([still]), "does not move")


def test_thirty_samples_of_motion() -> None:
    velocity = np.zeros(5000)
    velocity[2000:2015], velocity[2500:2515] = 5.0, -5.0
    refused(estimate([record(JOINT, motion_of(velocity))]), "30 samples of motion")


def test_too_slow_a_rate() -> None:
    signals = record(JOINT, stair(rate_hz=250.0))
    pick = slice(None, None, 250)
    assert signals.velocity_rad_s is not None
    rng = np.random.default_rng(0)
    velocity = rng.choice([-2.0, 0.0, 0.0, 2.0], 2000)
    slow = Signals.from_columns(
        {
            "time_s": np.arange(2000.0),
            "torque_nm": np.sign(velocity) + 0.1 * rng.standard_normal(2000),
            "velocity_rad_s": velocity,
        },
        1.0,
    )
    refused(estimate([slow]), "too slow", "1 Hz")
    sparse = Signals.from_columns(
        {
            "time_s": signals.time_s[pick],
            "torque_nm": signals.torque_nm[pick],
            "velocity_rad_s": signals.velocity_rad_s[pick],
        },
        224.0,
    )
    refused(estimate([sparse]), "valid samples")


def test_velocity_in_the_wrong_unit() -> None:
    signals = record(JOINT, stair())
    assert signals.velocity_rad_s is not None
    rpm = replace(signals, velocity_rad_s=signals.velocity_rad_s * 60.0 / (2.0 * np.pi))
    refused(estimate([rpm]), "0.1047 times", "unit")


def test_torque_with_the_wrong_sign() -> None:
    signals = record(JOINT, stair())
    refused(estimate([replace(signals, torque_nm=-signals.torque_nm)]), "opposite signs")


def test_lost_frames() -> None:
    signals = record(JOINT, stair())
    refused(estimate([replace(signals, samples_lost=20000)]), "frames lost")


def accounted(signals: Signals, **changes: Any) -> Signals:
    """Return signals with an account in which all is well but for `changes`."""
    expected = signals.time_s.size + changes.get("lost", 0)
    account = Acquisition(expected=expected, received=signals.time_s.size, lost=0)
    return replace(
        signals, samples_lost=changes.get("lost", 0), acquisition=replace(account, **changes)
    )


def test_a_loss_that_could_hide_a_bias_is_refused_and_a_smaller_one_is_shown() -> None:
    signals = record(JOINT, stair())
    few, many = signals.time_s.size // 200, signals.time_s.size // 50
    borne = estimate([accounted(signals, lost=few)])
    assert borne.decidable, borne.reasons
    assert borne.quality.acquisition is not None
    assert borne.quality.acquisition.lost == few
    refused(estimate([accounted(signals, lost=many)]), "without a known cause")
    refused(estimate([replace(signals, samples_lost=many)]), "without a known cause")
    explained = accounted(signals, lost=many, dropped_by_kernel=2 * many)
    assert refusals([read_motion(explained)]) == ()


def test_rows_that_may_stand_in_their_neighbours_place_are_borne_if_few() -> None:
    """One of 6993 on a busy computer had taken a whole cycle's estimate."""
    signals = record(JOINT, stair())
    count = signals.time_s.size
    assert refusals([read_motion(accounted(signals, doubtful=count // 1000))]) == ()
    refused(estimate([accounted(signals, doubtful=count // 100)]), "neighbour's place")


def test_rows_that_are_known_to_be_of_another_time_are_left_out_and_count_as_lost() -> None:
    """On a busy computer 26 of 6983 rows had taken a whole cycle's estimate: it said how many."""
    signals = record(JOINT, stair(), noise_nm=0.01)
    assert signals.velocity_rad_s is not None
    assert signals.position_rad is not None
    columns = {
        "time_s": signals.time_s,
        "torque_nm": signals.torque_nm.copy(),
        "position_rad": signals.position_rad.copy(),
        "velocity_rad_s": signals.velocity_rad_s.copy(),
    }

    def doubted(rows: Sequence[slice]) -> Signals:
        spans = tuple((signals.time_s[r][0], signals.time_s[r][-1]) for r in rows)
        account = Acquisition(len(signals.time_s), len(signals.time_s), 0, doubtful_s=spans)
        return Signals.from_columns(columns, signals.gear_ratio, acquisition=account)

    held_up = [slice(start, start + 26) for start in (2000, 5000)]
    for rows in held_up:
        for name in ("torque_nm", "position_rad", "velocity_rad_s"):
            columns[name][rows] = columns[name][rows.start]
    whole, found = estimate([signals]), estimate([doubted(held_up)])
    assert found.decidable, found.reasons
    assert found.quality.masked == 52
    assert any("52 rows that may stand in another's place" in note for note in found.notes)
    assert whole.rigid_body is not None
    assert found.rigid_body is not None
    for name in ("inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad"):
        of_whole, of_found = (b.parameters[name] for b in (whole.rigid_body, found.rigid_body))
        assert of_whole.ci95 is not None
        assert abs(of_found.value - of_whole.value) < np.ptp(of_whole.ci95)
    many = [slice(start, start + 26) for start in range(0, len(signals.time_s), 1000)]
    refused(estimate([doubted(many)]), "another's place in time", "1 % can be borne")


def test_what_somebody_has_changed_meanwhile_is_refused() -> None:
    signals = record(JOINT, stair())
    refused(estimate([accounted(signals, changed=("0x1A00:02 reads 1",))]), "no longer set")


def test_rows_that_are_missing_and_in_no_account_are_refused() -> None:
    whole = record(JOINT, stair())
    kept = np.ones(whole.time_s.size, dtype=bool)
    kept[2000 : 2000 + whole.time_s.size // 200] = False
    columns = {"time_s": whole.time_s, "torque_nm": whole.torque_nm}
    assert whole.velocity_rad_s is not None
    columns["velocity_rad_s"] = whole.velocity_rad_s
    cut = Signals.from_columns({k: v[kept] for k, v in columns.items()}, whole.gear_ratio)
    missing = int(np.count_nonzero(~kept))
    refused(estimate([accounted(cut)]), "the loss is unexplained")
    for reason in ({"lost": missing}, {"not_asked": missing}):
        assert refusals([read_motion(accounted(cut, **reason))]) == ()
    assert refusals([read_motion(cut)]) == ()  # without an account a gap is a gap


def test_different_gears_are_not_one_axis() -> None:
    other = record(Joint(gear_ratio=100.0), stair(), name="other")
    refused(estimate([record(JOINT, stair()), other]), "gear ratios")


HEAVY = replace(JOINT, gravity_cos_nm=1.5, gear_ratio=50.0)


def in_units(signals: Signals, motion: float, torque: float = 1.0) -> Signals:
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    return replace(
        signals,
        name="odd",
        position_rad=signals.position_rad * motion,
        velocity_rad_s=signals.velocity_rad_s * motion,
        torque_nm=signals.torque_nm * torque,
    )


@pytest.mark.parametrize(
    ("joint", "motion", "torque", "says"),
    [
        (JOINT, 1.0, 100.0, "odd shows friction of"),  # percent
        (JOINT, 1.0, -1.0, "odd shows friction of"),
        (JOINT, 180.0 / np.pi, 1.0, "odd is as the others if its motion is in degrees"),
        (HEAVY, 180.0 / np.pi, 1.0, "odd is as the others if its motion is in degrees"),
        (HEAVY, 1.0 / 50.0, 1.0, "odd is as the others if its motion is the arm's"),
    ],
)
def test_one_recording_in_another_unit_is_named(
    joint: Joint, motion: float, torque: float, says: str
) -> None:
    """The numbers of all had come out wide, and a twin had been written."""
    runs = [record(joint, stair((5.0, 20.0, 60.0), rate_hz=100.0), seed=k) for k in range(3)]
    refused(estimate([runs[0], in_units(runs[1], motion, torque), runs[2]]), says)
    assert mixed_units([read_motion(r) for r in runs]) == ""


def test_a_motor_that_would_turn_too_fast_may_be_in_degrees() -> None:
    """By itself a recording in degrees is one of a joint with a 57th of the inertia."""
    signals = record(HEAVY, stair((5.0, 20.0, 60.0), rate_hz=100.0))
    assert unlikely_units([read_motion(signals)]) == []
    for motion, says in ((180.0 / np.pi, "would turn at 32"), (30.0, "the arm would turn ")):
        said = unlikely_units([read_motion(in_units(signals, motion))])
        assert says in said[0]
        assert "in degrees" in said[0]


def test_a_joint_that_would_coast_for_minutes_may_be_in_milliseconds() -> None:
    """A bench of others came out with a million times its inertia, and nothing was said."""
    seconds = record(HEAVY, stair((5.0, 20.0, 60.0), rate_hz=100.0))
    thousandth = replace(seconds, time_s=1e3 * seconds.time_s, velocity_rad_s=None)
    assert not [note for note in estimate([seconds]).notes if "coast" in note]
    assert [note for note in estimate([thousandth]).notes if "in milliseconds" in note]
    millionth = replace(seconds, time_s=1e6 * seconds.time_s, velocity_rad_s=None)
    assert [note for note in estimate([millionth]).notes if "in microseconds" in note]


@pytest.mark.parametrize(
    ("channel", "factor", "says"),
    [
        ("time_s", 1e3, "as if time_s were in milliseconds, and not in seconds"),
        ("time_s", 1e6, "as if time_s were in microseconds, and not in seconds"),
        ("velocity_rad_s", 1e3, "one of the two is in another unit, or on the other side"),
        ("time_s", 60.0, "one of the two is in another unit, or on the other side"),
    ],
)
def test_time_in_another_unit_is_told_as_time_and_not_as_motion(
    channel: str, factor: float, says: str
) -> None:
    """A velocity in thousandths looks alike, but its samples come as fast as they should."""
    seconds = record(HEAVY, stair((5.0, 20.0, 60.0), rate_hz=250.0))
    values = getattr(seconds, channel)
    (reason,) = estimate([replace(seconds, **{channel: factor * values})]).reasons
    assert says in reason
    assert "another unit" in reason


@pytest.mark.parametrize("coulomb_nm", [0.3, 2.0])
def test_a_cold_joint_and_slow_speeds_are_in_the_same_unit(coulomb_nm: float) -> None:
    usual = record(HEAVY, stair((5.0, 20.0, 60.0), rate_hz=100.0))
    odd = record(replace(HEAVY, coulomb_nm=coulomb_nm), stair((0.5, 1.0), rate_hz=100.0))
    for runs in ((usual, odd), (usual, usual, odd)):
        assert mixed_units([read_motion(r) for r in runs]) == ""


def test_every_reason_is_given() -> None:
    signals = record(JOINT, stair())
    assert signals.velocity_rad_s is not None
    both = replace(
        signals,
        velocity_rad_s=signals.velocity_rad_s * 10.0,
        torque_nm=np.full_like(signals.torque_nm, 0.1),
    )
    assert len(estimate([both]).reasons) == 2


def test_nothing_is_refused_as_a_mistake_of_the_caller() -> None:
    with pytest.raises(ValueError, match="at least one recording"):
        estimate([])
    with pytest.raises(ValueError, match="cutoff"):
        estimate([record(JOINT, stair())], cutoff_hz=0.0)


def test_holes_lost_samples_and_jitter_do_not_move_the_answer() -> None:
    signals = record(JOINT, stair(), noise_nm=0.01)
    whole = estimate([signals])
    rng = np.random.default_rng(1)
    torque = signals.torque_nm.copy()
    torque[2000:2300] = np.nan
    torque[rng.random(torque.size) < 0.02] = np.nan
    holes = replace(signals, torque_nm=torque, valid=np.isfinite(torque))
    keep = rng.random(torque.size) > 0.2
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    thinned = Signals.from_columns(
        {
            "time_s": signals.time_s[keep],
            "torque_nm": signals.torque_nm[keep],
            "velocity_rad_s": signals.velocity_rad_s[keep],
            "position_rad": signals.position_rad[keep],
        },
        signals.gear_ratio,
    )
    assert whole.rigid_body is not None
    for damaged in (holes, thinned):
        result = estimate([damaged])
        assert result.decidable
        assert result.rigid_body is not None
        assert result.friction_curve is not None
        for name in ("inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad"):
            assert result.rigid_body.parameters[name].value == pytest.approx(
                whole.rigid_body.parameters[name].value, rel=0.03
            )
        truth = JOINT.friction(result.friction_curve.velocity_rad_s)
        np.testing.assert_allclose(result.friction_curve.friction_nm, truth, atol=0.03)
    assert estimate([holes]).quality.masked == int(np.count_nonzero(~holes.valid))
    assert any("uneven" in note for note in estimate([thinned]).notes)


def test_gravity_on_a_short_stroke_is_not_invented() -> None:
    body = estimate([record(Joint(offset_nm=0.1), stair())]).rigid_body
    assert body is not None
    for name in ("gravity_sin_nm", "gravity_cos_nm"):
        parameter = body.parameters[name]
        assert not parameter.identified
        assert parameter.ci95 is None
        assert np.isnan(parameter.value)
        assert "stroke" in parameter.reason
    assert body.parameters["torque_offset_nm"].identified
    assert body.parameters["torque_offset_nm"].value == pytest.approx(0.1, abs=0.02)


def test_inertia_without_acceleration_is_not_invented() -> None:
    motion = stair()
    steady = np.abs(motion.acceleration_rad_s2) < 1e-9
    signals = record(JOINT, motion)
    valid = signals.valid & steady
    body = estimate([replace(signals, valid=valid)]).rigid_body
    assert body is not None
    assert not body.parameters["inertia_kg_m2"].identified
    assert "velocity hardly changes" in body.parameters["inertia_kg_m2"].reason


def test_a_fall_below_the_slowest_speed_is_not_given_a_height() -> None:
    joint = Joint(static_extra_nm=0.5, stribeck_velocity_rad_s=0.8)
    fits = estimate([record(joint, stair(), noise_nm=0.004)]).friction_models
    stribeck = next(m for m in fits if m.model == "stribeck")
    extra = stribeck.parameters["static_extra_nm"]
    assert not extra.identified or (extra.ci95 is not None and extra.ci95[1] > 0.5)


def test_speeds_without_a_partner_lean_on_the_model_or_are_left_out() -> None:
    joint = Joint(gravity_sin_nm=0.5, gravity_cos_nm=0.2, gear_ratio=20.0)
    one_way = stair((10.0, 30.0, 90.0), directions=(1,), stroke_rad=40.0)
    both = stair((20.0, 50.0), stroke_rad=40.0)
    result = estimate([record(joint, one_way, name="a"), record(joint, both, seed=1, name="b")])
    assert result.friction_curve is not None
    assert result.friction_curve.velocity_rad_s.size == 5
    assert any("rigid-body fit" in note for note in result.notes)
    truth = joint.friction(result.friction_curve.velocity_rad_s)
    np.testing.assert_allclose(result.friction_curve.friction_nm, truth, atol=0.03)


def test_arrays_for_pictures_fit_the_recording() -> None:
    signals = record(JOINT, stair())
    run = identify([signals], validation=record(JOINT, stair(), seed=9))
    detail = run.details[0]
    assert detail.velocity_rad_s.shape == signals.time_s.shape
    assert detail.torque_predicted_nm is not None
    error = (detail.torque_nm - detail.torque_predicted_nm)[detail.compared]
    assert run.estimate.rigid_body is not None
    assert np.sqrt(np.mean(error**2)) == pytest.approx(run.estimate.rigid_body.rmse_nm, rel=1e-9)
    assert len(detail.windows) == 20
    assert run.validation_detail is not None
    assert run.validation_detail.torque_predicted_nm is not None


def test_twin_of_an_estimate_reads_back() -> None:
    result = estimate([record(Joint(), stair())])
    twin = twin_from_estimate(result, robot="cell", axis=2, gear_ratio=224.0)
    assert parse_twin(format_twin(twin)) == twin
    assert twin.effects == ()
    assert twin.coulomb_nm == pytest.approx(0.6042, rel=0.02)
    assert twin.extra["not_identified"] == ["gravity_sin_nm", "gravity_cos_nm"]
    dry = estimate([record(Joint(viscous_nm_s_per_rad=0.0), stair(), seed=2)])
    assert dry.rigid_body is not None
    assert dry.rigid_body.parameters["viscous_nm_s_per_rad"].value < 0.0  # by chance: zero is in it
    twin = twin_from_estimate(dry, robot="cell", axis=2, gear_ratio=224.0)
    assert twin.viscous_nm_s_per_rad == 0.0
    assert "viscous_nm_s_per_rad" in twin.extra["not_identified"]
    assert twin.coulomb_nm == pytest.approx(0.6042, abs=1e-3)
    nothing = estimate([record(JOINT, stair(directions=(1,)))])
    with pytest.raises(ValueError, match="one direction"):
        twin_from_estimate(nothing, robot="cell", axis=2, gear_ratio=224.0)


def test_samples_without_a_number_are_told_first_and_the_method_last() -> None:
    signals = record(JOINT, stair(rate_hz=250.0, longest_s=0.6))
    torque = signals.torque_nm.copy()
    torque[1000:1100] = np.nan
    said = estimate([replace(signals, torque_nm=torque, valid=np.isfinite(torque))])
    assert said.decidable
    assert "in 100 of " in said.notes[0]
    assert "torque is not a number" in said.notes[0]
    assert said.notes[-1].startswith("signals and regressors were low-passed alike")


@pytest.mark.parametrize(("wave_nm", "warned"), [(0.0, False), (1.0, True)])
def test_numbers_of_a_body_that_is_not_rigid_are_given_with_a_warning(
    wave_nm: float, warned: bool
) -> None:
    signals = record(JOINT, stair())
    assert signals.position_rad is not None
    place = np.sin(signals.position_rad)
    said = estimate([replace(signals, torque_nm=signals.torque_nm + wave_nm * place)])
    assert said.rigid_body is not None
    assert any("further off than their intervals say" in note for note in said.notes) is warned


@pytest.mark.parametrize("late", ["torque", "velocity"])
def test_a_filter_in_the_drive_does_not_bend_the_rigid_body(late: str) -> None:
    # Friction turns round a little later than the motion and looks like inertia: of a simulator's
    # joint Coulomb friction was 4 % and inertia 2 % off, at twice their intervals.
    signals = record(Joint(), stair(rate_hz=250.0, longest_s=0.6), noise_nm=0.005)
    assert signals.velocity_rad_s is not None
    if late == "torque":
        moved = replace(signals, torque_nm=lfilter([0.5], [1.0, -0.5], signals.torque_nm))
    else:
        filtered = lfilter([0.5], [1.0, -0.5], signals.velocity_rad_s)
        moved = replace(signals, velocity_rad_s=filtered)
    fit = estimate([moved])
    assert fit.rigid_body is not None
    for name, truth in (("inertia_kg_m2", JOINT.inertia_kg_m2), ("coulomb_nm", JOINT.coulomb_nm)):
        low, high = fit.rigid_body.parameters[name].ci95 or (0.0, 0.0)
        kink = 3e-4 * truth  # what sampling the ramps' kinks at 250 Hz makes of the inertia
        assert low - kink <= truth <= high + kink, (name, low / truth, high / truth)
        assert high < low + 0.02 * truth, (name, low / truth, high / truth)
    other = "motion" if late == "torque" else "torque"
    assert any(f"ms later than {other}; this was corrected" in note for note in fit.notes)


def test_a_late_velocity_behind_a_soft_gear_bends_neither_inertia_nor_viscous_friction() -> None:
    # Lateness was not asked beside a spring: of 63 such joints 78 % of the inertias and 29 % of the
    # viscous frictions were held.
    soft = Joint(spring_nm_per_rad=30.0, viscous_nm_s_per_rad=0.004)
    motion = stair(longest_s=1.0, ramp_s=0.3)
    signals = record(soft, motion, noise_nm=0.01, memory=0.5)
    assert signals.velocity_rad_s is not None
    filtered = lfilter([0.5], [1.0, -0.5], signals.velocity_rad_s)  # 4 ms
    body = estimate([replace(signals, velocity_rad_s=filtered)]).rigid_body
    assert body is not None
    assert body.spring_took_part
    assert body.torque_late_s == pytest.approx(-0.004, abs=0.0004)
    for name, share in (("inertia_kg_m2", 0.01), ("viscous_nm_s_per_rad", 0.08)):
        low, high = body.parameters[name].ci95 or (0.0, 0.0)
        truth = getattr(soft, name)
        assert low <= truth <= high < low + share * truth, (name, low / truth, high / truth)
