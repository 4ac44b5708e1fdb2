"""What the pictures need besides the estimate itself: arrays that identify made on its way."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.windows import SteadyWindow


@dataclass(frozen=True)
class RecordingView:
    """One recording as it is drawn.

    Parameters
    ----------
    signals : Signals
        What was recorded; n samples.
    windows : tuple of SteadyWindow
        The steady windows that the friction curve stands on.
    velocity_rad_s : ndarray, shape (n,), optional
        The velocity that the estimator worked with (derived, filtered); without it, the drive's
        own is drawn.
    torque_nm : ndarray, shape (n,), optional
        The measured torque as the estimator compared it (low-passed like its regressors);
        without it, the recorded one is compared.
    torque_predicted_nm : ndarray, shape (n,), optional
        The torque that the identified rigid body predicts.
    compared : ndarray of bool, shape (n,), optional
        The samples over which prediction and measurement are compared; all finite ones when None.
    validation : bool
        True for a run that the estimate has not seen.
    started_at : str
        ISO 8601, UTC; a label.
    """

    signals: Signals
    windows: tuple[SteadyWindow, ...] = ()
    velocity_rad_s: Floats | None = None
    torque_predicted_nm: Floats | None = None
    compared: NDArray[np.bool_] | None = None
    torque_nm: Floats | None = None
    validation: bool = False
    started_at: str = ""

    def __post_init__(self) -> None:
        """Refuse arrays and windows that do not fit the recording."""
        samples = self.signals.time_s.shape[0]
        arrays = {
            "velocity_rad_s": self.velocity_rad_s,
            "torque_nm": self.torque_nm,
            "torque_predicted_nm": self.torque_predicted_nm,
            "compared": self.compared,
        }
        for name, array in arrays.items():
            if array is not None and array.shape != (samples,):
                raise ValueError(
                    f"{self.signals.name}: expected {name} of shape ({samples},), got {array.shape}"
                )
        for window in self.windows:
            if not 0 <= window.start < window.stop <= samples:
                raise ValueError(
                    f"{self.signals.name}: expected a window inside 0 to {samples}, "
                    f"got {window.start} to {window.stop}"
                )

    @property
    def drawn_velocity_rad_s(self) -> Floats | None:
        """Return the velocity to draw: the estimator's, else the drive's own, else None."""
        if self.velocity_rad_s is not None:
            return self.velocity_rad_s
        return self.signals.velocity_rad_s

    @property
    def arm_position_deg(self) -> Floats | None:
        """Return the arm angle in degrees, q_arm = q_motor / N; None without a position."""
        if self.signals.position_rad is None:
            return None
        return np.degrees(self.signals.position_rad / self.signals.gear_ratio)

    @property
    def compared_torque_nm(self) -> Floats:
        """Return the measured torque that the prediction is held against."""
        return self.signals.torque_nm if self.torque_nm is None else self.torque_nm

    @property
    def drawn_prediction_nm(self) -> Floats | None:
        """Return the predicted torque, NaN where it is not compared; None without one."""
        if self.torque_predicted_nm is None or self.compared is None:
            return self.torque_predicted_nm
        return np.where(self.compared, self.torque_predicted_nm, np.nan)

    @property
    def residual_nm(self) -> Floats | None:
        """Return measured less predicted torque, NaN where the two are not compared."""
        predicted_nm = self.drawn_prediction_nm
        return None if predicted_nm is None else self.compared_torque_nm - predicted_nm


@dataclass(frozen=True)
class EstimateViews:
    """All recordings of one estimate, in the order in which the estimate names them."""

    recordings: tuple[RecordingView, ...] = ()
