"""The drive's watchdog, proven: at standstill and under torque we fall silent, and see it let go.

A watchdog that reads back as configured (0x1016, 0x6007) is a promise; whether a drive keeps it is
seen only when nobody feeds it. Nothing cyclic is sent during the silence, as if this computer had
died; the drive is merely asked, object by object, for its statusword.

The proof holds for one session: from `open` to `close` of the axis. Within it the settings are
ours, and a power cycle or another device cannot go unnoticed; after it the settings are given
back, and the next session proves anew.
"""

from __future__ import annotations

import math
from collections.abc import Callable

from canopen.emcy import EmcyError

from drivers.cia402 import objects
from drivers.cia402.exchange import Exchange
from drivers.cia402.network import NmtOrder, NmtState
from drivers.cia402.sdo import SdoAccess
from drivers.cia402.supervision import judge
from drivers.cia402.words import REMOTE_BIT, State, error_words, state_of
from drivers.errors import DriveFaultError, DriveStateError, SdoError
from drivers.ports import Goal, WatchdogProof

_LOOK_S = 0.002
_RESET_S = 0.1
"""What a drive may take to leave a fault once it is told to."""

_FAULT_RESET = 0x0080
"""Here and nowhere else, and only for the fault that the proof itself has provoked."""

_WITHOUT_TORQUE = (State.SWITCH_ON_DISABLED, State.READY, State.SWITCHED_ON)
_IN_FAULT = (State.FAULT, State.FAULT_REACTION)


def prove(
    exchange: Exchange,
    sdo: SdoAccess,
    *,
    arm_again: Callable[[], None],
    still_rad_s: float,
    patience_s: float,
    watch: Callable[[], None],
) -> WatchdogProof:
    """Enable at standstill, stop heart-beating, see the drive react, make it ready again.

    Parameters
    ----------
    exchange : Exchange
        Of a drive that is OPERATIONAL and healthy, without torque.
    sdo : SdoAccess
        Of the same drive.
    arm_again : callable
        Sets the drive up again after NMT reset communication; it ends PRE-OPERATIONAL.
    still_rad_s : float
        A joint that is faster than this, motor side, is not at a standstill.
    patience_s : float
        What enabling, and taking torque away, may each last.
    watch : callable
        Called at every look; raises what should end the proof.

    Returns
    -------
    WatchdogProof
        The drive is OPERATIONAL and without torque again, whether it reacted or not.

    Raises
    ------
    drivers.errors.DriverError
        The joint moves, another fault than the provoked one, a drive that does not recover. The
        drive may have torque then: `stop` and `close` follow, as after any failure.
    """
    proof = _Proof(exchange, sdo, still_rad_s, patience_s, watch)
    proof.tick_until(Goal.ON, (State.ENABLED,))
    proof.fall_silent()
    recovery = proof.recover(arm_again)
    return WatchdogProof(
        reacted=proof.state is not State.ENABLED,
        timeout_s=exchange.config.agent_heartbeat_timeout_s,
        still_enabled_s=proof.still_enabled_s,
        reaction_s=proof.reaction_s,
        state=proof.state.value,
        emergencies=tuple(proof.emergencies),
        recovery=recovery,
    )


