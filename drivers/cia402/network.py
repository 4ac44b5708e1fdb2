"""canopen on top of our bus owner: SDO, NMT, EMCY and heartbeat of one node, without a thread.

canopen's own Notifier would be a second owner of the bus, and it swallows exceptions of callbacks.
Here frames wait in an inbox, and `pump` hands them to canopen on the control tick's own thread.
"""

from __future__ import annotations

import enum
import logging
import math
from typing import Any, NoReturn, cast

import canopen
from canopen.emcy import EmcyConsumer, EmcyError
from canopen.nmt import NmtMaster
from canopen.sdo.client import SdoClient
from canopen.sdo.exceptions import SdoCommunicationError

from drivers.can.owner import CanBusOwner
from drivers.clock import Clock

# canopen logs each SDO that is refused or given up. We raise those; where nobody has asked for a
# log, Python would print them to stderr once more, between our own words.
logging.getLogger("canopen").addHandler(logging.NullHandler())


class NmtOrder(enum.IntEnum):
    """CiA 301's orders to a node."""

    START = 0x01
    STOP = 0x02
    PRE_OPERATIONAL = 0x80
    RESET_COMMUNICATION = 0x82


class NmtState(enum.IntEnum):
    """What a node's heartbeat says of it."""

    BOOT_UP = 0
    STOPPED = 4
    OPERATIONAL = 5
    PRE_OPERATIONAL = 127


_EMCY_BYTES = 8
_SDO_BYTES = 8
_SPECIFIER, _WRITE, _READ, _ABORT = 0xE0, 0x20, 0x40, 0x80
_INBOX_LIMIT = 1024


class OwnedNetwork(canopen.Network):
    """A canopen network whose frames go through the bus owner."""

    def __init__(self, owner: CanBusOwner) -> None:
        super().__init__()
        self._owner = owner

    def send_message(self, can_id: int, data: Any, remote: bool = False) -> None:
        """Send one data frame through the owner; remote frames are refused."""
        if remote:
            raise NotImplementedError("remote frames are not used")
        self._owner.send(can_id, bytes(data))

    def send_periodic(
        self, can_id: int, data: Any, period: float, remote: bool = False
    ) -> NoReturn:
        """Refuse: what is sent cyclically outlives the agent's own decisions."""
        raise NotImplementedError("nothing is sent cyclically; the control tick sends")


class WaitingSdoClient(SdoClient):
    """canopen's SDO client, waiting on the injected clock instead of on real time.

    `give_up_s` is a deadline on that clock beyond which no answer is waited for. An answer about
    another object than the one asked about is another program's, which may read the drive beside
    us: it is passed over, where canopen would call it an error.
    """

    def __init__(self, node: CanopenNode, timeout_s: float) -> None:
        no_dictionary = canopen.ObjectDictionary()  # type: ignore[no-untyped-call]  # canopen is untyped here
        super().__init__(0x600 + node.node_id, 0x580 + node.node_id, no_dictionary)  # type: ignore[no-untyped-call]  # canopen is untyped here
        self.RESPONSE_TIMEOUT = timeout_s
        self.give_up_s = math.inf
        self._node = node
        self._asked = b""  # index and subindex of the request that waits; none inside a transfer

    def request_response(self, sdo_request: bytes) -> bytes:
        """Send one request and return the answer to it.

        What waits was said before we ask: the answer to another program, about this object perhaps.
        """
        self._node.hear()
        self.responses.queue.clear()
        initiates = sdo_request[0] & _SPECIFIER in (_WRITE, _READ)
        self._asked = bytes(sdo_request[1:4]) if initiates else b""
        return cast(bytes, super().request_response(sdo_request))  # type: ignore[no-untyped-call]  # canopen is untyped here

    def read_response(self) -> bytes:
        """Return the server's answer, raising canopen's errors for an abort or a time-out."""
        deadline_s = min(self._node.clock.now() + self.RESPONSE_TIMEOUT, self.give_up_s)
        while True:
            self._pass_over_others()
            if not self.responses.empty():
                return cast(bytes, super().read_response())  # type: ignore[no-untyped-call]  # canopen is untyped here
            if not self._node.wait(deadline_s):
                raise SdoCommunicationError("No SDO response received")

    def _pass_over_others(self) -> None:
        """Drop waiting answers about other objects; an abort may leave out which it is about."""
        waiting = self.responses.queue
        while self._asked and waiting:
            about = bytes(waiting[0][1:4])
            unsaid = waiting[0][0] == _ABORT and not any(about)
            if about == self._asked or unsaid:
                return
            waiting.popleft()


