"""Typed reads and writes of a drive's objects; canopen's and python-can's errors mapped once.

Only time-outs are retried, and only where doing it twice is the same as doing it once: reading,
and writing a setting. A controlword is an order of its moment and is never repeated from here.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, cast

import can
from canopen.emcy import EmcyError
from canopen.lss import LssError
from canopen.nmt import NmtError
from canopen.objectdictionary import ObjectDictionaryError
from canopen.sdo.exceptions import SdoAbortedError, SdoCommunicationError
from canopen.sdo.exceptions import SdoError as CanopenSdoError

from drivers.cia402.network import CanopenNode
from drivers.cia402.objects import TYPES, DriveObject
from drivers.cia402.words import error_words
from drivers.errors import (
    BusError,
    ConfigurationError,
    DriveFaultError,
    DriverError,
    NodeMissingError,
    SdoError,
)

LIBRARY_ERRORS: dict[type[Exception], type[DriverError]] = {
    can.CanError: BusError,
    CanopenSdoError: SdoError,
    NmtError: NodeMissingError,
    EmcyError: DriveFaultError,
    LssError: BusError,
    ObjectDictionaryError: ConfigurationError,
}
"""The libraries' exceptions by their base classes, and what each becomes."""

_OBJECT_ABSENT = 0x06020000
_SUBINDEX_ABSENT = 0x06090011
_NO_DATA = 0x08000024
ABSENT = (_OBJECT_ABSENT, _SUBINDEX_ABSENT, _NO_DATA)
_NO_ACCESS = 0x06010000
_READ_ONLY = 0x06010002
READ_ONLY = (_NO_ACCESS, _READ_ONLY)

_ABORT_WORDS: dict[int, str] = {
    0x05030000: "the toggle bit was not alternated",
    0x05040000: "the transfer timed out in the drive",
    0x05040001: "the drive does not know this SDO command",
    0x05040005: "the drive is out of memory",
    _NO_ACCESS: "access to this object is not supported",
    0x06010001: "this object can only be written",
    _READ_ONLY: "this object can only be read",
    _OBJECT_ABSENT: "the drive has no such object",
    0x06040041: "this object cannot be mapped into a PDO",
    0x06040042: "the mapped objects exceed the length of a PDO",
    0x06040043: "this value does not go with the other parameters",
    0x06040047: "the drive is internally at odds",
    0x06060000: "a hardware error in the drive",
    0x06070010: "the length does not fit the object's type",
    0x06070012: "too many bytes for the object's type",
    0x06070013: "too few bytes for the object's type",
    _SUBINDEX_ABSENT: "the object has no such subindex",
    0x06090030: "the value is outside of what the drive allows",
    0x06090031: "the value is too high for the drive",
    0x06090032: "the value is too low for the drive",
    0x06090036: "the maximum would be below the minimum",
    0x08000000: "a general error in the drive",
    0x08000020: "the drive cannot take it over",
    0x08000021: "the drive is under local control",
    0x08000022: "the drive cannot take it over in its present state",
    _NO_DATA: "the drive has no data for it",
}


def abort_words(code: int) -> str:
    """Return CiA 301's abort code in plain words, with the code."""
    return f"{_ABORT_WORDS.get(code, 'an abort code of the vendor')} (abort 0x{code:08X})"


def translate(error: Exception, doing: str, node_id: int) -> DriverError:
    """Return our error for one of the libraries'.

    Parameters
    ----------
    error : Exception
        An instance of a class under `LIBRARY_ERRORS`.
    doing : str
        What was being done, as ``reading statusword (0x6041:00)``.
    node_id : int
        Of which node.
    """
    where = f"node {node_id}, {doing}"
    if isinstance(error, SdoAbortedError):
        code = int(error.code)
        return SdoError(
            f"The drive refused ({where}): {abort_words(code)}.",
            "Compare the object with the drive's manual.",
            abort_code=code,
        )
    if isinstance(error, CanopenSdoError):
        return SdoError(
            f"No usable answer to an SDO request ({where}): {str(error).rstrip('.')}.",
            "Check that the drive has power and that nobody else talks to it by SDO.",
        )
    if isinstance(error, EmcyError):
        return DriveFaultError(
            f"The drive reports {error_words(int(error.code))} ({where}).",
            error_code=int(error.code),
        )
    ours = next((LIBRARY_ERRORS[c] for c in type(error).__mro__ if c in LIBRARY_ERRORS), None)
    if ours is None:
        raise TypeError(f"no mapping for {type(error).__qualname__}") from error
    return ours(f"{str(error).rstrip('.') or type(error).__name__} ({where}).")


