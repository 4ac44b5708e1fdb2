"""SDO server of the fake: expedited and segmented transfers of CiA 301, both directions."""

from __future__ import annotations

import struct
from dataclasses import dataclass, field

from fakes.object_dictionary import (
    COMMAND_UNKNOWN,
    LENGTH_MISMATCH,
    LONGEST_STRING,
    OUT_OF_MEMORY,
    TOGGLE_NOT_ALTERNATED,
    ObjectDictionary,
    SdoAbortError,
)

_DOWNLOAD_SEGMENT, _DOWNLOAD, _UPLOAD, _UPLOAD_SEGMENT, _ABORT = range(5)
_HEADER = struct.Struct("<BHB")
_ABORT_FRAME = struct.Struct("<BHBI")


@dataclass(slots=True)
class _Transfer:
    """A segmented transfer under way; `announced` is the size that the client promised."""

    index: int
    subindex: int
    upload: bool
    data: bytearray = field(default_factory=bytearray)
    announced: int | None = None
    toggle: int = 0


class SdoServer:
    """Answers one client; at most one transfer at a time, as small drives do.

    A new initiate request drops the transfer under way. A frame of other than eight bytes and
    a client's abort are never answered.
    """

    def __init__(self, dictionary: ObjectDictionary) -> None:
        self._od = dictionary
        self._transfer: _Transfer | None = None

    def reset(self) -> None:
        """Forget a transfer under way."""
        self._transfer = None

    def handle(self, request: bytes) -> bytes | None:
        """Return the answer to one request, or None where the protocol has none."""
        if len(request) != 8:
            return None
        command = request[0] >> 5
        if command == _ABORT:
            self._transfer = None
            return None
        _, index, subindex = _HEADER.unpack_from(request)
        if self._transfer is not None and command in (_DOWNLOAD_SEGMENT, _UPLOAD_SEGMENT):
            index, subindex = self._transfer.index, self._transfer.subindex
        try:
            if command == _DOWNLOAD:
                return self._download(request, index, subindex)
            if command == _UPLOAD:
                return self._upload(index, subindex)
            if command == _DOWNLOAD_SEGMENT:
                return self._download_segment(request)
            if command == _UPLOAD_SEGMENT:
                return self._upload_segment(request)
            raise SdoAbortError(COMMAND_UNKNOWN)
        except SdoAbortError as abort:
            self._transfer = None
            return abort_frame(index, subindex, abort.code)

    def _download(self, request: bytes, index: int, subindex: int) -> bytes:
        self._transfer = None
        entry = self._od.check_writable(index, subindex)
        expedited, sized = bool(request[0] & 0x02), bool(request[0] & 0x01)
        if expedited:
            unused = request[0] >> 2 & 0x03
            size = 4 - unused if sized else min(entry.size or 4, 4)
            self._od.write_bytes(index, subindex, request[4 : 4 + size])
        else:
            announced = int.from_bytes(request[4:8], "little") if sized else None
            if announced is not None and entry.size and announced != entry.size:
                raise SdoAbortError(LENGTH_MISMATCH)
            if announced is not None and announced > LONGEST_STRING:
                raise SdoAbortError(OUT_OF_MEMORY)
            self._transfer = _Transfer(index, subindex, upload=False, announced=announced)
        return _HEADER.pack(0x60, index, subindex) + bytes(4)

    def _download_segment(self, request: bytes) -> bytes:
        transfer = self._running(upload=False)
        toggle = self._check_toggle(transfer, request)
        unused = request[0] >> 1 & 0x07
        transfer.data += request[1 : 8 - unused]
        if len(transfer.data) > LONGEST_STRING:
            raise SdoAbortError(OUT_OF_MEMORY)
        if request[0] & 0x01:
            self._transfer = None
            if transfer.announced not in (None, len(transfer.data)):
                raise SdoAbortError(LENGTH_MISMATCH)
            self._od.write_bytes(transfer.index, transfer.subindex, bytes(transfer.data))
        return bytes([0x20 | toggle]) + bytes(7)

    def _upload(self, index: int, subindex: int) -> bytes:
        self._transfer = None
        data = self._od.read_bytes(index, subindex)
        if 0 < len(data) <= 4:
            header = 0x43 | (4 - len(data)) << 2
            return _HEADER.pack(header, index, subindex) + data.ljust(4, b"\0")
        self._transfer = _Transfer(index, subindex, upload=True, data=bytearray(data))
        return _HEADER.pack(0x41, index, subindex) + struct.pack("<I", len(data))

    def _upload_segment(self, request: bytes) -> bytes:
        transfer = self._running(upload=True)
        toggle = self._check_toggle(transfer, request)
        part = bytes(transfer.data[:7])
        del transfer.data[:7]
        last = not transfer.data
        if last:
            self._transfer = None
        header = toggle | (7 - len(part)) << 1 | int(last)
        return bytes([header]) + part.ljust(7, b"\0")

    def _running(self, *, upload: bool) -> _Transfer:
        if self._transfer is None or self._transfer.upload is not upload:
            raise SdoAbortError(COMMAND_UNKNOWN)
        return self._transfer

    @staticmethod
    def _check_toggle(transfer: _Transfer, request: bytes) -> int:
        """Return this segment's toggle bit and expect the other one next."""
        toggle = request[0] & 0x10
        if toggle != transfer.toggle:
            raise SdoAbortError(TOGGLE_NOT_ALTERNATED)
        transfer.toggle ^= 0x10
        return toggle


def abort_frame(index: int, subindex: int, code: int) -> bytes:
    """Return the frame that ends a transfer with an abort code."""
    return _ABORT_FRAME.pack(0x80, index, subindex, code)
