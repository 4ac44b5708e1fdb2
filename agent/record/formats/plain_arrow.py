"""Arrow's stream format read without Arrow: for a program that shall stay small beside it.

Arrow's libraries cost 40 MB of a process that wants twenty points a second. This reads what
`agent.record.streams.stream` writes and nothing more: plain columns of numbers, truth values and
text, uncompressed, without dictionaries and without nulls. A test holds it against Arrow itself.

Source: Arrow Columnar Format 1.5, "Encapsulated message format" and ``format/Message.fbs``,
``format/Schema.fbs``; FlatBuffers internals (a table begins with the distance back to its vtable).
"""

from __future__ import annotations

import array
import struct
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

CONTINUES = 0xFFFFFFFF
_SCHEMA, _BATCH = 1, 3  # MessageHeader
_INT, _FLOAT, _TEXT, _BOOL = 2, 3, 5, 6  # Type
_LARGEST_HEADER = 4 << 20


class ForeignStreamError(Exception):
    """The bytes are no Arrow stream, or one of another form than ours."""


@dataclass(frozen=True)
class Message:
    """One whole message: where its header and its body lie, and where the next one begins."""

    header: memoryview
    body: memoryview
    ended: int


def next_message(content: memoryview, at: int) -> Message | None:
    """Return the message that begins at `at`; None where it is not whole yet, or at the end.

    Raises
    ------
    ForeignStreamError
        What stands there is no message.
    """
    if len(content) < at + 8:
        return None
    mark, size = struct.unpack_from("<Ii", content, at)
    if mark != CONTINUES or not 0 <= size <= _LARGEST_HEADER:
        raise ForeignStreamError("no message begins here")
    began = at + 8
    if size == 0 or len(content) < began + size:
        return None
    header = content[began : began + size]
    body_bytes = _Table.root(header).number(3, "q")
    ended = began + size + body_bytes
    if body_bytes < 0:
        raise ForeignStreamError("a body of less than nothing")
    return Message(header, content[began + size : ended], ended) if len(content) >= ended else None


def columns_of(message: Message) -> tuple[tuple[str, int], ...]:
    """Return name and type of every column that a schema's message describes.

    Raises
    ------
    ForeignStreamError
        It is no schema, or one with columns that are not plain.
    """
    fields = _headed(message, _SCHEMA).tables(1)
    found = tuple((field.text(0), field.number(2, "B")) for field in fields)
    for (name, kind), field in zip(found, fields, strict=True):
        if kind not in _READ or field.has(4):
            raise ForeignStreamError(f"column {name!r} is of a kind that is not read here")
    return found


def rows_of(message: Message, columns: Sequence[tuple[str, int]]) -> Mapping[str, Sequence[Any]]:
    """Return the values of a record batch, a column a name.

    Raises
    ------
    ForeignStreamError
        It is no record batch, is compressed, has nulls, or does not fit into its body.
    """
    batch = _headed(message, _BATCH)
    rows, nodes, buffers = batch.number(0, "q"), batch.structs(1, "qq"), batch.structs(2, "qq")
    if batch.has(3) or len(nodes) != len(columns) or rows < 0:
        raise ForeignStreamError("a batch that is compressed, or not of its schema")
    out: dict[str, Sequence[Any]] = {}
    pieces = iter(buffers)
    try:
        for (name, kind), (length, nulls) in zip(columns, nodes, strict=True):
            if length != rows or nulls:
                raise ForeignStreamError(f"column {name!r} has nulls, or another length")
            next(pieces)  # which values are valid: all
            body = [_piece(message.body, next(pieces)) for _ in range(2 if kind == _TEXT else 1)]
            out[name] = _READ[kind](rows, body)
    except (StopIteration, IndexError, ValueError) as error:
        raise ForeignStreamError("a batch does not fit into its body") from error
    return out


def _headed(message: Message, kind: int) -> _Table:
    root = _Table.root(message.header)
    if root.number(1, "B") != kind:
        raise ForeignStreamError("a message of another kind than expected")
    return root.table(2)


