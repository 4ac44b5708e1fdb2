"""What the fake exchanges while it is OPERATIONAL: answers to SYNC, events, set-points."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import can

from fakes.emergency import COMMUNICATION, PDO_LENGTH, Emergency
from fakes.object_dictionary import ObjectDictionary, SdoAbortError
from fakes.pdo import PdoConfiguration, ReceivePdo, TransmitPdo


class CyclicData:
    """The PDOs of one node as they were mapped when it went OPERATIONAL.

    Parameters
    ----------
    dictionary : ObjectDictionary
        What is mapped, and where it is mapped.
    emergency : Emergency
        Told of a PDO that is too short.
    may_be_mapped : callable
        Whether the node is in PRE-OPERATIONAL.
    send : callable
        Puts one frame on the bus: identifier and data.
    """

    def __init__(
        self,
        dictionary: ObjectDictionary,
        emergency: Emergency,
        *,
        may_be_mapped: Callable[[], bool],
        send: Callable[[int, bytes], None],
    ) -> None:
        self._od = dictionary
        self._emergency = emergency
        self._send = send
        self._configuration = PdoConfiguration(dictionary, may_be_mapped)
        self._receive: list[ReceivePdo] = []
        self._transmit: list[TransmitPdo] = []
        self._event_driven: list[TransmitPdo] = []

    @property
    def has_events(self) -> bool:
        """Return whether something is sent without being asked for."""
        return bool(self._event_driven)

    def begin(self) -> None:
        """Compile the mapping: the node goes OPERATIONAL."""
        self._receive, transmit = self._configuration.compile()
        self._transmit = [p for p in transmit if p.synchronous]
        self._event_driven = [p for p in transmit if not p.synchronous]

    def end(self) -> None:
        """Neither send nor hear any more: the node leaves OPERATIONAL."""
        self._receive, self._transmit, self._event_driven = [], [], []

    def handlers(self) -> dict[int, Callable[[can.Message], None]]:
        """Return who takes a frame, by its identifier."""
        return {pdo.cob_id: partial(self._take, pdo) for pdo in self._receive}

    def answer(self) -> None:
        """Answer a SYNC with the live values."""
        for pdo in self._transmit:
            data = pdo.on_sync(self._od.values)
            if data is not None:
                self._send(pdo.cob_id, data)

    def take_over(self) -> None:
        """Let the set-points act that have waited for a SYNC."""
        for pdo in self._receive:
            if pdo.waiting is not None:
                waiting, pdo.waiting = pdo.waiting, None
                self._apply(pdo, waiting)

    def tell_events(self, now_s: float) -> None:
        """Send what has changed, or what its timer is due for."""
        for pdo in self._event_driven:
            data = pdo.on_event(self._od.values, now_s)
            if data is not None:
                self._send(pdo.cob_id, data)

    def _take(self, pdo: ReceivePdo, message: can.Message) -> None:
        if len(message.data) < pdo.layout.size:
            self._emergency.report(PDO_LENGTH, COMMUNICATION)
        elif pdo.synchronous:
            pdo.waiting = message.data
        else:
            self._apply(pdo, message.data)

    def _apply(self, pdo: ReceivePdo, data: bytes | bytearray) -> None:
        for entry, value in zip(pdo.layout.entries, pdo.layout.unpack(data), strict=True):
            try:
                self._od.write_number(entry, value)
            except SdoAbortError:
                continue  # a PDO has no answer: a value out of range is not taken over
