"""An RTD module on a serial line, as the port `TemperatureProbe`."""

from __future__ import annotations

from collections.abc import Mapping

from drivers.clock import Clock
from drivers.polling import Poller
from drivers.ports import TemperatureReading
from drivers.serial.adam import answer, question
from drivers.serial.line import SerialLine


class AdamProbe:
    """One channel of an ADAM-style module, read once a period.

    Parameters
    ----------
    line : SerialLine
        It belongs to the probe from now on.
    clock : Clock
        Stamps readings.
    address, channel : int
        Of the module, and on it.
    checksum : bool
        Whether the module is configured for checksums.
    period_s, timeout_s : float
        How often, and how long one reading may take.
    """

    def __init__(
        self,
        line: SerialLine,
        clock: Clock,
        *,
        address: int,
        channel: int,
        checksum: bool,
        period_s: float,
        timeout_s: float,
    ) -> None:
        self._line = line
        self._clock = clock
        self._address = address
        self._channel = channel
        self._checksum = checksum
        self._question = question(address, channel, checksum=checksum)
        self._poller = Poller(
            self._read,
            clock,
            period_s=period_s,
            timeout_s=timeout_s,
            name=f"module {address:02X} on {line.config.port}",
        )

    def open(self) -> Mapping[str, str | int | float]:
        """Open the port and take the first reading."""
        try:
            self._poller.start()
        except BaseException:
            self.close()
            raise
        return {
            "kind": "adam",
            "where": self._poller.name,
            "channel": self._channel,
            "checksum": int(self._checksum),
        }

    def latest(self) -> TemperatureReading:
        """Return the newest reading, with what has gone wrong since."""
        reading = self._poller.latest()
        return reading if reading.reason else reading._replace(reason=self._poller.trouble)

    def close(self) -> None:
        """End the reading and let the port go."""
        self._poller.stop()
        self._line.close()

    def _read(self, deadline_s: float) -> TemperatureReading:
        asked_s = self._clock.now()
        found = answer(self._line.ask(self._question, deadline_s), checksum=self._checksum)
        return TemperatureReading(found.value, asked_s, found.quality, found.reason)
