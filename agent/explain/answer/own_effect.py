"""An effect of the simulation's own that is not as the joint's, in a sentence."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from agent.explain.answer.amounts import percent
from agent.explain.answer.located import Finding
from agent.explain.answer.names import OWN_EFFECT, OWN_NUMBER, effect_name, law_name
from agent.explain.answer.said import Said
from agent.explain.answer.sentences import LITTLE, shared
from agent.identify.result import Parameter
from agent.numbers import Scale, parameter_unit, scale_for, significant

_ALIKE = 0.1  # of its strength: so much more or less is the same
_MOVED = 0.03  # of a number: less is not told
_TOLD = 2  # numbers
_BY_ITS_NUMBERS = frozenset(
    {
        "joint-flexibility",
        "backlash",
        "presliding-hysteresis",
        "measurement-delay",
        "torque-saturation",
    }
)
"""Effects that twice the number does not make twice as strong."""

_CALLED: Mapping[str, str] = {
    "static_extra_nm": "extra friction at standstill",
    "stribeck_velocity_rad_s": "Stribeck velocity",
    "height_nm": "height",
    "coulomb_change_nm": "change",
    "coulomb_nm_per_h": "Coulomb friction's change",
    "coulomb_nm_per_k": "Coulomb friction's change",
    "torque_offset_nm": "offset",
    "limit_nm": "limit",
    "torque_delay_s": "delay",
    "torque_lag_s": "low-pass",
    "velocity_delay_s": "delay",
    "half_gap_rad": "half the gap",
    "stiffness_nm_per_rad": "stiffness",
    "stiffness_nm_per_arm_rad": "stiffness",
    "neutral_arm_rad": "the angle at which it hangs free",
    "load_coefficient": "friction per load",
    "arm_inertia_kg_m2": "the arm's inertia",
    "order_per_motor_rev": "order per motor turn",
    "order_per_arm_rev": "order per arm turn",
}
"""Numbers that say something by themselves; all of them stand with the finding."""

_ALONE = "load_coefficient"
"""Beside it an arm's inertia only says what the load is."""

_AS_OWNED: Mapping[str, str] = {
    "measurement-delay": "a delay between its channels",
    "torque-saturation": "a torque limit",
}
"""What is called otherwise where a simulation has it."""

_WAVE = ("cos_nm", "sin_nm")
_PER = {"_per_h": "/h", "_per_k": "/K"}


def own_effect_sentence(
    effect: str,
    given: Mapping[str, float],
    found: Mapping[str, Parameter],
    share: float,
    times: float,
    *,
    of_all: bool = False,
    nameless: bool = False,
) -> Said:
    """Return what is said of an effect that the simulation has with other numbers.

    Parameters
    ----------
    effect : str
    given : mapping of str to float
        Its numbers in the simulation.
    found : mapping of str to Parameter
        What the recordings say; empty where they do not show the effect.
    share : float
        Of the mismatch.
    times : float
        How many times as strong as the simulation's the joint's is.
    of_all : bool
        Whether the share is of the difference to the simulation as given.
    nameless : bool
        Whether far more than noise is left without it: then it is not shown to be missing.
    """
    whole = shared(OWN_NUMBER if of_all else OWN_EFFECT, beside_numbers=False)
    worth = f"This explains {percent(share)} of {whole}."
    if not found and nameless:
        lead = f"The {_own(effect)} is not the joint's; what the joint has instead has no name."
        return Said(lead, worth=f"Without it {percent(share)} of {whole} is gone.")
    if not found:
        name = _AS_OWNED.get(effect, effect_name(effect))
        lead = f"The simulation has {name}, which these recordings do not show."
        return Said(lead, worth=worth)
    numbers = _numbers(given, found)
    lead = f"The {_own(effect)} {_strength(effect, times)}{numbers}."
    return Said(lead, worth=worth)


