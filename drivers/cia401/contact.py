"""A release contact on a CiA 401 input node, as the port `Release`.

The node sends its first TPDO (0x180 + node id: inputs 1 to 8 in the first byte) by an event timer;
a bit that is not heard for too long is no permit, so a cable that is out is a contact that is open.
A contact can only say yes or no: request and done go nowhere.
"""

from __future__ import annotations

import math

from drivers.can.owner import CanBusOwner, Inbox
from drivers.clock import Clock
from drivers.errors import BusError
from drivers.ports import Permit

TPDO1 = 0x180


class CanContact:
    """One input of a CiA 401 node.

    Parameters
    ----------
    owner : CanBusOwner
        The bus; it stays open when the contact is closed.
    clock : Clock
        The one that the owner stamps with.
    node_id : int
        1 to 127.
    bit : int
        Which input of the first eight, from 0.
    age_max_s : float
        How long the node may be silent.
    """

    def __init__(
        self, owner: CanBusOwner, clock: Clock, *, node_id: int, bit: int, age_max_s: float
    ) -> None:
        if not (1 <= node_id <= 127 and 0 <= bit <= 7):
            raise ValueError(f"expected node 1 to 127 and bit 0 to 7, got {node_id}, {bit}")
        self.where = f"input {bit + 1} of node {node_id} on {owner.name}"
        self._owner = owner
        self._clock = clock
        self._cob_id = TPDO1 + node_id
        self._mask = 1 << bit
        self._age_max_s = age_max_s
        self._inbox: Inbox | None = None
        self._closed_contact = False
        self._granted = False
        self._opened_since = False
        self._heard_s = -math.inf

    def open(self) -> None:
        """Begin to listen.

        Raises
        ------
        drivers.errors.BusError
            Another reader has this identifier.
        """
        self._inbox = self._owner.subscribe((self._cob_id,))

    def request(self) -> None:
        """Do nothing: a contact cannot be asked."""

    def permit(self) -> Permit:
        """Return whether the contact is closed, and lately heard to be; never waits."""
        if self._inbox is None:
            raise BusError(f"{self.where} is not open.", "Open it first.")
        self._owner.poll()
        while self._inbox.frames:
            frame = self._inbox.frames.popleft()
            self._heard_s = frame.stamp_s
            # A frame without its first byte says nothing, and nothing is no permit.
            self._closed_contact = bool(frame.data and frame.data[0] & self._mask)
            self._opened_since = self._opened_since or not self._closed_contact
        silent_s = self._clock.now() - self._heard_s
        if not silent_s <= self._age_max_s:
            known = f"for {silent_s:.2f} s" if math.isfinite(silent_s) else "yet"
            return Permit(False, f"{self.where} has not been heard {known}")
        if not self._closed_contact:
            return Permit(False, f"the release contact is open ({self.where})")
        if self._granted and self._opened_since:
            return Permit(False, f"the release contact was open for a moment ({self.where})")
        self._granted, self._opened_since = True, False
        return Permit(True, "")

    def done(self, *, well: bool) -> None:
        """Do nothing: a contact cannot be told, however it ended."""

    def close(self) -> None:
        """Stop listening. May be repeated."""
        if self._inbox is not None:
            self._owner.unsubscribe(self._inbox)
            self._inbox = None
