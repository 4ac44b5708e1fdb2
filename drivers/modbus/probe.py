"""A temperature transmitter on Modbus, as the port `TemperatureProbe`."""

from __future__ import annotations

from collections.abc import Mapping

from drivers.clock import Clock
from drivers.modbus.device import MappedDevice
from drivers.polling import Poller
from drivers.ports import TemperatureReading


class ModbusProbe:
    """One temperature register of a mapped device, read once a period.

    Parameters
    ----------
    device : MappedDevice
        TCP or RTU; it belongs to the probe from now on.
    register : str
        Its name in the map; the unit must be ``degC``.
    clock : Clock
        Stamps readings.
    period_s, timeout_s : float
        How often, and how long one reading may take.
    """

    def __init__(
        self,
        device: MappedDevice,
        register: str,
        clock: Clock,
        *,
        period_s: float,
        timeout_s: float,
    ) -> None:
        if device.map[register].unit != "degC":
            raise ValueError(
                f"{device.map.device}: {register} is in {device.map[register].unit!r}, not in degC"
            )
        self._device = device
        self._register = register
        self._clock = clock
        self._poller = Poller(
            self._read,
            clock,
            period_s=period_s,
            timeout_s=timeout_s,
            name=device.connection.where,
        )

    def open(self) -> Mapping[str, str | int | float]:
        """Connect and take the first reading."""
        try:
            self._poller.start()
        except BaseException:
            self.close()
            raise
        register = self._device.map[self._register]
        return {
            "kind": "modbus",
            "device": self._device.map.device,
            "where": self._device.connection.where,
            "register": self._register,
            "address": register.address,
            "confirmed": register.confirmed or self._device.map.confirmed,
        }

    def latest(self) -> TemperatureReading:
        """Return the newest reading, with what has gone wrong since."""
        reading = self._poller.latest()
        return reading if reading.reason else reading._replace(reason=self._poller.trouble)

    def close(self) -> None:
        """End the reading and let the line go."""
        self._poller.stop()
        self._device.connection.close()

    def _read(self, deadline_s: float) -> TemperatureReading:
        asked_s = self._clock.now()
        value = self._device.read((self._register,), deadline_s)[self._register]
        return TemperatureReading(value.value, asked_s, value.quality, value.reason)
