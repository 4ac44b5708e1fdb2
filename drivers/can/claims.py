"""Identifiers that only this agent sends: whoever else sends one of them commands its drive.

A frame under our heartbeat's identifier feeds the drive's watchdog, whoever sends it, and one under
an order's identifier moves the joint. Neither shows in what the drive answers.

Most interfaces do not hand back what is sent through them, and then every such frame is somebody
else's. Some do (`udp_multicast`); there it takes more frames than were sent. Which kind it is has
been seen by the time at which identifiers are claimed: dozens of our own requests have gone out.
"""

from __future__ import annotations

from collections.abc import Iterable


class Claims:
    """What was sent and heard under identifiers that nobody listens to; one thread at a time."""

    def __init__(self) -> None:
        self._sent: dict[int, int] = {}
        self._heard: dict[int, int] = {}
        self._claimed: tuple[int, ...] = ()
        self._comes_back = False

    def sent(self, cob_id: int) -> None:
        """Count one frame of ours; before it goes out."""
        self._sent[cob_id] = self._sent.get(cob_id, 0) + 1

    def heard(self, cob_id: int) -> bool:
        """Count one frame that came from the bus; return whether we send this identifier, too."""
        self._heard[cob_id] = self._heard.get(cob_id, 0) + 1
        return cob_id in self._sent

    def claim(self, cob_ids: Iterable[int]) -> None:
        """Let only us send these from now on; what was heard before counts, too."""
        self._claimed = tuple(cob_ids)
        came_back = sum(min(self._heard.get(one, 0), sent) for one, sent in self._sent.items())
        self._comes_back = 2 * came_back > sum(self._sent.values())

    def intruded(self) -> int | None:
        """Return the first claimed identifier that somebody else has sent, None if nobody has."""
        for cob_id in self._claimed:
            ours = self._sent.get(cob_id, 0) if self._comes_back else 0
            if self._heard.get(cob_id, 0) > ours:
                return cob_id
        return None
