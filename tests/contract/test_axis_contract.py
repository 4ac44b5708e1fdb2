"""What every axis must do on every bus: `virtual` stepped, the others in real time."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import replace

import numpy as np
import pytest

from drivers.cia402 import objects
from drivers.cia402.axis import Cia402Axis
from drivers.cia402.config import ExpectedIdentity
from drivers.cia402.handing_back import restore
from drivers.cia402.words import State, state_of
from drivers.errors import (
    ConfigurationError,
    DriveFaultError,
    DriverError,
    DriveStateError,
    HeartbeatLostError,
    IdentityError,
    NodeMissingError,
    SdoError,
    SyncUnansweredError,
)
from drivers.ports import Axis, AxisEvidence, Command, DriveState, Goal, Sample, SyncAccount
from fakes import faults
from fakes.specification import DriveParameters, FakeSpecification
from tests.contract.axis_rig import NODE, VIRTUAL, Rig, interfaces, open_rig

OFF = Command(Goal.OFF, 0.0)
ABSENT = 0x06020000


@pytest.fixture(params=interfaces())
def interface(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def rig(interface: str) -> Iterator[Rig]:
    with open_rig(interface) as made:
        yield made


def statusword(rig: Rig) -> State | None:
    with rig.sdo() as sdo:
        return state_of(sdo.read(objects.STATUSWORD))


def test_opening_identifies_arms_and_leaves_the_drive_without_torque(rig: Rig) -> None:
    axis = rig.axis()
    evidence = axis.open()
    assert evidence.identity["product_code"] == 0x4020
    assert evidence.identity["serial"] == 1
    assert evidence.settings["0x6007:00"] == 3
    assert evidence.settings["0x1016:01"] == 127 << 16 | rig.config.agent_heartbeat_timeout_ms
    assert evidence.settings["0x6061:00"] == rig.rung.mode
    assert evidence.found["0x1016:01"] == 0
    assert evidence.found["0x6007:00"] == 1
    samples = rig.run(axis, 0.05, OFF)
    assert {sample.state for sample in samples} == {DriveState.OFF}
    axis.close()


def test_the_axis_is_the_port(rig: Rig) -> None:
    port: Axis = rig.axis()
    assert isinstance(port.open(), AxisEvidence)
    assert isinstance(port.close(), SyncAccount)


def test_a_velocity_is_reached_and_every_sync_is_answered(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    sent_s: list[float] = []
    samples: list[Sample] = []
    for _ in range(100):
        sent_s.append(rig.clock.now())
        rig.send(axis, Command(Goal.ON, 20.0))
        rig.clock.sleep_until(sent_s[-1] + 0.004)
        samples += rig.receive(axis)
    report = axis.stop(rig.clock.now() + 2.0)
    assert report.at_rest, report.reason
    account = axis.close()
    assert account.lost == 0
    assert account.received == account.expected >= 100
    times_s = [sample.time_s for sample in (*samples, *report.samples)]
    # Every sample carries its own SYNC's time: no earlier, and before the next one was sent.
    assert all(np.array(sent_s) <= times_s[:100])
    assert all(np.array(times_s[:99]) < sent_s[1:])
    assert all(sample.received_s >= sample.time_s for sample in samples)
    assert samples[-1].state is DriveState.ON
    assert samples[-1].velocity_rad_s == pytest.approx(20.0, abs=0.5)
    moved_rad = samples[-1].position_rad - samples[-26].position_rad
    assert moved_rad == pytest.approx(20.0 * (samples[-1].time_s - samples[-26].time_s), rel=0.1)
    assert 0.0 < samples[-1].torque_nm < 5.0
    assert samples[-1].gearbox_temperature_degc == pytest.approx(25.0, abs=5.0)


def test_direction_and_zero_turn_the_whole_axis(rig: Rig) -> None:
    scaling = rig.config.scaling
    turned = type(scaling)(
        encoder_counts_per_motor_rev=scaling.encoder_counts_per_motor_rev,
        rated_torque_nm=scaling.rated_torque_nm,
        direction=-1,
        zero_position_counts=65536,
    )
    axis = rig.axis(scaling=turned)
    axis.open()
    first = rig.run(axis, 0.02, OFF)[0]
    assert first.position_rad == pytest.approx(math.tau, abs=0.1)
    rig.enable(axis, 20.0)
    last = rig.run(axis, 0.3, Command(Goal.ON, 20.0))[-1]
    assert last.velocity_rad_s == pytest.approx(20.0, abs=0.5)
    assert last.position_rad > first.position_rad
    assert last.torque_nm > 0.0
    axis.stop(rig.clock.now() + 2.0)
    axis.close()


def test_a_stop_is_a_measured_standstill(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    rig.enable(axis, 60.0)
    report = axis.stop(rig.clock.now() + 2.0)
    assert report.at_rest, report.reason
    speeds = [abs(sample.velocity_rad_s) for sample in report.samples]
    assert max(speeds) > 30.0
    assert max(speeds[-5:]) <= rig.config.rest_velocity_rad_s
    assert report.samples[-1].state is not DriveState.ON
    axis.close()


def test_closing_restores_every_object_and_may_be_repeated(rig: Rig) -> None:
    axis = rig.axis()
    found = dict(axis.open().found)
    rig.enable(axis, 20.0)
    axis.stop(rig.clock.now() + 2.0)
    account = axis.close()
    assert axis.close() == account
    assert rig.values(found) == found
    assert statusword(rig) is State.SWITCH_ON_DISABLED


def test_closing_takes_torque_away_even_without_a_stop(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    rig.enable(axis, 5.0)
    axis.close()
    assert statusword(rig) is State.SWITCH_ON_DISABLED


def test_an_axis_that_is_closed_does_nothing(rig: Rig) -> None:
    axis = rig.axis()
    report = axis.stop(rig.clock.now() + 0.1)
    assert not report.at_rest
    assert axis.close() == SyncAccount()
    for call in (axis.open, axis.receive, lambda: axis.send(OFF)):
        with pytest.raises(DriveStateError):
            call()


@pytest.mark.parametrize("velocity_rad_s", [math.nan, math.inf, -math.inf])
def test_a_velocity_that_is_no_number_never_leaves(rig: Rig, velocity_rad_s: float) -> None:
    axis = rig.axis()
    axis.open()
    with pytest.raises(ValueError, match="finite"):
        axis.send(Command(Goal.ON, velocity_rad_s))
    axis.send(Command(Goal.OFF, velocity_rad_s))  # ignored unless the goal is ON
    axis.close()


def test_nobody_there(rig: Rig) -> None:
    axis = rig.axis(node_id=NODE + 1)
    with pytest.raises(NodeMissingError, match=f"node id {NODE + 1}"):
        axis.open()
    axis.close()


@pytest.mark.parametrize(
    ("expected", "words"),
    [
        (ExpectedIdentity(vendor_id=0x1234), "vendor id expected 0x1234, found 0x0"),
        (ExpectedIdentity(product_code=7), "product code expected 0x7, found 0x4020"),
        (ExpectedIdentity(serial=99), "serial expected 0x63, found 0x1"),
    ],
)
def test_another_device_is_left_as_it_is(rig: Rig, expected: ExpectedIdentity, words: str) -> None:
    axis = rig.axis(expected=expected)
    with pytest.raises(IdentityError, match=words):
        axis.open()
    axis.close()
    assert rig.values(["0x1017:00", "0x6007:00"]) == {"0x1017:00": 0, "0x6007:00": 1}


def test_another_master_that_takes_torque_away_is_noticed(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    rig.enable(axis, 5.0)
    rig.inject(0x200 + NODE, b"\x00\x00\x00\x00\x00\x00")
    with pytest.raises(DriveStateError, match="left operation enabled by itself"):
        rig.run(axis, 1.0, Command(Goal.ON, 5.0))
    with pytest.raises(DriveStateError, match="left operation enabled"):
        rig.send(axis, Command(Goal.ON, 5.0))
    axis.close()


def test_a_goal_that_is_taken_back_is_no_surprise(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    rig.enable(axis, 0.0)
    samples = rig.run(axis, 0.5, OFF)
    assert samples[-1].state is DriveState.OFF
    rig.enable(axis, 0.0)
    axis.close()


def test_a_second_sync_producer_is_noticed(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()

    def share_the_bus() -> None:
        for _ in range(100):
            axis.send(OFF)
            rig.inject(0x080, b"")
            axis.receive()

    with pytest.raises(SyncUnansweredError, match="no SYNC of ours"):
        share_the_bus()
    axis.close()


def test_a_caller_that_hangs_is_missed_by_the_drive(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    rig.enable(axis, 30.0)
    rig.clock.sleep_until(rig.clock.now() + rig.config.agent_heartbeat_timeout_s + 0.5)
    with pytest.raises(DriverError) as caught:
        axis.receive()
    assert isinstance(caught.value, DriveFaultError)
    assert caught.value.error_code == 0x8130
    report = axis.stop(rig.clock.now() + 1.0)
    axis.close()
    assert report.at_rest, report.reason
    assert statusword(rig) is not State.ENABLED


def test_a_drive_found_operational_is_left_operational(rig: Rig) -> None:
    rig.inject(0x000, bytes([0x01, NODE]))
    axis = rig.axis()
    found = dict(axis.open().found)
    axis.close()
    rig.inject(0x200 + NODE, b"\x06\x00")  # its own factory RPDO1: acts in OPERATIONAL only
    assert statusword(rig) is State.READY
    assert rig.values(found) == found


def test_nothing_is_restored_into_another_device(rig: Rig) -> None:
    axis = rig.axis()
    found = axis.open().found
    axis.close()
    other = replace(rig.config, expected=ExpectedIdentity(serial=99))
    with pytest.raises(IdentityError):
        restore(rig.owner, other, rig.clock, {**found, "0x6007:00": 2})
    assert rig.values(["0x6007:00"]) == {"0x6007:00": 1}


def test_what_a_crash_left_can_be_restored(rig: Rig) -> None:
    kept: dict[str, int] = {}
    crashed = Cia402Axis(rig.owner, rig.config, rig.clock, journal=kept.update)
    evidence = crashed.open()
    assert kept == evidence.found
    assert crashed._exchange is not None
    crashed._exchange.release()  # as if the process had gone: nothing is closed
    assert crashed._node is not None
    crashed._node.release()
    assert rig.values(["0x6007:00"]) == {"0x6007:00": 3}
    restore(rig.owner, rig.config, rig.clock, kept)
    assert rig.values(kept) == kept


class TestFaults:
    """The drive or the bus misbehaves."""

    def test_a_fault_is_told_with_its_code_and_latched(self, interface: str) -> None:
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
            if interface == VIRTUAL:  # elsewhere the emergency may outrun the sample
                assert report.samples[0].time_s < began_s  # what the error kept back is not lost
            axis.close()
            assert statusword(rig) is State.FAULT  # nobody has cleared it

    def test_a_drive_found_in_fault_is_left_to_a_person(self, interface: str) -> None:
        with open_rig(interface, [faults.DriveFault(at_s=0.0, code=0x4210)]) as rig:
            axis = rig.axis()
            with pytest.raises(DriveFaultError, match=r"0x4210 \(drive too hot\)") as caught:
                axis.open()
            assert "person" in caught.value.do
            axis.close()
            assert statusword(rig) is State.FAULT
            assert rig.values(["0x1017:00"]) == {"0x1017:00": 0}

    def test_a_heartbeat_that_stops(self, interface: str) -> None:
        with open_rig(interface, [faults.HeartbeatStops(at_sync=20)]) as rig:
            axis = rig.axis()
            axis.open()
            with pytest.raises(HeartbeatLostError, match=f"node {NODE}"):
                rig.run(axis, rig.config.drive_heartbeat_timeout_s + 1.0, OFF)
            axis.close()

    def test_one_lost_answer_is_counted_and_shifts_nobody(self, interface: str) -> None:
        with open_rig(interface, [faults.SwallowSync(at_sync=30, count=1)]) as rig:
            axis = rig.axis()
            axis.open()
            rig.run(axis, 0.4 + rig.config.sync_timeout_s, OFF)
            account = axis.close()
            assert account.lost == 1
            assert account.received == account.expected - 1

    def test_a_drive_that_stops_answering(self, interface: str) -> None:
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
        self, interface: str, fault: type[faults.Fault]
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

    def test_a_joint_that_does_not_obey_is_not_said_to_be_at_rest(self, interface: str) -> None:
        fault = faults.VelocityRunaway(at_sync=60, velocity_rad_s=100.0, obeys_ramps=False)
        with open_rig(interface, [fault]) as rig:
            axis = rig.axis()
            axis.open()
            rig.enable(axis, 10.0, shown_rad_s=100.0)
            report = axis.stop(rig.clock.now() + 0.3)
            assert not report.at_rest
            assert max(abs(sample.velocity_rad_s) for sample in report.samples) > 10.0
            axis.close()

    def test_a_mapping_that_does_not_stick(self, interface: str) -> None:
        with open_rig(interface, [faults.MapNotKept(index=0x1A00)]) as rig:
            axis = rig.axis()
            with pytest.raises((ConfigurationError, SdoError), match="TPDO1"):
                axis.open()
            axis.close()
            assert rig.values(["0x6007:00", "0x1016:01"]) == {"0x6007:00": 1, "0x1016:01": 0}

    def test_a_refused_setting_is_named_and_the_rest_restored(self, interface: str) -> None:
        with open_rig(interface, [faults.SdoAborts(index=0x605A, code=ABSENT)]) as rig:
            axis = rig.axis()
            with pytest.raises(SdoError, match=r"quick stop option \(0x605A:00\).*no such object"):
                axis.open()
            axis.close()
            without = rig.axis(quick_stop_option=None)
            without.open()
            without.close()


def test_another_rated_torque_than_configured_is_refused(interface: str) -> None:
    drive = FakeSpecification(drive=DriveParameters(rated_torque_mnm=4000))
    with open_rig(interface, specification=drive) as rig:
        axis = rig.axis()
        with pytest.raises(ConfigurationError, match=r"4\.0 N m.*5\.0 N m"):
            axis.open()
        axis.close()


@pytest.mark.parametrize("index", [0x6076, 0x6502])
def test_what_many_drives_lack_is_not_asked_of_them(interface: str, index: int) -> None:
    with open_rig(interface, [faults.SdoAborts(index=index, code=ABSENT)]) as rig:
        axis = rig.axis()
        evidence = axis.open()
        assert evidence.settings["0x6007:00"] == 3
        axis.close()
