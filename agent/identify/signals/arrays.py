"""The signals of one run as arrays: what every estimator starts from."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.acquisition import Acquisition
from agent.identify.result import Floats
from agent.samples import usable


@dataclass(frozen=True)
class Signals:
    """One recording's arrays, all of shape (n,), SI, motor side but for `position_arm_rad`.

    `valid` is False where a needed sample is no number that can be (`agent.samples`), and where the
    account calls a row doubtful: its motion and torque are NaN here, for they are of another time.
    `velocity_rad_s` is the drive's own, or None when it must be derived from `position_rad`; at
    least one of the two is there. `left_out` is how many rows are doubtful.
    """

    time_s: Floats
    torque_nm: Floats
    position_rad: Floats | None
    velocity_rad_s: Floats | None
    valid: NDArray[np.bool_]
    gear_ratio: float
    name: str = "recording"
    samples_lost: int = 0
    acquisition: Acquisition | None = None
    left_out: int = 0
    gearbox_temperature_degc: Floats | None = None
    velocity_command_rad_s: Floats | None = None
    position_command_rad: Floats | None = None
    position_arm_rad: Floats | None = None
    phase: NDArray[np.str_] | None = None

    @classmethod
    def from_columns(
        cls,
        columns: Mapping[str, NDArray[np.generic]],
        gear_ratio: float,
        *,
        name: str = "recording",
        samples_lost: int = 0,
        acquisition: Acquisition | None = None,
    ) -> Signals:
        """Take the contract's columns as they are; needed ones must be there.

        Parameters
        ----------
        columns : mapping of str to ndarray, shape (n,)
            Named as in contract section 2.
        gear_ratio : float
            Motor turns per arm turn.
        name : str
            What the recording is called in messages.
        samples_lost : int
            Samples that the recorder knows to be missing.
        acquisition : Acquisition, optional
            The recorder's account of every sample that it asked for.
        """

        def floats(key: str) -> Floats | None:
            return np.asarray(columns[key], dtype=np.float64) if key in columns else None

        time_s, torque_nm = floats("time_s"), floats("torque_nm")
        position_rad, velocity_rad_s = floats("position_rad"), floats("velocity_rad_s")
        if time_s is None or torque_nm is None:
            raise ValueError(
                f"{name}: expected columns time_s and torque_nm, got {sorted(columns)}"
            )
        if position_rad is None and velocity_rad_s is None:
            raise ValueError(f"{name}: expected position_rad or velocity_rad_s, found neither")
        if position_rad is not None and velocity_rad_s is not None:
            # A column without a single number was not recorded; the other one tells the motion.
            told = bool(usable(position_rad).any()), bool(usable(velocity_rad_s).any())
            position_rad = None if told == (False, True) else position_rad
            velocity_rad_s = None if told == (True, False) else velocity_rad_s
        left_out = 0
        if acquisition is not None and acquisition.doubtful_s:
            doubtful = acquisition.doubts(time_s)
            left_out = int(np.count_nonzero(doubtful))
            torque_nm = np.where(doubtful, np.nan, torque_nm)
            if position_rad is not None:
                position_rad = np.where(doubtful, np.nan, position_rad)
            if velocity_rad_s is not None:
                velocity_rad_s = np.where(doubtful, np.nan, velocity_rad_s)
        valid = usable(time_s) & usable(torque_nm)
        for signal in (position_rad, velocity_rad_s):
            if signal is not None:
                valid &= usable(signal)
        return cls(
            time_s=time_s,
            torque_nm=torque_nm,
            position_rad=position_rad,
            velocity_rad_s=velocity_rad_s,
            valid=valid,
            gear_ratio=gear_ratio,
            name=name,
            samples_lost=samples_lost,
            acquisition=acquisition,
            left_out=left_out,
            gearbox_temperature_degc=floats("gearbox_temperature_degc"),
            velocity_command_rad_s=floats("velocity_command_rad_s"),
            position_command_rad=floats("position_command_rad"),
            position_arm_rad=floats("position_arm_rad"),
            phase=np.asarray(columns["phase"], dtype=np.str_) if "phase" in columns else None,
        )
