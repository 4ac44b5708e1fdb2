"""What the fit of a flexible joint says: frozen, with intervals or reasons, and plain JSON."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Literal

from agent.identify.flexible.chain import Chain, Kind
from agent.identify.flexible.simulation import FlexibleJoint
from agent.identify.result import Parameter

SCHEMA = "stribeck.flexible/1"


@dataclass(frozen=True)
class Start:
    """Where one start of the search led.

    Parameters
    ----------
    origin : {"frequency-response", "random", "residual"}
        Where the start came from; the last one from what the lowest minimum before it left.
    rmse_nm : float
        Root mean square of what it left unexplained.
    outcome : {"best", "local", "unfinished"}
        The common minimum; another one, which is discarded; or none, the search being too slow to
        come below the best.
    """

    origin: Literal["frequency-response", "random", "residual"]
    rmse_nm: float
    outcome: Literal["best", "local", "unfinished"]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {"origin": self.origin, "rmse_nm": self.rmse_nm, "outcome": self.outcome}


@dataclass(frozen=True)
class FlexibleFit:
    """A flexible joint, as identified.

    Parameters
    ----------
    kind : {"two-mass", "three-mass"}
        How many masses the model has.
    friction : str
        The motor's friction law.
    decidable : bool
        Whether the recordings carry the model; if not, `parameters` hold no number.
    reasons : tuple of str
        Why not, each with what to record instead.
    parameters : mapping of str to Parameter
        Motor side. `torque_delay_s` is how late the reported torque is against the motion.
    rmse_nm, rigid_rmse_nm : float
        What the flexible joint and the rigid one, fitted to the same samples, leave of the torque
        in the band of the fit. NaN when not decidable.
    fit_percent, rigid_fit_percent : float
        Contract section 6.
    condition_number : float
        Of the prediction-error Jacobian with columns of unit length.
    cutoff_hz : float
        Up to where the recordings were used.
    starts : tuple of Start
        What came of every start.
    gear_ratio : float
        Motor turns per arm turn.
    notes : tuple of str
        What the model lacks, in plain words; intervals reach as far as that may have moved their
        parameters.
    joint, rigid : FlexibleJoint or None
        The flexible joint, to simulate with, and the rigid one that was fitted to the same
        samples; None when not decidable.
    """

    kind: Kind
    friction: str
    decidable: bool
    reasons: tuple[str, ...]
    parameters: Mapping[str, Parameter]
    rmse_nm: float = math.nan
    rigid_rmse_nm: float = math.nan
    fit_percent: float = math.nan
    rigid_fit_percent: float = math.nan
    condition_number: float = math.nan
    cutoff_hz: float = math.nan
    starts: tuple[Start, ...] = ()
    gear_ratio: float = 1.0
    notes: tuple[str, ...] = ()
    joint: FlexibleJoint | None = None
    rigid: FlexibleJoint | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.flexible/1` document; what is not a number is null."""
        numbers = {
            name: _number(getattr(self, name))
            for name in (
                "rmse_nm",
                "rigid_rmse_nm",
                "fit_percent",
                "rigid_fit_percent",
                "condition_number",
                "cutoff_hz",
            )
        }
        return {
            "schema": SCHEMA,
            "kind": self.kind,
            "friction": self.friction,
            "decidable": self.decidable,
            "reasons": list(self.reasons),
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            **numbers,
            "notes": list(self.notes),
            "starts": [s.to_json() for s in self.starts],
        }


def joint_of(values: Mapping[str, float], gear_ratio: float) -> FlexibleJoint:
    """Return the joint that parameters by name describe.

    With `inertia_kg_m2` it is rigid; friction and gravity may be missing.
    """
    if "inertia_kg_m2" in values:
        return FlexibleJoint(
            values["inertia_kg_m2"], None, gear_ratio=gear_ratio, **_optional(values)
        )
    nearest = ("gear",) if "gear_inertia_kg_m2" in values else ()
    masses = (*nearest, "arm")
    chain = Chain(
        tuple(values[f"{m}_inertia_kg_m2"] for m in masses),
        tuple(values[_named(m, "spring_nm_per_rad", nearest)] for m in masses),
        tuple(values[_named(m, "damper_nm_s_per_rad", nearest)] for m in masses),
    )
    return FlexibleJoint(
        values["motor_inertia_kg_m2"], chain, gear_ratio=gear_ratio, **_optional(values)
    )


def _optional(values: Mapping[str, float]) -> dict[str, float]:
    """Return friction, gravity and offset, as far as they are there."""
    names = (
        "cubic_spring_nm_per_rad3",
        "coulomb_nm",
        "viscous_nm_s_per_rad",
        "static_extra_nm",
        "stribeck_velocity_rad_s",
        "exponent",
        "gravity_sin_nm",
        "gravity_cos_nm",
        "torque_offset_nm",
    )
    return {name: values[name] for name in names if math.isfinite(values.get(name, math.nan))}


def _named(mass: str, quantity: str, nearest: tuple[str, ...]) -> str:
    """Return a spring's or damper's name: with a single one, its mass is not said."""
    return f"{mass}_{quantity}" if nearest else quantity


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
