"""A right name's numbers: where it was located, which share it was given, what it was measured as.

Only what means the same on both sides is compared: regions along the same variable, and parameters
of a concealed form that the tool has as well.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

Document = Mapping[str, Any]
Interval = tuple[float, float]
_ORDER = "order_per_"
_BY_BAND = "energy_share_by_band"

_SAME_FORM: Mapping[tuple[str, str, str], tuple[str, ...]] = {
    ("stribeck", "exponential", "exponential fall"): (
        "static_extra_nm",
        "stribeck_velocity_rad_s",
        "exponent",
    ),
    ("viscous-nonlinear", "power", "power law"): ("exponent",),
    ("torque-offset", "constant", "constant"): ("torque_offset_nm",),
    ("direction-asymmetry", "coulomb", "Coulomb"): ("coulomb_difference_nm",),
    ("direction-asymmetry", "viscous", "viscous"): ("viscous_difference_nm_s_per_rad",),
    ("load-dependent-friction", "proportional to the shaft's torque", "proportional"): (
        "load_coefficient",
    ),
    ("temperature-dependent-friction", "exponential", "viscosity"): ("decay_k",),
    ("position-dependent-friction", "wave", "wave"): ("cos_nm", "sin_nm"),
    ("torque-ripple", "sine", "one order"): ("cos_nm", "sin_nm"),
    ("resolver-error", "sine", "whole order of the motor"): ("cos_rad", "sin_rad"),
    (
        "resolver-error",
        "sine",
        "whole order of the motor, the arm on the gear's spring",
    ): ("cos_rad", "sin_rad"),
    ("torque-constant-error", "falls with winding temperature", "with motor temperature"): (
        "factor_per_k",
    ),
    ("torque-constant-error", "constant", "the twin's own number"): ("factor",),
    ("torque-saturation", "clipped, with anti-windup", "clipped"): ("limit_nm",),
    ("measurement-delay", "torque is late", "torque late or early"): ("torque_delay_s",),
    ("measurement-delay", "motion is late", "torque late or early"): ("torque_delay_s",),
    ("cable-force", "straight", "spring"): ("stiffness_nm_per_arm_rad",),
    ("gravity-imbalance", "unknown mass", "the twin's own number"): (
        "gravity_sin_nm",
        "gravity_cos_nm",
    ),
    ("inertia-error", "arm", "the twin's own number"): ("inertia_extra_kg_m2",),
    ("wrong-number", "coulomb_nm", "the twin's own number"): ("coulomb_extra_nm",),
    ("wrong-number", "viscous_nm_s_per_rad", "the twin's own number"): (
        "viscous_extra_nm_s_per_rad",
    ),
    ("backlash", "dead zone", "gap"): ("half_gap_rad",),
}
"""Parameters that mean the same, by effect, concealed form and found form. Orders are left out:
they are whole numbers, and a relative error of nearly nothing would flatter."""

_VECTORS = (("cos_nm", "sin_nm"), ("cos_rad", "sin_rad"), ("gravity_sin_nm", "gravity_cos_nm"))


@dataclass(frozen=True)
class Located:
    """One right name: place and share against the label.

    `overlap` is intersection over union along the variable that both name, `order_right` whether
    the order found lies in the label's band; None where the two name no variable in common.
    `share_error` is the energy share found less the label's; None where what the effect costs is
    not in the residual of a simulation that is driven by the measured motion.
    """

    effect: str
    variable: str
    overlap: float | None
    order_right: bool | None
    share_error: float | None


@dataclass(frozen=True)
class Measured:
    """One number of a right name: relative error, and whether its 95 % interval has the truth.

    The error of a cosine or sine is that of the vector of both, over its length. `covered` is None
    where the tool gave no interval.
    """

    effect: str
    parameter: str
    snr: float
    error: float
    covered: bool | None


def located(effect: Document, finding: Document, band_hz: float | None = None) -> Located:
    """Return how well a finding is placed.

    Parameters
    ----------
    effect : mapping
        An entry of the label.
    finding : mapping
        An entry of the explanation that names it.
    band_hz : float, optional
        Up to where the explanation compared torques, of which its shares are.
    """
    error = None
    if effect["basis"] != "commanded":
        error = float(finding["energy_share"]) - _share_in(effect, band_hz)
    variable = next((w["variable"] for w in finding["where"] if _of(effect, w["variable"])), "")
    if not variable:
        return Located(str(effect["effect"]), "", None, None, error)
    true, found = _of(effect, variable), _of(finding, variable)
    if variable.startswith(_ORDER):
        middle = 0.5 * (found[0][0] + found[0][1])
        inside = any(low <= middle <= high for low, high in true)
        return Located(str(effect["effect"]), variable, None, inside, error)
    return Located(str(effect["effect"]), variable, overlap(true, found), None, error)


def _share_in(effect: Document, band_hz: float | None) -> float:
    """Return an effect's true share in a band, between those that the label tells of."""
    told = [(float(b["up_to_hz"]), float(b["energy_share"])) for b in effect.get(_BY_BAND, ())]
    if band_hz is None or not told:
        return float(effect["energy_share"])
    at = math.log(min(max(band_hz, told[0][0]), told[-1][0]))
    for (low, first), (high, last) in pairwise(told):
        if at <= math.log(high):
            part = (at - math.log(low)) / math.log(high / low)
            return first + part * (last - first)
    return told[-1][1]


