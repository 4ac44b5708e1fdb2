"""An RTD node (CiA 404) on the drive's bus, as the port `TemperatureProbe`.

It is asked by SDO from the control tick, one frame at a time and never waited for: the process
value (0x7130) first, then what the node thinks of it (0x6150); a reading counts when both have
come. Unit (0x6131) and decimals (0x6132) are read once, when it is opened.
"""

from __future__ import annotations

import math
import struct
from collections.abc import Mapping

from drivers.can.owner import CanBusOwner, Inbox
from drivers.cia402.network import CanopenNode
from drivers.cia402.objects import DEVICE_TYPE, SERIAL_NUMBER, VENDOR_ID, DriveObject
from drivers.cia402.sdo import SdoAccess
from drivers.clock import Clock
from drivers.errors import ConfigurationError, IdentityError, NodeMissingError, SdoError
from drivers.ports import Quality, TemperatureReading

PROFILE = 404
DEGREE_CELSIUS = 0x002D0000
"""CiA 303-2's code of the unit, prefix 0."""

NOT_VALID, TOO_HIGH, TOO_LOW = 0x01, 0x02, 0x04
_STATUS_WORDS = ((NOT_VALID, "not valid"), (TOO_HIGH, "above its range"), (TOO_LOW, "below it"))
_SENTINELS = (0x7FFF, -0x8000)
_REQUEST = struct.Struct("<BHB4x")
_EXPEDITED = struct.Struct("<BHB4s")
_UPLOAD, _ABORT = 0x40, 0x80


class RtdNode:
    """One channel of a CiA 404 node.

    Parameters
    ----------
    owner : CanBusOwner
        The bus; it stays open when the probe is closed.
    clock : Clock
        The one that the owner stamps with.
    node_id, channel : int
        1 to 127; 1 is the first channel.
    period_s, timeout_s : float
        How often it is asked, and how long an answer may take.
    """

    def __init__(
        self,
        owner: CanBusOwner,
        clock: Clock,
        *,
        node_id: int,
        channel: int,
        period_s: float,
        timeout_s: float,
    ) -> None:
        self._owner = owner
        self._clock = clock
        self._node_id = node_id
        self._value = DriveObject(0x7130, channel, "i16", "process value")
        self._unit = DriveObject(0x6131, channel, "u32", "unit")
        self._decimals = DriveObject(0x6132, channel, "u8", "decimals")
        self._status = DriveObject(0x6150, channel, "u8", "input status")
        self._period_s = period_s
        self._timeout_s = timeout_s
        self._degc_per_count = math.nan
        self._inbox: Inbox | None = None
        self._asked: DriveObject | None = None
        self._asked_s = -math.inf
        self._round_s = -math.inf  # when the value of this round was asked for
        self._raw = 0
        self._reading: TemperatureReading | None = None
        self._trouble = ""

    def open(self) -> Mapping[str, str | int | float]:
        """Identify the node, read unit and decimals, and take the first reading.

        Raises
        ------
        NodeMissingError, IdentityError, ConfigurationError, SdoError
            Nobody, no CiA 404 device, or another unit than degrees Celsius.
        """
        node = CanopenNode(self._owner, self._clock, self._node_id, self._timeout_s)
        try:
            sdo = SdoAccess(node, 2)
            identity = self._identify(sdo)
            decimals = sdo.read(self._decimals)
            if decimals > 6:
                raise ConfigurationError(
                    f"Node {self._node_id} gives {decimals} decimals (0x6132), expected 0 to 6.",
                    "Compare the object with the device's manual.",
                )
            self._degc_per_count = 10.0**-decimals
            asked_s = self._clock.now()
            self._raw = sdo.read(self._value)
            self._reading = self._judged(asked_s, sdo.read(self._status))
        finally:
            node.release()
        self._round_s = asked_s
        self._inbox = self._owner.subscribe((0x580 + self._node_id,))
        return {**identity, "kind": "cia404", "channel": self._value.subindex}

    def latest(self) -> TemperatureReading:
        """Return the newest reading, and ask for the next one when it is due; never waits."""
        if self._reading is None or self._inbox is None:
            raise NodeMissingError(f"Node {self._node_id} is not open.", "Open it first.")
        while self._inbox.frames:
            self._take(self._inbox.frames.popleft().data)
        now_s = self._clock.now()
        if self._asked is not None and now_s - self._asked_s > self._timeout_s:
            self._trouble = f"node {self._node_id} does not answer ({self._asked})"
            self._asked = None
        if self._asked is None and now_s - self._round_s >= self._period_s:
            self._round_s = now_s
            self._ask(self._value)
        reading = self._reading
        return reading if reading.reason else reading._replace(reason=self._trouble)

    def close(self) -> None:
        """Stop listening; may be repeated."""
        if self._inbox is not None:
            self._owner.unsubscribe(self._inbox)
            self._inbox = None

    def _identify(self, sdo: SdoAccess) -> dict[str, str | int | float]:
        try:
            device_type = sdo.read(DEVICE_TYPE)
        except SdoError as error:
            if error.abort_code is not None:
                raise
            raise NodeMissingError(
                f"Nobody answers under node id {self._node_id} on {self._owner.name}.",
                "Check the temperature node's power, its node id and the cable.",
            ) from error
        if device_type & 0xFFFF != PROFILE:
            raise IdentityError(
                f"Node {self._node_id} is a device of profile {device_type & 0xFFFF}, expected "
                f"{PROFILE} (measuring device).",
                "Check the node id in [axis.temperature].",
            )
        unit = sdo.read(self._unit)
        if unit != DEGREE_CELSIUS:
            raise ConfigurationError(
                f"Node {self._node_id} measures in unit 0x{unit:08X} (0x6131), expected "
                f"0x{DEGREE_CELSIUS:08X} (degrees Celsius).",
                "Set the unit of the channel, or name another channel.",
            )
        found: dict[str, str | int | float] = {"where": f"node {self._node_id}"}
        for name, item in (("vendor_id", VENDOR_ID), ("serial", SERIAL_NUMBER)):
            value = sdo.read_optional(item)
            if value is not None:
                found[name] = value
        return found

    def _ask(self, item: DriveObject) -> None:
        self._asked, self._asked_s = item, self._clock.now()
        self._owner.post(0x600 + self._node_id, _REQUEST.pack(_UPLOAD, item.index, item.subindex))

    def _take(self, data: bytes) -> None:
        """Take one answer; what was not asked for is left alone."""
        item = self._asked
        if item is None or len(data) != 8:
            return
        command, index, subindex, payload = _EXPEDITED.unpack(data)
        if (index, subindex) != (item.index, item.subindex):
            return
        self._asked = None
        if command == _ABORT or command & 0xE2 != 0x42:
            self._trouble = f"node {self._node_id} refuses {item}"
        elif item is self._value:
            (self._raw,) = struct.unpack_from("<h", payload)
            self._ask(self._status)
        else:
            self._trouble = ""
            self._reading = self._judged(self._round_s, payload[0])

    def _judged(self, asked_s: float, status: int) -> TemperatureReading:
        """Return the reading that value and status make together."""
        if self._raw in _SENTINELS:
            return TemperatureReading(
                math.nan, asked_s, Quality.ABSENT, f"the node has no value (0x7130 = {self._raw})"
            )
        wrong = [words for bit, words in _STATUS_WORDS if status & bit]
        if wrong:
            text = " and ".join(wrong)
            return TemperatureReading(
                math.nan, asked_s, Quality.BAD, f"the node calls its input {text} (0x6150)"
            )
        return TemperatureReading(self._raw * self._degc_per_count, asked_s, Quality.GOOD)