class _Proof:
    """One proof in progress."""

    def __init__(
        self,
        exchange: Exchange,
        sdo: SdoAccess,
        still_rad_s: float,
        patience_s: float,
        watch: Callable[[], None],
    ) -> None:
        self.exchange = exchange
        self.sdo = sdo
        self.still_rad_s = still_rad_s
        self.patience_s = patience_s
        self.watch = watch
        self.state = State.ENABLED
        self.still_enabled_s = 0.0
        self.reaction_s = math.nan
        self.emergencies: dict[str, None] = {}

    def tick_until(self, goal: Goal, states: tuple[State, ...]) -> None:
        """Tick at standstill, with heartbeats, until the drive is in one of `states`."""
        exchange, clock = self.exchange, self.exchange.clock
        deadline_s = clock.now() + self.patience_s
        while True:
            self.watch()
            exchange.transmit(goal, 0.0)
            clock.sleep_until(clock.now() + exchange.config.stop_period_s)
            samples = exchange.collect()
            failure = judge(exchange)
            if failure is not None:
                raise failure
            for sample in samples:
                self._insist_on_rest(sample.velocity_rad_s)
            if samples and exchange.state in states:
                return
            if clock.now() > deadline_s:
                raise DriveStateError(
                    f"The drive at node {exchange.config.node_id} is not "
                    f"'{states[0].value}' after {self.patience_s:g} s of the watchdog's proof "
                    f"(statusword 0x{exchange.statusword:04X}).",
                    "Look for an enabling switch, a stop input, or missing power of the drive"
                    f"{_locally(exchange.statusword)}.",
                )

    def fall_silent(self) -> None:
        """Send nothing that feeds the drive until it lets go, or until it should have."""
        exchange, clock = self.exchange, self.exchange.clock
        config = exchange.config
        limit_s = config.agent_heartbeat_timeout_s + config.agent_heartbeat_period_s
        look = SdoAccess(exchange.node, attempts=1)
        while True:
            self.watch()
            asked_s = clock.now() - exchange.last_heartbeat_s
            state = self._state_now(look, may_be_unanswered=asked_s <= limit_s)
            if state is not None and state is not State.ENABLED:
                self.state = state
                self.reaction_s = clock.now() - exchange.last_heartbeat_s
                return
            if state is State.ENABLED:
                self.still_enabled_s = asked_s
                velocity = look.read(objects.VELOCITY)
                self._insist_on_rest(config.scaling.velocity_rad_s(velocity))
                if asked_s > limit_s:
                    return
            clock.sleep_until(clock.now() + _LOOK_S)

    def recover(self, arm_again: Callable[[], None]) -> str:
        """Make the drive OPERATIONAL and healthy again, without torque; return what it needed."""
        recovery = "start"
        if self.state in _IN_FAULT:
            recovery = "fault reset"
            self._insist_on_own_fault()
            if not self._reset_fault():
                recovery = "reset communication"
                self._order(NmtOrder.RESET_COMMUNICATION)
                arm_again()
                if not self._reset_fault():
                    raise DriveFaultError(
                        f"The drive at node {self.exchange.config.node_id} stays in the fault "
                        "that the proof of its watchdog has provoked.",
                        "Switch the drive off and on; its manual says how a heartbeat fault ends.",
                        error_code=self._fault_code(),
                    )
        self._order(NmtOrder.START, NmtState.OPERATIONAL)
        self._take_own_emergencies()
        self.tick_until(Goal.OFF, _WITHOUT_TORQUE)
        self.exchange.forget()
        return recovery

    def _insist_on_rest(self, velocity_rad_s: float) -> None:
        if not abs(velocity_rad_s) <= self.still_rad_s:
            raise DriveStateError(
                f"The joint moves at {velocity_rad_s:.2f} rad/s while the watchdog is proven at "
                "standstill.",
                "Look for a drifting velocity controller, or a brake that does not hold.",
            )

    def _state_now(self, look: SdoAccess, *, may_be_unanswered: bool) -> State | None:
        """Return the drive's state as an SDO tells it; None while nobody can.

        A drive that reacts by going STOPPED (0x1029) answers no SDO until it is told otherwise.
        """
        node = self.exchange.node
        try:
            return state_of(look.read(objects.STATUSWORD))
        except SdoError as error:
            if error.abort_code is not None:
                raise
            if node.nmt_state == NmtState.STOPPED:
                self._order(NmtOrder.PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL)
            elif not may_be_unanswered:
                raise
            return None

    def _order(self, order: NmtOrder, state: NmtState | None = None) -> None:
        """Give an NMT order and wait for the heartbeat, or boot-up, that answers it."""
        exchange = self.exchange
        node, config = exchange.node, exchange.config
        node.command(order)
        deadline_s = exchange.clock.now() + config.state_timeout_s
        while node.nmt_state is None or state not in (None, node.nmt_state):
            if order is NmtOrder.START:
                exchange.keep_alive()
            node.wait(min(deadline_s, exchange.clock.now() + config.agent_heartbeat_period_s))
            if exchange.clock.now() >= deadline_s:
                raise DriveStateError(
                    f"Node {config.node_id} did not follow NMT order {order.name} within "
                    f"{config.state_timeout_s} s of the watchdog's proof.",
                    "Look for another NMT master on the bus.",
                )

    def _reset_fault(self) -> bool:
        """Reset the provoked fault and return whether the drive has left it."""
        exchange, clock = self.exchange, self.exchange.clock
        deadline_s = clock.now() + self.patience_s
        while state_of(self.sdo.read(objects.STATUSWORD)) is State.FAULT_REACTION:
            if clock.now() > deadline_s:
                return False
            clock.sleep_until(clock.now() + _LOOK_S)
        exchange.keep_alive()
        self.sdo.order(objects.CONTROLWORD, 0)
        self.sdo.order(objects.CONTROLWORD, _FAULT_RESET)
        deadline_s = clock.now() + _RESET_S
        while (left := state_of(self.sdo.read(objects.STATUSWORD)) not in _IN_FAULT) is False:
            if clock.now() > deadline_s:
                break
            exchange.keep_alive()
            clock.sleep_until(clock.now() + _LOOK_S)
        self.sdo.order(objects.CONTROLWORD, 0)
        return left

    def _fault_code(self) -> int:
        """Return the fault's code from 0x603F or, where a drive has none, from its emergency."""
        code = self.sdo.read_optional(objects.ERROR_CODE)
        sent = [e.code for e in self.exchange.node.emergencies if e.code & 0xFF00]
        return code or (int(sent[-1]) if sent else 0)

    def _insist_on_own_fault(self) -> None:
        """Refuse to touch any other fault than that of a lost heartbeat or connection (0x81xx)."""
        code = self._fault_code()
        sent = self.exchange.node.emergencies
        others = [e for e in sent if e.code & 0xFF00 and not _is_own(e)]
        if code & 0xFF00 == 0x8100 and not others:
            return
        code = int(others[0].code) if others else code
        raise DriveFaultError(
            f"The drive at node {self.exchange.config.node_id} went to fault during the "
            f"watchdog's proof, and not for the missing heartbeat: {error_words(code)}.",
            "A person must find the cause and clear the fault at the drive; the agent never does.",
            error_code=code,
        )

    def _take_own_emergencies(self) -> None:
        """Keep the emergencies that the silence has caused as evidence; `judge` finds any other."""
        sent = self.exchange.node.emergencies
        self.emergencies.update((f"0x{e.code:04X}", None) for e in sent if e.code & 0xFF00)
        sent[:] = [e for e in sent if not _is_own(e)]


def _is_own(emergency: EmcyError) -> bool:
    """Return whether an emergency is one of the connection, such as 0x8130: heartbeat lost."""
    return int(emergency.code) & 0xFF00 == 0x8100


def _locally(statusword: int) -> str:
    """Return where else to look at a drive that does not say that it obeys the bus."""
    if statusword & REMOTE_BIT:
        return ""
    return "; it does not say that it obeys the bus (bit 9, remote): see whether it is set to local"
