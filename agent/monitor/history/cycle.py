"""One cycle of one joint as the monitor sees it: its friction curve and what it was run under."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from typing import Any

import numpy as np

from agent.identify.result import Estimate, Floats

_NORMAL_975 = 1.959963984540054
_FEWEST_POINTS = 3


@dataclass(frozen=True, order=True)
class Joint:
    """Which joint: cycles of another one never enter its history."""

    robot: str
    axis: int
    gear_ratio: float

    @property
    def label(self) -> str:
        """Return the joint in words."""
        return f"{self.robot} axis {self.axis} (gear {self.gear_ratio:g})"


@dataclass(frozen=True)
class CycleCurve:
    """The friction curve of one cycle, both directions averaged; all of shape (n,), speed rising.

    `deviation_nm` is one standard deviation of each point. How the points of one curve go wrong
    together is not known from one cycle; the scatter between healthy cycles shows it.
    """

    speed_rad_s: Floats
    friction_nm: Floats
    deviation_nm: Floats


@dataclass(frozen=True)
class Cycle:
    """What one recording of a joint's cycle says.

    Parameters
    ----------
    name : str
        Of the recording.
    joint : Joint
    started_s : float
        Seconds since 1970, UTC; NaN where the recording does not say.
    duration_s : float
    curve : CycleCurve or None
        None where the estimate is not decidable, and `reasons` say why.
    temperature_degc : float
        Mean gearbox temperature; NaN where none was recorded.
    payload_kg : float
        NaN where nobody said.
    load_nm : float
        Mean of the curve's |gravity|, motor side; NaN where it is not known.
    inertia_kg_m2, inertia_deviation_kg_m2 : float
        Of the rigid body; NaN where it was not identified.
    trajectory : str
        Name and parameters, one text for one trajectory.
    parts : mapping of str to str
        Serial numbers by part, such as ``gearbox`` or ``drive``.
    oil : str
        Empty where nobody said.
    model : str
        The robot's, as ``robot_model`` names it; empty where nobody said.
    event : str
        What was done to the joint right before, as the recording says; empty for nothing.
    fingerprint : str
        Of the samples: two recordings of the same one are one cycle.
    reasons : tuple of str
        Why there is no curve.
    """

    name: str
    joint: Joint
    started_s: float
    duration_s: float
    curve: CycleCurve | None
    temperature_degc: float = math.nan
    payload_kg: float = math.nan
    load_nm: float = math.nan
    inertia_kg_m2: float = math.nan
    inertia_deviation_kg_m2: float = math.nan
    trajectory: str = ""
    parts: Mapping[str, str] = field(default_factory=dict)
    oil: str = ""
    event: str = ""
    fingerprint: str = ""
    model: str = ""
    reasons: tuple[str, ...] = ()

    @property
    def started_at(self) -> str:
        """Return when it started, ISO 8601 in UTC; empty where that is not known."""
        if not math.isfinite(self.started_s):
            return ""
        return datetime.fromtimestamp(self.started_s, UTC).isoformat(timespec="seconds")

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON; what is not a number is null. `from_json` reads it back."""
        curve = self.curve
        return {
            "name": self.name,
            "robot": self.joint.robot,
            "axis": self.joint.axis,
            "gear_ratio": self.joint.gear_ratio,
            **{key: _number(getattr(self, key)) for key in _NUMBERS},
            **{key: getattr(self, key) for key in _TEXTS},
            "parts": dict(self.parts),
            "reasons": list(self.reasons),
            "curve": None
            if curve is None
            else {
                "speed_rad_s": curve.speed_rad_s.tolist(),
                "friction_nm": curve.friction_nm.tolist(),
                "deviation_nm": curve.deviation_nm.tolist(),
            },
        }

    @classmethod
    def from_json(cls, document: Mapping[str, Any]) -> Cycle:
        """Take what `to_json` gave.

        Raises
        ------
        KeyError, TypeError, ValueError
            The document is another.
        """
        curve = document["curve"]
        texts: dict[str, Any] = {key: str(document[key]) for key in _TEXTS}
        numbers: dict[str, Any] = {
            key: math.nan if document[key] is None else float(document[key]) for key in _NUMBERS
        }
        return cls(
            name=str(document["name"]),
            joint=Joint(document["robot"], int(document["axis"]), float(document["gear_ratio"])),
            curve=None if curve is None else CycleCurve(**{k: np.array(curve[k]) for k in _CURVE}),
            parts=dict(document["parts"]),
            reasons=tuple(document["reasons"]),
            **numbers,
            **texts,
        )


