"""`stribeck flexible`, from a triangle wave on the wire to spring, picture and reasons."""

from __future__ import annotations

from typing import Any

import pytest

from agent.cell import Axis, parse_cell
from agent.cli.fake_cell import fake_cell_text
from agent.cycle.plan import NAMED, triangle_of
from fakes.specification import FakeSpecification
from trajectories import TrajectoryError, check


def axis_with(**edits: dict[str, Any] | None) -> Axis:
    """Return the simulated joint's axis; a table of it is updated, or left out where None."""
    import tomllib

    import tomli_w

    text = fake_cell_text(FakeSpecification(), interface="virtual", channel="none")
    cell = tomllib.loads(text)
    for table, values in edits.items():
        if values is None:
            del cell["axis"][0][table]
        else:
            cell["axis"][0][table] |= values
    return parse_cell(tomli_w.dumps(cell)).axis[0]


@pytest.mark.parametrize(
    "edits",
    [
        {},
        {"expected": None},
        {"limits": {"motor_velocity_max_rad_s": 170.0, "motor_torque_max_nm": 4.0}},
        {"stair": {"arm_from_deg": 10.0, "arm_to_deg": 11.0}},
        {"stair": {"motor_velocity_max_rad_s": 10.0}},
        {"expected": {"inertia_kg_m2": 0.0}},
    ],
)
def test_a_triangle_wave_fits_the_axis_that_it_is_made_for(edits: dict[str, Any]) -> None:
    axis = axis_with(**edits)
    wave = NAMED["triangle"](axis)
    assert wave.name == "triangle"
    assert not check(wave, axis.motor_limits, axis.torque_model)
    positions = [p.position_rad for p in wave.pieces]
    low, high = (axis.motor_rad(d) for d in (axis.stair.arm_from_deg, axis.stair.arm_to_deg))
    assert low - 1e-9 <= min(positions) <= max(positions) <= high + 1e-9
    middle = 0.5 * (min(positions) + max(positions))
    assert middle == pytest.approx(0.5 * (low + high), abs=0.02 * (high - low))
    peak = float(str(wave.parameters["peak_velocity_rad_s"]))
    assert 0.0 < peak <= axis.stair.motor_velocity_max_rad_s


def test_ringing_stays_within_the_torque_that_the_axis_may_use() -> None:
    strong, weak = axis_with(), axis_with(limits={"motor_torque_max_nm": 4.0})
    accelerations = [
        float(str(triangle_of(a).parameters["acceleration_rad_s2"])) for a in (strong, weak)
    ]
    expected = weak.expected
    assert expected is not None
    assert accelerations[1] < accelerations[0]
    assert 3.0 * expected.inertia_kg_m2 * accelerations[1] + expected.coulomb_nm < 4.0
    with pytest.raises(TrajectoryError, match="nothing is left to excite"):
        triangle_of(axis_with(limits={"motor_torque_max_nm": 0.8}))
