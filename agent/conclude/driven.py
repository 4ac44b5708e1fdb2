"""What recordings drove through, as far as a twin notes it."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from agent.identify.result import Floats
from agent.physics.learnt_over import ranges_of
from agent.record.recording import Recording


def driven(recordings: Sequence[Recording]) -> dict[str, tuple[float, float]]:
    """Return the ranges of arm angles, motor speeds and gearbox temperatures, as far as recorded.

    Parameters
    ----------
    recordings : sequence of Recording
        Of one axis.
    """
    columns: dict[str, list[Floats]] = {}
    for recording in recordings:
        for name in ("velocity_rad_s", "gearbox_temperature_degc"):
            if name in recording:
                columns.setdefault(name, []).append(np.asarray(recording[name], dtype=np.float64))
        if "position_rad" in recording:
            motor = np.asarray(recording["position_rad"], dtype=np.float64)
            arm = motor / recording.metadata.gear_ratio
            columns.setdefault("arm_position_rad", []).append(arm)
    return ranges_of({name: np.concatenate(parts) for name, parts in columns.items()})