def too_much_sentence(
    effect: str,
    found: Mapping[str, Parameter],
    share: float,
    *,
    of_all: bool = False,
    another: bool = False,
) -> Said:
    """Return what is said of an effect that a recorded simulation has more of than the joint.

    Parameters
    ----------
    effect : str
    found : mapping of str to Parameter
        What it has more of it.
    share : float
        Of the mismatch.
    of_all : bool
        Whether the share is of the difference to the simulation as given.
    another : bool
        Whether the joint has an effect of the same kind with other numbers.
    """
    name = _AS_OWNED.get(effect, effect_name(effect))
    told = _listed(_known(found))
    lead = f"What the simulation has too much of is {name}{told}."
    if another:
        lead = f"The {_own(effect)} is not the joint's."
    whole = shared(OWN_NUMBER if of_all else OWN_EFFECT, beside_numbers=False)
    return Said(lead, worth=f"This explains {percent(share)} of {whole}.")


def _listed(known: Mapping[str, float]) -> str:
    """Return the first numbers that say something, as they follow a colon; nothing for none."""
    texts = []
    for name, called in _CALLED.items():
        if name in known:
            scale = _scale(name, known[name])
            value = significant(known[name] * scale.factor, 3)
            texts.append(f"{called} {value} {scale.unit}".rstrip())
    return f": {' and '.join(texts[:_TOLD])}" if texts else ""


def _known(found: Mapping[str, Parameter]) -> dict[str, float]:
    known = {n: p.value for n, p in found.items() if p.identified and math.isfinite(p.value)}
    return {_ALONE: known[_ALONE]} if _ALONE in known else known


def finding_name(finding: Finding) -> str:
    """Return what a finding is called: an effect, or that of the simulation's own."""
    if finding.form == OWN_EFFECT:
        return _own(finding.effect)
    return law_name(finding.effect, finding.parameters)


def _own(effect: str) -> str:
    name = _AS_OWNED.get(effect, effect_name(effect))
    return f"simulation's own {name.removeprefix('a ').removeprefix('an ')}"


def _strength(effect: str, times: float) -> str:
    if effect in _BY_ITS_NUMBERS or abs(times - 1.0) <= _ALIKE:
        return "is not the joint's"
    if times < 1.0:
        return f"is {significant(1.0 / times, 2)} times as strong as the joint's"
    return f"has only {percent(1.0 / times)} of the joint's strength"


def _numbers(given: Mapping[str, float], found: Mapping[str, Parameter]) -> str:
    """Return the numbers that moved most, as they follow a colon; nothing for none."""
    known = _known(found)
    pairs = {
        called: (name, given[name], known[name])
        for name, called in _CALLED.items()
        if name in given and name in known
    }
    if all(name in given and name in known for name in _WAVE):
        was, now = (math.hypot(*(numbers[name] for name in _WAVE)) for numbers in (given, known))
        pairs["amplitude"] = _WAVE[0], was, now

    def moved(called: str) -> float:
        _, was, now = pairs[called]
        return abs(now - was) / max(abs(was), abs(now), 1e-300)

    best = sorted((called for called in pairs if moved(called) > _MOVED), key=lambda c: -moved(c))
    told = [f"{called} {_change(*pairs[called])}" for called in best[:_TOLD]]
    return f": {' and '.join(told)}" if told else ""


def _change(name: str, given: float, found: float) -> str:
    scale = _scale(name, given, found)
    now, was = (significant(value * scale.factor, 3) for value in (found, given))
    return f"{now}, not {was} {scale.unit}".rstrip()


def _scale(name: str, *values: float) -> Scale:
    """Return the unit in which a number is written, or what it changes by in an hour or kelvin."""
    ending = next((ending for ending in _PER if name.endswith(ending)), "")
    scale = scale_for(parameter_unit(name.removesuffix(ending)), values)
    return replace(scale, unit=f"{scale.unit}{_PER.get(ending, '')}")


def with_share(finding: Finding, share: float) -> Said:
    """Return what is said of a finding with a share of another mismatch than it was written for."""
    before, now = (percent(max(each, LITTLE)) for each in (finding.energy_share, share))
    said = finding.said
    lead, worth = (text.replace(f"{before} of ", f"{now} of ") for text in (said.lead, said.worth))
    return Said(lead, said.place, worth, said.caveat)