def _of(entry: Document, variable: str) -> list[Interval]:
    return [(float(w["from"]), float(w["to"])) for w in entry["where"] if w["variable"] == variable]


def overlap(first: Sequence[Interval], second: Sequence[Interval]) -> float:
    """Return intersection over union of two sets of intervals, 0 to 1."""
    ends = sorted({end for interval in (*first, *second) for end in interval})
    both = either = 0.0
    for low, high in pairwise(ends):
        middle = 0.5 * (low + high)
        inside = [any(a <= middle <= b for a, b in those) for those in (first, second)]
        both += (high - low) * all(inside)
        either += (high - low) * any(inside)
    return both / either if either > 0.0 else 0.0


def measured(effect: Document, finding: Document) -> list[Measured]:
    """Return the numbers that mean the same in label and finding; none where the forms differ."""
    key = (str(effect["effect"]), str(effect["form"]), str(finding["form"]))
    names = _SAME_FORM.get(key, ()) if finding["effect"] == effect["effect"] else ()
    found = finding["parameters"]
    true = _at_reference(effect["parameters"], found)
    out = []
    for name in names:
        entry = found.get(name)
        if entry is None or entry.get("value") is None:
            continue
        together = next((pair for pair in _VECTORS if name in pair), (name,))
        error = _relative(true, found, together)
        if not math.isfinite(error):
            continue  # of what is not there, no error is a share
        interval = entry.get("ci95")
        covered = None if not interval else bool(interval[0] <= true[name] <= interval[1])
        out.append(Measured(key[0], name, float(effect["snr"]), error, covered))
    return out


def _at_reference(true: Document, found: Document) -> Document:
    """Return the truth with a relative slope taken about the temperature that the finding names.

    ``1 + k (T - R) = (1 + k (S - R)) (1 + k' (T - S))``, hence ``k' = k / (1 + k (S - R))``.
    """
    reference = found.get("reference_degc", {}).get("value")
    if "factor_per_k" not in true or reference is None:
        return true
    slope = float(true["factor_per_k"])
    about = 1.0 + slope * (float(reference) - float(true["reference_degc"]))
    return {**true, "factor_per_k": slope / about}


def _relative(true: Document, found: Document, names: Sequence[str]) -> float:
    """Return the length of the error of some numbers over the length of the truth."""
    size = math.hypot(*(float(true[name]) for name in names))
    off = [float(found.get(n, {}).get("value") or 0.0) - float(true[n]) for n in names]
    return math.hypot(*off) / size if size > 0.0 else math.inf
