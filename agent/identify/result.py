"""What an estimate says: frozen, honest, and written out as `stribeck.estimate/1`.

A parameter that the data do not carry has no interval and a reason; an estimate that the data do
not carry has reasons and no numbers at all.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.acquisition import Acquisition

Floats = NDArray[np.float64]

SCHEMA = "stribeck.estimate/1"


@dataclass(frozen=True)
class Parameter:
    """One identified number.

    Parameters
    ----------
    value : float
        In the unit that its name carries; NaN where it was not identified at all.
    ci95 : tuple of float or None
        Lower and upper end of the 95 % interval; None when not identified.
    identified : bool
        Whether the data carry it.
    reason : str
        Why not, in plain words; empty when identified.
    """

    value: float
    ci95: tuple[float, float] | None
    identified: bool = True
    reason: str = ""

    @classmethod
    def not_identified(cls, reason: str, value: float = math.nan) -> Parameter:
        """Return a parameter that the data do not carry, with the reason."""
        return cls(value=value, ci95=None, identified=False, reason=reason)

    def to_json(self) -> dict[str, Any]:
        """Return the contract's form; a value that is not a number is null."""
        out: dict[str, Any] = {
            "value": _number(self.value),
            "identified": self.identified,
        }
        if self.identified and self.ci95 is not None:
            out["ci95"] = [float(self.ci95[0]), float(self.ci95[1])]
        if self.reason:
            out["reason"] = self.reason
        return out


@dataclass(frozen=True)
class FrictionCurve:
    """Friction torque at each steady speed, gravity removed (thesis 4.21).

    All arrays have shape (n,) and run with rising speed; `ci95_nm` has shape (n, 2).
    `temperature_degc` is the gearbox's while each speed was passed, NaN where it was not recorded;
    empty where nobody asked.
    """

    velocity_rad_s: Floats
    friction_nm: Floats
    ci95_nm: Floats
    gravity_nm: Floats
    samples: NDArray[np.int64]
    temperature_degc: Floats = field(default_factory=lambda: np.empty(0))

    def to_json(self) -> dict[str, Any]:
        """Return the contract's form: parallel lists; `ci95_nm` as [lower, upper] pairs."""
        return {
            "velocity_rad_s": self.velocity_rad_s.tolist(),
            "friction_nm": self.friction_nm.tolist(),
            "ci95_nm": self.ci95_nm.tolist(),
            "gravity_nm": [_number(x) for x in self.gravity_nm],
            "samples": self.samples.tolist(),
        }


@dataclass(frozen=True)
class FrictionModelFit:
    """One friction law fitted to the friction curve.

    `rmse_nm` and `fit_percent` are over the steady means that the curve was made of, one for each
    speed and direction, gravity and offset removed; `reason` says why it was, or was not, selected.
    """

    model: str
    selected: bool
    rmse_nm: float
    fit_percent: float
    bic: float
    parameters: Mapping[str, Parameter]
    reason: str = ""

    def to_json(self) -> dict[str, Any]:
        """Return the contract's form."""
        return {
            "model": self.model,
            "selected": self.selected,
            "rmse_nm": _number(self.rmse_nm),
            "fit_percent": _number(self.fit_percent),
            "bic": _number(self.bic),
            "reason": self.reason,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
        }


@dataclass(frozen=True)
class RigidBodyFit:
    """The rigid-body regression of thesis (4.5) over all moving samples.

    `as_twin` are the values of a fit without what a twin cannot hold, a constant torque or friction
    that pushes, where it is no more than chance; empty where nothing is. `spring_took_part` and
    `torque_late_s`, by how much the torque comes later than the motion (0 where that does not
    show), are what stood beside the parameters in the fit. `straight_line` are Coulomb and viscous
    friction of the straight line that predicts where friction is bent, and the parameters are the
    friction law's; empty elsewhere. `rmse_nm` and `fit_percent` are of what predicts.
    """

    parameters: Mapping[str, Parameter]
    condition_number: float
    rmse_nm: float
    fit_percent: float
    as_twin: Mapping[str, float] = field(default_factory=dict)
    spring_took_part: bool = False
    torque_late_s: float = 0.0
    straight_line: Mapping[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """Return the contract's form."""
        return {
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "condition_number": _number(self.condition_number),
            "rmse_nm": _number(self.rmse_nm),
            "fit_percent": _number(self.fit_percent),
        }


@dataclass(frozen=True)
class ClosedLoopError:
    """The position of a run simulated in its drive's loop, against the recorded one.

    `relative_percent` is of the recorded position's deviation from its mean, for an angle has no
    zero of its own. The loop's gains, and how well they reproduce the torque that they were read
    from, stand beside it.
    """

    rmse_rad: float
    largest_rad: float
    relative_percent: float
    stiffness_nm_per_rad: float
    damping_nm_s_per_rad: float
    integral_nm_per_rad_s: float
    loop_torque_error_percent: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "rmse_rad": _number(self.rmse_rad),
            "largest_rad": _number(self.largest_rad),
            "relative_percent": _number(self.relative_percent),
            "loop": {
                "stiffness_nm_per_rad": _number(self.stiffness_nm_per_rad),
                "damping_nm_s_per_rad": _number(self.damping_nm_s_per_rad),
                "integral_nm_per_rad_s": _number(self.integral_nm_per_rad_s),
                "torque_error_percent": _number(self.loop_torque_error_percent),
            },
        }


