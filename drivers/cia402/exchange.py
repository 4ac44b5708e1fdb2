"""The exchange of one tick: order, SYNC and heartbeat out, samples in. It judges nothing.

`transmit` and `collect` are the hot path: a thousand times a second, stepped through a virtual bus.
"""

from __future__ import annotations

import math
import struct
from dataclasses import replace

from drivers.can.owner import CanBusOwner
from drivers.cia402.answers import Place, SyncedAnswer
from drivers.cia402.company import HEARTBEAT, SYNC
from drivers.cia402.config import Cia402Config
from drivers.cia402.modes import Rung
from drivers.cia402.network import CanopenNode, NmtState
from drivers.cia402.orders import disable_voltage, orders_of
from drivers.cia402.placing import Placing
from drivers.cia402.states import next_controlword
from drivers.cia402.sync import SyncLedger
from drivers.cia402.wanted import ProcessData
from drivers.cia402.words import INTERNAL_LIMIT_BIT, REDUCED, REMOTE_BIT, State, state_of
from drivers.clock import Clock
from drivers.errors import ConfigurationError, DriverError
from drivers.ports import Command, DriveState, Goal, Sample, SyncAccount

_ALIVE = bytes([NmtState.OPERATIONAL])


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
    rung : Rung
        The mode of operation.
    node : CanopenNode
        Pumped on each `collect`, so that EMCY and heartbeats are seen in the same tick.
    """

    def __init__(
        self,
        owner: CanBusOwner,
        clock: Clock,
        config: Cia402Config,
        rung: Rung,
        node: CanopenNode,
    ) -> None:
        pdos = ProcessData.of(config, rung)
        self.config = config
        self.rung = rung
        self.node = node
        self.owner = owner
        self.clock = clock
        self.ledger = SyncLedger(len(pdos.answers), config.sync_timeout_s, config.stop_period_s)
        self._placing = Placing(config.stop_period_s, config.scaling)
        self._taken: list[Sample] = []
        self.state: State | None = None
        self.statusword = 0
        self.left_enabled: State | None = None  # where it went when nobody had asked it to
        self.unheard = 0  # answers in a row of a drive that obeyed, and says it no longer does
        self.unreadable: DriverError | None = None
        self.muted = False  # no more heartbeats: the drive's own watchdog shall act
        self.last_heartbeat_s = -math.inf  # ours
        self._was_enabled = False
        self._was_remote = False
        self.has_had_torque = False
        self._next_heartbeat_s = -math.inf
        self._dropped_before = owner.reception().dropped_by_kernel or 0
        self.orders = orders_of(config, rung, pdos.orders)
        self._pdos = pdos
        self._codecs = tuple(pdo.codec() for pdo in pdos.answers)
        self._inboxes = tuple(owner.subscribe((pdo.cob_id,)) for pdo in pdos.answers)

    def transmit(self, goal: Goal, velocity_rad_s: float = 0.0, *, heartbeat: bool = True) -> None:
        """Send what leads towards `goal` without a position or a move of its own; see `follow`."""
        self.follow(Command(goal, velocity_rad_s), heartbeat=heartbeat)

    def follow(self, command: Command, *, heartbeat: bool = True) -> None:
        """Send the next controlword towards the goal with its set-point, SYNC, heartbeat when due.

        The set-point leaves the drive where it is unless the goal is ON and the drive has said
        that it is enabled.
        """
        if heartbeat:
            self.keep_alive()
        word = next_controlword(command.goal, self.state)
        self.orders.post(self.owner.post, word, command, self.state)
        self.ledger.sent(self.clock.now(), command.goal)
        self.owner.send(SYNC, b"")

    def disable_voltage(self) -> None:
        """Take torque away by RPDO, at once."""
        disable_voltage(self.owner.send, self._pdos.orders)

    def keep_alive(self) -> None:
        """Send our heartbeat when it is due and we are not muted."""
        now_s = self.clock.now()
        if now_s >= self._next_heartbeat_s and not self.muted:
            self.owner.post(HEARTBEAT + self.config.agent_node_id, _ALIVE)
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
        ledger.settle(heard_until_s, self._take)
        taken, self._taken = self._taken, []
        return taken

    def forget(self) -> None:
        """Begin to count anew, once the answers have been seen to come."""
        config = self.config
        self.ledger = SyncLedger(
            len(self._codecs), config.sync_timeout_s, config.stop_period_s, self.ledger.usual
        )
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

    def _take(self, answer: SyncedAnswer) -> Place:
        """Take one complete answer as a sample, unless the motion contradicts its place in time."""
        try:
            sample = self._sample(answer)
        except struct.error:
            self._note_unreadable(answer)
            return Place.UNKNOWN
        place = self._placing.judge(sample) if answer.contested else Place.UNKNOWN
        if place is Place.CONTRADICTED and answer.counted:
            place = Place.DOUBTFUL
        if place is not Place.CONTRADICTED:
            self._taken.append(sample)
        if place not in (Place.CONTRADICTED, Place.DOUBTFUL):
            self._placing.keep(sample)
        return place

    def _sample(self, answer: SyncedAnswer) -> Sample:
        """Decode one complete answer and follow the drive's state."""
        first, second = self._codecs
        statusword, torque, position = first.unpack(answer.answers[0])
        velocity, *temperature = second.unpack(answer.answers[1])
        state = state_of(statusword)
        self.state = state
        self.statusword = statusword
        self._follow(answer.goal, state)
        if state is State.ENABLED:
            self._listens(statusword)
        move = self.orders.heard(statusword, position)
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
            gearbox_temperature_reason="" if source is None else source.why_none(temperature[0]),
            move=move,
        )

    def _follow(self, goal: Goal, state: State | None) -> None:
        """Note it when the drive leaves operation enabled while the goal was ON throughout."""
        self.has_had_torque = self.has_had_torque or state is State.ENABLED
        if goal is not Goal.ON:
            self._was_enabled = False
        elif state is State.ENABLED:
            self._was_enabled = True
        elif self._was_enabled and state is not None and self.left_enabled is None:
            self.left_enabled = state

    def _listens(self, statusword: int) -> None:
        """Note it when an enabled drive, which obeyed controlwords, says that it no longer does.

        Without torque, or in a fault, a drive may say so and mean nothing by it.
        """
        remote = bool(statusword & REMOTE_BIT)
        self._was_remote = self._was_remote or remote
        self.unheard = self.unheard + 1 if self._was_remote and not remote else 0

    def _note_unreadable(self, answer: SyncedAnswer) -> None:
        """Keep the first answer whose length is not that of the mapping."""
        if self.unreadable is None:
            lengths = [len(data) for data in answer.answers]
            self.unreadable = ConfigurationError(
                f"Node {self.config.node_id} answers SYNC with {lengths} bytes, expected "
                f"{[codec.size for codec in self._codecs]}: its PDOs are not mapped as they were.",
                "Another program may have changed the mapping; find it, then start again.",
            )
