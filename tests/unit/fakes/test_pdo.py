"""The fake's PDOs: the mapping protocol of real drives, transmission types, packing."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes.object_dictionary import ObjectDictionary, SdoAbortError, load_entries
from fakes.pdo import Layout
from tests.unit.fakes.bench import Bench, Frame, fake_bench

STATE, MAPPABLE, SEQUENCE = 0x08000022, 0x06040041, 0x06010003
NUMBERS = [e for e in load_entries(1) if e.pdo_mappable]


@pytest.fixture
def bench() -> Iterator[Bench]:
    with fake_bench() as bench:
        yield bench


def count(frames: list[Frame], cob_id: int) -> int:
    return sum(f.cob_id == cob_id for f in frames)


def test_mapping_is_refused_outside_pre_operational(bench: Bench) -> None:
    bench.nmt(0x01)
    assert bench.write(0x1800, 1, 0xC0000181, 4) == STATE
    assert bench.write(0x1A00, 0, 0, 1) == STATE
    assert bench.write(0x1600, 1, 0x60FF0020, 4) == STATE
    bench.nmt(0x80)
    assert bench.write(0x1800, 1, 0xC0000181, 4) == 0


def test_mapping_is_refused_in_the_wrong_order(bench: Bench) -> None:
    assert bench.write(0x1A00, 0, 0, 1) == STATE  # the PDO is still valid
    assert bench.write(0x1800, 1, 0xC0000181, 4) == 0
    assert bench.write(0x1A00, 1, 0x60640020, 4) == SEQUENCE  # the count is still set
    assert bench.write(0x1A00, 0, 0, 1) == 0
    assert bench.write(0x1A00, 1, 0x60640020, 4) == 0
    assert bench.write(0x1A00, 0, 1, 1) == 0
    assert bench.read(0x1A00, 1) == 0x60640020
    assert bench.write(0x1800, 1, 0x40000181, 4) == 0


@pytest.mark.parametrize(
    ("communication", "raw", "code"),
    [
        (0x1800, 0x55550010, MAPPABLE),
        (0x1800, 0x10180120, MAPPABLE),
        (0x1800, 0x21000710, 0x06090011),
        (0x1800, 0x60640010, 0x06070010),
        (0x1400, 0x60640020, MAPPABLE),
        (0x1400, 0x60FF0020, 0),
    ],
)
def test_only_what_can_be_mapped_is(bench: Bench, communication: int, raw: int, code: int) -> None:
    current = bench.read(communication, 1)
    assert bench.write(communication, 1, current | 0x80000000, 4) == 0
    assert bench.write(communication + 0x200, 0, 0, 1) == 0
    assert bench.write(communication + 0x200, 1, raw, 4) == code


def test_more_than_eight_bytes_do_not_fit(bench: Bench) -> None:
    assert bench.write(0x1801, 1, 0x80000281, 4) == 0
    assert bench.write(0x1A01, 0, 0, 1) == 0
    for subindex, raw in enumerate((0x60640020, 0x606C0020, 0x60410010), 1):
        assert bench.write(0x1A01, subindex, raw, 4) == 0
    assert bench.write(0x1A01, 0, 3, 1) == 0x06040042
    assert bench.write(0x1A01, 0, 9, 1) == 0x06090030
    assert bench.write(0x1A01, 0, 4, 1) == MAPPABLE  # the fourth entry is empty
    assert bench.write(0x1A01, 0, 2, 1) == 0


def test_communication_parameters_are_checked(bench: Bench) -> None:
    assert bench.write(0x1800, 1, 0x40000182, 4) == 0x06090030  # moves while it is valid
    assert bench.write(0x1800, 1, 0xA0000181, 4) == 0x06090030  # 29-bit identifier
    assert bench.write(0x1801, 1, 0x601, 4) == 0x06090030  # kept for SDO
    assert bench.write(0x1401, 1, 0x000, 4) == 0x06090030  # kept for NMT
    assert bench.write(0x1801, 1, 0x40000300, 4) == 0
    assert bench.write(0x1005, 0, 0x20000080, 4) == 0x06090030
    assert bench.write(0x1800, 2, 241, 1) == 0x06090030
    assert bench.write(0x1800, 2, 253, 1) == 0x06090030
    assert bench.write(0x1800, 2, 240, 1) == 0
    assert bench.write(0x1800, 3, 10, 2) == STATE  # inhibit time of a valid PDO


@pytest.mark.parametrize("every", [1, 2, 7, 240])
def test_synchronous_pdo_answers_every_nth_sync(bench: Bench, every: int) -> None:
    bench.map(0x1800, 0x181, every, [0x60640020])
    bench.nmt(0x01)
    answered = [count(bench.sync(), 0x181) for _ in range(500)]
    assert sum(answered) == 500 // every
    assert answered.index(1) + 1 == every


def test_acyclic_synchronous_pdo_answers_a_change_at_the_next_sync(bench: Bench) -> None:
    bench.map(0x1800, 0x181, 0, [0x60400010])
    bench.nmt(0x01)
    heard = []
    for word in (0, 0, 0x1234, 0x1234):
        assert bench.write(0x6040, 0, word, 2) == 0
        assert bench.step(0.01) == []
        bench.send(0x080, b"")
        heard.append(bench.step())
    assert heard == [[Frame(0x181, b"\x00\x00")], [], [Frame(0x181, b"\x34\x12")], []]


def test_no_sync_is_answered_outside_operational(bench: Bench) -> None:
    bench.map(0x1800, 0x181, 1, [0x60640020])
    bench.send(0x080, b"")
    assert bench.step(0.01) == []
    bench.nmt(0x01)
    bench.send(0x080, b"")
    assert count(bench.step(0.01), 0x181) == 1
    bench.nmt(0x80)
    bench.send(0x080, b"")
    assert bench.step(0.01) == []


def test_event_driven_pdo_waits_for_its_inhibit_time(bench: Bench) -> None:
    """The factory's TPDO1: statusword on change, 10 ms apart at least."""
    assert count(bench.nmt(0x01), 0x181) == 1
    bench.run(0.02)
    bench.write(0x6040, 0, 0x06, 2)  # answered by SDO; the change of state by PDO
    assert bench.heard[-1].cob_id == 0x181
    assert int.from_bytes(bench.heard[-1].data, "little") & 0x6F == 0x21
    bench.write(0x6040, 0, 0x00, 2)
    changes = [i for i in range(1, 15) if count(bench.step(0.001), 0x181)]
    assert changes == [10]


