"""What a drive does with a move when nobody speaks to it any more: it ends where it was to end."""

from __future__ import annotations

import pytest

from agent.cell.bus import Drive
from drivers.cia402.settings import MAY_LACK
from drivers.errors import SdoError
from drivers.ports import Command, Goal, Move
from fakes.specification import DriveParameters, FakeSpecification
from tests.contract.axis_rig import EVERY_MODE, VIRTUAL, open_rig

OFF = Command(Goal.OFF, 0.0)


def test_a_move_ends_by_itself_when_the_agent_dies_and_the_drive_watches_nobody() -> None:
    """Bounded: what pp is for, on a drive without consumer heartbeat."""
    every = DriveParameters(supported_modes=EVERY_MODE, absent_objects=(0x1016, 0x6007))
    with open_rig(f"{VIRTUAL}/pp", specification=FakeSpecification(drive=every)) as rig:
        axis = rig.axis(mode="auto", heartbeat_consumer_subindex=None, abort_connection_option=None)
        evidence = axis.open()
        assert evidence.mode == "pp"
        assert "0x1016" in evidence.mode_reason
        assert rig.drive is not None
        start_rad = rig.run(axis, 0.1, OFF)[-1].position_rad
        going = Command(Goal.ON, 0.0, move=Move(1, start_rad + 30.0, 40.0))
        for _ in range(60):
            axis.send(going)
            rig.clock.sleep_until(rig.clock.now() + 0.004)
            axis.receive()
        assert abs(rig.drive.motor_velocity_rad_s) > 5.0
        rig.clock.sleep_until(rig.clock.now() + 3.0)  # nobody says anything any more
        assert abs(rig.drive.motor_velocity_rad_s) < 0.5
        assert rig.drive.motor_position_rad == pytest.approx(start_rad + 30.0, abs=0.2)
        axis.close()


@pytest.mark.parametrize("index", MAY_LACK)
def test_of_an_object_that_a_drive_lacks_it_is_said_what_the_cell_says_of_it(index: int) -> None:
    lacking = FakeSpecification(drive=DriveParameters(absent_objects=(index,)))
    with open_rig(VIRTUAL, specification=lacking) as rig:
        axis = rig.axis()
        with pytest.raises(SdoError, match="no such object") as caught:
            axis.open()
        axis.close()
    key, _, value = MAY_LACK[index].partition(" = ")
    assert f"set {key} = {value} under [axis.drive]" in caught.value.do
    assert Drive.model_fields[key].default is None  # the cell may say it
