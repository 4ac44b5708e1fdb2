"""One axis under test, another one of the robot on the same bus: watched, it may end the cycle."""

from __future__ import annotations

import copy
from collections.abc import Callable, Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import can
import pytest

from agent.record.reading import read
from drivers.errors import DriverError
from fakes import faults
from fakes.can_drive import FakeDrive
from fakes.fault import Fault
from fakes.process import open_bus
from fakes.specification import FakeSpecification
from tests.system.rig import Rig, rig
from tests.system.test_modes import brisk

OTHER_NODE = 2
IN_MOTION_S = 3.0


def two_axes(cell: dict[str, Any]) -> None:
    """Give the cell a second axis, the same but for its number and node."""
    brisk(cell)
    cell["axis"][0]["stair"] |= {"duration_s": 5.0, "motor_velocity_max_rad_s": 40.0}
    other = copy.deepcopy(cell["axis"][0])
    other["number"] = 2
    other["drive"]["node_id"] = OTHER_NODE
    cell["axis"].append(other)


@contextmanager
def robot(
    folder: Path,
    beside: Iterable[Fault] = (),
    edit: Callable[[dict[str, Any]], None] = two_axes,
) -> Iterator[tuple[Rig, FakeDrive]]:
    """Yield a cell with two drives on its bus; the second one has the faults."""
    with rig(folder, edit=edit) as cell:
        bus = open_bus("virtual", str(cell.cell.bus.channel))
        try:
            other = FakeDrive(
                bus, node_id=OTHER_NODE, specification=FakeSpecification(), faults=beside
            )
            cell.clock.attach(other.step_to)
            yield cell, other
        finally:
            bus.shutdown()


def test_a_watched_axis_is_left_as_it_is_and_its_answers_to_our_sync_confuse_nobody(
    tmp_path: Path,
) -> None:
    """It is OPERATIONAL, and both its TPDOs answer every SYNC of the axis under test."""
    with robot(tmp_path) as (cell, other):
        other.dictionary.set(0x1800, 2, 1)
        other.dictionary.set(0x1801, 1, 0x280 + OTHER_NODE)
        other.dictionary.set(0x1801, 2, 1)
        bus = open_bus("virtual", str(cell.cell.bus.channel))
        start = bytes([0x01, OTHER_NODE])
        bus.send(can.Message(arbitration_id=0, data=start, is_extended_id=False))
        cell.later(0.02)
        bus.shutdown()
        settings = {
            entry.key: other.dictionary.values[entry.key]
            for entry in other.dictionary
            if entry.writable
        }
        cell.cell = cell.cell.model_copy(update={"robot_model": "IRB 6650"})
        result = cell.run()
        assert other.syncs > 500
        assert {key: other.dictionary.values[key] for key in settings} == settings
    assert result.account.lost == result.account.unmatched == 0
    said = read(result.recording).metadata.extra
    assert (said["watched"], said["robot_model"]) == (["axis 2"], "IRB 6650")


@pytest.mark.parametrize(
    ("fault", "says"),
    [
        (faults.DriveFault(at_s=IN_MOTION_S, code=0x8611), r"axis 2.*following error"),
        (faults.Unplugged(at_s=IN_MOTION_S), r"axis 2.*unanswered"),
        (faults.PowerCut(at_s=IN_MOTION_S), r"axis 2.*unanswered"),
    ],
)
def test_a_watched_axis_that_faults_or_vanishes_ends_the_cycle(
    fault: Fault, says: str, tmp_path: Path
) -> None:
    with robot(tmp_path, [fault]) as (cell, _):
        began_s = cell.clock.now()
        with pytest.raises(DriverError, match=says) as caught:
            cell.run()
        assert cell.clock.now() - began_s < IN_MOTION_S + 1.5
        assert abs(cell.drive.motor_velocity_rad_s) < 1.0
        assert not cell.drive.plant.powered
    assert any("The joint is at rest" in note for note in caught.value.__notes__)


def test_a_watched_axis_that_moves_ends_the_cycle(tmp_path: Path) -> None:
    with robot(tmp_path) as (cell, other):

        def pushed(now_s: float) -> None:
            if now_s > IN_MOTION_S and other.plant.motor_position_rad < 5.0:
                other.plant.motor_position_rad += 0.05
                other.plant.arm_position_rad += 0.05

        cell.clock.attach(pushed)
        with pytest.raises(DriverError, match=r"axis 2.*has moved by"):
            cell.run()
        assert cell.clock.now() < IN_MOTION_S + 1.5
        assert not cell.drive.plant.powered


def test_an_axis_that_is_not_there_is_watched_only_if_the_cell_wants_it(tmp_path: Path) -> None:
    with rig(tmp_path, edit=two_axes) as cell:
        with pytest.raises(DriverError, match="axis 2"):
            cell.run()
        assert not cell.drive.plant.powered

    def unwatched(description: dict[str, Any]) -> None:
        two_axes(description)
        description["axis"][1]["drive"]["watched"] = False

    with rig(tmp_path, edit=unwatched) as cell:
        assert cell.run().account.lost == 0
