"""From a solution to named parameters with intervals, or with the reason why there is none."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.identify.reversals.laws import Range, share_of
from agent.identify.reversals.search import Solution

RESOLVED = 4.0  # times the finest travel: shorter lengths are the encoder's, not the joint's
LOOSE = math.log(3.0)
_LENGTHS = ("space_constant_rad", "wind_up_rad", "backlash_rad")
_POSITIVE = ("coulomb_nm", "fast_nm", "slow_nm", "inertia_kg_m2", "arm_inertia_kg_m2")


def parameters_of(found: Solution, range_: Range) -> dict[str, Parameter]:
    """Return every parameter of a law, its derived ones, and those of sliding and inertia."""
    out = {name: _shape(found, name, range_) for name in found.law.shape}
    out |= {name: _linear(found, name) for name in found.law.linear}
    if found.law.name == "bliman-sorine":
        out["fast_share"] = _share(out.pop("fast_ratio"))
    if found.law.name in ("dahl", "lugre"):
        out["stiffness_nm_per_rad"] = _product(
            found, {"coulomb_nm": 1.0, "space_constant_rad": -1.0}, out
        )
    if found.law.name == "lugre":
        names = {"coulomb_nm": 1.0, "static_extra_share": 1.0}
        out["static_extra_nm"] = _product(found, names, out)
        del out["static_extra_share"]
    return out


def unresolved(found: Solution, range_: Range) -> str:
    """Return why the law's first length is not the joint's own; empty where it is."""
    return _shape(found, found.law.shape[0], range_).reason if found.law.shape else ""


def _shape(found: Solution, name: str, range_: Range) -> Parameter:
    place = found.law.shape.index(name)
    value = found.value(name)
    half = found.half_width(_unit(found, name))
    if name in _LENGTHS and value < RESOLVED * range_.finest_rad:
        return Parameter.not_identified(
            f"not identified: friction turns within {1e3 * RESOLVED * range_.finest_rad:.2g} mrad, "
            "which encoder and sampling do not resolve; use a finer encoder, or sample faster and "
            "reverse more slowly"
        )
    if name in _LENGTHS and value > 0.4 * range_.longest_rad:
        return Parameter.not_identified(
            "not identified: the swings are too short for the joint to slip; record reversals of "
            "a larger amplitude"
        )
    if found.at_bound[place]:
        return Parameter.not_identified("not identified: it ran to the end of its range")
    if not half < LOOSE:
        return Parameter.not_identified(
            "not identified: its order of magnitude differs from reversal to reversal; record "
            "more reversals, at several speeds"
        )
    return Parameter(value, (value * math.exp(-half), value * math.exp(half)))


def _linear(found: Solution, name: str) -> Parameter:
    value = found.value(name)
    half = found.half_width(_unit(found, name))
    if name in _POSITIVE and value <= 0.0:
        return Parameter.not_identified("not identified: it came out negative")
    if not math.isfinite(half) or half == 0.0:
        return Parameter.not_identified("not identified: these reversals do not excite it")
    return Parameter(value, (value - half, value + half))


def _share(ratio: Parameter) -> Parameter:
    """Return the fast element's length as a share of the slow one's."""
    if ratio.ci95 is None:
        return ratio
    low, high = (share_of(end) for end in ratio.ci95)
    return Parameter(share_of(ratio.value), (low, high))


def _product(
    found: Solution, powers: Mapping[str, float], own: Mapping[str, Parameter]
) -> Parameter:
    """Return a product of powers of parameters; its interval knows that they move together."""
    for name in powers:
        if own[name].ci95 is None:
            return Parameter.not_identified(own[name].reason)
    value = math.prod(found.value(name) ** power for name, power in powers.items())
    gradient = np.zeros(found.shifts.shape[1])
    for name, power in powers.items():
        shape = name in found.law.shape
        gradient[found.place(name)] = power if shape else power / found.value(name)
    half = found.half_width(gradient)
    return Parameter(value, (value * math.exp(-half), value * math.exp(half)))


def _unit(found: Solution, name: str) -> Floats:
    out = np.zeros(found.shifts.shape[1])
    out[found.place(name)] = 1.0
    return out
