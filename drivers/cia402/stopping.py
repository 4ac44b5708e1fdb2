"""How an axis is brought to rest: every means in turn, and an honest report.

1. Quick stop by RPDO at every SYNC, heartbeat kept, until samples show standstill; once more
   without the reader process, if there is one and no samples come.
2. No samples come, or they show that the drive stays enabled because no RPDO reaches it, or that it
   hardly brakes: quick stop by SDO, its ramp written once more before, standstill read by SDO.
3. It still hardly brakes, runs faster than when it was to brake, or stays enabled: the voltage is
   taken away, so that friction and the holding brake do it. At the ramp that was agreed upon it
   would have stood long ago; here it would run to its end stop.
4. That fails too, or the deadline has passed: NMT stop, and our heartbeat ends, so that the
   drive's own watchdog does what we could not.
"""

from __future__ import annotations

import enum
import math

from drivers.cia402 import objects
from drivers.cia402.config import Cia402Config
from drivers.cia402.exchange import Exchange
from drivers.cia402.network import NmtOrder
from drivers.cia402.sdo import SdoAccess
from drivers.cia402.words import Controlword, State, error_words, state_of
from drivers.errors import DriverError
from drivers.ports import DriveState, Goal, Sample, StopReport

_SILENCE_TIMEOUTS = 2.0
"""So many SYNC time-outs without a sample, or without obedience, and the PDO way is given up."""

_BRAKING_TIMES = 2.0
_SPEED_LEFT = 0.5
"""With more than this share of its speed left after so many times what braking takes, a joint runs
on: its drive brakes with less than a quarter of what was set."""

_FASTER = 1.25
_FASTER_RESTS = 10.0
"""Faster than so many times the speed from which it was to brake, and by so many times what counts
as rest, a joint is driven by the loop that was to hold it: no ramp will stop it."""

_ANSWERS = 3
"""Nobody lets go because of what one answer says: a bit of it may be wrong."""


class _Braked(enum.Enum):
    """What a joint does that its drive was told to brake."""

    AS_TOLD = enum.auto()
    HARDLY = enum.auto()
    FASTER = enum.auto()


_ENABLED = frozenset({State.ENABLED})
_UNDER_TORQUE = _ENABLED | {State.QUICK_STOP, State.FAULT_REACTION}

_TROUBLES = {
    _Braked.HARDLY: "the joint hardly braked",
    _Braked.FASTER: "the joint ran faster than when it was to brake",
}


class _Braking:
    """Whether a joint brakes about as hard as its drive was told to."""

    def __init__(self, config: Cia402Config) -> None:
        self._deceleration_rad_s2 = config.quick_stop_deceleration_rad_s2
        self._reaction_s = _SILENCE_TIMEOUTS * config.sync_timeout_s
        self._faster_by_rad_s = _FASTER_RESTS * config.rest_velocity_rad_s
        self._from_rad_s: float | None = None
        self._heeded_s = self._due_s = math.inf
        self._faster = 0  # speeds in a row

    def seen(self, now_s: float, velocity_rad_s: float) -> _Braked:
        """Take in one speed of a drive that is braking."""
        speed = abs(velocity_rad_s)
        if self._from_rad_s is None:
            self._from_rad_s = speed
            self._heeded_s = now_s + self._reaction_s
            self._due_s = self._heeded_s + _BRAKING_TIMES * speed / self._deceleration_rad_s2
        before = self._from_rad_s
        faster = speed > max(_FASTER * before, before + self._faster_by_rad_s)
        self._faster = self._faster + 1 if faster and now_s > self._heeded_s else 0
        if self._faster >= _ANSWERS:
            return _Braked.FASTER
        if now_s > self._due_s and speed > _SPEED_LEFT * before:
            return _Braked.HARDLY
        return _Braked.AS_TOLD