def _piece(body: memoryview, place: Sequence[int]) -> memoryview:
    offset, length = place
    if offset < 0 or length < 0 or offset + length > len(body):
        raise ForeignStreamError("a buffer lies outside of its body")
    return body[offset : offset + length]


def _numbers(code: str) -> Callable[[int, Sequence[memoryview]], Sequence[Any]]:
    def read(rows: int, body: Sequence[memoryview]) -> Sequence[Any]:
        values = array.array(code)
        values.frombytes(body[0][: rows * values.itemsize])
        if sys.byteorder == "big":
            values.byteswap()
        if len(values) != rows:
            raise ForeignStreamError("a column is shorter than its batch")
        return values

    return read


def _truths(rows: int, body: Sequence[memoryview]) -> Sequence[Any]:
    return [bool(body[0][i >> 3] >> (i & 7) & 1) for i in range(rows)]


def _texts(rows: int, body: Sequence[memoryview]) -> Sequence[Any]:
    ends = _numbers("i")(rows + 1, body[:1]) if rows else []
    words = bytes(body[1])
    return [words[ends[i] : ends[i + 1]].decode("utf-8") for i in range(rows)]


_READ: Mapping[int, Callable[[int, Sequence[memoryview]], Sequence[Any]]] = {
    _INT: _numbers("q"),
    _FLOAT: _numbers("d"),
    _TEXT: _texts,
    _BOOL: _truths,
}


@dataclass(frozen=True)
class _Table:
    """One FlatBuffers table: fields by their number, absent ones at their default of nothing."""

    content: memoryview
    at: int

    @classmethod
    def root(cls, content: memoryview) -> _Table:
        return cls(content, _unpack("I", content, 0)[0])

    def _field(self, number: int) -> int:
        """Return where a field stands; 0 where it is not there."""
        vtable = self.at - _unpack("i", self.content, self.at)[0]
        size = _unpack("H", self.content, vtable)[0]
        place = 4 + 2 * number
        offset: int = _unpack("H", self.content, vtable + place)[0] if place < size else 0
        return self.at + offset if offset else 0

    def has(self, number: int) -> bool:
        return self._field(number) != 0

    def number(self, number: int, code: str) -> int:
        at = self._field(number)
        return int(_unpack(code, self.content, at)[0]) if at else 0

    def table(self, number: int) -> _Table:
        at = self._field(number)
        if not at:
            raise ForeignStreamError("a message without what it is about")
        return _Table(self.content, at + _unpack("I", self.content, at)[0])

    def text(self, number: int) -> str:
        at, length = self._vector(number)
        if at + length > len(self.content):
            raise ForeignStreamError("a name lies outside of its message")
        try:
            return bytes(self.content[at : at + length]).decode("utf-8")
        except UnicodeDecodeError as error:
            raise ForeignStreamError("a name is no text") from error

    def tables(self, number: int) -> list[_Table]:
        at, length = self._vector(number)
        places = range(at, at + 4 * length, 4)
        return [_Table(self.content, p + _unpack("I", self.content, p)[0]) for p in places]

    def structs(self, number: int, code: str) -> list[tuple[int, ...]]:
        at, length = self._vector(number)
        size = struct.calcsize(f"<{code}")
        return [_unpack(code, self.content, at + size * i) for i in range(length)]

    def _vector(self, number: int) -> tuple[int, int]:
        at = self._field(number)
        if not at:
            return 0, 0
        at += _unpack("I", self.content, at)[0]
        length = _unpack("I", self.content, at)[0]
        if length > len(self.content):
            raise ForeignStreamError("a list is longer than its message")
        return at + 4, length


def _unpack(code: str, content: memoryview, at: int) -> tuple[int, ...]:
    if at < 0:
        raise ForeignStreamError("an offset leads out of its message")
    try:
        return struct.unpack_from(f"<{code}", content, at)
    except struct.error as error:
        raise ForeignStreamError("an offset leads out of its message") from error
