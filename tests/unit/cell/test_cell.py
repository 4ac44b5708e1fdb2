"""A cell is read whole or refused whole, with every mistake named at once."""

from __future__ import annotations

import math
from importlib.resources import files
from pathlib import Path

import pytest

from agent.cell.cell import parse_cell, read_cell
from agent.errors import InputError

EXAMPLE = files("agent.examples").joinpath("cell.toml").read_text(encoding="utf-8")


def test_the_shipped_example_is_valid_and_not_commissioned() -> None:
    cell = parse_cell(EXAMPLE)
    assert [axis.number for axis in cell.axis] == [1]
    assert not cell.axis[0].commissioned


def test_arm_degrees_become_motor_radians_once() -> None:
    axis = parse_cell(EXAMPLE).axis[0]
    assert axis.motor_limits.position_max_rad == pytest.approx(math.radians(80.0) * 224.0)
    assert axis.motor_limits.reaction_time_s == pytest.approx(0.17)


def test_all_mistakes_are_reported_at_once() -> None:
    text = (
        EXAMPLE.replace("gear_ratio = 224.0", 'gear_ratio = "224"')
        .replace("\nnode_id = 1\n", "\nnode_id = 200\n")
        .replace("speeds = 11", "spedes = 11")
        .replace("arm_position_min_deg = -80.0", "arm_position_min_deg = 90.0")
    )
    with pytest.raises(InputError) as caught:
        parse_cell(text, "cell.toml")
    message = str(caught.value)
    assert message.startswith("cell.toml has 4 mistakes:")
    for piece in (
        "axis[1].gear_ratio",
        "axis[1].drive.node_id",
        "axis[1].stair.spedes: unknown key",
        "arm_position_min_deg must be below arm_position_max_deg",
    ):
        assert piece in message


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("gear_ratio = 224.0", "gear_ratio = nan", "gear_ratio"),
        ("gear_ratio = 224.0", "", "axis[1].gear_ratio: is missing"),
        ("commissioned = false", "commissioned = true", "commissioned_by"),
        ("commissioned = false", "commissioned = 1", "commissioned"),
        ('robot = "cell7-irb6650"', 'robot = "../etc"', "robot"),
        ("sample_rate_hz = 500.0", "sample_rate_hz = 5000.0", "sample_rate_hz"),
        ("agent_node_id = 127", "agent_node_id = 1", "own node_id"),
        ("heartbeat_timeout_s = 0.15", "heartbeat_timeout_s = 0.03", "at least three"),
        ('schema = "stribeck.cell/1"', 'schema = "stribeck.cell/9"', "schema"),
        ("arm_from_deg = -50.0", "arm_from_deg = 50.0", "arm_from_deg"),
        ("motor_velocity_min_rad_s = 2.0", "motor_velocity_min_rad_s = 999.0", "must be below"),
    ],
)
def test_each_mistake_has_its_sentence(old: str, new: str, says: str) -> None:
    assert old in EXAMPLE
    with pytest.raises(InputError, match="mistake") as caught:
        parse_cell(EXAMPLE.replace(old, new), "cell.toml")
    assert says in str(caught.value)


def test_not_toml_and_not_there(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="is not TOML"):
        parse_cell("robot = ")
    with pytest.raises(InputError, match="cannot be read"):
        read_cell(tmp_path / "missing.toml")


def test_an_unknown_axis_is_refused_naming_those_there_are() -> None:
    with pytest.raises(InputError, match="no axis 7; it has 1"):
        parse_cell(EXAMPLE).axis_numbered(7)