class _Stop:
    """One stop in progress."""

    def __init__(self, exchange: Exchange, deadline_s: float) -> None:
        self.exchange = exchange
        self.deadline_s = deadline_s
        self.started_s = exchange.clock.now()
        self.heard_s = self.started_s  # of the present attempt
        self.samples: list[Sample] = []
        self.troubles: list[str] = []
        self.still = 0
        self.obeyed = False  # a sample has shown that the drive is no longer enabled
        self.unbraked = ""  # why the voltage was taken away
        self.braked = _Braked.AS_TOLD  # and others that it does not brake all the same
        self._braking = _Braking(exchange.config)

    def by_pdo(self) -> bool:
        """Return whether samples have shown standstill.

        Ends when none come any more, and when they come and show a drive that does not obey.
        """
        config, clock = self.exchange.config, self.exchange.clock
        self.heard_s = began_s = clock.now()
        patience_s = _SILENCE_TIMEOUTS * config.sync_timeout_s
        while True:
            self._quick_stop()
            clock.sleep_until(clock.now() + config.stop_period_s)
            self._listen()
            if self.still >= config.rest_samples:
                return True
            now_s = clock.now()
            if now_s >= self.deadline_s:
                return False
            if now_s - self.heard_s > patience_s or self._bus_is_dead():
                self.troubles.append("no samples came while stopping")
                return False
            if self.braked is not _Braked.AS_TOLD:
                self.troubles.append(_TROUBLES[self.braked])
                return False
            if not self.obeyed and now_s - began_s > patience_s:
                self.troubles.append("the drive stayed enabled in spite of quick stop by PDO")
                return False

    def without_help(self) -> bool:
        """Return whether there was a reader to do without, now that nothing comes from it."""
        before_deadline = self.exchange.clock.now() < self.deadline_s
        return (
            before_deadline
            and self.braked is _Braked.AS_TOLD
            and self.exchange.owner.receive_without_help(suspected=True)
        )

    def by_sdo(self) -> bool:
        """Return whether the drive, asked object by object, has come to rest."""
        exchange = self.exchange
        sdo = SdoAccess(exchange.node, attempts=1)
        exchange.node.sdo.give_up_s = self.deadline_s
        try:
            if self.braked is _Braked.HARDLY:
                self._write_ramp_again(sdo)
            lost = self.braked is _Braked.FASTER  # a ramp would only be time to run in
            if lost:
                self._let_go(sdo, _TROUBLES[self.braked])
            else:
                sdo.order(objects.CONTROLWORD, Controlword.QUICK_STOP)
            return self._rest_read(sdo, released=lost)
        except DriverError as error:
            self._note(error)
            return False
        finally:
            exchange.node.sdo.give_up_s = math.inf

    def _write_ramp_again(self, sdo: SdoAccess) -> None:
        """Set how hard a quick stop brakes, as `open` did: somebody may have changed it since."""
        config = self.exchange.config
        if not config.has_quick_stop_deceleration:
            return
        ramp = config.scaling.acceleration_units(config.quick_stop_deceleration_rad_s2)
        try:
            sdo.write(objects.QUICK_STOP_DECELERATION, ramp)
        except DriverError as error:
            self._note(error)

    def _rest_read(self, sdo: SdoAccess, *, released: bool) -> bool:
        """Return whether what is read shows standstill; let go of a joint that does not brake.

        Ends early where a drive that was to let go does not.
        """
        exchange = self.exchange
        config, clock = exchange.config, exchange.clock
        patience_s = _SILENCE_TIMEOUTS * config.sync_timeout_s
        braking, heeded, due_s = _Braking(config), False, clock.now() + patience_s
        still = answers = 0
        while still < config.rest_samples and clock.now() < self.deadline_s:
            exchange.keep_alive()
            velocity_rad_s = config.scaling.velocity_rad_s(sdo.read(objects.VELOCITY))
            state = state_of(sdo.read(objects.STATUSWORD))
            slow = abs(velocity_rad_s) <= config.rest_velocity_rad_s
            still = still + 1 if slow and state is not State.ENABLED else 0
            answers += 1
            heeded = heeded or state not in (_UNDER_TORQUE if released else _ENABLED)
            trouble = None
            if not heeded and answers >= _ANSWERS and clock.now() > due_s:
                trouble = (
                    "the drive stayed under torque" if released else "the drive stayed enabled"
                )
            elif not released and state is not State.ENABLED:
                trouble = _TROUBLES.get(braking.seen(clock.now(), velocity_rad_s))
            if trouble is not None and released:
                self.troubles.append(trouble)
                return False
            if trouble is not None:
                self._let_go(sdo, trouble)
                released, heeded, answers = True, False, 0
                due_s = clock.now() + patience_s
            clock.sleep_until(clock.now() + config.stop_period_s)
        return still >= config.rest_samples

    def _let_go(self, sdo: SdoAccess, why: str) -> None:
        """Take the voltage away: friction and a holding brake are left."""
        sdo.order(objects.CONTROLWORD, Controlword.DISABLE_VOLTAGE)
        self.unbraked = why
        self.troubles.append(f"{why}, so its voltage was taken away")

    def by_silence(self) -> None:
        """Stop the node by NMT and let the drive's own watchdog miss us."""
        self.exchange.muted = True
        try:
            self.exchange.node.command(NmtOrder.STOP)
        except DriverError as error:
            self._note(error)

    def report(self, at_rest: bool, how: str) -> StopReport:
        """Return what was achieved, with every trouble on the way."""
        emergencies = [
            f"the drive sent the emergency {error_words(emergency.code)}"
            for emergency in self.exchange.node.emergencies
            if emergency.code & 0xFF00
        ]
        reason = "; ".join(dict.fromkeys([how, *self.troubles, *emergencies]))
        return StopReport(at_rest, tuple(self.samples), reason, self._loose_rad(), self.unbraked)

    def _loose_rad(self) -> float:
        """Return how far the motor moved after the drive had let go of it.

        What a single sample says is no motion: one wrong bit is thousands of turns.
        """
        loose = [s.position_rad for s in self.samples if s.state is DriveState.OFF]
        borne_out = [sorted(loose[k : k + 3])[1] for k in range(len(loose) - 2)]
        return max((abs(position - borne_out[0]) for position in borne_out), default=0.0)

    def _quick_stop(self) -> None:
        """Order it once; a bus that does not take the frame is noted, and tried again."""
        try:
            self.exchange.transmit(Goal.QUICK_STOP, 0.0)
        except DriverError as error:
            self._note(error)

    def _listen(self) -> None:
        """Take in what has come, whatever became of what was sent."""
        try:
            self._take(self.exchange.collect())
        except DriverError as error:
            self._note(error)

    def _take(self, samples: list[Sample]) -> None:
        """Count samples at rest, taken since the stop began; torque must have been taken back."""
        self.samples.extend(samples)
        for sample in samples:
            if sample.time_s < self.started_s:
                continue
            self.heard_s = self.exchange.clock.now()
            self.obeyed = self.obeyed or sample.state is not DriveState.ON
            if self.obeyed:
                self.braked = self._braking.seen(self.heard_s, sample.velocity_rad_s)
            slow = abs(sample.velocity_rad_s) <= self.exchange.config.rest_velocity_rad_s
            self.still = self.still + 1 if slow and sample.state is not DriveState.ON else 0

    def _note(self, error: DriverError) -> None:
        self.troubles.append(error.what.rstrip("."))

    def _bus_is_dead(self) -> bool:
        """Return whether the owner says that nothing more will come."""
        try:
            self.exchange.owner.check()
        except DriverError as error:
            self._note(error)
            return True
        return False


def stop_axis(exchange: Exchange, samples: list[Sample], deadline_s: float) -> StopReport:
    """Bring the axis to rest by every means, up to the clock's `deadline_s`; never raises.

    Parameters
    ----------
    exchange : Exchange
        Of the axis.
    samples : list of Sample
        Taken before and not yet handed out: the report begins with them.
    deadline_s : float
        On the exchange's clock.
    """
    exchange.owner.receive_without_help()
    stop = _Stop(exchange, deadline_s)
    stop.samples.extend(samples)
    if stop.by_pdo() or (stop.without_help() and stop.by_pdo()):
        return stop.report(True, "quick stop, standstill measured")
    if exchange.clock.now() < deadline_s and stop.by_sdo():
        return stop.report(True, "quick stop by SDO, standstill read by SDO")
    stop.by_silence()
    return stop.report(
        False, "standstill was not measured; the node was stopped by NMT and our heartbeat ended"
    )
