"""The fake drive as a node: NMT, motion, stops, limits, errors, determinism."""

from __future__ import annotations

import math
import struct
from collections.abc import Iterator
from dataclasses import replace

import can
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from fakes.can_drive import FakeDrive
from fakes.faults import DriveFault, PowerCut
from fakes.joint import JointParameters
from fakes.specification import DriveParameters, FakeSpecification
from fakes.thermal import ThermalParameters
from tests.unit.fakes.bench import COUNTS_PER_RAD, Bench, Frame, fake_bench


@pytest.fixture
def bench() -> Iterator[Bench]:
    with fake_bench() as bench:
        yield bench


def test_switching_on_says_boot_up_and_waits_in_pre_operational(bench: Bench) -> None:
    assert bench.heard == [Frame(0x701, b"\x00")]
    assert bench.write(0x1017, 0, 100, 2) == 0
    beats = bench.run(1.0)
    assert beats == [Frame(0x701, b"\x7f")] * 10


@pytest.mark.parametrize(("command", "state"), [(0x01, 0x05), (0x02, 0x04), (0x80, 0x7F)])
def test_nmt_states_show_in_the_heartbeat(bench: Bench, command: int, state: int) -> None:
    bench.write(0x1017, 0, 10, 2)
    bench.nmt(command)
    assert Frame(0x701, bytes([state])) in bench.run(0.05)


def test_a_late_caller_gets_one_heartbeat_and_no_burst(bench: Bench) -> None:
    bench.write(0x1017, 0, 10, 2)
    assert bench.step(5.0) == [Frame(0x701, b"\x7f")]
    assert len(bench.run(0.1)) == 10


def test_nmt_to_all_and_to_others(bench: Bench) -> None:
    bench.write(0x1017, 0, 10, 2)
    bench.send(0x000, b"\x01\x02")
    assert Frame(0x701, b"\x7f") in bench.run(0.02)
    bench.send(0x000, b"\x01\x00")
    assert Frame(0x701, b"\x05") in bench.run(0.02)


def test_stopped_node_answers_nothing_but_nmt(bench: Bench) -> None:
    bench.nmt(0x02)
    assert bench.request(bytes.fromhex("4000100000000000")) is None
    bench.nmt(0x80)
    assert bench.read(0x1000) == 0x00020192


def test_reset_communication_forgets_communication_and_keeps_the_rest(bench: Bench) -> None:
    bench.operate()
    bench.write(0x6083, 0, 999, 4)
    assert bench.nmt(0x82) == [Frame(0x701, b"\x00")]
    assert bench.read(0x1A00, 0) == 1
    assert bench.read(0x1800, 1) == 0x40000181
    assert bench.read(0x6083) == 999


def test_reset_node_forgets_everything_and_takes_the_torque_away(bench: Bench) -> None:
    bench.operate()
    bench.write(0x6083, 0, 999_999, 4)
    bench.enable()
    bench.drive_at(50.0, 0.5)
    assert bench.nmt(0x81) == [Frame(0x701, b"\x00")]
    assert bench.read(0x6083) == 2_000_000
    assert bench.read(0x6041) & 0x4F == 0x40
    bench.run(3.0)
    assert bench.drive.motor_velocity_rad_s == 0.0


def test_frames_that_are_not_for_it_are_let_pass(bench: Bench) -> None:
    for frame in (
        can.Message(arbitration_id=0x601, is_extended_id=True, data=bytes(8)),
        can.Message(arbitration_id=0x601, is_extended_id=False, is_remote_frame=True, dlc=8),
        can.Message(arbitration_id=0x000, is_extended_id=False, data=b"\x01"),
        can.Message(arbitration_id=0x602, is_extended_id=False, data=b"\x40" + bytes(7)),
    ):
        bench.bus.send(frame)
    assert bench.step(0.01) == []


