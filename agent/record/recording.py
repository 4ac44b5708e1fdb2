"""A recording as a value: columns and metadata, frozen, the same whatever file it came from."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.record.metadata import KEY, SCHEMA, Metadata
from agent.samples import usable

__all__ = [
    "FLOAT_COLUMNS",
    "KEY",
    "MINIMUM_SAMPLES",
    "MOTION_COLUMNS",
    "NEEDED_COLUMNS",
    "SCHEMA",
    "TEXT_COLUMNS",
    "Column",
    "Metadata",
    "Recording",
]

Column = NDArray[Any]

MINIMUM_SAMPLES = 100
NEEDED_COLUMNS = ("time_s", "torque_nm")
MOTION_COLUMNS = ("position_rad", "velocity_rad_s")  # at least one of the two

FLOAT_COLUMNS: Mapping[str, str] = {
    "time_s": "seconds from the recording's start",
    "position_rad": "motor angle in rad",
    "velocity_rad_s": "motor velocity in rad/s",
    "torque_nm": "motor torque in N m",
    "gearbox_temperature_degc": "gearbox temperature in degrees Celsius",
    "motor_temperature_degc": "motor temperature in degrees Celsius",
    "ambient_temperature_degc": "ambient temperature in degrees Celsius",
    "velocity_command_rad_s": "commanded motor velocity in rad/s",
    "position_command_rad": "commanded motor angle in rad",
    "position_arm_rad": "arm angle in rad",
    "torque_simulated_nm": "simulated motor torque in N m",
}
TEXT_COLUMNS: Mapping[str, str] = {"phase": "the part of the cycle"}


@dataclass(frozen=True, eq=False)
class Recording:
    """One run of one trajectory on one axis.

    Parameters
    ----------
    columns : mapping of str to ndarray, shape (n,)
        In the file's order. The contract's columns are float64, `phase` is text; columns that
        the contract does not know keep their own type, text and whatever has gaps as objects. The
        arrays are made read-only.
    metadata : Metadata
        What the file says about the run.
    source : str
        Where it came from, for messages and reports.

    Raises
    ------
    ValueError
        When the columns are not one-dimensional and of one length.
    """

    columns: Mapping[str, Column]
    metadata: Metadata
    source: str = "recording"

    def __post_init__(self) -> None:
        own: dict[str, Column] = {}
        for name, values in self.columns.items():
            own[name] = np.asarray(values).view()
            own[name].setflags(write=False)
        shapes = {values.shape for values in own.values()}
        if len(shapes) > 1 or any(len(shape) != 1 for shape in shapes):
            got = ", ".join(f"{name} {values.shape}" for name, values in own.items())
            raise ValueError(f"{self.source}: expected columns of one length (n,), got {got}")
        object.__setattr__(self, "columns", own)

    def __len__(self) -> int:
        """Return the number of samples, masked ones included."""
        return next((len(values) for values in self.columns.values()), 0)

    def __getitem__(self, name: str) -> Column:
        """Return one column; KeyError when there is none of this name."""
        return self.columns[name]

    def __contains__(self, name: object) -> bool:
        """Tell whether there is a column of this name."""
        return name in self.columns

    @property
    def robot(self) -> str:
        """Return which robot."""
        return self.metadata.robot

    @property
    def axis(self) -> int:
        """Return which axis."""
        return self.metadata.axis

    @property
    def gear_ratio(self) -> float:
        """Return motor turns per arm turn."""
        return self.metadata.gear_ratio

    @property
    def samples_lost(self) -> int:
        """Return how many samples are known to be missing; 0 where nobody counted."""
        return self.metadata.samples_lost or 0

    @property
    def valid(self) -> NDArray[np.bool_]:
        """Return a mask, shape (n,): False where time, torque or motion cannot be used."""
        mask = np.ones(len(self), dtype=np.bool_)
        for name in (*NEEDED_COLUMNS, *MOTION_COLUMNS):
            if name in self.columns:
                mask &= usable(self.columns[name])
        return mask

    @property
    def masked(self) -> int:
        """Return how many samples are kept but cannot be used."""
        return len(self) - int(np.count_nonzero(self.valid))

    def with_columns(self, columns: Mapping[str, Column]) -> Recording:
        """Return a recording with columns replaced in their place, or added at the end."""
        return replace(self, columns={**self.columns, **columns})

    def with_metadata(self, metadata: Metadata) -> Recording:
        """Return the same columns under other metadata."""
        return replace(self, metadata=metadata)

    def select(self, names: Iterable[str]) -> Recording:
        """Return a recording of these columns only, in this order."""
        return replace(self, columns={name: self.columns[name] for name in names})
