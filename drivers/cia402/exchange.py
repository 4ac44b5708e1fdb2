"""The exchange of one tick: order, SYNC and heartbeat out, samples in. It judges nothing.

`transmit` and `collect` are the hot path: a thousand times a second, stepped through a virtual bus.
"""

from __future__ import annotations

import math
import struct
from dataclasses import replace

from drivers.can.owner import CanBusOwner
from drivers.cia402.config import Cia402Config
from drivers.cia402.network import CanopenNode, NmtState
from drivers.cia402.settings import ProcessData
from drivers.cia402.states import next_controlword
from drivers.cia402.sync import SyncedAnswer, SyncLedger
from drivers.cia402.words import INTERNAL_LIMIT_BIT, REDUCED, Controlword, State, state_of
from drivers.clock import Clock
from drivers.errors import ConfigurationError, DriverError
from drivers.ports import DriveState, Goal, Sample, SyncAccount

_SYNC = 0x080
_HEARTBEAT = 0x700
_ALIVE = bytes([NmtState.OPERATIONAL])
_ORDER = struct.Struct("<Hi")


class Exchange:
    """Orders, SYNCs and answers of one drive whose PDOs are mapped.

    Parameters
    ----------
    owner : CanBusOwner
        The bus.
    clock : Clock
        Times SYNCs and heartbeats.
    config : Cia402Config
        Identifiers, scaling, periods.
    node : CanopenNode
        Pumped on each `collect`, so that EMCY and heartbeats are seen in the same tick.
    """

    def __init__(
        self, owner: CanBusOwner, clock: Clock, config: Cia402Config, node: CanopenNode
    ) -> None:
        pdos = ProcessData.of(config)
        self.config = config
        self.node = node
        self.owner = owner
        self.clock = clock
        self.ledger = SyncLedger(len(pdos.answers), config.sync_timeout_s, config.stop_period_s)
        self.state: State | None = None
        self.statusword = 0
        self.left_enabled: State | None = None  # where it went when nobody had asked it to
        self.unreadable: DriverError | None = None
        self.muted = False  # no more heartbeats: the drive's own watchdog shall act
        self.last_heartbeat_s = -math.inf  # ours
        self._was_enabled = False
        self._next_heartbeat_s = -math.inf
        self._dropped_before = owner.reception().dropped_by_kernel or 0
        self._order_id = pdos.orders.cob_id
        self._codecs = tuple(pdo.codec() for pdo in pdos.answers)
        self._inboxes = tuple(owner.subscribe((pdo.cob_id,)) for pdo in pdos.answers)

    def transmit(self, goal: Goal, velocity_rad_s: float, *, heartbeat: bool = True) -> None:
        """Send the next controlword towards `goal` with its velocity, SYNC, heartbeat when due.

        The velocity is 0 unless the goal is ON and the drive has said that it is enabled.
        """
        if heartbeat:
            self.keep_alive()
        follows = goal is Goal.ON and self.state is State.ENABLED
        units = self.config.scaling.velocity_units(velocity_rad_s) if follows else 0
        word = next_controlword(goal, self.state)
        self.owner.post(self._order_id, _ORDER.pack(word, units))
        self.ledger.sent(self.clock.now(), goal)
        self.owner.send(_SYNC, b"")

    def disable_voltage(self) -> None:
        """Take torque away by RPDO, at once."""
        self.owner.send(self._order_id, _ORDER.pack(Controlword.DISABLE_VOLTAGE, 0))

    def keep_alive(self) -> None:
        """Send our heartbeat when it is due and we are not muted."""
        now_s = self.clock.now()
        if now_s >= self._next_heartbeat_s and not self.muted:
            self.owner.post(_HEARTBEAT + self.config.agent_node_id, _ALIVE)
            self._next_heartbeat_s = now_s + self.config.agent_heartbeat_period_s
            self.last_heartbeat_s = self.clock.now()

    def collect(self) -> list[Sample]:
        """Take in everything that has arrived and return the complete samples, oldest first.

        A SYNC is lost when it was not answered while we listened, not when it is merely long ago.
        """
        heard_until_s = self.owner.heard_until_s
        self.owner.poll()
        self.node.pump()
        ledger = self.ledger
        for stream, inbox in enumerate(self._inboxes):
            frames = inbox.frames
            while frames:
                frame = frames.popleft()
                ledger.answered(stream, frame.stamp_s, frame.data)
        samples: list[Sample] = []
        for answer in ledger.settle(heard_until_s):
            try:
                samples.append(self._sample(answer))
            except struct.error:
                self._note_unreadable(answer)
        return samples

    def forget(self) -> None:
        """Begin to count anew, once the answers have been seen to come."""
        config = self.config
        self.ledger = SyncLedger(len(self._codecs), config.sync_timeout_s, config.stop_period_s)
        self._dropped_before = self.owner.reception().dropped_by_kernel or 0

    def account(self) -> SyncAccount:
        """Return what became of every SYNC, and how the answers were received."""
        reception = self.owner.reception()
        dropped = reception.dropped_by_kernel
        return replace(
            self.ledger.account(),
            reader=reception.reader,
            stamps=reception.stamps,
            receive_buffer_bytes=reception.receive_buffer_bytes,
            dropped_by_kernel=None if dropped is None else dropped - self._dropped_before,
        )

    def release(self) -> None:
        """Stop listening; may be repeated."""
        for inbox in self._inboxes:
            self.owner.unsubscribe(inbox)

    def _sample(self, answer: SyncedAnswer) -> Sample:
        """Decode one complete answer and follow the drive's state."""
        first, second = self._codecs
        statusword, torque, position = first.unpack(answer.answers[0])
        velocity, *temperature = second.unpack(answer.answers[1])
        state = state_of(statusword)
        self.state = state
        self.statusword = statusword
        self._follow(answer.goal, state)
        scaling = self.config.scaling
        source = self.config.temperature
        return Sample(
            answer.sent_s,
            answer.received_s,
            scaling.position_rad(position),
            scaling.velocity_rad_s(velocity),
            scaling.torque_nm(torque),
            math.nan if source is None else source.degc(temperature[0]),
            DriveState.FAULT if state is None else REDUCED[state],
            bool(statusword & INTERNAL_LIMIT_BIT),
        )

    def _follow(self, goal: Goal, state: State | None) -> None:
        """Note it when the drive leaves operation enabled while the goal was ON throughout."""
        if goal is not Goal.ON:
            self._was_enabled = False
        elif state is State.ENABLED:
            self._was_enabled = True
        elif self._was_enabled and state is not None and self.left_enabled is None:
            self.left_enabled = state

    def _note_unreadable(self, answer: SyncedAnswer) -> None:
        """Keep the first answer whose length is not that of the mapping."""
        if self.unreadable is None:
            lengths = [len(data) for data in answer.answers]
            self.unreadable = ConfigurationError(
                f"Node {self.config.node_id} answers SYNC with {lengths} bytes, expected "
                f"{[codec.size for codec in self._codecs]}: its PDOs are not mapped as they were.",
                "Another program may have changed the mapping; find it, then start again.",
            )