def test_event_timer_repeats_without_a_change(bench: Bench) -> None:
    bench.map(0x1800, 0x181, 255, [0x60400010])
    assert bench.write(0x1800, 5, 50, 2) == 0
    bench.nmt(0x01)
    assert count(bench.run(1.0), 0x181) == 20


def test_received_pdo_acts_at_once_or_at_the_next_sync(bench: Bench) -> None:
    bench.map(0x1400, 0x201, 255, [0x60FF0020])
    bench.map(0x1401, 0x301, 1, [0x60720010])
    bench.nmt(0x01)
    bench.send(0x201, (1000).to_bytes(4, "little"))
    bench.send(0x301, (500).to_bytes(2, "little"))
    assert bench.read(0x60FF) == 1000
    assert bench.read(0x6072) == 2000
    bench.send(0x080, b"")
    assert bench.read(0x6072) == 500
    assert bench.drive.plant.torque_limit_nm == pytest.approx(2.5)


def test_answer_to_a_sync_shows_the_state_before_its_command(bench: Bench) -> None:
    bench.operate()
    bench.controlword = 0x06
    assert bench.cycle().status & 0x6F == 0x40
    assert bench.cycle().status & 0x6F == 0x21


def test_a_short_received_pdo_is_reported_and_not_applied(bench: Bench) -> None:
    bench.map(0x1400, 0x201, 255, [0x60FF0020])
    bench.nmt(0x01)
    bench.send(0x201, b"\x01\x02")
    bench.step()
    assert bench.emergencies() == [(0x8210, 0x11)]
    assert bench.read(0x60FF) == 0


def test_a_value_out_of_range_is_not_taken_over(bench: Bench) -> None:
    bench.map(0x1400, 0x201, 255, [0x60830020, 0x60720010])
    bench.nmt(0x01)
    bench.send(0x201, struct.pack("<IH", 0, 700))
    assert bench.read(0x6083) == 2_000_000
    assert bench.read(0x6072) == 700


@given(data=st.data())
def test_what_is_packed_unpacks_to_the_same_numbers(data: st.DataObject) -> None:
    entries = data.draw(st.lists(st.sampled_from(NUMBERS), max_size=8))
    od = ObjectDictionary(1)
    for entry in entries:
        od.values[entry.key] = data.draw(st.integers(entry.low, entry.high))
    layout = Layout(tuple(entries))
    packed = layout.pack(od.values)
    assert len(packed) == layout.size == sum(e.size for e in entries)
    assert layout.unpack(packed) == tuple(od.values[e.key] for e in entries)
    assert layout.unpack(packed + b"\xff\xff") == layout.unpack(packed)


@given(
    steps=st.lists(
        st.tuples(
            st.sampled_from([0x1400, 0x1600, 0x1800, 0x1A00]),
            st.integers(0, 8),
            st.sampled_from([0, 1, 2, 0x81, 0x60410010, 0x60FF0020, 0xC0000181, 0x40000181]),
        ),
        max_size=30,
    )
)
def test_no_sequence_of_writes_leaves_a_pdo_that_cannot_be_sent(
    steps: list[tuple[int, int, int]],
) -> None:
    with fake_bench() as bench:
        od = bench.drive.dictionary
        for index, subindex, value in steps:
            try:
                size = od.entry(index, subindex).size
                od.write_bytes(index, subindex, (value % 256**size).to_bytes(size, "little"))
            except SdoAbortError:
                continue
        bench.nmt(0x01)
        for frame in bench.sync() + bench.sync():
            assert len(frame.data) <= 8