def test_an_idle_node_id_is_refused() -> None:
    with pytest.raises(ValueError, match="1 to 127"), fake_bench(node_id=0):
        pass


@pytest.mark.parametrize("velocity", [3.0, -40.0, 120.0])
def test_steady_velocity_is_held_and_torque_is_the_truths_friction(
    bench: Bench, velocity: float
) -> None:
    bench.operate()
    bench.enable()
    bench.drive_at(velocity, 2.5)
    answers = bench.drive_at(velocity, 1.0)
    measured = np.mean([a.velocity_rad_s for a in answers])
    torque = np.array([a.torque_nm for a in answers])
    truth = bench.drive.plant.friction
    assert measured == pytest.approx(velocity, abs=0.02)
    standard_error = 0.02 / math.sqrt(len(torque))
    assert torque.mean() == pytest.approx(truth.torque_nm(velocity), abs=4.0 * standard_error)
    assert torque.std() == pytest.approx(0.02, rel=0.2)
    way = answers[-1].position_rad - answers[0].position_rad
    assert way == pytest.approx(velocity * 0.999, rel=2e-3)
    assert answers[-1].status & 0x0400  # target reached


def test_the_profile_keeps_its_acceleration(bench: Bench) -> None:
    bench.operate()
    bench.enable()
    bench.write(0x6083, 0, round(100.0 * COUNTS_PER_RAD), 4)
    answers = bench.drive_at(100.0, 0.9)
    early, late = answers[300].velocity_rad_s, answers[800].velocity_rad_s
    assert late - early == pytest.approx(50.0, abs=1.0)


@pytest.mark.parametrize("dt_s", [0.001, 0.0003])
def test_a_move_is_as_fast_as_asked_however_finely_time_is_cut(dt_s: float) -> None:
    """Frames come when they come: where each of them was a tick, moves went at twice the speed."""
    plain = FakeSpecification()
    moving = replace(plain, drive=replace(plain.drive, supported_modes=1))
    with fake_bench(moving) as bench:
        bench.operate()
        counts = {0x6083: 200.0, 0x6084: 200.0, 0x6081: 20.0, 0x607A: 30.0}
        for index, wanted in counts.items():
            assert bench.write(index, 0, round(wanted * COUNTS_PER_RAD), 4) == 0
        assert bench.write(0x6060, 0, 1, 1) == 0
        for word in (0x06, 0x07, 0x0F, 0x1F):
            assert bench.write(0x6040, 0, word, 2) == 0
            bench.run(0.002, dt_s)
        bench.run(0.6, dt_s)
        assert bench.drive.motor_velocity_rad_s == pytest.approx(20.0, abs=1.5)
        bench.run(2.0, dt_s)
        assert bench.drive.plant.motor_position_rad == pytest.approx(30.0, abs=0.1)


def test_set_point_beyond_the_profile_limit_is_held_and_said(bench: Bench) -> None:
    bench.operate()
    bench.write(0x607F, 0, round(30.0 * COUNTS_PER_RAD), 4)
    bench.enable()
    answer = bench.drive_at(50.0, 1.0)[-1]
    assert answer.velocity_rad_s == pytest.approx(30.0, abs=0.2)
    assert answer.status & 0x0800


def test_temperature_is_sent_in_tenths_and_the_sentinel_without_a_sensor() -> None:
    warm = FakeSpecification(thermal=ThermalParameters(initial_degc=33.3))
    with fake_bench(warm) as bench:
        bench.operate()
        assert bench.cycle().temperature_degc == pytest.approx(33.3)
    blind = FakeSpecification(thermal=ThermalParameters(has_sensor=False))
    with fake_bench(blind) as bench:
        bench.operate()
        assert bench.cycle().temperature_degc == pytest.approx(-3276.8)


