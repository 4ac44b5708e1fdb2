"""Every scripted fault, as the bus sees it."""

from __future__ import annotations

import struct
from dataclasses import FrozenInstanceError, fields

import pytest

from fakes.fault import Fault
from fakes.faults import (
    KINDS,
    DriveFault,
    FaultPlayer,
    FrozenPosition,
    HeartbeatStops,
    MapNotKept,
    SdoAborts,
    SdoSilent,
    SwallowSync,
    TemperatureSentinel,
    Unplugged,
    VelocityRunaway,
    WrongIdentity,
    fault_from_mapping,
)
from tests.unit.fakes.bench import MASTER, fake_bench


def test_swallowed_syncs_are_counted_exactly_and_set_points_still_act() -> None:
    with fake_bench(faults=[SwallowSync(at_sync=11, count=3)]) as bench:
        bench.operate()
        answered = []
        for number in range(1, 21):
            bench.controlword = 0x06 if number == 12 else bench.controlword
            frames = bench.sync()
            answered += [number] if any(f.cob_id == 0x181 for f in frames) else []
        assert answered == [*range(1, 11), *range(14, 21)]
        assert bench.cycle().status & 0x6F == 0x21


def test_a_stopped_heartbeat_leaves_everything_else_alive() -> None:
    with fake_bench(faults=[HeartbeatStops(at_s=0.5)]) as bench:
        bench.write(0x1017, 0, 10, 2)
        assert len(bench.run(0.495)) == 49
        assert len(bench.run(1.0)) <= 1
        assert bench.read(0x1000) == 0x00020192


def test_unplugged_is_silent_and_stops_by_its_own_watchdog() -> None:
    with fake_bench(faults=[Unplugged(at_s=1.0)]) as bench:
        bench.write(0x6007, 0, 3, 2)
        bench.write(0x1016, 1, MASTER << 16 | 100, 4)
        bench.operate()
        bench.heartbeat_s = 0.04
        bench.enable()
        bench.drive_at(50.0, 0.9)
        bench.run(0.15)
        assert bench.drive.motor_velocity_rad_s > 40.0
        assert bench.run(2.0) == []
        assert bench.drive.motor_velocity_rad_s == 0.0


def test_a_map_is_accepted_and_not_kept() -> None:
    with fake_bench(faults=[MapNotKept(index=0x1A00)]) as bench:
        bench.map(0x1800, 0x181, 1, [0x60640020, 0x60770010])
        assert (bench.read(0x1A00, 0), bench.read(0x1A00, 1)) == (1, 0x60410010)
        bench.map(0x1801, 0x281, 1, [0x60640020])
        assert bench.read(0x1A01, 1) == 0x60640020


def test_a_wrong_identity_survives_reset() -> None:
    with fake_bench(faults=[WrongIdentity(vendor_id=0x1234, product_code=0x5678)]) as bench:
        assert (bench.read(0x1018, 1), bench.read(0x1018, 2)) == (0x1234, 0x5678)
        bench.nmt(0x81)
        assert bench.read(0x1018, 1) == 0x1234


def test_an_object_that_aborts_does_so_for_reads_and_writes() -> None:
    with fake_bench(faults=[SdoAborts(index=0x6083, code=0x08000020)]) as bench:
        assert bench.read_abort(0x6083) == 0x08000020
        assert bench.write(0x6083, 0, 5, 4) == 0x08000020
        assert bench.write(0x6084, 0, 5, 4) == 0


def test_an_object_that_is_silent_answers_again_after_its_count() -> None:
    upload = struct.pack("<BHB4x", 0x40, 0x1018, 1)
    with fake_bench(faults=[SdoSilent(index=0x1018, subindex=1, count=2)]) as bench:
        assert [bench.request(upload) is None for _ in range(4)] == [True, True, False, False]
    with fake_bench(faults=[SdoSilent(index=0x1018, subindex=1)]) as bench:
        assert all(bench.request(upload) is None for _ in range(20))
        assert bench.read(0x1018, 2) == 0x4020


