"""The fake's SDO server on raw frames: CiA 301, expedited and segmented, with its aborts."""

from __future__ import annotations

import struct
from collections.abc import Iterator

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fakes.object_dictionary import ObjectDictionary
from fakes.sdo_server import SdoServer
from tests.unit.fakes.bench import Bench, abort_code, fake_bench

PLACE = 0x2101  # a writable string


@pytest.fixture
def bench() -> Iterator[Bench]:
    with fake_bench() as bench:
        yield bench


def upload(server: SdoServer, index: int, subindex: int = 0) -> bytes:
    """Read a string by segments."""
    answer = server.handle(struct.pack("<BHB4x", 0x40, index, subindex))
    assert answer is not None
    assert answer[0] == 0x41
    size, data, toggle = int.from_bytes(answer[4:8], "little"), b"", 0
    while True:
        answer = server.handle(bytes([0x60 | toggle]) + bytes(7))
        assert answer is not None
        assert answer[0] & 0xF0 == toggle
        data += answer[1 : 8 - (answer[0] >> 1 & 7)]
        if answer[0] & 1:
            assert len(data) == size
            return data
        toggle ^= 0x10


def download(server: SdoServer, index: int, data: bytes, announced: int | None) -> bytes:
    """Write by segments; return the last answer."""
    head = 0x20 if announced is None else 0x21
    answer = server.handle(struct.pack("<BHBI", head, index, 0, announced or 0))
    assert answer is not None
    parts = [data[i : i + 7] for i in range(0, len(data), 7)] or [b""]
    for number, part in enumerate(parts):
        if answer[0] == 0x80:
            return answer
        last = number == len(parts) - 1
        header = (number % 2) << 4 | (7 - len(part)) << 1 | last
        answer = server.handle(bytes([header]) + part.ljust(7, b"\0"))
        assert answer is not None
    return answer


def test_expedited_upload_of_every_size(bench: Bench) -> None:
    assert bench.request(bytes.fromhex("4000100000000000")) == bytes.fromhex("4300100092010200")
    assert bench.request(bytes.fromhex("4017100000000000")) == bytes.fromhex("4b17100000000000")
    assert bench.request(bytes.fromhex("4061600000000000")) == bytes.fromhex("4f61600003000000")


def test_expedited_download_reads_back(bench: Bench) -> None:
    assert bench.request(bytes.fromhex("2b83600034120000")) is not None  # two bytes: refused
    assert bench.read(0x6083) == 2_000_000
    assert bench.write(0x6083, 0, 123_456, 4) == 0
    assert bench.read(0x6083) == 123_456


def test_expedited_download_without_a_size_takes_the_objects(bench: Bench) -> None:
    answer = bench.request(struct.pack("<BHBHH", 0x22, 0x1017, 0, 250, 0xFFFF))
    assert answer == bytes.fromhex("6017100000000000")
    assert bench.read(0x1017) == 250


@pytest.mark.parametrize(
    ("index", "subindex", "value", "size", "code"),
    [
        (0x5555, 0, 1, 1, 0x06020000),
        (0x1018, 9, 1, 1, 0x06090011),
        (0x1000, 0, 1, 4, 0x06010002),
        (0x6041, 0, 1, 2, 0x06010002),
        (0x1017, 0, 1, 4, 0x06070010),
        (0x6060, 0, 1, 1, 0x06090030),
        (0x6083, 0, 0, 4, 0x06090030),
        (0x1003, 0, 5, 1, 0x06090030),
    ],
)
def test_refused_downloads_say_why(
    bench: Bench, index: int, subindex: int, value: int, size: int, code: int
) -> None:
    assert bench.write(index, subindex, value, size) == code


def test_refused_uploads_say_why(bench: Bench) -> None:
    assert bench.read_abort(0x5555) == 0x06020000
    assert bench.read_abort(0x1018, 9) == 0x06090011
    assert bench.read_abort(0x1003, 1) == 0x08000024  # the history is empty


