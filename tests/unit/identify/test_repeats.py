"""Logs that ask faster than the drive answers."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.rows.repeats import without_repeats
from agent.explain.rows.run import Run
from agent.identify.estimate import estimate
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.repeats import repeats, with_motion_between, without

PERIOD_S = 0.004
COUNT_RAD = 2.0 * np.pi / (1 << 17)


def answers(torque_step_nm: float = 0.0, seconds: float = 24.0) -> Signals:
    """Return what a drive answers every 4 ms: steady speeds both ways, and rests between them."""
    time_s = np.arange(0.0, seconds, PERIOD_S)
    speed = np.array([20.0, 0.0, -20.0, 0.0, 35.0, 0.0, -35.0, 0.0, 50.0, 0.0, -50.0, 0.0])
    command = np.repeat(speed, time_s.size // speed.size)
    velocity = np.convolve(command, np.ones(60) / 60.0, mode="same")
    position = np.floor(np.cumsum(velocity) * PERIOD_S / COUNT_RAD) * COUNT_RAD
    torque = 0.01 * np.gradient(velocity, PERIOD_S) + 0.5 * np.sign(velocity) + 0.004 * velocity
    torque += 0.01 * np.random.default_rng(8).standard_normal(time_s.size)
    if torque_step_nm > 0.0:
        torque = np.round(torque / torque_step_nm) * torque_step_nm
    columns = {"time_s": time_s, "position_rad": position, "torque_nm": torque}
    return Signals.from_columns(columns, 1.0)


def asked_at(drive: Signals, time_s: Floats) -> Signals:
    """Return a log that asks at these times, and stamps what it is told when it asked."""
    latest = np.clip((time_s / PERIOD_S).astype(np.intp), 0, drive.time_s.size - 1)
    assert drive.position_rad is not None
    return replace(
        drive,
        time_s=time_s,
        position_rad=drive.position_rad[latest],
        torque_nm=drive.torque_nm[latest],
        valid=drive.valid[latest],
    )


def ticks_s(drive: Signals, times: int) -> Floats:
    """Return when a log asks that asks so many times for every answer."""
    ticks: Floats = np.arange(drive.time_s.size * times, dtype=np.float64)
    return ticks * (PERIOD_S / times) + 1e-5


@pytest.mark.parametrize("torque_step_nm", [0.0, 0.05])
@pytest.mark.parametrize("times", [2, 4])
def test_of_a_drive_that_is_asked_too_often_each_answer_counts_once(
    times: int, torque_step_nm: float
) -> None:
    """At rest a coarse torque is the same for long: an answer stays for every so many rows."""
    drive = answers(torque_step_nm)
    log = asked_at(drive, ticks_s(drive, times))
    assert not repeats(drive).any()
    kept = without(log, repeats(log))
    assert abs(kept.time_s.size - drive.time_s.size) < 0.02 * drive.time_s.size
    told = np.isin(kept.time_s, log.time_s[::times])
    assert told.mean() > 0.98


def test_a_log_with_a_clock_of_its_own_has_the_drives_friction() -> None:
    """Asked every 3 ms, give or take, for what changes every 4: the motion stood every fourth row.

    The stamps of what is left are off by up to 3 ms, and the motion tells that, too.
    """
    drive, rng = answers(), np.random.default_rng(9)
    asked_s = np.cumsum(0.003 + rng.normal(0.0, 2e-4, 7900))
    found = estimate([asked_at(drive, asked_s)])
    assert any("repeat the row before (25 %)" in note for note in found.notes)
    assert any("sampled evenly" in note for note in found.notes)
    assert found.rigid_body is not None
    inertia = found.rigid_body.parameters["inertia_kg_m2"]
    assert inertia.value == pytest.approx(0.01, rel=0.02)
    assert found.rigid_body.parameters["coulomb_nm"].value == pytest.approx(0.5, rel=0.01)


def test_motion_that_is_slower_than_the_torque_is_taken_from_its_neighbours() -> None:
    drive = answers()
    assert drive.position_rad is not None
    held = replace(drive, position_rad=np.repeat(drive.position_rad[::2], 2))
    filled, count = with_motion_between(held)
    assert filled.position_rad is not None
    assert count == pytest.approx(0.5 * 6.0 / 12.0 * drive.time_s.size, rel=0.1)
    off = np.abs(filled.position_rad - drive.position_rad)
    assert float(off.max()) < 0.02  # in the corner of a ramp; held it was 0.2
    assert float(np.median(off[1:-1:2])) < 2.0 * COUNT_RAD
    found = estimate([held])
    assert any("hold the motion of the row before" in note for note in found.notes)
    assert found.rigid_body is not None
    assert found.rigid_body.parameters["inertia_kg_m2"].value == pytest.approx(0.01, rel=0.02)
    assert with_motion_between(drive) == (drive, 0)


def test_a_joint_that_stands_for_a_moment_on_its_way_holds_nothing() -> None:
    """Between two moves of one direction it was "a torque that is told more often"."""
    drive = answers()
    speed = np.where(np.arange(drive.time_s.size) % 50 < 6, 0.0, 3.0)
    speed[:50] = 0.02  # by which its least step is known
    position = np.floor(np.cumsum(speed) * PERIOD_S / COUNT_RAD) * COUNT_RAD
    stops = replace(drive, position_rad=position, velocity_rad_s=speed)
    assert with_motion_between(stops) == (stops, 0)
    assert with_motion_between(replace(stops, velocity_rad_s=None))[1] > 0  # nobody can tell


def test_a_slow_joint_and_one_at_rest_are_no_repeats() -> None:
    drive = answers(0.05)
    assert drive.position_rad is not None
    slow = np.floor(1e-3 * drive.position_rad / COUNT_RAD) * COUNT_RAD
    still = replace(drive, position_rad=slow, torque_nm=np.round(drive.torque_nm, 1))
    assert not repeats(still).any()
    assert not repeats(replace(drive, position_rad=None, velocity_rad_s=drive.torque_nm)).any()


def test_what_an_explanation_says_of_them() -> None:
    drive = answers()
    log = asked_at(drive, ticks_s(drive, 2))
    (kept, same), said = without_repeats((Run(log, {"warmth": log.time_s}), Run(drive)))
    assert same.signals is drive
    assert kept.columns["warmth"].size == kept.signals.time_s.size
    assert said == (
        "6000 rows repeat the row before (33 %), as a log that asks faster than the drive answers: "
        "they were left out",
    )
    assert without_repeats((Run(drive),)) == ((Run(drive),), ())