def test_a_runaway_ignores_the_set_point_but_brakes() -> None:
    with fake_bench(faults=[VelocityRunaway(at_s=1.0, velocity_rad_s=200.0)]) as bench:
        bench.operate()
        bench.enable()
        assert bench.drive_at(10.0, 0.9)[-1].velocity_rad_s < 11.0
        assert bench.drive_at(10.0, 1.0)[-1].velocity_rad_s > 150.0
        bench.controlword = 0x02
        assert bench.drive_at(0.0, 1.0)[-1].velocity_rad_s == pytest.approx(0.0, abs=0.1)


def test_a_runaway_without_ramps_only_obeys_disable_voltage() -> None:
    fault = VelocityRunaway(at_s=0.5, velocity_rad_s=100.0, obeys_ramps=False)
    with fake_bench(faults=[fault]) as bench:
        bench.operate()
        bench.enable()
        bench.drive_at(10.0, 1.5)
        bench.controlword = 0x02
        assert bench.drive_at(0.0, 1.0)[-1].velocity_rad_s > 90.0
        bench.controlword = 0x00
        assert bench.drive_at(0.0, 4.0)[-1].velocity_rad_s == pytest.approx(0.0, abs=0.1)


def test_a_frozen_position_stands_while_the_joint_moves() -> None:
    with fake_bench(faults=[FrozenPosition(at_sync=500)]) as bench:
        bench.operate()
        bench.enable()
        answers = bench.drive_at(20.0, 1.0)
        assert answers[400].position_rad != answers[450].position_rad
        assert len({a.position_rad for a in answers[500:]}) == 1
        assert answers[-1].velocity_rad_s == pytest.approx(20.0, abs=0.2)


def test_the_temperature_turns_into_its_sentinel() -> None:
    with fake_bench(faults=[TemperatureSentinel(at_sync=3)]) as bench:
        bench.operate()
        temperatures = [bench.cycle().temperature_degc for _ in range(4)]
        assert temperatures == pytest.approx([25.0, 25.0, -3276.8, -3276.8])


def test_a_fault_strikes_with_the_sync_it_names() -> None:
    with fake_bench(faults=[DriveFault(at_sync=5)]) as bench:
        bench.operate()
        status = [bench.cycle().status & 0x4F for _ in range(6)]
        assert status == [0x40, 0x40, 0x40, 0x40, 0x08, 0x08]


def test_the_player_hands_each_fault_out_once() -> None:
    early, late = HeartbeatStops(at_s=1.0), SwallowSync(at_sync=10)
    player = FaultPlayer([late, early])
    assert player.begin(0.9, 9) == []
    assert player.begin(1.0, 9) == [early]
    assert player.begin(2.0, 12) == [late]
    assert player.begin(9.0, 99) == []


@pytest.mark.parametrize("kind", sorted(KINDS))
def test_every_fault_is_made_from_a_mapping_and_frozen(kind: str) -> None:
    needed = {"index": 0x6083} if "index" in {f.name for f in fields(KINDS[kind])} else {}
    fault = fault_from_mapping({"kind": kind, "at_sync": 7} | needed)
    assert isinstance(fault, KINDS[kind])
    assert fault.at_sync == 7
    with pytest.raises(FrozenInstanceError):
        fault.at_sync = 8  # type: ignore[misc]  # frozen: refused


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({}, "expected one of"),
        ({"kind": "gremlin"}, "gremlin"),
        ({"kind": "swallow-sync", "at_time": 3}, "at_time"),
        ({"kind": "sdo-aborts"}, "index"),
        ({"kind": "drive-fault", "at_s": 1.0, "at_sync": 3}, "got both"),
        ({"kind": "drive-fault", "at_s": -1.0}, "at_s"),
        ({"kind": "drive-fault", "at_sync": 0}, "at_sync"),
    ],
)
def test_a_script_with_a_mistake_is_refused(data: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        fault_from_mapping(data)


def test_without_a_time_it_is_broken_from_the_start() -> None:
    assert Fault().has_begun(0.0, 0)
