"""What a CiA 402 axis promises beside the port's contract, on every bus.

In simulated time; what hangs on a clock that nobody steps, in real time, too.
"""

from __future__ import annotations

import math
import re
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
    IdentityError,
    IntruderError,
    NodeMissingError,
)
from drivers.ports import Command, DriveState, Goal, Sample
from fakes import faults
from fakes.specification import DriveParameters, FakeSpecification
from tests.contract.axis_rig import NODE, Rig, in_real_time, interfaces, open_rig

OFF = Command(Goal.OFF, 0.0)
ABSENT = 0x06020000
IN_EITHER_TIME = pytest.mark.parametrize(
    "interface", [*interfaces(), *in_real_time()], indirect=True
)


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


@IN_EITHER_TIME
def test_every_sample_carries_the_time_of_its_own_sync(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    sent_s: list[float] = []
    samples: list[Sample] = []
    for _ in range(50):
        sent_s.append(rig.clock.now())
        rig.send(axis, Command(Goal.ON, 20.0))
        rig.clock.sleep_until(sent_s[-1] + 0.004)
        samples += rig.receive(axis)
    report = axis.stop(rig.clock.now() + 2.0)
    axis.close()
    times_s = [sample.time_s for sample in (*samples, *report.samples)]
    # No earlier than it was asked for, and before the next one was sent.
    assert all(np.array(sent_s) <= times_s[:50])
    assert all(np.array(times_s[:49]) < sent_s[1:])
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


@IN_EITHER_TIME
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


def test_nobody_there(rig: Rig) -> None:
    axis = rig.axis(node_id=NODE + 1)
    with pytest.raises(NodeMissingError, match=f"node id {NODE + 1}"):
        axis.open()
    axis.close()


@pytest.mark.parametrize(
    ("expected", "words"),
    [
        (ExpectedIdentity(vendor_id=0x1234), "vendor id expected 4660 (0x1234), found 0 (0x0)"),
        (ExpectedIdentity(product_code=7), "product code expected 7 (0x7), found 16416 (0x4020)"),
        (ExpectedIdentity(serial=99), "serial expected 99 (0x63), found 1 (0x1)"),
    ],
)
def test_another_device_is_left_as_it_is(rig: Rig, expected: ExpectedIdentity, words: str) -> None:
    axis = rig.axis(expected=expected)
    with pytest.raises(IdentityError, match=re.escape(words)):
        axis.open()
    axis.close()
    assert rig.values(["0x1017:00", "0x6007:00"]) == {"0x1017:00": 0, "0x6007:00": 1}


def test_a_drive_that_lets_go_by_itself_is_noticed(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    rig.enable(axis, 5.0)
    # an enabling switch does the same; sent by our own owner, it is nobody else's
    rig.owner.send(0x600 + NODE, bytes.fromhex("2b40600000000000"))
    with pytest.raises(DriveStateError, match="left operation enabled by itself"):
        rig.run(axis, 1.0, Command(Goal.ON, 5.0))
    with pytest.raises(DriveStateError, match="left operation enabled"):
        rig.send(axis, Command(Goal.ON, 5.0))
    axis.close()


def test_another_program_may_read_the_drive_beside_us(rig: Rig) -> None:
    """Its answers come under the identifier of ours, about the very object that we ask for, too."""
    for others in ("4300100092010200", "8000100000000206", "4318100192010200"):
        with rig.sdo() as sdo:
            vendor_id = sdo.read(objects.VENDOR_ID)
            rig.inject(0x580 + NODE, bytes.fromhex(others))
            assert sdo.read(objects.VENDOR_ID) == vendor_id


@pytest.mark.parametrize(
    ("cob_id", "data", "words"),
    [
        (0x080, b"", "sends SYNC"),
        (0x77F, b"\x05", "sends the heartbeat of node 127, which is ours"),
        (0x200 + NODE, bytes(6), f"sends orders to the drive at node {NODE}"),
        (
            0x600 + NODE,
            bytes.fromhex("2385600001000000"),  # how hard a quick stop brakes
            f"sends settings to the drive at node {NODE}",
        ),
    ],
    ids=["SYNC", "heartbeat", "orders", "settings"],
)
def test_one_frame_that_only_we_may_send_is_noticed(
    rig: Rig, cob_id: int, data: bytes, words: str
) -> None:
    axis = rig.axis()
    axis.open()
    rig.run(axis, 0.05, OFF)
    rig.inject(cob_id, data)
    with pytest.raises(IntruderError, match=words):
        rig.run(axis, 1.0, OFF)
    axis.close()


@pytest.mark.parametrize("interface", in_real_time(), indirect=True)
def test_somebody_else_is_heard_by_a_reader_of_its_own_too(rig: Rig) -> None:
    axis = rig.axis()
    axis.open()
    rig.inject(0x77F, b"\x05")
    with pytest.raises(IntruderError, match="heartbeat of node 127"):
        rig.run(axis, 1.0, OFF)
    axis.close()


def test_who_finds_another_agent_at_work_leaves_everything_as_it_is() -> None:
    with open_rig("virtual") as rig:
        first, second = rig.axis(), rig.axis()
        found = first.open().found
        first.close()
        rig.inject(0x77F, b"\x05")
        with pytest.raises(IntruderError, match="heartbeat of node 127"):
            second.open()
        assert not second._found  # nothing was written, so nothing is to be given back
        second.close()
        assert rig.values(found) == found
        rig.inject(0x77F, b"\x05")
        with pytest.raises(IntruderError):  # a journal that two computers share is no crash's
            restore(rig.owner, rig.config, rig.clock, {**found, "0x6083:00": 1})
        assert rig.values(found) == found


@IN_EITHER_TIME
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


def test_another_rated_torque_than_configured_is_refused(interface: str) -> None:
    drive = FakeSpecification(drive=DriveParameters(rated_torque_mnm=4000))
    with open_rig(interface, specification=drive) as rig:
        axis = rig.axis()
        with pytest.raises(ConfigurationError, match=r"4\.0 N m.*5\.0 N m"):
            axis.open()
        axis.close()


@pytest.mark.parametrize(
    ("low", "high", "wider"),
    [
        (0, 0, False),  # the drive has none
        (-41_721_512, 41_721_512, False),  # to the count, rounded by others
        (-41_721_511, 41_721_512, True),
        (-41_721_512, 41_721_511, True),
        (-400, 400, True),
    ],
)
def test_software_limits_that_somebody_has_drawn_narrower_are_not_overwritten(
    low: int, high: int, wider: bool
) -> None:
    with open_rig("virtual") as rig:
        with rig.sdo() as sdo:
            sdo.set(objects.SOFTWARE_LIMIT_MIN, low)
            sdo.set(objects.SOFTWARE_LIMIT_MAX, high)
        axis = rig.axis(software_limits_rad=(-4000.0, 4000.0))
        if wider:
            with pytest.raises(ConfigurationError, match=f"{low} to {high} counts"):
                axis.open()
        else:
            axis.open()
        axis.close()
        assert rig.values(("0x607D:01", "0x607D:02")) == {"0x607D:01": low, "0x607D:02": high}


@pytest.mark.parametrize(
    ("index", "subindex", "code"),
    [(0x6076, 0, ABSENT), (0x6502, 0, ABSENT), (0x6091, 1, 0x08000000)],
)
def test_what_many_drives_lack_is_not_asked_of_them(
    interface: str, index: int, subindex: int, code: int
) -> None:
    with open_rig(interface, [faults.SdoAborts(index=index, subindex=subindex, code=code)]) as rig:
        axis = rig.axis()
        evidence = axis.open()
        assert evidence.settings["0x6007:00"] == 3
        axis.close()