def test_quick_stop_brakes_on_its_own_ramp_and_switches_off(bench: Bench) -> None:
    bench.operate()
    bench.enable()
    bench.drive_at(100.0, 1.0)
    bench.controlword = 0x02
    answers = bench.drive_at(100.0, 0.5)
    ramp = 4_000_000 / COUNTS_PER_RAD
    stopped = next(i for i, a in enumerate(answers) if abs(a.velocity_rad_s) < 1.0)
    assert stopped * 1e-3 == pytest.approx(100.0 / ramp, abs=0.03)
    assert answers[5].status & 0x6F == 0x07
    assert answers[-1].status & 0x4F == 0x40
    assert bench.drive.motor_velocity_rad_s == 0.0


def test_halt_stops_and_lets_go_on(bench: Bench) -> None:
    bench.operate()
    bench.enable()
    bench.drive_at(30.0, 0.5)
    bench.controlword = 0x010F
    halted = bench.drive_at(30.0, 1.0)[-1]
    assert abs(halted.velocity_rad_s) < 0.1
    assert halted.status & 0x6F == 0x27
    bench.controlword = 0x0F
    assert bench.drive_at(30.0, 1.0)[-1].velocity_rad_s == pytest.approx(30.0, abs=0.2)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize(("velocity", "limit"), [(5.0, 5.0), (60.0, 40.0), (150.0, 100.0)])
def test_it_stops_in_front_of_a_software_limit_and_comes_back(
    bench: Bench, sign: int, velocity: float, limit: float
) -> None:
    bench.operate()
    for subindex, position in ((1, -limit), (2, limit)):
        assert bench.write(0x607D, subindex, round(position * COUNTS_PER_RAD), 4) == 0
    bench.enable()
    answers = bench.drive_at(sign * velocity, limit / velocity + 1.5)
    furthest = max(sign * a.position_rad for a in answers)
    assert limit - 2.0 < furthest <= limit
    assert answers[-1].status & 0x0800
    assert not answers[10].status & 0x0800
    assert abs(answers[-1].velocity_rad_s) < 0.1
    back = bench.drive_at(-sign * velocity, 0.5)[-1]
    assert sign * back.velocity_rad_s < -4.0
    assert not back.status & 0x0800


def test_without_software_limits_nothing_stops_it(bench: Bench) -> None:
    bench.operate()
    bench.enable()
    answer = bench.drive_at(150.0, 3.0)[-1]
    assert answer.position_rad > 300.0
    assert not answer.status & 0x0800


def test_drive_fault_is_latched_reported_and_reset_by_an_edge() -> None:
    with fake_bench(faults=[DriveFault(at_s=1.0, code=0x4210, register=0x08)]) as bench:
        bench.operate()
        bench.enable()
        bench.drive_at(50.0, 0.9)
        assert bench.emergencies() == []
        status = [a.status & 0x4F for a in bench.drive_at(50.0, 0.5)]
        assert 0x0F in status
        assert status[-1] == 0x08
        assert bench.emergencies() == [(0x4210, 0x09)]
        assert (bench.read(0x603F), bench.read(0x1001)) == (0x4210, 0x09)
        assert (bench.read(0x1003, 0), bench.read(0x1003, 1)) == (1, 0x4210)
        assert bench.cycle().status & 0x4F == 0x08  # 0x0F goes on arriving
        bench.controlword = 0x80
        bench.cycle()
        assert bench.cycle().status & 0x4F == 0x40
        assert bench.emergencies()[-1] == (0x0000, 0x00)
        assert (bench.read(0x603F), bench.read(0x1001)) == (0, 0)
        assert bench.read(0x1003, 1) == 0x4210
        assert bench.write(0x1003, 0, 0, 1) == 0
        assert bench.read(0x1003, 0) == 0


def test_emergency_can_be_switched_off_and_moved() -> None:
    with fake_bench(faults=[DriveFault(at_s=0.5)]) as bench:
        assert bench.write(0x1014, 0, 0x99, 4) == 0
        assert [f.cob_id for f in bench.run(1.0)] == [0x99]


