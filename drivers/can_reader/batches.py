"""Many frames with one system call: `recvmmsg` straight into the ring, with the kernel's stamps.

Linux, 64 bit, little endian: the structures of socket(7), cmsg(3) and recvmmsg(2) are laid out here
once, for every slot of the ring, so that a batch costs one call and no copy.
"""

from __future__ import annotations

import ctypes
import errno
import os
import socket
import struct
import sys

from drivers.can_reader.ring import FRAME_BYTES, SLOT_BYTES, STAMP_BYTES, FrameRing, Word

BATCH = 256
RENEW = 1024
"""So many slots at a time are made ready again for the kernel."""

# asm-generic/socket.h; Python's `socket` does not name them
SO_RCVBUFFORCE = 33
SO_TIMESTAMPNS = 35
SO_RXQ_OVFL = 40
_DO_NOT_WAIT = 0x40  # MSG_DONTWAIT, which not every platform's does

_VECTOR = struct.Struct("<QQ")  # struct iovec: base, bytes
_CALL = struct.Struct("<QI4xQQQQi4xI4x")  # struct mmsghdr
CALL_BYTES = _CALL.size


def available() -> bool:
    """Tell whether this machine is one that the layouts are written for."""
    return (
        sys.platform == "linux"
        and sys.byteorder == "little"
        and struct.calcsize("P") == 8
        and hasattr(os, "memfd_create")
    )


def prepare(receiver: socket.socket, buffer_bytes: int) -> int:
    """Ask for stamps, the drop counter and a large buffer; return the bytes that were granted.

    The kernel doubles what is asked for, to have room for its own bookkeeping (socket(7)); what it
    reports is halved here, so that it compares with what was asked for. Without the right to force
    it (CAP_NET_ADMIN) the kernel grants at most ``net.core.rmem_max``.
    """
    receiver.setsockopt(socket.SOL_SOCKET, SO_TIMESTAMPNS, 1)
    receiver.setsockopt(socket.SOL_SOCKET, SO_RXQ_OVFL, 1)
    try:
        receiver.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, buffer_bytes)
    except PermissionError:
        receiver.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, buffer_bytes)
    return receiver.getsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF) // 2


class BatchReceiver:
    """Receives from one socket into a ring, up to `BATCH` frames at a time; never waits.

    Parameters
    ----------
    descriptor : int
        Of a datagram socket that was `prepare`-d.
    ring : FrameRing
        This side writes.
    """

    def __init__(self, descriptor: int, ring: FrameRing) -> None:
        self._descriptor = descriptor
        self._ring = ring
        self._call = ctypes.CDLL(None, use_errno=True).recvmmsg
        self._slots = ctypes.addressof(ctypes.c_char.from_buffer(ring.slots))
        self._vectors = ctypes.create_string_buffer(_VECTOR.size * ring.capacity)
        self._fresh = self._every_call()
        self._calls = bytearray(self._fresh)
        self._address = ctypes.addressof(ctypes.c_char.from_buffer(self._calls))
        self._ready = 0  # slots before this number may be handed to the kernel
        self.emptied = False  # whether the last call left nothing in the socket

    def receive(self) -> int:
        """Put what waits into the ring, oldest first; return how many frames that were.

        When the ring is full nothing is received: the rest waits in the socket, where the kernel
        counts what it has to drop.

        Raises
        ------
        OSError
            The interface went down, the socket is gone ...
        """
        ring = self._ring
        head = ring.word(Word.HEAD)
        if head + BATCH > self._ready:
            self._renew(ring.word(Word.TAIL))
        start = head % ring.capacity
        most = min(BATCH, self._ready - head, ring.capacity - start)
        self.emptied = False
        if most == 0:
            ring.set_word(Word.FULL, ring.word(Word.FULL) + 1)
            return 0
        call = ctypes.c_void_p(self._address + start * CALL_BYTES)
        count = int(self._call(self._descriptor, call, most, _DO_NOT_WAIT, None))
        if count <= 0:
            code = ctypes.get_errno()
            if code not in (errno.EAGAIN, errno.EINTR):
                raise OSError(code, os.strerror(code))
            self.emptied = code == errno.EAGAIN
            return 0
        self.emptied = count < most
        ring.set_word(Word.HEAD, head + count)
        return count

    def _renew(self, tail: int) -> None:
        """Make the next slots ready, if the owner has taken what was in them.

        The kernel has overwritten their room for stamps with what it used; an old stamp must not
        pass for a new one.
        """
        ring, first = self._ring, self._ready
        if first + RENEW > tail + ring.capacity:
            return
        start = first % ring.capacity
        calls = slice(start * CALL_BYTES, (start + RENEW) * CALL_BYTES)
        self._calls[calls] = memoryview(self._fresh)[calls]
        ring.blank(start, RENEW)
        self._ready = first + RENEW

    def _every_call(self) -> bytes:
        """Return one mmsghdr for each slot: where its frame goes, and where its stamp."""
        vectors, calls = ctypes.addressof(self._vectors), bytearray()
        for slot in range(self._ring.capacity):
            at = self._slots + slot * SLOT_BYTES
            _VECTOR.pack_into(self._vectors, slot * _VECTOR.size, at + STAMP_BYTES, FRAME_BYTES)
            calls += _CALL.pack(0, 0, vectors + slot * _VECTOR.size, 1, at, STAMP_BYTES, 0, 0)
        return bytes(calls)