_CURVE = ("speed_rad_s", "friction_nm", "deviation_nm")
_TEXTS = ("trajectory", "oil", "event", "fingerprint", "model")
_NUMBERS = (
    "started_s",
    "duration_s",
    "temperature_degc",
    "payload_kg",
    "load_nm",
    "inertia_kg_m2",
    "inertia_deviation_kg_m2",
)


def cycle_of(
    estimate: Estimate,
    metadata: Mapping[str, Any],
    *,
    name: str,
    duration_s: float,
    temperature_degc: float,
    fingerprint: str,
) -> Cycle:
    """Return the cycle that one recording's estimate and metadata make.

    Parameters
    ----------
    estimate : Estimate
        Of this recording alone.
    metadata : mapping
        The recording's (contract section 2).
    name : str
        Of the recording.
    duration_s : float
        How long the recording lasts.
    temperature_degc : float
        Mean gearbox temperature; NaN for none.
    fingerprint : str
        Of the samples.
    """
    curve, reasons = _curve(estimate)
    inertia, inertia_deviation = _inertia(estimate)
    gravity = None if estimate.friction_curve is None else estimate.friction_curve.gravity_nm
    known = np.zeros(0) if gravity is None else gravity[np.isfinite(gravity)]
    payload = metadata.get("payload_kg")
    return Cycle(
        name=name,
        joint=Joint(str(metadata["robot"]), int(metadata["axis"]), float(metadata["gear_ratio"])),
        started_s=_seconds(str(metadata.get("started_at") or "")),
        duration_s=duration_s,
        curve=curve,
        temperature_degc=temperature_degc,
        payload_kg=math.nan if payload is None else float(payload),
        load_nm=float(np.mean(np.abs(known))) if known.size else math.nan,
        inertia_kg_m2=inertia,
        inertia_deviation_kg_m2=inertia_deviation,
        trajectory=_text(metadata.get("trajectory") or ""),
        parts=_parts(metadata),
        oil=str(metadata.get("oil") or ""),
        event=str(metadata.get("event") or ""),
        fingerprint=fingerprint,
        model=str(metadata.get("robot_model") or ""),
        reasons=reasons,
    )


def _curve(estimate: Estimate) -> tuple[CycleCurve | None, tuple[str, ...]]:
    """Return the curve, or why there is none that a monitor can use."""
    curve = estimate.friction_curve
    if not estimate.decidable:
        return None, estimate.reasons
    if curve is None:
        return None, ("the motion has no steady speeds in both directions: no friction curve",)
    speed = np.abs(curve.velocity_rad_s)
    half = 0.5 * (curve.ci95_nm[:, 1] - curve.ci95_nm[:, 0])
    kept = np.isfinite(speed) & np.isfinite(curve.friction_nm) & np.isfinite(half) & (half > 0.0)
    kept[kept] &= np.diff(speed[kept], prepend=-1.0) > 0.0
    if np.count_nonzero(kept) < _FEWEST_POINTS:
        return None, (
            f"{np.count_nonzero(kept)} speeds of the friction curve have an interval; "
            f"{_FEWEST_POINTS} are needed",
        )
    return CycleCurve(speed[kept], curve.friction_nm[kept], half[kept] / _NORMAL_975), ()


def _inertia(estimate: Estimate) -> tuple[float, float]:
    """Return the inertia and one standard deviation; NaN where it is not identified."""
    body = estimate.rigid_body
    found = None if body is None else body.parameters.get("inertia_kg_m2")
    if found is None or not found.identified or found.ci95 is None:
        return math.nan, math.nan
    low, high = found.ci95
    half = 0.5 * (high - low) if low > 0.0 else high - found.value  # cut at zero: half is missing
    return found.value, half / _NORMAL_975


def _parts(metadata: Mapping[str, Any]) -> dict[str, str]:
    """Return the serial numbers: keys that end with `_serial`, and that of the drive."""
    out = {
        key.removesuffix("_serial"): str(value)
        for key, value in metadata.items()
        if key.endswith("_serial") and value not in (None, "")
    }
    drive = metadata.get("drive")
    if isinstance(drive, Mapping):
        serial = drive.get("serial", drive.get("serial_number"))
        if serial not in (None, "", 0):
            out.setdefault("drive", str(serial))
    return dict(sorted(out.items()))


def _text(trajectory: object) -> str:
    """Return one text for one trajectory, whatever the order of its keys."""
    return trajectory if isinstance(trajectory, str) else json.dumps(trajectory, sort_keys=True)


def _seconds(started_at: str) -> float:
    """Return seconds since 1970; a time without a zone is UTC (contract section 2)."""
    try:
        start = datetime.fromisoformat(started_at)
    except ValueError:
        return math.nan
    return (start if start.tzinfo is not None else start.replace(tzinfo=UTC)).timestamp()


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
