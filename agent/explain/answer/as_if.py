"""What no law carries, told as a number of the simulation that would have to vary, or as spells."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType

from agent.explain.answer.amounts import percent
from agent.explain.answer.located import Region, Spells, Varying
from agent.explain.answer.places import place_in_words
from agent.numbers import Scale, parameter_unit, scale_for, significant

_CALLED: Mapping[str, str] = MappingProxyType(
    {
        "coulomb_nm": "Coulomb friction",
        "viscous_nm_s_per_rad": "viscous friction",
        "inertia_kg_m2": "the inertia",
        "gravity": "the load's weight",
        "gravity_sin_nm": "gravity's sine part",
        "scale": "all of the torque",
        "offset": "a torque beside all others",
    }
)
_OF_ITSELF = ("gravity", "scale")
_MOST_PLACES, _MOST_SPELLS = 2, 3


def as_if(varies: Varying) -> str:
    """Return which number would have to vary, by how much and where, in a sentence.

    Parameters
    ----------
    varies : Varying
    """
    told = list(zip(varies.regions, varies.amounts, strict=True))[:_MOST_PLACES]
    where = " and ".join(_differs(varies.number, region, amount) for region, amount in told)
    share = percent(varies.share)
    if varies.number == "offset":
        return f"It is as if there were {where}: varying so it would carry {share} of it."
    return (
        f"It is as if {called(varies.number)} were {where} than usual: varying so it would "
        f"carry {share} of it."
    )


def called(number: str) -> str:
    """Return what a number of the deficiency map is called within a sentence."""
    return _CALLED.get(number, number)


def _differs(name: str, region: Region, amount: float) -> str:
    """Return by how much a number differs in a region, and where that is."""
    place = place_in_words(region)
    if name == "offset":
        return f"another {_size(name, amount)} of torque {place}"
    return f"{_size(name, abs(amount))} {'more' if amount > 0.0 else 'less'} {place}"


def _size(name: str, amount: float) -> str:
    scale = scale_of(name, amount)
    return f"{significant(amount * scale.factor, 2)} {scale.unit}"


def scale_of(number: str, largest: float) -> Scale:
    """Return the unit in which a number of the map is written; percent of itself for some."""
    if number in _OF_ITSELF:
        return Scale(100.0, "%")
    return scale_for("N m" if number == "offset" else parameter_unit(number), (largest,))


def in_spells(spells: Spells) -> str:
    """Return when a mismatch is there, in two sentences.

    Parameters
    ----------
    spells : Spells
    """
    told = "; ".join(
        f"{significant(begin, 3)} to {significant(end, 3)} s of {name}"
        for name, begin, end in spells.at[:_MOST_SPELLS]
    )
    holds = (
        f"{percent(spells.share)} of it in {significant(spells.seconds, 2)} of "
        f"{significant(spells.whole_s, 3)} s"
    )
    if len(spells.at) == 1:
        return f"It comes in one spell, at {told}, which holds {holds}."
    strongest = "the strongest " if len(spells.at) > _MOST_SPELLS else ""
    return f"It comes in {len(spells.at)} spells, {strongest}at {told}. They hold {holds}."
