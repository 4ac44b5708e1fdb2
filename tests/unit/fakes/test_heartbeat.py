"""What the fake does when its master falls silent: object 0x6007, value by value."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager

import pytest

from fakes.heartbeat import HeartbeatConsumer, HeartbeatProducer
from fakes.specification import DriveParameters, FakeSpecification
from tests.unit.fakes.bench import MASTER, Bench, fake_bench

PERIOD_S = 0.1
STICKY = FakeSpecification(drive=DriveParameters(heartbeat_fault_sticks=True))


@contextmanager
def moving(reaction: int, specification: FakeSpecification | None = None) -> Iterator[Bench]:
    """Yield a bench at 50 rad/s whose drive watches the master's heartbeat."""
    with fake_bench(specification) as bench:
        assert bench.write(0x6007, 0, reaction, 2) == 0
        assert bench.write(0x1016, 1, MASTER << 16 | round(PERIOD_S * 1000), 4) == 0
        bench.operate()
        bench.heartbeat_s = 0.04
        bench.enable()
        assert bench.drive_at(50.0, 1.0)[-1].velocity_rad_s == pytest.approx(50.0, abs=0.5)
        assert bench.emergencies() == []
        yield bench


def silence(bench: Bench, seconds: float) -> None:
    """Let the master's program end: no heartbeat, no set-point, no SYNC."""
    bench.heartbeat_s = float("inf")
    bench.run(seconds)


@pytest.mark.parametrize(
    ("reaction", "state"), [(1, 0x08), (2, 0x40), (3, 0x40)], ids=["fault", "off", "quick-stop"]
)
def test_the_joint_stops_by_itself(reaction: int, state: int) -> None:
    with moving(reaction) as bench:
        silence(bench, 0.05)
        assert bench.drive.motor_velocity_rad_s > 49.0
        silence(bench, 3.0)
        assert bench.drive.motor_velocity_rad_s == 0.0
        assert bench.read(0x6041) & 0x4F == state
        assert bench.emergencies() == [(0x8130, 0x11)]
        assert bench.read(0x603F) == 0x8130


def test_option_zero_goes_on_moving_for_ever() -> None:
    with moving(0) as bench:
        silence(bench, 5.0)
        assert bench.drive.motor_velocity_rad_s == pytest.approx(50.0, abs=0.5)
        assert bench.read(0x6041) & 0x6F == 0x27
        assert bench.emergencies() == [(0x8130, 0x11)]


def test_an_unconfigured_consumer_goes_on_moving_too() -> None:
    """The factory state: 0x1016 is zero, whatever 0x6007 says."""
    with fake_bench() as bench:
        assert (bench.read(0x1016, 1), bench.read(0x6007)) == (0, 1)
        bench.operate()
        bench.heartbeat_s = 0.04
        bench.enable()
        bench.drive_at(50.0, 1.0)
        silence(bench, 5.0)
        assert bench.drive.motor_velocity_rad_s == pytest.approx(50.0, abs=0.5)


@pytest.mark.parametrize(("reaction", "longest_s"), [(1, 0.35), (3, 0.35)])
def test_braking_is_by_the_quick_stop_ramp(reaction: int, longest_s: float) -> None:
    with moving(reaction) as bench:
        silence(bench, PERIOD_S + longest_s)
        assert bench.drive.motor_velocity_rad_s == 0.0


def test_without_voltage_it_only_coasts() -> None:
    with moving(2) as bench:
        silence(bench, PERIOD_S + 0.35)
        assert 10.0 < bench.drive.motor_velocity_rad_s < 45.0


def test_old_set_points_do_not_restart_a_stopped_joint() -> None:
    """SYNC and set-points from the kernel go on while the supervision hangs."""
    with moving(3) as bench:
        bench.heartbeat_s = float("inf")
        bench.drive_at(50.0, 3.0)
        assert bench.drive.motor_velocity_rad_s == 0.0


def test_watching_begins_with_the_first_heartbeat() -> None:
    with fake_bench() as bench:
        bench.write(0x1016, 1, MASTER << 16 | 50, 4)
        bench.run(1.0)
        assert bench.emergencies() == []
        bench.send(0x700 + MASTER, b"\x05")
        bench.run(1.0)
        assert [code for code, _ in bench.emergencies()] == [0x8130]


def test_another_nodes_heartbeat_does_not_count() -> None:
    with moving(3) as bench:
        bench.heartbeat_s = float("inf")
        for _ in range(300):
            bench.send(0x700 + MASTER - 1, b"\x05")
            bench.step(0.01)
        assert bench.drive.motor_velocity_rad_s == 0.0


def test_its_return_clears_the_error_unless_that_is_a_fault() -> None:
    with moving(3) as bench:
        silence(bench, 1.0)
        bench.heartbeat_s = 0.04
        bench.run(0.1)
        assert bench.emergencies() == [(0x8130, 0x11), (0x0000, 0x00)]
    with moving(1) as bench:
        silence(bench, 1.0)
        bench.heartbeat_s = 0.04
        bench.run(0.1)
        assert bench.emergencies() == [(0x8130, 0x11)]
        bench.controlword = 0x80
        bench.cycle()
        assert bench.cycle().status & 0x4F == 0x40


def test_a_sticky_heartbeat_fault_needs_reset_communication() -> None:
    with moving(1, STICKY) as bench:
        silence(bench, 1.0)
        bench.heartbeat_s = 0.04
        for word in (0x80, 0x00, 0x80):
            bench.write(0x6040, 0, word, 2)
        assert bench.read(0x6041) & 0x4F == 0x08
        bench.nmt(0x82)
        assert bench.read(0x6041) & 0x4F == 0x08  # the fault itself stays latched
        bench.write(0x6040, 0, 0x00, 2)
        bench.write(0x6040, 0, 0x80, 2)
        assert bench.read(0x6041) & 0x4F == 0x40


def test_node_stop_counts_as_a_lost_connection() -> None:
    with moving(3) as bench:
        bench.nmt(0x02)
        bench.run(1.0)
        assert bench.drive.motor_velocity_rad_s == 0.0
        assert bench.emergencies() == []
    with moving(1) as bench:
        bench.nmt(0x02)
        bench.run(1.0)
        bench.nmt(0x80)
        assert bench.read(0x6041) & 0x4F == 0x08
        assert bench.emergencies() == [(0x8100, 0x11)]


def test_error_behaviour_zero_leaves_operational() -> None:
    with moving(3) as bench:
        assert bench.write(0x1029, 1, 0, 1) == 0
        silence(bench, 0.5)
        assert bench.write(0x1800, 2, 5, 1) == 0  # accepted in PRE-OPERATIONAL only


def test_consumer_expires_once_and_only_beyond_its_time() -> None:
    consumer = HeartbeatConsumer()
    consumer.configure(5 << 16 | 100)
    assert not consumer.has_expired(99.0)
    consumer.seen(1.0)
    assert not consumer.has_expired(1.1)
    assert consumer.has_expired(1.1001)
    assert not consumer.has_expired(9.0)


def test_producer_of_zero_milliseconds_is_silent() -> None:
    producer = HeartbeatProducer()
    producer.configure(0, 0.0)
    assert not producer.is_due(1e9)