def test_power_cut_is_silent_and_the_joint_coasts_to_rest() -> None:
    with fake_bench(faults=[PowerCut(at_s=1.0)]) as bench:
        bench.write(0x1017, 0, 10, 2)
        bench.operate()
        bench.enable()
        bench.drive_at(50.0, 0.9)
        bench.run(0.2)
        moving = bench.drive.motor_velocity_rad_s
        assert bench.run(3.0) == []
        assert moving > 20.0
        assert bench.drive.motor_velocity_rad_s == 0.0


def test_the_same_seed_and_calls_give_the_same_bytes() -> None:
    def heard(seed: int) -> list[Frame]:
        with fake_bench(seed=seed) as bench:
            bench.operate()
            bench.enable()
            bench.drive_at(20.0, 0.5)
            return bench.heard

    assert heard(7) == heard(7)
    assert heard(7) != heard(8)


@given(
    frames=st.lists(
        st.tuples(
            st.sampled_from([0x000, 0x080, 0x201, 0x301, 0x601, 0x77E, 0x123]),
            st.binary(max_size=8),
            st.floats(0.0, 0.02),
        ),
        max_size=25,
    )
)
@settings(deadline=None)
def test_no_frames_bring_it_down(frames: list[tuple[int, bytes, float]]) -> None:
    with fake_bench() as bench:
        bench.write(0x1016, 1, 0x7E << 16 | 10, 4)
        bench.operate()
        bench.enable()
        for cob_id, data, dt_s in frames:
            bench.send(cob_id, data)
            for answer in bench.step(dt_s):
                assert answer.cob_id in (0x081, 0x181, 0x281, 0x381, 0x581, 0x701)
        bench.nmt(0x81)
        assert bench.read(0x1000) == 0x00020192


def test_time_before_the_last_moves_nothing(bench: Bench) -> None:
    bench.operate()
    bench.enable()
    bench.drive_at(20.0, 0.2)
    before = bench.drive.motor_position_rad
    bench.drive.step_to(bench.now_s - 1.0)
    assert bench.drive.motor_position_rad == before


def test_a_frame_taken_by_the_caller_is_handled_alone(bench: Bench) -> None:
    bench.send(0x601, struct.pack("<BHB4x", 0x40, 0x1017, 0))
    taken = can.Message(
        arbitration_id=0x601, is_extended_id=False, data=struct.pack("<BHBI", 0x2B, 0x1017, 0, 70)
    )
    bench.drive.step_to(bench.now_s, taken)
    bench.drive.step_to(bench.now_s)  # what waits came later, and is handled at its own time
    heard = iter(lambda: bench.bus.recv(0.0), None)
    answers = [bytes(m.data).hex() for m in heard if m.arbitration_id == 0x581]
    assert answers == ["6017100000000000", "4b17100046000000"]


def test_identity_scale_and_encoder_come_from_the_specification() -> None:
    drive = DriveParameters(vendor_id=5, product_code=6, revision=7, serial=8, rated_torque_mnm=900)
    with fake_bench(FakeSpecification(drive=drive)) as bench:
        assert [bench.read(0x1018, i) for i in (1, 2, 3, 4)] == [5, 6, 7, 8]
        assert bench.read(0x6076) == 900
        bench.nmt(0x81)
        assert bench.read(0x1018, 4) == 8


def test_truth_names_what_an_estimator_should_find() -> None:
    spec = FakeSpecification(joint=replace(JointParameters(), gravity_sin_nm=0.4))
    with fake_bench(spec) as bench:
        truth = bench.drive.truth
        assert isinstance(bench.drive, FakeDrive)
        assert truth.inertia_kg_m2 == pytest.approx(0.0184)
        assert truth.gravity_sin_nm == 0.4
        assert truth.viscous_nm_s_per_rad == pytest.approx(0.0107)
        assert truth.gearbox_temperature_degc == bench.drive.gearbox_temperature_degc == 25.0
