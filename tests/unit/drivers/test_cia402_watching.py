"""A watched drive: what moves is told from what merely wraps around or flickers."""

from __future__ import annotations

import math

import pytest

from drivers.cia402.watching import WatchedConfig, WatchedDrive
from drivers.errors import DriveStateError, NodeMissingError
from tests.contract.axis_rig import NODE, VIRTUAL, Rig, open_rig

RAD_PER_COUNT = 2.0 * math.pi / 65536


def watch(rig: Rig, drive: WatchedDrive, seconds: float) -> None:
    """Look every 4 ms."""
    end_s = rig.clock.now() + seconds
    while rig.clock.now() < end_s:
        rig.owner.poll()
        drive.look()
        rig.clock.sleep_until(rig.clock.now() + 0.004)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("counts", "moves"), [(400, False), (600, True)])
def test_a_position_that_wraps_around_has_moved_by_the_shorter_way(
    sign: int, counts: int, moves: bool
) -> None:
    with open_rig(VIRTUAL) as rig:
        assert rig.drive is not None
        plant = rig.drive.plant
        place = sign * (2**31 - 200) * RAD_PER_COUNT
        plant.motor_position_rad += place
        plant.arm_position_rad += place
        rig.clock.sleep_until(rig.clock.now() + 0.1)
        drive = WatchedDrive(rig.owner, rig.clock, WatchedConfig(NODE, "axis 2", 500.0))
        watch(rig, drive, 0.3)
        assert drive.is_known
        assert drive.failure is None
        plant.motor_position_rad += sign * counts * RAD_PER_COUNT
        plant.arm_position_rad += sign * counts * RAD_PER_COUNT
        watch(rig, drive, 0.3)
        assert isinstance(drive.failure, DriveStateError) is moves
        drive.release()


def test_restart_and_silence_are_told_within_the_time_that_is_said() -> None:
    with open_rig(VIRTUAL) as rig:
        drive = WatchedDrive(rig.owner, rig.clock, WatchedConfig(NODE, "axis 2", 500.0))
        watch(rig, drive, 0.3)
        rig.inject(0x000, bytes([0x82, NODE]))
        watch(rig, drive, 0.05)
        assert isinstance(drive.failure, DriveStateError)
        assert "restarted" in drive.failure.what
        drive.release()
        nobody = WatchedDrive(rig.owner, rig.clock, WatchedConfig(NODE + 1, "axis 3", 500.0))
        watch(rig, nobody, nobody.config.silence_s + 0.02)
        assert isinstance(nobody.failure, NodeMissingError)
        nobody.release()


@pytest.mark.parametrize(
    "wrong",
    [{"node_id": 0}, {"node_id": 128}, {"motion_max_counts": math.nan}, {"period_s": 0.0}],
)
def test_what_cannot_be_watched_is_refused(wrong: dict[str, float]) -> None:
    given = {"node_id": 2, "motion_max_counts": 10.0, **wrong}
    with pytest.raises(ValueError, match=next(iter(wrong))):
        WatchedConfig(name="axis 2", **given)  # type: ignore[arg-type]  # the keys are its fields
