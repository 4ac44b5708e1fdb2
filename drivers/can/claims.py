"""What only this agent may send: whoever else does commands its drive, or changes how it stops.

A frame under our heartbeat's identifier feeds the drive's watchdog, whoever sends it, and one under
an order's identifier moves the joint. Neither shows in what the drive answers. Nor does it show,
before a stop is needed, that somebody has written a softer ramp or no watchdog into the drive: so
requests that write (SDO download) are told apart from those that only read, which are anybody's.

Most interfaces do not hand back what is sent through them, and then every such frame is somebody
else's. Some do (`udp_multicast`); there it takes more frames than were sent. Which kind it is has
been seen by the time at which identifiers are claimed: dozens of our own requests have gone out.
"""

from __future__ import annotations

from collections.abc import Iterable

_FIRST_REQUEST, _LAST_REQUEST = 0x601, 0x67F
_DOWNLOAD = 1
"""Command specifier of a request that begins to write an object (CiA 301, 7.2.4.3.3)."""

_WRITES = 0x1000
"""Beyond every identifier of 11 bits: marks requests that write."""


def writing_to(node_id: int) -> int:
    """Return what to claim so that nobody else writes objects of a node."""
    return _WRITES | asking(node_id)


def asking(node_id: int) -> int:
    """Return under what requests to a node are counted that write nothing."""
    return _FIRST_REQUEST - 1 + node_id


def _counted_as(cob_id: int, data: bytes) -> int:
    """Return under what a frame is counted: its identifier, and apart from it when it writes."""
    writes = _asks(cob_id) and data[:1] and data[0] >> 5 == _DOWNLOAD
    return _WRITES | cob_id if writes else cob_id


def _asks(cob_id: int) -> bool:
    return _FIRST_REQUEST <= cob_id <= _LAST_REQUEST


class Claims:
    """What was sent and heard under identifiers that nobody listens to; one thread at a time.

    Attributes
    ----------
    others : dict
        How often an identifier was heard that we do not send and whose data do not matter. Who has
        frames by the block counts here by himself: a call would cost more than the frame.
    """

    def __init__(self) -> None:
        self.others: dict[int, int] = {}
        self._sent: dict[int, int] = {}
        self._heard: dict[int, int] = {}
        self._claimed: tuple[int, ...] = ()
        self._comes_back = False

    def sent(self, cob_id: int, data: bytes = b"") -> None:
        """Count one frame of ours; before it goes out."""
        what = _counted_as(cob_id, data)
        if what in self.others:
            self._heard[what] = self.others.pop(what)
        self._sent[what] = self._sent.get(what, 0) + 1

    def heard(self, cob_id: int, data: bytes = b"") -> bool:
        """Count one frame that came from the bus; return whether we send the like, too."""
        what = _counted_as(cob_id, data)
        if what in self._sent or _asks(cob_id):
            self._heard[what] = self._heard.get(what, 0) + 1
            return what in self._sent
        self.others[what] = self.others.get(what, 0) + 1
        return False

    def claim(self, cob_ids: Iterable[int]) -> None:
        """Let only us send these from now on; what was heard before counts, too.

        Identifiers, and what `writing_to` returns.
        """
        self._claimed = tuple(cob_ids)
        came_back = sum(min(self._heard.get(one, 0), sent) for one, sent in self._sent.items())
        self._comes_back = 2 * came_back > sum(self._sent.values())

    def intruded(self) -> int | None:
        """Return the first claim that somebody else has broken, None if nobody has."""
        return next((cob_id for cob_id in self._claimed if self.of_others(cob_id)), None)

    def broken(self) -> int:
        """Return how many frames somebody else has sent so far that only we may send."""
        return sum(self.of_others(cob_id) for cob_id in self._claimed)

    def of_others(self, cob_id: int) -> int:
        """Return how many frames under an identifier somebody else has sent so far."""
        ours = self._sent.get(cob_id, 0) if self._comes_back else 0
        return max(0, self._heard.get(cob_id, 0) + self.others.get(cob_id, 0) - ours)
