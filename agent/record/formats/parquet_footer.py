"""What a Parquet file says of itself, read without Arrow: its key-value metadata alone.

A page that lists a thousand recordings needs a line of JSON from each footer, and neither Arrow's
40 MB nor its threads for that. A test holds this against Arrow.

Source: Parquet format 2.11, ``parquet.thrift`` (``FileMetaData.key_value_metadata`` is field 5, a
``KeyValue`` has key 1 and value 2); Thrift's compact protocol.
"""

from __future__ import annotations

from pathlib import Path

MAGIC = b"PAR1"
LARGEST_FOOTER = 16 << 20
_DEEPEST = 32
_KEY_VALUES = 5
_TRUE, _FALSE, _BYTE, _I16, _I32, _I64, _DOUBLE, _BINARY, _LIST, _SET, _MAP, _STRUCT = range(1, 13)


class ForeignFooterError(Exception):
    """The file is no Parquet file, or its footer is damaged."""


def key_values(path: Path) -> dict[bytes, bytes]:
    """Return the key-value metadata of a Parquet file's footer.

    Raises
    ------
    ForeignFooterError
        It is no Parquet file, one whose footer is encrypted, or a damaged one.
    OSError
        It cannot be read.
    """
    with path.open("rb") as file:
        size = file.seek(0, 2)
        if size < 12:
            raise ForeignFooterError("too short to be a Parquet file")
        file.seek(size - 8)
        end = file.read(8)
        length = int.from_bytes(end[:4], "little")
        if end[4:] != MAGIC or not 0 < length <= min(size - 12, LARGEST_FOOTER):
            raise ForeignFooterError("no Parquet footer")
        file.seek(size - 8 - length)
        return _Compact(file.read(length)).file_metadata()


class _Compact:
    """Thrift's compact protocol, as far as to find one list in a struct and pass over the rest."""

    def __init__(self, content: bytes) -> None:
        self._content = content
        self._at = 0

    def file_metadata(self) -> dict[bytes, bytes]:
        found: dict[bytes, bytes] = {}
        number = 0
        while (field := self._field(number)) is not None:
            number, kind = field
            if number == _KEY_VALUES and kind == _LIST:
                return dict(self._key_value() for _ in range(self._list_of(_STRUCT)))
            self._pass_over(kind)
        return found

    def _key_value(self) -> tuple[bytes, bytes]:
        texts, number = {1: b"", 2: b""}, 0
        while (field := self._field(number)) is not None:
            number, kind = field
            if number in texts and kind == _BINARY:
                texts[number] = self._take(self._varint())
            else:
                self._pass_over(kind)
        return texts[1], texts[2]

    def _field(self, before: int) -> tuple[int, int] | None:
        """Return number and type of a struct's next field; None at its end."""
        head = self._byte()
        if head == 0:
            return None
        step = head >> 4
        return (before + step if step else self._zigzag()), head & 0x0F

    def _list_of(self, wanted: int) -> int:
        kind, length = self._list()
        if kind != wanted:
            raise ForeignFooterError("a list of another kind than expected")
        return length

    def _list(self) -> tuple[int, int]:
        head = self._byte()
        length = head >> 4
        return head & 0x0F, self._varint() if length == 15 else length

    def _pass_over(self, kind: int, depth: int = 0, *, inside: bool = False) -> None:
        """Pass over a value; a truth value has its byte only inside of a list or map."""
        if depth > _DEEPEST:
            raise ForeignFooterError("nested deeper than any footer")
        if kind in (_TRUE, _FALSE):
            self._take(1 if inside else 0)
        elif kind in (_I16, _I32, _I64):
            self._varint()
        elif kind in (_BYTE, _DOUBLE):
            self._take(1 if kind == _BYTE else 8)
        elif kind == _BINARY:
            self._take(self._varint())
        elif kind in (_LIST, _SET):
            item, length = self._list()
            for _ in range(length):
                self._pass_over(item, depth + 1, inside=True)
        elif kind == _MAP:
            length = self._varint()
            kinds = self._byte() if length else 0
            for _ in range(length):
                self._pass_over(kinds >> 4, depth + 1, inside=True)
                self._pass_over(kinds & 0x0F, depth + 1, inside=True)
        elif kind == _STRUCT:
            number = 0
            while (field := self._field(number)) is not None:
                number, inner = field
                self._pass_over(inner, depth + 1)
        else:
            raise ForeignFooterError(f"a value of kind {kind}")

    def _byte(self) -> int:
        return self._take(1)[0]

    def _take(self, count: int) -> bytes:
        taken = self._content[self._at : self._at + count]
        if len(taken) != count:
            raise ForeignFooterError("the footer ends too early")
        self._at += count
        return taken

    def _varint(self) -> int:
        value = 0
        for shift in range(0, 70, 7):
            byte = self._byte()
            value |= (byte & 0x7F) << shift
            if byte < 0x80:
                return value
        raise ForeignFooterError("a number without an end")

    def _zigzag(self) -> int:
        value = self._varint()
        return (value >> 1) ^ -(value & 1)
