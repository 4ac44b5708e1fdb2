"""One recording as a question: what was measured, and what the simulation said of it."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from agent.acquisition import Acquisition
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.thermal.stand_in import lacks_gearbox_temperature, with_stand_in
from agent.physics.twin import Effect

SIMULATED = "torque_simulated_nm"
"""What the user's own simulator predicts for the very run: it takes the twin's place."""

CORNERS = "acceleration_beside_rad_s2"
"""What the acceleration is at corners, beside differences of the speed: see `rows.corners`."""

OPTIONAL = (
    "gearbox_temperature_degc",
    "motor_temperature_degc",
    "ambient_temperature_degc",
    "velocity_command_rad_s",
    "position_command_rad",
    "position_arm_rad",
    SIMULATED,
)
"""Columns of contract section 2 that an explanation makes use of where they are recorded."""


@dataclass(frozen=True)
class Run:
    """One recording of one axis.

    Parameters
    ----------
    signals : Signals
        The columns that every estimator starts from.
    columns : mapping of str to ndarray, shape (n,)
        The optional columns by name, as far as recorded.
    started_s : float
        When it began, seconds since any instant that the runs share; NaN if not known.
    payload_kg : float
        NaN if not known.
    thinned_away_nm2 : float
        Mean square of the torque that was recorded and is not in it any more: see `rows.coarser`.
    recorded_every_s : float
        The period of the recording that was thinned; NaN where it was not.
    simulated_less : tuple of Effect
        What is taken off its recorded simulation: see `own_effects.other_way`.
    exchanged : bool
        Whether measured and simulated torque have changed places.
    """

    signals: Signals
    columns: Mapping[str, Floats] = field(default_factory=dict)
    started_s: float = math.nan
    payload_kg: float = math.nan
    thinned_away_nm2: float = 0.0
    recorded_every_s: float = math.nan
    simulated_less: tuple[Effect, ...] = ()
    exchanged: bool = False

    @property
    def name(self) -> str:
        """Return what the recording is called."""
        return self.signals.name

    @property
    def sampled_every_s(self) -> float:
        """Return the period that it was recorded with."""
        thinned = math.isfinite(self.recorded_every_s)
        return self.recorded_every_s if thinned else float(np.median(np.diff(self.signals.time_s)))

    @classmethod
    def from_columns(
        cls,
        columns: Mapping[str, Floats],
        gear_ratio: float,
        *,
        name: str,
        started_s: float = math.nan,
        payload_kg: float = math.nan,
        acquisition: Acquisition | None = None,
    ) -> Run:
        """Take a recording's columns, named as in contract section 2, less its doubtful rows."""
        known = {
            key: np.asarray(columns[key], dtype=np.float64) for key in OPTIONAL if key in columns
        }
        return cls(
            Signals.from_columns(columns, gear_ratio, name=name, acquisition=acquisition),
            {key: value for key, value in known.items() if np.isfinite(value).any()},
            started_s,
            payload_kg,
        )


def without_gearbox_temperature(runs: Sequence[Run]) -> bool:
    """Return whether every run has a motor's temperature, and none the gearbox's."""
    return bool(runs) and all(lacks_gearbox_temperature(run.columns) for run in runs)


def stood_in(runs: Sequence[Run]) -> tuple[Run, ...]:
    """Return runs with the motor's temperature in the gearbox's place."""
    return tuple(replace(run, columns=with_stand_in(run.columns)) for run in runs)


def are_simulated(runs: Sequence[Run]) -> bool:
    """Return whether all recordings carry a simulation."""
    return all(SIMULATED in run.columns for run in runs)
