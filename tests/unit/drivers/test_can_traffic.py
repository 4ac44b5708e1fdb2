"""Blocks of frames as NumPy sees them: the same frames, times and counts as one by one."""

from __future__ import annotations

import collections
import itertools
import json
import os
import random
import socket
import statistics
import struct
from collections.abc import Iterator
from pathlib import Path

import can
import numpy as np
import pytest
import typer
from hypothesis import given
from hypothesis import strategies as st

from agent.cli.devices.bus import run_bus
from agent.cli.devices.fake_cell import fake_cell_text
from drivers.can.frames import CanBusConfig
from drivers.can.listening import listen, listen_by
from drivers.can.reader_process import ReaderProcess
from drivers.can.routing import Routing
from drivers.can.traffic import (
    ERROR,
    EXTENDED,
    REMOTE,
    SLOTS,
    Block,
    Traffic,
    block_of,
    who_says,
)
from drivers.can_reader.batches import available
from drivers.can_reader.ring import SLOT, SLOT_BYTES, FrameRing, Word
from drivers.clock import MonotonicClock, SteppedClock
from fakes.specification import FakeSpecification

AHEAD_S = 1.7e9
CLOCK = MonotonicClock()

slots = st.lists(
    st.tuples(
        st.integers(1_700_000_000, 1_700_000_003),
        st.integers(0, 999_999_999),
        st.integers(0, 0x7FF),
        st.integers(0, 8),
        st.binary(min_size=8, max_size=8),
    ),
    max_size=40,
)


@given(slots)
def test_a_block_holds_the_frames_that_come_one_by_one(
    rows: list[tuple[int, int, int, int, bytes]],
) -> None:
    packed = b"".join(SLOT.pack(*row) for row in rows)
    routing = Routing("block", wakes=False)
    inbox = routing.subscribe(range(0x800), limit=1000)

    routing.slots(packed, AHEAD_S, 0.5, 2.5)
    block = block_of(packed, AHEAD_S, 0.5, 2.5)

    assert block.can_id.tolist() == [frame.cob_id for frame in inbox.frames]
    assert block.length.tolist() == [len(frame.data) for frame in inbox.frames]
    assert block.time_s.tolist() == [frame.stamp_s for frame in inbox.frames]
    whole = np.frombuffer(packed, SLOTS)["data"]
    for data, frame in zip(whole, inbox.frames, strict=True):
        assert data.tobytes()[: len(frame.data)] == frame.data


def block(*frames: tuple[float, int, int]) -> Block:
    time_s, can_id, length = zip(*frames, strict=True)
    return Block(np.array(time_s), np.array(can_id, np.uint32), np.array(length, np.uint8))


@given(st.integers(0, 10_000))
def test_counts_and_gaps_do_not_depend_on_where_blocks_end(seed: int) -> None:
    draw = random.Random(seed)
    times_s = list(itertools.accumulate(draw.uniform(0.0, 0.01) for _ in range(60)))
    frames = [(t, draw.choice((0x080, 0x181, 0x281)), draw.randrange(9)) for t in times_s]
    ends = sorted(draw.sample(range(1, 60), 3))

    traffic = Traffic()
    for first, after in itertools.pairwise((0, *ends, 60)):
        traffic.add(block(*frames[first:after]))

    for stream in traffic.streams():
        own_s = [t for t, can_id, _ in frames if can_id == stream.cob_id]
        gaps_s = [b - a for a, b in itertools.pairwise(own_s)]
        assert stream.frames == len(own_s)
        if gaps_s:
            assert stream.period_s == pytest.approx(statistics.fmean(gaps_s))
            assert stream.jitter_s == pytest.approx(statistics.pstdev(gaps_s), abs=1e-8)
            assert stream.longest_s == max(gaps_s)
    assert traffic.frames == 60
    bits = sum(47 + 8 * length for _, _, length in frames)
    assert traffic.load(1_000_000, 1.0)[0] == pytest.approx(bits / 1e6)
    over = collections.Counter[int]()
    for time_s, _, length in frames:
        over[int((time_s - times_s[0]) / 0.1)] += 47 + 8 * length
    assert traffic.busiest(1_000_000) == pytest.approx(max(over.values()) / 1e5)


def test_load_is_what_iso_11898_says_of_a_full_bus() -> None:
    traffic = Traffic()
    traffic.add(block(*((n / 9009.0, 0x181, 8) for n in range(9009))))
    least, most = traffic.load(1_000_000, 1.0)
    assert least == pytest.approx(1.0, abs=1e-4)  # 111 bits each
    assert most == 1.0
    assert traffic.load(10_000_000, 1.0)[1] == pytest.approx(9009 * 135 / 1e7)
    assert traffic.busiest(1_000_000) == pytest.approx(1.0, abs=2e-3)


def test_what_is_no_data_frame_of_canopen_is_counted_apart() -> None:
    traffic = Traffic()
    traffic.add(
        block(
            (0.0, 0x181, 8),
            (0.1, EXTENDED | 0x181, 8),
            (0.2, REMOTE | 0x181, 8),
            (0.3, ERROR | 0x004, 8),
            (0.4, 0x181, 12),
        )
    )
    assert (traffic.frames, traffic.extended, traffic.remote) == (1, 1, 1)
    assert (traffic.error_frames, traffic.malformed) == (1, 1)
    assert [s.cob_id for s in traffic.streams()] == [0x181]