@dataclass(frozen=True)
class OpenLoopError:
    """The root mean square error of the position after `horizon_s` without a loop."""

    horizon_s: float
    rmse_rad: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {"horizon_s": self.horizon_s, "rmse_rad": _number(self.rmse_rad)}


@dataclass(frozen=True)
class PositionError:
    """How far the rigid body, run forward, strays from the recorded position.

    `reason` says why there is no closed loop; it is empty where there is one.
    """

    closed_loop: ClosedLoopError | None
    open_loop: OpenLoopError | None
    reason: str

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON: what is not decidable is null, and `reason` says why."""
        return {
            "closed_loop": None if self.closed_loop is None else self.closed_loop.to_json(),
            "open_loop": None if self.open_loop is None else self.open_loop.to_json(),
            "reason": self.reason,
        }


@dataclass(frozen=True)
class Validation:
    """How well the rigid body, as identified, predicts a run that it has not seen.

    `relative_torque_error_percent` = 100 ||y - yhat|| / ||y||, `fit_percent` as in the contract;
    `position` is None where the run has no position.
    """

    recording: str
    rmse_nm: float
    fit_percent: float
    relative_torque_error_percent: float
    position: PositionError | None = None

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "recording": self.recording,
            "rmse_nm": _number(self.rmse_nm),
            "fit_percent": _number(self.fit_percent),
            "relative_torque_error_percent": _number(self.relative_torque_error_percent),
            "position": None if self.position is None else self.position.to_json(),
        }


@dataclass(frozen=True)
class Quality:
    """What the estimate stands on."""

    samples: int
    samples_lost: int
    masked: int
    sample_rate_hz: float
    jitter_s: float
    temperature_degc: tuple[float, float] | None
    acquisition: Acquisition | None = None

    def to_json(self) -> dict[str, Any]:
        """Return the contract's form; `acquisition` is null where no recording has an account."""
        return {
            "samples": self.samples,
            "samples_lost": self.samples_lost,
            "masked": self.masked,
            "sample_rate_hz": _number(self.sample_rate_hz),
            "jitter_s": _number(self.jitter_s),
            "temperature_degc": (
                None
                if self.temperature_degc is None
                else [_number(t) for t in self.temperature_degc]
            ),
            "acquisition": None if self.acquisition is None else self.acquisition.to_json(),
        }


@dataclass(frozen=True)
class Estimate:
    """Everything that was learned from one axis's recordings."""

    recordings: tuple[str, ...]
    decidable: bool
    reasons: tuple[str, ...]
    quality: Quality
    friction_curve: FrictionCurve | None = None
    friction_models: tuple[FrictionModelFit, ...] = ()
    rigid_body: RigidBodyFit | None = None
    validation: Validation | None = None
    sentence: str = ""
    notes: tuple[str, ...] = field(default=())

    @property
    def selected_model(self) -> FrictionModelFit | None:
        """Return the friction law that was selected, if any."""
        return next((m for m in self.friction_models if m.selected), None)

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.estimate/1` document (contract section 7)."""
        return {
            "schema": SCHEMA,
            "recordings": list(self.recordings),
            "decidable": self.decidable,
            "reasons": list(self.reasons),
            "sentence": self.sentence,
            "notes": list(self.notes),
            "friction_curve": None
            if self.friction_curve is None
            else self.friction_curve.to_json(),
            "friction_models": [m.to_json() for m in self.friction_models],
            "rigid_body": None if self.rigid_body is None else self.rigid_body.to_json(),
            "validation": None if self.validation is None else self.validation.to_json(),
            "quality": self.quality.to_json(),
        }


def _number(value: float | np.floating[Any]) -> float | None:
    """Return a JSON number, or None where there is none to give."""
    number = float(value)
    return number if math.isfinite(number) else None
