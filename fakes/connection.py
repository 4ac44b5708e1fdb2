"""The fake's side of the connection to its master: watched heartbeat, and what its loss does."""

from __future__ import annotations

from fakes.emergency import COMMUNICATION, CONNECTION_ABORTED, HEARTBEAT_LOST, Emergency
from fakes.heartbeat import HeartbeatConsumer
from fakes.object_dictionary import ObjectDictionary
from fakes.state_machine import Motion, State, StateMachine

ABORT_CONNECTION_OPTION = 0x6007
CONSUMER_HEARTBEAT = 0x1016


class Connection:
    """Watches the master's heartbeat (0x1016:1) and reacts to its loss (0x6007).

    Parameters
    ----------
    dictionary, machine, emergency
        Where the options stand, what is to react, and who reports.
    fault_sticks : bool
        Whether a fault from a lost connection needs NMT reset-communication before it can be
        reset.
    """

    def __init__(
        self,
        dictionary: ObjectDictionary,
        machine: StateMachine,
        emergency: Emergency,
        *,
        fault_sticks: bool,
    ) -> None:
        self._od = dictionary
        self._machine = machine
        self._emergency = emergency
        self._fault_sticks = fault_sticks
        self._consumer = HeartbeatConsumer()
        self.blocks_fault_reset = False

    @property
    def master(self) -> int:
        """Return the node id whose heartbeat is watched; 0 for none."""
        return self._consumer.node_id

    def configure(self) -> None:
        """Take object 0x1016:1 over; watching begins with the next heartbeat."""
        self._consumer.configure(self._od.number(CONSUMER_HEARTBEAT, 1))

    def renew(self) -> None:
        """Begin anew, as after NMT reset: the old connection's error is past."""
        self.blocks_fault_reset = False
        self._clear_unless_fault()
        self.configure()

    def seen(self, now_s: float) -> None:
        """Note a heartbeat of the master."""
        self._consumer.seen(now_s)
        self._clear_unless_fault()

    def is_lost(self, now_s: float) -> bool:
        """Return True once when the heartbeat has stayed away, after reporting and reacting."""
        if not self._consumer.has_expired(now_s):
            return False
        self._emergency.report(HEARTBEAT_LOST, COMMUNICATION)
        self.abort()
        return True

    def end(self) -> None:
        """React to an NMT stop or reset, which leaves a drive without torque as it is."""
        if self._machine.motion is not Motion.NO_TORQUE:
            self.abort()

    def abort(self) -> None:
        """React as object 0x6007 says; 0 goes on as if nothing had happened."""
        reaction = self._od.number(ABORT_CONNECTION_OPTION)
        if reaction == 1:
            self.blocks_fault_reset = self._fault_sticks
            if not self._emergency.active:
                self._emergency.report(CONNECTION_ABORTED, COMMUNICATION)
            self._machine.fault()
        elif reaction == 2:
            self._machine.disable_voltage()
        elif reaction == 3:
            self._machine.quick_stop()

    def _clear_unless_fault(self) -> None:
        if self._machine.state not in (State.FAULT, State.FAULT_REACTION_ACTIVE):
            self._emergency.clear(HEARTBEAT_LOST)
