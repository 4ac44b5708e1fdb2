"""The drive's watchdog is proven before the first motion, whatever way a drive reacts in."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import pytest

from agent.errors import RefusedError, StoppedError
from drivers.cia402.axis import Cia402Axis
from drivers.errors import DriveFaultError, DriveStateError
from drivers.ports import Command, DriveState, Goal, WatchdogProof
from fakes import faults
from fakes.heartbeat import HeartbeatConsumer
from fakes.specification import DriveParameters, FakeSpecification
from fakes.state_machine import State
from tests.contract.axis_rig import MULTICAST, VIRTUAL, Rig, open_rig
from tests.system.rig import rig as cell_rig

OFF = Command(Goal.OFF, 0.0)
FAULT, IGNORE = 1, 0
"""What the drive does about a lost connection where 0x6007 is left as its factory set it."""

AMID_THE_PROOF_S = 1
UNITS = ".simulated-joint-axis1.units.json"
"""What a cycle that begins leaves beside its recording: in what the drive counts."""


def is_enabled(rig: Rig) -> bool:
    assert rig.drive is not None
    return rig.drive.machine.state is State.OPERATION_ENABLED


def prove(rig: Rig, axis: Cia402Axis, watch: Callable[[], None] = lambda: None) -> WatchdogProof:
    """Prove as the runner does: on a drive that is heard without torque."""
    rig.run(axis, 0.1, OFF)
    return axis.prove_watchdog(still_rad_s=20.0, patience_s=2.0, watch=watch)


def drive_with(option: int, *, sticks: bool = False) -> FakeSpecification:
    return FakeSpecification(
        drive=DriveParameters(abort_connection_option=option, heartbeat_fault_sticks=sticks)
    )


def assert_ready(rig: Rig, axis: Cia402Axis) -> None:
    """See that the proof has left a drive that can be driven, stopped and given back."""
    assert rig.drive is not None
    assert rig.run(axis, 0.02, OFF)[-1].state is DriveState.OFF
    assert rig.enable(axis, 20.0).state is DriveState.ON
    assert axis.stop(rig.clock.now() + 2.0).at_rest
    account = axis.close()
    assert account.received == account.expected
    assert account.longest_gap_s < 0.02, "the silence is part of the recording's account"


def test_a_drive_that_reacts_is_timed_and_ready_again() -> None:
    with open_rig(VIRTUAL) as rig:
        axis, enabled = rig.axis(), list[bool]()
        found = axis.open().found
        proof = prove(rig, axis, lambda: enabled.append(is_enabled(rig)))
        assert True in enabled, "nothing is proven without torque"
        assert proof.reacted
        assert proof.emergencies == ("0x8130",)
        assert proof.recovery == "start"
        assert proof.timeout_s == rig.config.agent_heartbeat_timeout_s
        limit_s = proof.timeout_s + rig.config.agent_heartbeat_period_s
        assert proof.timeout_s - 0.01 < proof.still_enabled_s < proof.reaction_s < limit_s
        assert proof.reaction_s - proof.still_enabled_s < 0.01
        assert_ready(rig, axis)
        assert rig.values(found) == found


@pytest.mark.real_time
def test_the_same_in_real_time_on_a_network() -> None:
    with open_rig(MULTICAST) as rig:
        axis = rig.axis()
        axis.open()
        proof = prove(rig, axis)
        assert proof.reacted
        assert proof.reaction_s > proof.timeout_s - 0.01
        axis.close()


@pytest.mark.parametrize(
    ("sticks", "recovery"), [(False, "fault reset"), (True, "reset communication")]
)
def test_the_fault_that_the_proof_provokes_is_cleared_as_the_drive_needs(
    sticks: bool, recovery: str
) -> None:
    with open_rig(VIRTUAL, specification=drive_with(FAULT, sticks=sticks)) as rig:
        axis = rig.axis(abort_connection_option=None)
        evidence = axis.open()
        proof = prove(rig, axis)
        assert (proof.reacted, proof.recovery) == (True, recovery)
        assert proof.state in ("fault", "fault reaction active")
        watch = evidence.settings["0x1016:01"]
        assert rig.drive is not None
        assert rig.drive.dictionary.number(0x1016, 1) == watch, "it watches us as before"
        assert_ready(rig, axis)
        assert rig.values(evidence.found) == evidence.found


@pytest.mark.parametrize("behaviour", [1, 2], ids=["stays operational", "goes stopped"])
def test_whatever_nmt_state_the_drive_goes_to(behaviour: int) -> None:
    with open_rig(VIRTUAL) as rig:
        assert rig.drive is not None
        rig.drive.dictionary.set_factory(0x1029, 1, behaviour)
        axis = rig.axis()
        axis.open()
        assert prove(rig, axis).reacted
        assert_ready(rig, axis)


def test_a_drive_that_only_complains_has_not_reacted() -> None:
    """It sends EMCY 0x8130 and keeps its torque: the state decides, not the message."""
    with open_rig(VIRTUAL, specification=drive_with(IGNORE)) as rig:
        axis = rig.axis(abort_connection_option=None)
        axis.open()
        proof = prove(rig, axis)
        assert not proof.reacted
        assert proof.emergencies == ("0x8130",)
        assert proof.still_enabled_s > proof.timeout_s
        assert_ready(rig, axis)


def test_another_fault_than_the_provoked_one_stays() -> None:
    with open_rig(VIRTUAL, [faults.DriveFault(at_s=AMID_THE_PROOF_S)]) as rig:
        axis, enabled = rig.axis(), list[bool]()
        axis.open()
        with pytest.raises(DriveFaultError, match="0x4210"):
            prove(rig, axis, lambda: enabled.append(is_enabled(rig)))
        assert True in enabled
        assert axis.stop(rig.clock.now() + 2.0).at_rest
        axis.close()
        with pytest.raises(DriveFaultError, match="0x4210"):
            rig.axis().open()


def test_a_joint_that_moves_ends_the_proof() -> None:
    runaway = faults.VelocityRunaway(at_s=AMID_THE_PROOF_S, velocity_rad_s=60.0)
    with open_rig(VIRTUAL, [runaway]) as rig:
        axis, enabled = rig.axis(), list[bool]()
        axis.open()
        with pytest.raises(DriveStateError, match="moves at"):
            prove(rig, axis, lambda: enabled.append(is_enabled(rig)))
        assert True in enabled
        assert axis.stop(rig.clock.now() + 2.0).at_rest
        axis.close()


def test_a_stop_is_heard_during_the_proof_and_takes_the_torque_away(tmp_path: Path) -> None:
    with cell_rig(tmp_path) as bench:

        def press_stop(stage: str, _share: float) -> None:
            if stage == "prove":
                bench.stop_reason = "the operator asked for it"

        with pytest.raises(StoppedError, match="before anything moved: the operator"):
            bench.run(progress=press_stop)
        assert bench.drive.machine.state is State.SWITCH_ON_DISABLED
    assert [p.name for p in tmp_path.iterdir()] == [UNITS]


def test_a_drive_that_takes_the_settings_and_does_not_watch_is_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(HeartbeatConsumer, "has_expired", lambda _self, _now_s: False)
    with cell_rig(tmp_path) as bench:
        with pytest.raises(RefusedError, match="bounded moves") as refused:
            bench.run()
        assert len(refused.value.reasons) == 1
        assert abs(bench.drive.motor_position_rad) < 0.01
        assert bench.drive.machine.state is State.SWITCH_ON_DISABLED
    assert [p.name for p in tmp_path.iterdir()] == [UNITS]
