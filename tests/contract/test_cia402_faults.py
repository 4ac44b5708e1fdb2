"""What becomes of a CiA 402 axis whose drive or bus misbehaves, on every bus.

In simulated time; what hangs on a clock that nobody steps, in real time, too.
"""

from __future__ import annotations

import pytest

from drivers.cia402 import objects
from drivers.cia402.words import State, state_of
from drivers.errors import (
    ConfigurationError,
    DriveFaultError,
    HeartbeatLostError,
    SdoError,
    SyncUnansweredError,
)
from drivers.ports import Command, DriveState, Goal
from fakes import faults
from fakes.fault import Fault
from tests.contract.axis_rig import NODE, Rig, in_real_time, interfaces, open_rig

OFF = Command(Goal.OFF, 0.0)
ABSENT = 0x06020000
IN_EITHER_TIME = pytest.mark.parametrize(
    "interface", [*interfaces(), *in_real_time()], indirect=True
)


@pytest.fixture(params=interfaces())
def interface(request: pytest.FixtureRequest) -> str:
    return str(request.param)


def statusword(rig: Rig) -> State | None:
    with rig.sdo() as sdo:
        return state_of(sdo.read(objects.STATUSWORD))


def test_a_fault_is_told_with_its_code_and_latched(interface: str) -> None:
    with open_rig(interface, [faults.DriveFault(at_sync=40, code=0x8611)]) as rig:
        axis = rig.axis()
        axis.open()
        for _ in range(2):
            with pytest.raises(DriveFaultError, match="following error") as caught:
                rig.run(axis, 2.0, Command(Goal.OFF, 0.0))
            assert caught.value.error_code == 0x8611
        began_s = rig.clock.now()
        report = axis.stop(began_s + 2.0)
        assert report.at_rest
        assert DriveState.FAULT in {sample.state for sample in report.samples}
        assert report.samples[0].time_s < began_s  # what the error kept back is not lost
        axis.close()
        assert statusword(rig) is State.FAULT  # nobody has cleared it


def test_a_drive_found_in_fault_is_left_to_a_person(interface: str) -> None:
    with open_rig(interface, [faults.DriveFault(at_s=0.0, code=0x4210)]) as rig:
        axis = rig.axis()
        with pytest.raises(DriveFaultError, match=r"0x4210 \(drive too hot\)") as caught:
            axis.open()
        assert "person" in caught.value.do
        axis.close()
        assert statusword(rig) is State.FAULT
        assert rig.values(["0x1017:00"]) == {"0x1017:00": 0}


@IN_EITHER_TIME
def test_a_heartbeat_that_stops(interface: str) -> None:
    with open_rig(interface, [faults.HeartbeatStops(at_sync=20)]) as rig:
        axis = rig.axis()
        axis.open()
        with pytest.raises(HeartbeatLostError, match=f"node {NODE}"):
            rig.run(axis, rig.config.drive_heartbeat_timeout_s + 1.0, OFF)
        axis.close()


@IN_EITHER_TIME
def test_one_lost_answer_is_counted_and_shifts_nobody(interface: str) -> None:
    with open_rig(interface, [faults.SwallowSync(at_sync=30, count=1)]) as rig:
        axis = rig.axis()
        axis.open()
        rig.run(axis, 0.4 + rig.config.sync_timeout_s, OFF)
        account = axis.close()
        assert account.lost == 1
        assert account.received == account.expected - 1


@IN_EITHER_TIME
def test_a_drive_that_stops_answering(interface: str) -> None:
    with open_rig(interface, [faults.SwallowSync(at_sync=30, count=100_000)]) as rig:
        axis = rig.axis()
        axis.open()
        with pytest.raises(SyncUnansweredError, match="unanswered"):
            rig.run(axis, 2.0, Command(Goal.ON, 10.0))
        report = axis.stop(rig.clock.now() + 3.0)
        assert report.at_rest, report.reason
        assert "SDO" in report.reason  # the samples were silent, the objects were not
        axis.close()


@pytest.mark.parametrize("fault", [faults.Unplugged, faults.PowerCut])
def test_a_drive_that_is_gone_is_never_said_to_be_at_rest(
    interface: str, fault: type[Fault]
) -> None:
    with open_rig(interface, [fault(at_sync=30)]) as rig:
        axis = rig.axis()
        found = axis.open().found
        with pytest.raises((SyncUnansweredError, HeartbeatLostError)):
            rig.run(axis, 3.0, Command(Goal.ON, 10.0))
        report = axis.stop(rig.clock.now() + 1.0)
        assert not report.at_rest
        assert "standstill was not measured" in report.reason
        with pytest.raises(ConfigurationError, match="could not be given back") as caught:
            axis.close()
        for key in ("0x6007:00", "0x607D:01", "0x1017:00"):
            assert key in found
            assert key in caught.value.what


def test_a_joint_that_does_not_obey_is_not_said_to_be_at_rest(interface: str) -> None:
    fault = faults.VelocityRunaway(at_sync=60, velocity_rad_s=100.0, obeys_ramps=False)
    with open_rig(interface, [fault]) as rig:
        axis = rig.axis()
        axis.open()
        rig.enable(axis, 10.0, shown_rad_s=100.0)
        report = axis.stop(rig.clock.now() + 0.3)
        assert not report.at_rest
        assert max(abs(sample.velocity_rad_s) for sample in report.samples) > 10.0
        axis.close()


def test_a_mapping_that_does_not_stick(interface: str) -> None:
    with open_rig(interface, [faults.MapNotKept(index=0x1A00)]) as rig:
        axis = rig.axis()
        with pytest.raises((ConfigurationError, SdoError), match="TPDO1"):
            axis.open()
        axis.close()
        assert rig.values(["0x6007:00", "0x1016:01"]) == {"0x6007:00": 1, "0x1016:01": 0}


def test_a_refused_setting_is_named_and_the_rest_restored(interface: str) -> None:
    with open_rig(interface, [faults.SdoAborts(index=0x605A, code=ABSENT)]) as rig:
        axis = rig.axis()
        with pytest.raises(SdoError, match=r"quick stop option \(0x605A:00\).*no such object"):
            axis.open()
        axis.close()
        without = rig.axis(quick_stop_option=None)
        without.open()
        without.close()
