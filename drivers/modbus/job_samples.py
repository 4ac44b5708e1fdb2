"""A controller's own samples, put on the agent's time base and counted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from drivers.modbus.device import Value
from drivers.modbus.job_words import DRIVE_STATES, state_of
from drivers.ports import DriveState, Quality, Sample, SyncAccount


class ControllerSamples:
    """Turns blocks of registers into samples: each once, with the time at which it was taken.

    The controller takes samples in its own time and numbers them; a number that was skipped is a
    sample that was lost between two looks.

    Attributes
    ----------
    account : SyncAccount
        What became of them.
    """

    def __init__(self) -> None:
        self.account = SyncAccount(reader="modbus", stamps="controller")
        self._offset_s = math.inf  # from the controller's clock to ours
        self._number: int | None = None

    def see_clock(self, read: Mapping[str, Value], asked_s: float) -> None:
        """Note what the controller's clock said in answer to what was asked at `asked_s`.

        The smallest offset seen stays: no sample then has a time later than it was asked for, so
        that it never lies in the future, also when the controller's clock runs fast.
        """
        self._offset_s = min(self._offset_s, asked_s - read["sample_time"].value)

    def take(self, read: Mapping[str, Value], now_s: float) -> Sample | None:
        """Return the sample of a block that was read at `now_s`, None when it is not new."""
        number = read["sample_number"].whole
        if number == self._number:
            return None
        step = 1 if self._number is None else number - self._number & 0xFFFF
        self._number = number
        self.account = replace(
            self.account,
            expected=self.account.expected + step,
            received=self.account.received + 1,
            lost=self.account.lost + step - 1,
        )
        self.see_clock(read, now_s)
        temperature = read["gearbox_temperature"]
        good = temperature.quality is Quality.GOOD
        return Sample(
            time_s=read["sample_time"].value + self._offset_s,
            received_s=now_s,
            position_rad=read["position"].value,
            velocity_rad_s=read["velocity"].value,
            torque_nm=read["torque"].value,
            gearbox_temperature_degc=temperature.value if good else math.nan,
            state=DRIVE_STATES.get(state_of(read), DriveState.OFF),
            internal_limit_active=False,
            gearbox_temperature_reason=temperature.reason,
        )
