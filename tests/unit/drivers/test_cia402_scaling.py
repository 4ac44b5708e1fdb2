"""The drive's integers in SI and back; a configuration refuses what cannot be."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.cia402.config import Cia402Config
from drivers.cia402.objects import setting_of
from drivers.cia402.scaling import Scaling, TemperatureSource, VelocityUnit

SCALING = Scaling(encoder_counts_per_motor_rev=4096, rated_torque_nm=2.0)
CONFIG = Cia402Config(
    node_id=5,
    scaling=SCALING,
    acceleration_rad_s2=100.0,
    deceleration_rad_s2=100.0,
    quick_stop_deceleration_rad_s2=400.0,
    software_limits_rad=(-10.0, 20.0),
)


def test_one_motor_turn_is_tau() -> None:
    assert SCALING.position_rad(4096) == pytest.approx(math.tau)
    assert SCALING.velocity_rad_s(4096) == pytest.approx(math.tau)
    assert SCALING.torque_nm(1000) == pytest.approx(2.0)


@pytest.mark.parametrize(
    ("unit", "one_turn_a_second"),
    [("counts_per_s", 4096), ("rpm", 60), ("milli_rpm", 60_000)],
)
def test_velocity_units(unit: VelocityUnit, one_turn_a_second: int) -> None:
    scaling = dataclasses.replace(SCALING, velocity_unit=unit)
    assert scaling.velocity_units(math.tau) == one_turn_a_second
    assert scaling.velocity_rad_s(one_turn_a_second) == pytest.approx(math.tau)
    assert scaling.acceleration_units(math.tau) == one_turn_a_second


def test_acceleration_may_have_a_unit_of_its_own() -> None:
    scaling = dataclasses.replace(SCALING, velocity_unit="milli_rpm", acceleration_unit="rpm")
    assert scaling.acceleration_units(math.tau) == 60


def test_direction_turns_position_velocity_and_torque_but_no_acceleration() -> None:
    turned = dataclasses.replace(SCALING, direction=-1)
    assert turned.position_rad(4096) == pytest.approx(-math.tau)
    assert turned.velocity_units(math.tau) == -4096
    assert turned.torque_nm(1000) == pytest.approx(-2.0)
    assert turned.acceleration_units(math.tau) == 4096


def test_power_has_the_drives_sign_whatever_the_direction() -> None:
    for direction in (1, -1):
        turned = dataclasses.replace(SCALING, direction=direction)
        assert turned.velocity_rad_s(100) * turned.torque_nm(10) > 0.0


@given(
    counts=st.integers(-(2**31), 2**31 - 1),
    zero=st.integers(-(2**20), 2**20),
    direction=st.sampled_from([1, -1]),
)
def test_positions_round_trip(counts: int, zero: int, direction: int) -> None:
    scaling = dataclasses.replace(SCALING, zero_position_counts=zero, direction=direction)
    assert scaling.position_counts(scaling.position_rad(counts)) == counts


@pytest.mark.parametrize("velocity_rad_s", [math.nan, math.inf, -math.inf])
def test_a_velocity_that_is_no_number_is_refused(velocity_rad_s: float) -> None:
    with pytest.raises(ValueError, match="finite"):
        SCALING.velocity_units(velocity_rad_s)


def test_what_the_drives_integer_cannot_hold_is_refused_not_clamped() -> None:
    with pytest.raises(ValueError, match="beyond its integer"):
        SCALING.velocity_units(1e7)
    with pytest.raises(ValueError, match="less than one unit"):
        SCALING.acceleration_units(1e-6)


@pytest.mark.parametrize(
    "wrong",
    [
        {"encoder_counts_per_motor_rev": 0.0},
        {"rated_torque_nm": -1.0},
        {"rated_torque_nm": math.nan},
        {"direction": 0},
        {"velocity_unit": "deg_per_s"},
        {"acceleration_unit": "g"},
    ],
)
def test_wrong_scaling_is_refused(wrong: dict[str, Any]) -> None:
    with pytest.raises(ValueError, match="must be"):
        dataclasses.replace(SCALING, **wrong)


def test_a_temperature_sentinel_is_no_temperature() -> None:
    source = TemperatureSource(0x2100, 1, sentinels=(-32768, 0))
    assert source.degc(251) == pytest.approx(25.1)
    assert math.isnan(source.degc(-32768))
    assert math.isnan(source.degc(0))


def test_a_temperature_of_an_unknown_type_is_refused() -> None:
    with pytest.raises(ValueError, match="type must be one of"):
        TemperatureSource(0x2100, 1, kind="i64")


def test_software_limits_in_counts_rise_whatever_the_direction() -> None:
    turned = dataclasses.replace(CONFIG, scaling=dataclasses.replace(SCALING, direction=-1))
    counts = turned.software_limits_counts
    assert counts is not None
    assert counts[0] < counts[1]
    assert counts == (SCALING.position_counts(-20.0), SCALING.position_counts(10.0))


@pytest.mark.parametrize(
    ("wrong", "words"),
    [
        ({"node_id": 0}, "node_id must be 1 to 127"),
        ({"agent_node_id": 128}, "agent_node_id must be 1 to 127"),
        ({"agent_node_id": 5}, "must differ"),
        ({"sync_timeout_s": 0.0}, "sync_timeout_s must be positive"),
        ({"agent_heartbeat_timeout_s": 0.06}, "at least two periods"),
        ({"drive_heartbeat_timeout_s": math.inf}, "drive_heartbeat_timeout_s must be positive"),
        ({"agent_heartbeat_timeout_s": 70.0}, "1 ms to 65.535 s"),
        ({"deceleration_rad_s2": -1.0}, "deceleration_rad_s2 must be positive"),
        ({"software_limits_rad": (1.0, -1.0)}, "must rise"),
        ({"software_limits_rad": (0.0, 1e9)}, "beyond its integer"),
        ({"software_limits_rad": (0.0, 1e-9)}, "one count apart"),
        ({"consecutive_lost_limit": 0}, "at least 1"),
        ({"rest_velocity_rad_s": math.nan}, "rest_velocity_rad_s must be positive"),
    ],
)
def test_wrong_configurations_are_refused(wrong: dict[str, Any], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        dataclasses.replace(CONFIG, **wrong)


def test_all_mistakes_are_told_at_once() -> None:
    with pytest.raises(ValueError, match="node_id must be") as caught:
        dataclasses.replace(CONFIG, node_id=0, rest_samples=0, acceleration_rad_s2=math.nan)
    assert "rest_samples" in str(caught.value)
    assert "acceleration_rad_s2" in str(caught.value)


@pytest.mark.parametrize("key", ["6007:00", "0x6040:00", "0x1018:01", "0x1400:03"])
def test_a_journal_cannot_make_us_write_what_we_never_set(key: str) -> None:
    with pytest.raises(ValueError, match=key):
        setting_of(key)
