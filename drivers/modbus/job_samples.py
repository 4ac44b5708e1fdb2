"""A controller's own samples, put on the agent's time base and counted."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from drivers.errors import DriveStateError
from drivers.modbus.device import Value
from drivers.modbus.job_words import DRIVE_STATES, state_of
from drivers.ports import DriveState, Quality, Sample, SyncAccount

CLOCK_SLACK_S = 1.0
"""So much farther than ours a controller's clock may have gone between two looks."""


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
        self._seen: tuple[float, float] | None = None  # the controller's clock, and ours

    def see_clock(self, read: Mapping[str, Value], asked_s: float) -> None:
        """Note what the controller's clock said in answer to what was asked at `asked_s`.

        The smallest offset seen stays: no sample then has a time later than it was asked for, so
        that it never lies in the future, also when the controller's clock runs fast.

        Raises
        ------
        DriveStateError
            It went backward, or far ahead: nothing that was read with it can be believed, and no
            row of a recording may be earlier than the one before.
        """
        theirs_s = read["sample_time"].value
        if self._seen is not None:
            ahead_s, passed_s = theirs_s - self._seen[0], asked_s - self._seen[1]
            if not 0.0 <= ahead_s <= max(passed_s, 0.0) + CLOCK_SLACK_S:
                raise DriveStateError(
                    f"The controller's clock went by {ahead_s:.3f} s in {passed_s:.3f} s.",
                    "Look for a restart of its job program, or words in the wrong order.",
                )
        self._seen = theirs_s, asked_s
        self._offset_s = min(self._offset_s, asked_s - theirs_s)

    def take(self, read: Mapping[str, Value], now_s: float) -> Sample | None:
        """Return the sample of a block that was read at `now_s`, None when it is not new."""
        number = read["sample_number"].whole
        if number == self._number:
            return None
        self.see_clock(read, now_s)
        step = 1 if self._number is None else number - self._number & 0xFFFF
        self._number = number
        self.account = replace(
            self.account,
            expected=self.account.expected + step,
            received=self.account.received + 1,
            lost=self.account.lost + step - 1,
        )
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