def test_segmented_upload_of_the_device_name(bench: Bench) -> None:
    answer = bench.request(bytes.fromhex("4008100000000000"))
    assert answer is not None
    assert answer[:4] == bytes.fromhex("41081000")
    size, name, toggle = int.from_bytes(answer[4:], "little"), b"", 0
    while len(name) < size:
        answer = bench.request(bytes([0x60 | toggle]) + bytes(7))
        assert answer is not None
        name += answer[1 : 8 - (answer[0] >> 1 & 7)]
        toggle ^= 0x10
    assert name == b"Stribeck generic joint drive"
    assert answer[0] & 1


@given(text=st.binary(max_size=64), sized=st.booleans())
def test_what_is_written_by_segments_is_read_back(text: bytes, sized: bool) -> None:
    server = SdoServer(ObjectDictionary(1))
    answer = download(server, PLACE, text, len(text) if sized else None)
    assert answer[0] & 0xE0 == 0x20
    if 0 < len(text) <= 4:
        expedited = server.handle(struct.pack("<BHB4x", 0x40, PLACE, 0))
        assert expedited is not None
        assert expedited[4 : 4 + len(text)] == text
    else:
        assert upload(server, PLACE) == text


def test_a_number_may_come_by_segments_too() -> None:
    od = ObjectDictionary(1)
    assert download(SdoServer(od), 0x6083, (77).to_bytes(4, "little"), 4)[0] & 0xE0 == 0x20
    assert od.number(0x6083) == 77


def test_segments_that_break_their_promise_are_refused() -> None:
    server = SdoServer(ObjectDictionary(1))
    assert abort_code(download(server, PLACE, b"eleven byte", 12)) == 0x06070010
    assert abort_code(download(server, 0x6083, b"eight by", 8)) == 0x06070010
    assert abort_code(download(server, PLACE, b"x" * 300, None)) == 0x05040005
    assert abort_code(download(server, PLACE, b"x" * 300, 300)) == 0x05040005


def test_a_repeated_toggle_ends_the_transfer() -> None:
    server = SdoServer(ObjectDictionary(1))
    assert server.handle(bytes.fromhex("4008100000000000")) is not None
    first, again = server.handle(b"\x60" + bytes(7)), server.handle(b"\x60" + bytes(7))
    assert first is not None
    assert again is not None
    assert abort_code(again) == 0x05030000
    assert again[1:4] == bytes.fromhex("081000")
    after = server.handle(b"\x70" + bytes(7))
    assert after is not None
    assert abort_code(after) == 0x05040001


@pytest.mark.parametrize("command", [0xA0, 0xC0, 0xE0, 0x60, 0x00])
def test_block_transfers_and_stray_segments_are_unknown_commands(command: int) -> None:
    answer = SdoServer(ObjectDictionary(1)).handle(bytes([command]) + bytes(7))
    assert answer is not None
    assert abort_code(answer) == 0x05040001


@given(requests=st.lists(st.binary(min_size=0, max_size=8), max_size=12))
def test_any_frames_get_an_answer_or_silence_by_the_protocol(requests: list[bytes]) -> None:
    server = SdoServer(ObjectDictionary(1))
    for request in requests:
        answer = server.handle(request)
        if len(request) != 8 or request[0] >> 5 == 4:
            assert answer is None
        else:
            assert answer is not None
            assert len(answer) == 8
            allowed = {0: 0x20, 1: 0x60, 2: 0x40, 3: 0x00}.get(request[0] >> 5)
            assert answer[0] == 0x80 or answer[0] & 0xE0 == allowed
    assert upload(server, 0x1008) == b"Stribeck generic joint drive"


@given(head=st.sampled_from([0x20, 0x21, 0x22, 0x23, 0x27, 0x2B, 0x2F, 0x40]), data=st.data())
def test_no_write_leaves_a_number_that_its_type_cannot_hold(head: int, data: st.DataObject) -> None:
    od = ObjectDictionary(1)
    entry = data.draw(st.sampled_from(list(od)))
    payload = data.draw(st.binary(min_size=4, max_size=4))
    SdoServer(od).handle(struct.pack("<BHB", head, entry.index, entry.subindex) + payload)
    for each in od:
        value = od.values[each.key]
        if isinstance(value, int):
            assert each.low <= value <= each.high