class SdoAccess:
    """Reads and writes one node's objects by name.

    Parameters
    ----------
    node : CanopenNode
        Whose SDO client is used.
    attempts : int
        How often a time-out may cost a new try.
    before_writing : callable, optional
        Called before every request that writes; what it raises keeps that from being sent.
    """

    def __init__(
        self,
        node: CanopenNode,
        attempts: int,
        before_writing: Callable[[], None] = lambda: None,
    ) -> None:
        self._node = node
        self._attempts = attempts
        self._before_writing = before_writing

    def read(self, item: DriveObject) -> int:
        """Return an integer object's value.

        Raises
        ------
        SdoError
            Aborted (with the code), unanswered, or of another length than its type.
        """
        data = self._upload(item.index, item.subindex, str(item))
        codec = TYPES[item.kind]
        # Some drives send 32 bits for a shorter object; fewer than it has is another matter.
        if len(data) < codec.size:
            raise SdoError(
                f"Node {self._node.node_id} gave {len(data)} bytes for {item}, "
                f"expected {codec.size}.",
                "Compare the object with the drive's manual.",
            )
        return int(codec.unpack_from(data)[0])

    def read_optional(self, item: DriveObject) -> int | None:
        """Return the value, or None when the drive says that it has no such object."""
        try:
            return self.read(item)
        except SdoError as error:
            if error.abort_code in ABSENT:
                return None
            raise

    def read_text(self, index: int, subindex: int, name: str) -> str | None:
        """Return a text object, or None when the drive has none."""
        try:
            data = self._upload(index, subindex, f"{name} (0x{index:04X}:{subindex:02X})")
        except SdoError as error:
            if error.abort_code in ABSENT:
                return None
            raise
        return data.rstrip(b"\x00").decode("latin-1").strip()

    def write(self, item: DriveObject, value: int) -> None:
        """Write a setting; a time-out is tried again.

        Raises
        ------
        SdoError
            Aborted (with the code) or unanswered.
        """
        self._download(item, value, self._attempts)

    def order(self, item: DriveObject, value: int) -> None:
        """Write something that must not be repeated later, such as a controlword: one try."""
        self._download(item, value, 1)

    def set(self, item: DriveObject, value: int) -> int:
        """Write a setting and compare what reads back; return it.

        Raises
        ------
        ConfigurationError
            Naming what was set and what was read.
        """
        self.write(item, value)
        return self.expect(item, value)

    def expect(self, item: DriveObject, value: int) -> int:
        """Return the value read, refusing any other than `value`."""
        found = self.read(item)
        if found != value:
            raise ConfigurationError(
                f"Node {self._node.node_id}: {item} was set to {_both(item, value)} "
                f"but reads {_both(item, found)}.",
                "Compare the object with the drive's manual; nothing moves until it holds.",
            )
        return found

    def _upload(self, index: int, subindex: int, name: str) -> bytes:
        """Read raw bytes, trying again after a time-out."""
        for attempt in range(1, self._attempts + 1):
            try:
                return cast(bytes, cast(Any, self._node.sdo).upload(index, subindex))
            except SdoCommunicationError as error:
                if attempt == self._attempts:
                    raise translate(error, f"reading {name}", self._node.node_id) from error
            except (CanopenSdoError, can.CanError) as error:
                raise translate(error, f"reading {name}", self._node.node_id) from error
        raise AssertionError("unreachable: at least one attempt is made")

    def _download(self, item: DriveObject, value: int, attempts: int) -> None:
        """Write a packed value, trying again after a time-out while `attempts` last."""
        data = TYPES[item.kind].pack(value)
        doing = f"writing {_both(item, value)} to {item}"
        for attempt in range(1, attempts + 1):
            self._before_writing()
            try:
                cast(Any, self._node.sdo).download(item.index, item.subindex, data)
            except SdoCommunicationError as error:
                if attempt == attempts:
                    raise translate(error, doing, self._node.node_id) from error
            except (CanopenSdoError, can.CanError) as error:
                raise translate(error, doing, self._node.node_id) from error
            else:
                return


def _both(item: DriveObject, value: int) -> str:
    """Return a number as decimal and, for wide unsigned ones, as hexadecimal."""
    return f"{value} (0x{value:X})" if item.kind in ("u16", "u32") and value > 9 else str(value)
