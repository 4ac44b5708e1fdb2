"""Numbers that are all off by one factor but for one: a torque constant, and a number beside it.

Inertia, weight, Coulomb and viscous friction have nothing in common but the torque in which they
are told. Where three of them are off by the same few percent, that is no coincidence of three wrong
numbers; and a fourth that is off by something else is wrong by what the factor does not make of it.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from agent.explain.numbers.model import Model
from agent.identify.result import Parameter
from agent.physics.rigid_body import GRAVITY
from agent.physics.twin import Twin

_GROUPS: tuple[tuple[str, ...], ...] = (
    ("inertia_kg_m2",),
    ("coulomb_nm",),
    ("viscous_nm_s_per_rad",),
    GRAVITY,
)
_FEWEST = 3  # of them that are off alike
_OFF = 0.03  # of a number: drives know their torque to that
_APART = 0.1  # of the factor's way from one: so much each may be off by itself
_NOTHING = 1e-6  # of what is known of a number: a twin that says less of it says that it has none
_SAYS = 0.5  # of that way: a number whose interval begins nearer to one says nothing of it


@dataclass(frozen=True)
class OffAlike:
    """The factor that most numbers are off by, and the number that is not, if one is not.

    Parameters
    ----------
    factor : Parameter
        The true torque over the reported one.
    but : tuple of str
        Names of the number that is off by something else; empty where there is none.
    """

    factor: Parameter
    but: tuple[str, ...] = ()


def off_alike(twin: Twin, model: Model, among: Sequence[str]) -> OffAlike | None:
    """Return the factor by which a twin's numbers are off, all or all but one; or nothing.

    Parameters
    ----------
    twin : Twin
        As given.
    model : Model
    among : sequence of str
        The numbers that are known, and that no law found lets vary.
    """
    ratios = {
        names: ratio
        for names in _GROUPS
        if set(names) <= set(among) and (ratio := _ratio(twin, model, names)) is not None
    }
    for left_out in range(2):
        for but in combinations(ratios, left_out):
            kept = {names: ratio for names, ratio in ratios.items() if names not in but}
            factor = _common(kept)
            if factor is None or any(_is_of(ratios[names], factor) for names in but):
                continue
            low, value, high = factor
            real = Parameter(1.0 / value, (1.0 / high, 1.0 / low))
            return OffAlike(real, but[0] if but else ())
    return None


_Ratio = tuple[float, float, float]
"""Lower end, value and upper end of what a number is over what the twin says."""


def _ratio(twin: Twin, model: Model, names: Sequence[str]) -> _Ratio | None:
    """Return the ratio of a number; of a weight, along the one that the twin says."""
    given = [float(getattr(twin, name)) for name in names]
    size = math.hypot(*given)
    found = [model.base[name] for name in names]
    halves = [0.5 * (p.ci95[1] - p.ci95[0]) for p in found if p.ci95 is not None]
    if len(halves) < len(found) or not size > _NOTHING * math.hypot(*halves):
        return None
    way = [g / size for g in given]
    along = sum(p.value * w for p, w in zip(found, way, strict=True)) / size
    half = math.hypot(*(h * w for h, w in zip(halves, way, strict=True))) / size
    # What a weight has beside its direction is a load of its own, whatever its size is.
    beside = math.hypot(*(p.value - along * g for p, g in zip(found, given, strict=True)))
    if beside > max(math.hypot(*halves), _APART * abs(along - 1.0) * size):
        along += math.copysign(beside / size, along - 1.0)
    return along - half, along, along + half


def _common(ratios: Mapping[tuple[str, ...], _Ratio]) -> _Ratio | None:
    """Return the ratio of the number that is known best, where it is that of all others as well."""
    if len(ratios) < _FEWEST:
        return None
    best = min(ratios.values(), key=lambda ratio: ratio[2] - ratio[0])
    off = abs(best[1] - 1.0)
    if off < _OFF or not all(_is_of(ratio, best) for ratio in ratios.values()):
        return None
    nearest = [min((low, high), key=lambda end: abs(end - 1.0)) for low, _, high in ratios.values()]
    saying = [end for end in nearest if (end - 1.0) * (best[1] - 1.0) >= _SAYS * off**2]
    return best if len(saying) >= _FEWEST else None


def _is_of(ratio: _Ratio, factor: _Ratio) -> bool:
    """Return whether a number may be off by a factor, and a little by itself."""
    low, value, high = ratio
    most = max(0.5 * (high - low), _APART * abs(factor[1] - 1.0))
    return abs(value - factor[1]) <= most
