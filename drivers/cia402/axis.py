"""One CiA 402 drive, in the mode that the ladder gives it, as the port `Axis`.

Everything that moves or feeds the drive's watchdog leaves from `send` and `stop`, on the caller's
thread: if the caller hangs, SYNC, set-points and heartbeat end together and the drive stops by
itself. Faults latch here and are never reset.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import replace

from drivers.can.owner import CanBusOwner
from drivers.cia402 import objects
from drivers.cia402.company import refuse_company, refuse_intruder
from drivers.cia402.config import Cia402Config
from drivers.cia402.exchange import Exchange
from drivers.cia402.handing_back import hand_back, not_restored
from drivers.cia402.modes import Rung
from drivers.cia402.network import CanopenNode, NmtOrder, NmtState
from drivers.cia402.opening import (
    identify,
    mode_for,
    refuse_other_counts,
    refuse_other_units,
    refuse_unable,
    refuse_unhealthy,
    refuse_wider,
    units_of,
)
from drivers.cia402.sdo import SdoAccess
from drivers.cia402.settings import apply, held_of, leave_at_rest, snapshot
from drivers.cia402.stopping import stop_axis
from drivers.cia402.supervision import judge
from drivers.cia402.waiting import (
    await_answers,
    bring,
    mode_taken,
    prove_answers,
    sinks_at,
    state_found,
)
from drivers.cia402.wanted import ProcessData
from drivers.cia402.watchdog_proof import prove
from drivers.clock import Clock
from drivers.errors import DriverError, DriveStateError, JointSinksError
from drivers.ports import (
    AxisEvidence,
    Command,
    Goal,
    Sample,
    StopReport,
    SyncAccount,
    WatchdogProof,
)

Journal = Callable[[Mapping[str, int]], None]
"""Told what a drive was set to, before the first of it is overwritten."""


class Cia402Axis:
    """A CiA 402 drive on a CAN bus; one object serves one session, from `open` to `close`.

    One open axis at a time on a bus: its SYNC is the only one, so a second open axis would find
    answers that it never asked for, and says so (`SyncUnansweredError`). Other drives of a robot
    are watched (`drivers.cia402.watching`); what they answer to the SYNC is theirs.

    Parameters
    ----------
    owner : CanBusOwner
        The bus; it stays open when the axis is closed.
    config : Cia402Config
        How the drive is reached, armed, supervised and read.
    clock : Clock
        The one that the owner stamps with.
    journal : callable, optional
        Given every object that is about to be overwritten, with its value, so that a next start
        can `restore` what a crash left.
    """

    def __init__(
        self,
        owner: CanBusOwner,
        config: Cia402Config,
        clock: Clock,
        journal: Journal | None = None,
    ) -> None:
        self._owner = owner
        self._config = config
        self._clock = clock
        self._journal = journal
        self._node: CanopenNode | None = None
        self._exchange: Exchange | None = None
        self._found: dict[str, int] = {}
        self._held: dict[str, int] = {}  # what must read in the end as it does now
        self._found_state = NmtState.PRE_OPERATIONAL
        self._ready: list[Sample] = []
        self._failure: DriverError | None = None
        self._account = SyncAccount()
        self._closed = False
        self._opened = False

    def open(self) -> AxisEvidence:
        """Identify, snapshot, map and arm the drive; it stays without torque.

        The drive begins to watch our heartbeat when it first hears it, with the first `send`.

        Raises
        ------
        NodeMissingError, IdentityError, DriveFaultError, DriveStateError, ConfigurationError,
        IntruderError
            As `opening` and `company` refuse; nothing has been changed then.
        SdoError, SyncUnansweredError, HeartbeatLostError, BusError
            What the drive did not take or answer; `close` restores what had been written.
        """
        if self._node is not None or self._closed:
            raise DriveStateError("This axis object has been opened before.", "Make a new one.")
        config = self._config
        node = CanopenNode(self._owner, self._clock, config.node_id, config.sdo_timeout_s)
        self._node = node
        sdo = SdoAccess(node, config.sdo_attempts, self._refuse_intruder)
        identity = identify(sdo, config, self._owner.name)
        refuse_unhealthy(sdo, config.node_id)
        refuse_unable(sdo, config)
        units = units_of(sdo)
        refuse_other_counts(config, units)
        refuse_other_units(config, units)
        choice = mode_for(sdo, config)
        orders = [pdo.cob_id for pdo in ProcessData.of(config, choice.rung).orders]
        refuse_company(self._owner, self._clock, config, sdo, orders)
        found = {
            objects.HEARTBEAT_PRODUCER.key: sdo.read(objects.HEARTBEAT_PRODUCER),
            **snapshot(sdo, config, choice.rung),
        }
        refuse_wider(config, found)
        if self._journal is not None:
            self._journal(found)
        self._refuse_intruder()  # while the journal was written, too; there is nothing to give back
        self._found = found
        settings = {
            objects.HEARTBEAT_PRODUCER.key: sdo.set(
                objects.HEARTBEAT_PRODUCER, config.drive_heartbeat_period_ms
            )
        }
        self._found_state = state_found(node, config, self._refuse_intruder)
        self._bring(NmtOrder.PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL)
        settings.update(self._set_up(sdo, choice.rung))
        self._exchange = Exchange(self._owner, self._clock, config, choice.rung, node)
        self._bring(NmtOrder.START, NmtState.OPERATIONAL)
        prove_answers(self._exchange)
        self._opened = True
        self._held = {**held_of(settings, config, choice.rung), **units}
        return AxisEvidence(
            identity=identity,
            settings=settings,
            found=dict(found),
            mode=choice.rung.word,
            mode_reason=choice.reason,
            set_points=choice.rung.set_points,
            units=units,
        )

    def prove_watchdog(
        self, *, still_rad_s: float, patience_s: float, watch: Callable[[], None]
    ) -> WatchdogProof:
        """Fall silent at standstill, under torque, and see the drive react; it ends without torque.

        As `drivers.cia402.watchdog_proof.prove`, on an open axis.
        """
        exchange, node = self._running(), self._node
        assert node is not None  # an axis that is open has one
        sdo = SdoAccess(node, self._config.sdo_attempts, self._refuse_intruder)

        def arm_again() -> None:
            sdo.set(objects.HEARTBEAT_PRODUCER, self._config.drive_heartbeat_period_ms)
            self._bring(NmtOrder.PRE_OPERATIONAL, NmtState.PRE_OPERATIONAL)
            self._set_up(sdo, exchange.rung)

        return prove(
            exchange,
            sdo,
            arm_again=arm_again,
            still_rad_s=still_rad_s,
            patience_s=patience_s,
            watch=watch,
        )

    def send(self, command: Command) -> None:
        """Send set-point, SYNC and (when due) the heartbeat; never waits for an answer.

        Raises
        ------
        ValueError
            A set-point of the mode that is not finite, or beyond the drive's integer, with the
            goal ON.
        DriveStateError
            The axis is not open.
        BusError
            The frame does not go out.
        DriverError
            With the goal ON after a failure: that failure again.
        """
        if command.goal is Goal.ON and not math.isfinite(command.velocity_rad_s):
            raise ValueError(f"velocity must be finite, got {command.velocity_rad_s} rad/s")
        if command.goal is Goal.ON and self._failure is not None:
            raise self._failure
        exchange = self._running()
        if command.goal is Goal.ON:
            exchange.orders.check(command)
        exchange.follow(command)

    def receive(self) -> tuple[Sample, ...]:
        """Return all samples that have arrived since the last call, oldest first; never waits.

        What had arrived before a failure is kept: `stop` hands it out.

        Raises
        ------
        DriverError
            EMCY, fault, heartbeat lost, SYNC unanswered, bus or worker dead. The first failure
            is raised again by every later call.
        """
        exchange = self._running()
        if self._failure is None:
            try:
                self._ready.extend(exchange.collect())
                self._failure = judge(exchange)
            except DriverError as error:
                self._failure = error
        if self._failure is not None:
            raise self._failure
        ready, self._ready = self._ready, []
        return tuple(ready)

    def stop(self, deadline_s: float) -> StopReport:
        """Quick-stop and wait, up to the clock's `deadline_s`, for a measured standstill.

        Never raises: whatever fails is in the report, and the other means are still tried.
        """
        if self._exchange is None or self._closed:
            return StopReport(at_rest=False, samples=(), reason="the axis is not open")
        ready, self._ready = self._ready, []
        return stop_axis(self._exchange, ready, deadline_s)

    def close(self) -> SyncAccount:
        """Take torque away, restore what `open` changed, let go of the node. May be repeated.

        Raises
        ------
        ConfigurationError
            Naming every object that could not be restored.
        JointSinksError
            The joint moves since its torque was taken away; the rest has been done all the same.
        """
        if self._closed:
            return self._account
        self._closed = True
        troubles: list[str] = []
        changed: list[str] = []
        sinks_rad_s = 0.0
        try:
            if self._found and self._node is not None:
                sinks_rad_s = self._take_torque_away()
                troubles, changed = hand_back(
                    self._owner,
                    self._node,
                    self._config,
                    self._found,
                    self._found_state,
                    self._held,
                )
        finally:
            if self._exchange is not None:
                if not self._account.expected:
                    self._account = self._exchange.account()
                self._account = replace(self._account, changed=tuple(changed))
                self._exchange.release()
            if self._node is not None:
                self._node.release()
        trouble = not_restored(self._config.node_id, troubles) if troubles else None
        if sinks_rad_s:
            raise JointSinksError(self._config.node_id, sinks_rad_s, self._account) from trouble
        if trouble is not None:
            raise trouble
        return self._account

    def _running(self) -> Exchange:
        """Return the exchange of an open axis."""
        if not self._opened or self._closed or self._exchange is None:
            raise DriveStateError("The axis is not open.", "Open it first.")
        return self._exchange

    def _refuse_intruder(self) -> None:
        refuse_intruder(self._owner, self._config)

    def _bring(self, order: NmtOrder, state: NmtState) -> None:
        """Bring the node into an NMT state, and look around meanwhile."""
        assert self._node is not None  # of an axis that is being opened, or is open
        bring(self._node, self._config, order, state, self._refuse_intruder)

    def _set_up(self, sdo: SdoAccess, rung: Rung) -> dict[str, int]:
        """Write limits, watchdog, PDOs and mode in PRE-OPERATIONAL; return what was read back."""
        settings = apply(sdo, self._config, rung, self._found)
        leave_at_rest(sdo, rung)
        settings[objects.MODE_DISPLAY.key] = mode_taken(sdo, rung, self._clock, self._config)
        return settings

    def _take_torque_away(self) -> float:
        """Send disable voltage by RPDO, at once; `hand_back` repeats it by SDO and looks.

        Return how fast the joint moves then, in rad/s; 0 where it rests, or nobody can say.
        """
        if self._exchange is None:
            return 0.0
        try:
            self._exchange.disable_voltage()
            await_answers(self._exchange)
            self._account = self._exchange.account()  # what follows is in no recording
            return sinks_at(self._exchange)
        except DriverError:
            return 0.0  # the bus says the same to the SDOs that follow, where it is reported
