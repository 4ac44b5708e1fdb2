"""A heavier load beside friction under it: a gear that loses more driving than driven is the same.

What a gear takes is c l where the load l turns against the motor and d l where it drives it: a
mean of both along the motion, and half of their difference in the load itself (decision 0092). No
motion tells the latter from a payload that hangs where the arm's own weight does. Either is told
with the other: a payload with such losses, and losses that a gear's own friction makes with a
payload (decision 0220).
"""

from __future__ import annotations

import math

from agent.explain.answer.amounts import percent, short
from agent.explain.forms.driving import EXCESS
from agent.explain.study import Study
from agent.physics.rigid_body import GRAVITY

_LEAST = 0.005  # of the weight: less is no payload that anybody asks about
_ACROSS = 0.2  # of the payload: with more of it elsewhere it does not hang where the weight does
_LOADED, _WEIGHT = "load-dependent-friction", "gravity-imbalance"


def driven_or_heavier(found: Study) -> str:
    """Return what losses make of a payload that is named, or a payload of losses that are.

    Empty where there are no such losses, or no payload that hangs as the weight.
    """
    instead = _heavier_instead(found)
    if instead:
        return instead
    named = {
        term.scored.form.effect: {name: p.value for name, p in numbers.items()}
        for term, numbers in zip(found.model.terms, found.model.parameters, strict=True)
    }
    for number in found.numbers:
        named.setdefault(number.effect, {n: p.value for n, p in number.parameters.items()})
    friction = named.get(_LOADED, {}).get("load_coefficient", math.nan)
    sine, cosine = (named.get(_WEIGHT, {}).get(name, 0.0) for name in GRAVITY)
    weight = found.twin.gravity_sin_nm, found.twin.gravity_cos_nm
    return losses_said(friction, (sine, cosine), weight)


def _heavier_instead(found: Study) -> str:
    """Return which weight would do as well as friction that loads the gear; empty without it."""
    for term, numbers in zip(found.model.terms, found.model.parameters, strict=True):
        if EXCESS in numbers:
            per_load = sum(numbers[name].value for name in term.scored.form.linear)
            falls = "load_velocity_rad_s" in numbers
            return weight_said(per_load, numbers[EXCESS].value, falls=falls)
    return ""


def weight_said(per_load: float, excess: float, *, falls: bool) -> str:
    """Return what friction is in either direction of power, and which weight does as well.

    Parameters
    ----------
    per_load : float
        Friction over the load, at a load alone.
    excess : float
        Of it that its own part makes: from 0 to below 1.
    falls : bool
        Whether it falls with speed.
    """
    driving, driven = per_load / (1.0 - excess), per_load / (1.0 + excess)
    return (
        f"friction under load is {short(100.0 * driving)} % of the load where the motor drives it, "
        f"and {short(100.0 * driven)} % where it drives the motor"
        f"{' (near standstill)' if falls else ''}, as "
        "a gear's own friction loads it, too; were both the same, the load would be "
        f"{short(50.0 * (driving - driven))} % heavier instead: a known weight tells"
    )


def losses_said(
    friction: float, extra_nm: tuple[float, float], weight_nm: tuple[float, float]
) -> str:
    """Return with which losses a heavier load need not be there; empty where with none.

    Parameters
    ----------
    friction : float
        Over the load.
    extra_nm, weight_nm : tuple of float
        Sine and cosine part of what the payload adds, and of the twin's gravity.
    """
    size, own = math.hypot(*extra_nm), math.hypot(*weight_nm)
    if not own > 0.0 or not size > 0.0:
        return ""
    more = sum(e * w for e, w in zip(extra_nm, weight_nm, strict=True)) / own**2
    across = abs(extra_nm[0] * weight_nm[1] - extra_nm[1] * weight_nm[0]) / own
    if not _LEAST < more <= friction or across > _ACROSS * size:
        return ""
    driving, driven = (percent(friction * (1.0 + more) + way * more) for way in (1.0, -1.0))
    return (
        f"the load is {short(100.0 * more)} % heavier wherever the arm is: a gear that takes "
        f"{driving} of it where the motor drives it, and {driven} where it drives the motor, needs "
        "no payload; a known weight tells"
    )
