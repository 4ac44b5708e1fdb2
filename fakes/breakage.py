"""What is broken on the fake now: the script's faults, once they have begun."""

from __future__ import annotations

from functools import partial

from fakes import faults as script
from fakes.drive_loop import DriveLoop, Runaway
from fakes.emergency import Emergency
from fakes.fault import Fault
from fakes.object_dictionary import ObjectDictionary
from fakes.sdo_server import abort_frame
from fakes.state_machine import StateMachine
from fakes.wire_faults import WireFault

_DOWNLOAD, _UPLOAD = 1, 2


class Breakage:
    """Flags and counters that the drive asks on its way; nothing is broken at first.

    Parameters
    ----------
    dictionary, loop, machine, emergency
        The parts of the drive that a fault acts on when it begins.
    """

    def __init__(
        self,
        dictionary: ObjectDictionary,
        loop: DriveLoop,
        machine: StateMachine,
        emergency: Emergency,
    ) -> None:
        self._od = dictionary
        self._loop = loop
        self._machine = machine
        self._emergency = emergency
        self.supplied = True
        self.connected = True  # the bus cable
        self.beats = True  # the drive's own heartbeat
        self.sensor_lost = False
        self.position_frozen = False
        self._unanswered_syncs = 0
        self._sdo_aborts: dict[int, int] = {}
        self._sdo_silent: dict[int, int] = {}

    def begin(self, fault: Fault) -> None:
        """Let a fault happen, or begin to last."""
        if isinstance(fault, WireFault | script.AdapterFails):
            raise TypeError(f"{fault.kind}: expected a fault of the drive; a Wire plays this one")
        self._begin_on_the_bus(fault)
        self._begin_in_the_drive(fault)

    def _begin_on_the_bus(self, fault: Fault) -> None:
        match fault:
            case script.SwallowSync():
                self._unanswered_syncs += fault.count
            case script.HeartbeatStops():
                self.beats = False
            case script.Unplugged() | script.PowerCut():
                self.connected = False
            case script.SdoAborts():
                self._sdo_aborts[fault.index << 8 | fault.subindex] = fault.code
            case script.SdoSilent():
                self._sdo_silent[fault.index << 8 | fault.subindex] = fault.count
            case _:
                return

    def _begin_in_the_drive(self, fault: Fault) -> None:
        match fault:
            case script.DriveFault():
                self._emergency.report(fault.code, fault.register)
                self._machine.fault()
            case script.PowerCut():
                self.supplied = False
                self._machine.reset()
            case script.WrongIdentity():
                self._od.set_factory(0x1018, 1, fault.vendor_id)
                self._od.set_factory(0x1018, 2, fault.product_code)
            case script.MapNotKept():
                self._od.on_write(fault.index, 0, partial(self._forget_map, fault.index))
            case script.VelocityRunaway():
                self._loop.runaway = Runaway(fault.velocity_rad_s, obeys_ramps=fault.obeys_ramps)
            case script.FrozenPosition():
                self.position_frozen = True
            case script.IgnoresQuickStop():
                self._machine.deaf_to_quick_stop = True
            case script.TakenOver():
                self._machine.taken_over = True
            case script.BrakesSoftly():
                self._loop.braking_share = fault.share
            case script.BrakeCloses():
                self._loop.plant.stuck_brake_nm = fault.brake_nm
            case script.TemperatureSentinel():
                self.sensor_lost = True
            case _:
                return

    def _forget_map(self, index: int, count: int) -> None:
        """Fall back to the factory's mapping as soon as a new one is complete."""
        if count:
            self._od.reset(index, index)

    def swallows_sync(self) -> bool:
        """Return whether this SYNC stays unanswered; call it once a SYNC."""
        if not self._unanswered_syncs:
            return False
        self._unanswered_syncs -= 1
        return True

    def sdo_fate(self, request: bytes) -> bytes | None:
        """Return what a broken object answers to an initiate request.

        Returns
        -------
        bytes or None
            An abort frame; empty for no answer at all; None when nothing is broken there.
        """
        if len(request) != 8 or request[0] >> 5 not in (_DOWNLOAD, _UPLOAD):
            return None
        key = int.from_bytes(request[1:3], "little") << 8 | request[3]
        if key in self._sdo_silent:
            self._sdo_silent[key] -= 1
            if self._sdo_silent[key] == 0:
                del self._sdo_silent[key]
            return b""
        if key in self._sdo_aborts:
            return abort_frame(key >> 8, key & 0xFF, self._sdo_aborts[key])
        return None