@pytest.mark.parametrize(
    ("cob_id", "words"),
    [
        (0x000, "NMT command"),
        (0x080, "SYNC"),
        (0x081, "emergency of node 1"),
        (0x1FF, "TPDO1 of node 127"),
        (0x285, "TPDO2 of node 5"),
        (0x505, "RPDO4 of node 5"),
        (0x585, "SDO answer of node 5"),
        (0x705, "heartbeat of node 5"),
        (0x7E5, "no CANopen service"),
        (0x580, "no CANopen service"),
    ],
)
def test_an_identifier_is_named_by_the_predefined_connection_set(cob_id: int, words: str) -> None:
    assert who_says(cob_id) == words


@pytest.mark.skipif(not available(), reason="the ring needs 64-bit Linux")
def test_what_waits_is_seen_where_it_lies_also_around_the_end() -> None:
    ring, descriptor = FrameRing.make(capacity=1024)
    written = 1020
    ring.set_word(Word.HEAD, written)
    ring.set_word(Word.TAIL, written)
    for number in range(8):  # four before the end of the memory, four after
        at = (written + number) % 1024 * SLOT_BYTES
        ring.slots[at : at + SLOT_BYTES] = SLOT.pack(1, 0, 0x181 + number, 8, bytes(8))
    ring.set_word(Word.HEAD, written + 8)

    pieces = ring.waiting()
    seen = [np.frombuffer(piece, SLOTS) for piece in pieces]
    assert [list(s["can_id"]) for s in seen] == [
        [0x181, 0x182, 0x183, 0x184],
        [0x185, 0x186, 0x187, 0x188],
    ]
    assert not any(s.flags.owndata for s in seen)
    assert ring.word(Word.TAIL) == written  # still the owner's: the writer may not touch them
    ring.give_back(8)
    assert ring.waiting() == ()
    del seen, pieces
    ring.close()
    os.close(descriptor)


@pytest.mark.skipif(not available(), reason="the reader process needs 64-bit Linux")
def test_the_process_lends_every_frame_once() -> None:
    with (
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as receiver,
        socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as sender,
    ):
        receiver.bind(("127.0.0.1", 0))
        sender.connect(receiver.getsockname())
        reader = ReaderProcess.start(receiver, CLOCK, "loopback")
        try:
            for number in range(3000):
                sender.send(struct.pack("<IB3x8s", 0x181 + number % 3, 8, bytes(8)))
                while number + 1 - reader._ring.word(Word.HEAD) >= 400:  # what a socket holds
                    CLOCK.sleep_until(CLOCK.now() + 0.001)
            while reader._ring.word(Word.HEAD) < 3000:
                CLOCK.sleep_until(CLOCK.now() + 0.001)
            heard = listen_by(reader, CLOCK, 0.02)
        finally:
            reader.close()
    assert [(s.cob_id, s.frames) for s in heard.traffic.streams()] == [
        (0x181, 1000),
        (0x182, 1000),
        (0x183, 1000),
    ]
    assert heard.reception.reader == "process"
    assert heard.reception.dropped_by_kernel == 0


@pytest.fixture
def speaker() -> Iterator[tuple[can.BusABC, SteppedClock]]:
    """A device that sends a heartbeat each 0.1 s and a TPDO each 0.01 s of simulated time."""
    bus = can.Bus(interface="virtual", channel="traffic", ignore_config=True)
    clock, due_s = SteppedClock(), {0x705: 0.1, 0x185: 0.01}

    def step_to(now_s: float) -> None:
        for cob_id, period_s in ((0x705, 0.1), (0x185, 0.01)):
            while due_s[cob_id] <= now_s + 1e-9:
                bus.send(can.Message(arbitration_id=cob_id, data=b"\5", is_extended_id=False))
                due_s[cob_id] += period_s

    clock.attach(step_to)
    yield bus, clock
    bus.shutdown()


def test_any_adapter_is_listened_to(speaker: tuple[can.BusABC, SteppedClock]) -> None:
    heard = listen(CanBusConfig("virtual", "traffic"), speaker[1], 1.0)
    assert [(s.cob_id, s.frames) for s in heard.traffic.streams()] == [(0x185, 100), (0x705, 10)]
    assert heard.duration_s == pytest.approx(1.0)
    assert heard.reception.dropped_by_kernel is None


def test_the_command_says_who_talks_and_what_is_odd(
    speaker: tuple[can.BusABC, SteppedClock], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bus, clock = speaker
    cell = tmp_path / "cell.toml"
    cell.write_text(fake_cell_text(FakeSpecification(), interface="virtual", channel="traffic"))
    run_bus(cell, 1.0, as_json=False, clock=clock)
    told = capsys.readouterr().out
    assert "0x185  TPDO1 of node 5" in told
    assert "0x705  heartbeat of node 5" in told

    clock.attach(lambda _now_s: bus.send(can.Message(arbitration_id=0x080, is_extended_id=False)))
    with pytest.raises(typer.Exit) as ended:
        run_bus(cell, 1.0, as_json=True, clock=clock)
    assert ended.value.exit_code == 1
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "stribeck.bus/1"
    assert document["streams"][0]["who"] == "SYNC"
    assert "somebody sends SYNC" in document["remarks"][0]


def test_a_silent_bus_is_said_and_is_no_bad_news(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    cell = tmp_path / "cell.toml"
    cell.write_text(fake_cell_text(FakeSpecification(), interface="virtual", channel="silent"))
    run_bus(cell, 1.0, as_json=True, clock=SteppedClock())
    assert json.loads(capsys.readouterr().out)["remarks"][0].startswith("nothing was heard")
