"""What is broken on the fake now: the script's faults, once they have begun."""

from __future__ import annotations

from fakes import faults as script
from fakes.sdo_server import abort_frame

_DOWNLOAD, _UPLOAD = 1, 2


class Breakage:
    """Flags and counters that the drive asks on its way; nothing is broken at first."""

    def __init__(self) -> None:
        self.connected = True  # the bus cable
        self.beats = True  # the drive's own heartbeat
        self.sensor_lost = False
        self.position_frozen = False
        self._unanswered_syncs = 0
        self._sdo_aborts: dict[int, int] = {}
        self._sdo_silent: dict[int, int] = {}

    def begin(self, fault: script.Fault) -> None:
        """Take over what a fault breaks here; a fault of the drive itself breaks nothing here."""
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
            case script.FrozenPosition():
                self.position_frozen = True
            case script.TemperatureSentinel():
                self.sensor_lost = True
            case _:
                return

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
