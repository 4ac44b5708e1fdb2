"""Which of a simulation's own effects may have other numbers: the mismatch goes along them."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.result import NAMELESS, Explanation, Finding
from agent.explain.choosing.materiality import CLOSE
from agent.explain.numbers.model import predicted, with_numbers
from agent.explain.own_effects.better import floor_nm2
from agent.explain.rows.refit import refit
from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.physics.twin import Effect, Twin, TwinError

_DOUBTED = 0.2  # of the mismatch: so much of it goes along an effect, or along one of its numbers
_NUDGE = 1.02  # times a number
_LOADED = "reference_payload_kg"  # a payload that recordings state


@dataclass(frozen=True)
class Doubted:
    """A simulation as given, and which of its effects may have other numbers.

    Parameters
    ----------
    twin, refitted : Twin
        As given, and with its rigid body and plain friction refitted.
    table : Table
        Of the recordings to learn from, its target what the twin as given leaves.
    places : tuple of int
        Among the twin's effects.
    excess : mapping of int to Finding
        By place, what was found of a recorded simulation: that it has more of an effect.
    """

    twin: Twin
    refitted: Twin
    table: Table
    places: tuple[int, ...]
    excess: Mapping[int, Finding] = field(default_factory=dict)

    @property
    def bare(self) -> Twin:
        """Return the simulation without them."""
        kept = (e for i, e in enumerate(self.twin.effects) if i not in self.places)
        return replace(self.twin, effects=tuple(kept))


def doubted_of(twin: Twin, table: Table, answer: Explanation) -> tuple[Doubted, ...]:
    """Return which of a twin's effects may have other numbers, the likeliest ones first.

    Those along whose torque, or along what one of their numbers changes of it, a good part of the
    mismatch goes; at last all of them where it has no name, as a spring twice as stiff is no sum of
    such changes. None where the twin leaves no more than noise.

    Parameters
    ----------
    twin : Twin
        As given.
    table : Table
    answer : Explanation
        Of the twin as given.
    """
    if table.simulated or not table.sliding.any():
        return ()
    gains: dict[int, float] = {}
    for place, effect in enumerate(twin.effects):
        if _LOADED not in effect.parameters:
            slopes = _slopes(twin, place, table)
            gains[place] = max(_goes_along(slopes, table, answer, moved=m) for m in (True, False))
    order = sorted((p for p in gains if gains[p] >= _DOUBTED), key=lambda p: -gains[p])
    every = tuple(gains) if answer.verdict in NAMELESS else ()
    sets = dict.fromkeys((tuple(order[:1]), tuple(sorted(order)), every))
    refitted = refitted_of(twin, answer)
    return tuple(Doubted(twin, refitted, table, places) for places in sets if places)


def says_twice(answer: Explanation, doubted: Doubted) -> bool:
    """Return whether an answer has another law of the very kind that is doubted.

    Friction under load that grew is one law with another number, and not two laws.
    """
    kinds = {doubted.twin.effects[place].id for place in doubted.places}
    return any(f.effect in kinds and f.form != OWN_NUMBER for f in answer.findings)


def refitted_of(twin: Twin, answer: Explanation) -> Twin:
    """Return a twin with its rigid body and plain friction as they fit best, effects as given."""
    best = {moved.parameter: moved.refitted for moved in answer.moved}
    numbers = {name: p.value for name, p in best.items() if p.identified}
    return with_numbers(twin, numbers)


def _slopes(twin: Twin, place: int, table: Table) -> Floats:
    """Return an effect's torque, and how it follows each of its numbers, shape (n, k)."""
    whole, effect = predicted(table, twin), twin.effects[place]
    others: list[tuple[Effect, ...]] = [()]
    for name, value in effect.numbers.items():
        if value and math.isfinite(value):
            moved = replace(effect, parameters={**effect.parameters, name: _NUDGE * value})
            others.append((moved,))
    out = [np.zeros_like(whole)]
    for instead in others:
        try:
            out.append(predicted(table, _with(twin, place, instead)) - whole)
        except TwinError:  # a number that may not be another one
            continue
    return np.stack(out, axis=-1)


def _with(twin: Twin, place: int, instead: Sequence[Effect]) -> Twin:
    effects = twin.effects
    return replace(twin, effects=(*effects[:place], *instead, *effects[place + 1 :]))


def _goes_along(columns: Floats, table: Table, answer: Explanation, *, moved: bool) -> float:
    """Return which share of the mismatch goes along columns, shape (n, k).

    Where the twin's rigid body and plain friction may move beside them, it is the mismatch that
    these leave; else that of the twin as given, which they may take over: an offset, gravity.
    """
    left = refit(table)[1] if moved else table.target_nm
    rows = table.sliding & np.isfinite(left)
    if not rows.any():
        return 0.0
    noise_nm2 = CLOSE**2 * floor_nm2(answer)
    mismatch = float(left[rows] @ left[rows]) - noise_nm2 * np.count_nonzero(rows)
    if not mismatch > 0.0:
        return 0.0
    base = table.base[np.ix_(rows, table.carried)] if moved else np.zeros((rows.sum(), 0))
    both = np.concatenate((base, np.nan_to_num(columns[rows])), axis=1)
    size = np.sqrt(np.mean(both**2, axis=0))
    unit = both / np.where(size > 0.0, size, 1.0)
    beside = left[rows] - unit @ np.linalg.lstsq(unit, left[rows], rcond=1e-6)[0]
    return (float(left[rows] @ left[rows]) - float(beside @ beside)) / mismatch
