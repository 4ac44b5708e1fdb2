"""Recordings that are as if of another axis, among others that the simulation fits as it is.

A payload changes inertia and weight, a colder gear its friction, viscous friction most of all.
Where the mass that moves and Coulomb friction are others, and all other recordings ask for no other
number, it is another joint, as far as can be told: no law of this one explains it, and it is left
aside. Payloads that recordings state are none of this.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.answer import words
from agent.explain.answer.amounts import listed
from agent.explain.answer.names import NUMBERS
from agent.explain.answer.number_sentences import change_said
from agent.explain.answer.result import Explanation
from agent.explain.numbers.loads import payloads
from agent.explain.rows.refit import refit
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats
from agent.numbers import parameter_unit
from agent.physics.rigid_body import GRAVITY

_FITS, _FAR_OFF = 1.25, 4.0  # times the noise: what a right simulation leaves, and one of another
_EXPLAINED = 0.5  # of what it leaves: so much numbers of its own take off
_ANOTHER = 1.6  # times a number, either way


@dataclass(frozen=True)
class Aside:
    """Recordings that are no part of an answer.

    Parameters
    ----------
    places : tuple of int
        Among the recordings to learn from.
    said : str
        What they are, in a sentence.
    """

    places: tuple[int, ...]
    said: str


def of_another_axis(table: Table, floor_nm: float) -> Aside | None:
    """Return the few recordings that are as if of another axis; None where none is.

    Parameters
    ----------
    table : Table
        Its target is what the simulation as given leaves.
    floor_nm : float
        The noise.
    """
    count = len(table.runs)
    if table.simulated or not floor_nm > 0.0 or len(payloads(table.runs)) > 1:
        return None
    left_nm = [_rms(table.target_nm[table.sliding & (table.run == k)]) for k in range(count)]
    odd = tuple(k for k in range(count) if left_nm[k] > _FAR_OFF * floor_nm)
    others = [left for k, left in enumerate(left_nm) if k not in odd]
    if not odd or 2 * len(odd) >= count or max(others) > _FITS * floor_nm:
        return None
    own = [_own_numbers(table, k, left_nm[k]) for k in odd]
    if not all(map(_are_anothers, own)):
        return None
    names = [table.runs[k].name for k in odd]
    changed = [
        change_said(NUMBERS[name], given, found, parameter_unit(name))
        for name, (given, found) in own[0].items()
        if name not in GRAVITY and _is_another(given, found)
    ]
    one = len(odd) == 1
    return Aside(
        odd,
        f"The recording{'' if one else 's'} {listed(names)} {'is' if one else 'are'} as if of "
        f"another axis: there {listed(changed)}, while the simulation fits all others as it is. "
        "Make sure of what axis that is.",
    )


def without_them(answer: Explanation, aside: Aside) -> Explanation:
    """Return the answer of all other recordings, which begins with those that were left aside."""
    it = "It was" if len(aside.places) == 1 else "They were"
    said = f"{aside.said} {it} left aside."
    answer = replace(answer, unit_off=" ".join(s for s in (said, answer.unit_off) if s))
    return replace(answer, sentence=words.summary_of(answer))


def _rms(left_nm: Floats) -> float:
    return float(np.sqrt(np.mean(left_nm**2))) if left_nm.size else 0.0


def _own_numbers(table: Table, run: int, left_nm: float) -> dict[str, tuple[float, float]]:
    """Return the numbers that a recording asks for, as given and found; none if they do not do."""
    alone = replace(table, used=table.used & (table.run == run))
    delta, left = refit(alone)
    if _rms(left[alone.sliding]) > _EXPLAINED * left_nm:
        return {}
    given = {name: float(getattr(table.twin, name)) for name in BASE}
    return {
        name: (given[name], given[name] + float(by)) for name, by in zip(BASE, delta, strict=True)
    }


def _are_anothers(numbers: dict[str, tuple[float, float]]) -> bool:
    """Return whether Coulomb friction and the mass that moves are others, both."""
    if not numbers:
        return False
    given, found = (math.hypot(*(numbers[name][k] for name in GRAVITY)) for k in (0, 1))
    mass = _is_another(*numbers["inertia_kg_m2"]) or _is_another(given, found)
    return mass and _is_another(*numbers["coulomb_nm"])


def _is_another(given: float, found: float) -> bool:
    """Return whether a number is far from the one that was given; a twin has to have it."""
    return given > 0.0 and not given / _ANOTHER < found < given * _ANOTHER
