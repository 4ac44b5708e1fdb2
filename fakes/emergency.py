"""Errors of the fake: error register, error history, error code, and the EMCY frames."""

from __future__ import annotations

import struct
from collections.abc import Callable

from fakes.object_dictionary import (
    NO_DATA,
    VALUE_RANGE,
    Entry,
    ObjectDictionary,
    SdoAbortError,
    Value,
)

GENERIC, COMMUNICATION = 0x01, 0x10
CONNECTION_ABORTED, HEARTBEAT_LOST, PDO_LENGTH = 0x8100, 0x8130, 0x8210
NO_ERROR = 0x0000
HISTORY, HISTORY_LENGTH = 0x1003, 8
_FRAME = struct.Struct("<HB5x")


class Emergency:
    """Keeps 0x1001, 0x1003 and 0x603F, and sends EMCY on each change.

    Parameters
    ----------
    dictionary : ObjectDictionary
        Where the three objects live.
    send : callable
        Sends eight bytes under the EMCY COB-ID.
    """

    def __init__(self, dictionary: ObjectDictionary, send: Callable[[bytes], None]) -> None:
        self._od = dictionary
        self._send = send
        self._active: dict[int, int] = {}
        dictionary.guard(self._check_history)
        dictionary.on_write(HISTORY, 0, self._clear_history)

    @property
    def active(self) -> frozenset[int]:
        """Return the codes of the errors that are there now."""
        return frozenset(self._active)

    def report(self, code: int, register: int = GENERIC) -> None:
        """Report an error once, until it is cleared."""
        if code in self._active:
            return
        self._active[code] = register | GENERIC
        history = [self._od.number(HISTORY, i) for i in range(1, HISTORY_LENGTH)]
        for i, value in enumerate([code, *history], start=1):
            self._od.set(HISTORY, i, value)
        self._od.set(HISTORY, 0, min(self._od.number(HISTORY, 0) + 1, HISTORY_LENGTH))
        self._od.set(0x603F, 0, code)
        self._publish(code)

    def clear(self, *codes: int) -> None:
        """Clear the given errors, or all; EMCY 0x0000 says so when none is left."""
        gone = [c for c in (codes or tuple(self._active)) if c in self._active]
        for code in gone:
            del self._active[code]
        if gone and not self._active:
            self._od.set(0x603F, 0, 0)
            self._publish(NO_ERROR)

    def forget(self) -> None:
        """Start anew without a word, as after a reset."""
        self._active.clear()
        self._od.set(0x1001, 0, 0)
        self._od.set(0x603F, 0, 0)

    def restore(self) -> int:
        """Write the error register anew from the errors that are there, and return it."""
        register = 0
        for bits in self._active.values():
            register |= bits
        self._od.set(0x1001, 0, register)
        return register

    def _publish(self, code: int) -> None:
        self._send(_FRAME.pack(code, self.restore()))

    @staticmethod
    def _check_history(entry: Entry, value: Value) -> None:
        if entry.index == HISTORY and value != 0:
            raise SdoAbortError(VALUE_RANGE)

    def _clear_history(self, _zero: int) -> None:
        for i in range(1, HISTORY_LENGTH + 1):
            self._od.set(HISTORY, i, 0)

    def check_read(self, entry: Entry) -> None:
        """Refuse a history entry that holds nothing."""
        if entry.index == HISTORY and entry.subindex > self._od.number(HISTORY, 0):
            raise SdoAbortError(NO_DATA)