class CanopenNode:
    """One remote node's SDO client, NMT master, EMCY log and heartbeat.

    Parameters
    ----------
    owner : CanBusOwner
        Of the bus that the node is on.
    clock : Clock
        Stamps heartbeats and bounds waits.
    node_id : int
        1 to 127.
    sdo_timeout_s : float
        Wait for one SDO answer.
    """

    def __init__(
        self, owner: CanBusOwner, clock: Clock, node_id: int, sdo_timeout_s: float
    ) -> None:
        self.node_id = node_id
        self.clock = clock
        self.malformed = 0
        self.emergencies: list[EmcyError] = []
        self.heartbeat_s: float | None = None
        self.nmt_state: int | None = None
        self._owner = owner
        self._inbox = owner.subscribe(
            (0x080 + node_id, 0x580 + node_id, 0x700 + node_id), limit=_INBOX_LIMIT
        )
        self._network = OwnedNetwork(owner)
        self.sdo = WaitingSdoClient(self, sdo_timeout_s)
        self.sdo.network = self._network
        self._nmt = NmtMaster(node_id)
        self._nmt.network = self._network
        self._nmt.add_heartbeat_callback(self._note_state)
        emcy = EmcyConsumer()  # type: ignore[no-untyped-call]  # canopen is untyped here
        emcy.add_callback(self.emergencies.append)
        self._network.subscribe(0x080 + node_id, emcy.on_emcy)
        self._network.subscribe(0x580 + node_id, self.sdo.on_response)
        self._network.subscribe(0x700 + node_id, self._nmt.on_heartbeat)

    def pump(self) -> None:
        """Hand every waiting frame to canopen; cheap when there is none."""
        frames = self._inbox.frames
        while frames:
            frame = frames.popleft()
            data = self._whole(frame.cob_id - self.node_id, frame.data)
            if data is None:
                self.malformed += 1
                continue
            if frame.cob_id == 0x700 + self.node_id:
                self.heartbeat_s = frame.stamp_s
            self._network.notify(frame.cob_id, bytearray(data), frame.stamp_s)

    def hear(self) -> None:
        """Take in what has come by now, and hand it to canopen."""
        self._owner.poll()
        self.pump()

    def wait(self, deadline_s: float) -> bool:
        """Wait for a frame of this node until the clock's `deadline_s`; hand it to canopen."""
        came = self._owner.wait(self._inbox, deadline_s)
        self.pump()
        return came

    def command(self, order: NmtOrder) -> None:
        """Send an NMT command to this node."""
        self.hear()  # what waits was said before the order, and does not answer it
        self.nmt_state = None
        self._nmt.send_command(order)

    def release(self) -> None:
        """Stop listening; may be repeated."""
        self._owner.unsubscribe(self._inbox)

    def _note_state(self, state: int) -> None:
        self.nmt_state = state

    def _whole(self, service: int, data: bytes) -> bytes | None:
        """Return the data as canopen's decoders need it, None when nothing can be made of it.

        An emergency is never thrown away for its length.
        """
        if service == 0x080:
            return data[:_EMCY_BYTES].ljust(_EMCY_BYTES, b"\x00")
        if service == 0x580:
            return data if len(data) == _SDO_BYTES else None
        return data or None
