"""Who gets which frame: identifiers to inboxes, and a count of what became of all the others."""

from __future__ import annotations

from collections.abc import Iterable

import can

from drivers.can.claims import Claims
from drivers.can.frames import BusCounts, Frame, Inbox
from drivers.can_reader.ring import SLOT
from drivers.errors import BusError, BusOverflowError

_EXTENDED, _REMOTE, _ERROR = 1 << 31, 1 << 30, 1 << 29  # linux/can.h, in the identifier
_STANDARD_ID_MAX = 0x7FF
_DATA_BYTES_MAX = 8
_STAMP_SLACK_S = 1e-4


class Routing:
    """The table of one bus. Frames come from one thread at a time; inboxes are read from another.

    Parameters
    ----------
    name : str
        What messages call the bus.
    wakes : bool
        Whether somebody waits at an inbox until a thread has put a frame into it.

    Attributes
    ----------
    counts : BusCounts
        What became of the frames so far.
    claims : Claims
        Which identifiers only we may send.
    """

    def __init__(self, name: str, *, wakes: bool) -> None:
        self.counts = BusCounts()
        self._name = name
        self._wakes = wakes
        self._routes: dict[int, Inbox] = {}
        self._inboxes: list[Inbox] = []
        self.claims = Claims()

    def subscribe(self, cob_ids: Iterable[int], limit: int) -> Inbox:
        """Return an inbox that gets every frame with one of `cob_ids` from now on.

        Raises
        ------
        BusError
            When another reader already has one of these ids.
        """
        inbox = Inbox(frozenset(cob_ids), limit)
        taken = inbox.cob_ids & self._routes.keys()
        if taken:
            listed = ", ".join(f"0x{cob_id:03X}" for cob_id in sorted(taken))
            raise BusError(
                f"On {self._name} the identifiers {listed} already have a reader.",
                "Two axes must not share a node id.",
            )
        # A new table each time: the owner thread reads it without a lock.
        self._routes = {**self._routes, **dict.fromkeys(inbox.cob_ids, inbox)}
        self._inboxes.append(inbox)
        return inbox

    def unsubscribe(self, inbox: Inbox) -> None:
        """Let go of an inbox; nothing happens when it was let go before."""
        if inbox in self._inboxes:
            self._inboxes.remove(inbox)
            self._routes = {k: v for k, v in self._routes.items() if v is not inbox}

    def check(self) -> None:
        """Raise where an inbox was full when a frame came; it says so until the bus is closed.

        Raises
        ------
        BusOverflowError
        """
        for inbox in self._inboxes:
            if inbox.overflowed:
                raise BusOverflowError(
                    f"On {self._name} frames came faster than they were taken away: "
                    f"{inbox.overflowed} are lost beyond {inbox.limit} waiting ones.",
                    "Lower the sample rate or relieve the computer, then start again.",
                )

    def message(self, message: can.Message, stamp_s: float) -> None:
        """Deliver one of python-can's messages, or count why it is none of ours."""
        if message.is_error_frame or message.is_remote_frame or message.is_extended_id:
            self._count_odd(
                message.is_error_frame * _ERROR
                | message.is_remote_frame * _REMOTE
                | message.is_extended_id * _EXTENDED
            )
            return
        data = bytes(message.data)
        self._deliver(Frame(stamp_s, message.arbitration_id, data, message.timestamp))

    def slots(
        self, slots: memoryview | bytes, ahead_s: float, oldest_s: float, newest_s: float
    ) -> None:
        """Route what the reader process has put into the ring, stamped by the kernel.

        A frame came after the ring was last known to be complete, and before now. A stamp that says
        otherwise was made before somebody set the wall clock, or is missing; it is moved to the
        nearer end, and counted.

        Parameters
        ----------
        slots : buffer
            One `SLOT` after the other; nothing of it is kept.
        ahead_s : float
            How far the wall clock is ahead of the monotonic one.
        oldest_s, newest_s : float
            Between which monotonic times the frames came.
        """
        routes, others, make = self._routes, self.claims.others, tuple.__new__
        routed = passed = 0
        for seconds, nanoseconds, can_id, length, data in SLOT.iter_unpack(slots):
            inbox = routes.get(can_id)
            if inbox is None and can_id in others and length <= _DATA_BYTES_MAX:
                others[can_id] += 1  # most of a full bus: no stamp, no value, no call
                passed += 1
                continue
            wall_s = seconds + nanoseconds * 1e-9
            stamp_s = wall_s - ahead_s
            if not oldest_s <= stamp_s <= newest_s:
                if not oldest_s - _STAMP_SLACK_S < stamp_s < newest_s + _STAMP_SLACK_S:
                    self.counts.restamped += 1
                stamp_s = min(max(stamp_s, oldest_s), newest_s)
            # Frame(...) and a call of `_deliver` would double what a frame costs
            frame = make(Frame, (stamp_s, can_id, data[:length], wall_s))
            if inbox is None or length > _DATA_BYTES_MAX or len(inbox.frames) >= inbox.limit:
                self._refuse(frame, length)
                continue
            inbox.frames.append(frame)
            routed += 1
        self.counts.routed += routed
        self.counts.unrouted += passed

    def _refuse(self, frame: Frame, length: int) -> None:
        """Count one of the reader's frames that no inbox takes, by the reason."""
        if frame.cob_id > _STANDARD_ID_MAX or length > _DATA_BYTES_MAX:
            self._count_odd(frame.cob_id)
        else:
            self._deliver(frame)

    def _deliver(self, frame: Frame) -> None:
        """Put one frame into its inbox, or count why it has none."""
        inbox = self._routes.get(frame.cob_id)
        if inbox is None:
            if self.claims.heard(frame.cob_id, frame.data):
                self.counts.own_echoes += 1
            else:
                self.counts.unrouted += 1
            return
        if len(inbox.frames) >= inbox.limit:
            inbox.overflowed += 1
            return
        self.counts.routed += 1
        inbox.frames.append(frame)
        if self._wakes:
            inbox.arrived.set()

    def _count_odd(self, can_id: int) -> None:
        """Count a frame that is no CANopen data frame, by the flags in its identifier."""
        if can_id & _ERROR:
            self.counts.error_frames += 1
        elif can_id & _REMOTE:
            self.counts.remote_frames += 1
        elif can_id & _EXTENDED:
            self.counts.extended += 1
        else:
            self.counts.malformed += 1
