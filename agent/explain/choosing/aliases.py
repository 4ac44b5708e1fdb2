"""Which effects some recordings, or a cycle that is only planned, cannot tell apart.

What an effect adds to the torque is seen only as far as the twin's own numbers do not absorb it.
Two effects are aliases where everything that the one may add, whatever its numbers, is copied by
the other: the squared cosine of the largest principal angle between their columns, projected off
the base model, stays above 0.95 (Bjorck and Golub, Math. Comput. 27, 1973, 579). Nothing
of what was measured enters but the motion, so that a planned cycle can be asked as well.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.search import Library
from agent.explain.forms.form import Form, Point
from agent.explain.forms.grid import log_grid
from agent.explain.forms.order import at_order, goes_by_order
from agent.explain.forms.seen_arm import SEEN
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.effects.library import card_of

ALIKE = 0.95
"""Squared cosine above which nobody tells two torques apart."""

_ABSORBED = 0.02  # of a column's energy: with less left over the base model, nothing is found
_NOTHING = 1e-9
_MOST_ROWS = 3000
_USUAL_ORDERS = (1.0, 2.0)
_ARM_SHARE, _CONTACT_DAMPING = 0.5, 0.3
_GAPS_ARM_RAD = (3e-5, 1e-3)


@dataclass(frozen=True)
class _Side:
    """One candidate's orthonormal basis off the base model, shape (m, k)."""

    form: tuple[str, str]
    basis: Floats


def aliases(library: Library) -> tuple[tuple[str, ...], ...]:
    """Return the sets of effects that these recordings cannot tell apart, whatever is found.

    Parameters
    ----------
    library : Library
        Of the recordings, or of a planned motion (see `agent.explain.experiment.planned`).

    Returns
    -------
    tuple of tuple of str
        Ids of contract section 4, sorted; an effect may be in several sets. Every two of a set
        have forms that copy each other.
    """
    likeness = copied(library)
    alike = {
        frozenset((a[0], b[0]))
        for (a, b), share in likeness.items()
        if min(share, likeness[b, a]) > ALIKE
    }
    return _largest_sets(sorted({a[0] for a, _ in likeness}), alike)


def copied(library: Library) -> dict[tuple[tuple[str, str], tuple[str, str]], float]:
    """Return how much of one form another can copy, at worst, for every ordered pair.

    Parameters
    ----------
    library : Library

    Returns
    -------
    dict of (form, form) to float
        A form is (effect, name). For (found, copy), of different effects: the smallest squared
        cosine, over all that the found form may be, of the best that the other makes of it; 0 to
        1. What the twin's own numbers absorb is left out.
    """
    sides = _sides(library)
    if not sides:
        return {}
    width = np.array([side.basis.shape[1] for side in sides])
    first = np.concatenate(([0], np.cumsum(width)[:-1]))
    columns = np.concatenate([side.basis for side in sides], axis=1).astype(np.float32)
    cosines = (columns.T @ columns).astype(np.float64)
    # Candidates of one form stand side by side.
    starts = [i for i, s in enumerate(sides) if i == 0 or s.form != sides[i - 1].form]
    forms = [sides[i].form for i in starts]
    squares = np.stack(
        [
            np.maximum.reduceat(_smallest_squared(cosines[a : a + k], first), starts)
            for a, k in zip(first, width, strict=True)
        ]
    )
    worst = np.minimum.reduceat(squares, starts, axis=0)
    return {
        (a, b): float(worst[i, j])
        for i, a in enumerate(forms)
        for j, b in enumerate(forms)
        if a[0] != b[0]
    }


def _smallest_squared(cosines: Floats, first: NDArray[np.int64]) -> Floats:
    """Return the squared cosine of the largest angle to every candidate, shape (c,).

    `cosines` (k, p) are one candidate's basis against the bases of all, which begin at `first`.
    """
    if cosines.shape[0] == 1:
        return np.asarray(np.add.reduceat(cosines[0] ** 2, first))
    outer = cosines[:, np.newaxis, :] * cosines[np.newaxis, :, :]
    squares = np.moveaxis(np.add.reduceat(outer, first, axis=2), 2, 0)
    return np.asarray(np.linalg.eigvalsh(squares)[:, 0])


def _sides(library: Library) -> list[_Side]:
    """Return every candidate that the base model does not absorb, those of one form together."""
    count = library.target.shape[0]
    # Rows at random, because a fixed stride would make waves of different orders alike.
    rows = np.sort(np.random.default_rng(0).permutation(count)[:_MOST_ROWS])
    base = basis_of(library.base[rows])
    out = []
    for candidate in _all_candidates(library):
        columns = candidate.columns[rows]
        left = columns - base @ (base.T @ columns)
        whole = np.einsum("ij,ij->j", columns, columns)
        # A shape that may be varied is left out where it vanishes; one of its own stays what it is.
        absorbed = _ABSORBED if candidate.form.nonlinear else _NOTHING
        if np.any(np.einsum("ij,ij->j", left, left) <= absorbed * whole):
            continue
        basis = basis_of(left, like=columns)
        if basis.shape[1]:
            out.append(_Side((candidate.form.effect, candidate.form.name), basis))
    return sorted(out, key=lambda side: side.form)


def _all_candidates(library: Library) -> list[Candidate]:
    """Return a library's candidates, those that go by orders at each other's orders, too."""
    waves = [c for c in library.candidates if goes_by_order(c.form)]
    orders = {c.point[0] for c in waves}
    there = {(c.form.effect, c.form.name, c.point) for c in waves}
    forms = {(c.form.effect, c.form.name): c.form for c in waves if c.form.refine}
    return [
        *library.candidates,
        *(
            library.candidate(form, point)
            for key, form in forms.items()
            for point in (at_order(form, order) for order in sorted(orders))
            if (*key, point) not in there
        ),
    ]


def usual_points(scene: Scene, form: Form) -> Sequence[Point]:
    """Return a form's points on a motion without residual, which has no strong orders or impacts.

    Parameters
    ----------
    scene : Scene
    form : Form
    """
    points = form.grid(scene)
    if points:
        return points
    if goes_by_order(form):
        return tuple(at_order(form, order) for order in _USUAL_ORDERS)
    if form.effect == "backlash" and form.name != SEEN:
        cutoff, gear = scene.table.cutoff_hz, scene.table.gear_ratio
        gaps = log_grid(_GAPS_ARM_RAD[0] * gear, _GAPS_ARM_RAD[1] * gear, 6)
        contact = cutoff, _CONTACT_DAMPING, 0.0, 0.0
        return tuple((gap, _ARM_SHARE, _ARM_SHARE, *contact) for gap in gaps)
    return ()


def _largest_sets(
    effects: Sequence[str], alike: set[frozenset[str]]
) -> tuple[tuple[str, ...], ...]:
    """Return the largest sets within which every two are alike."""
    sets: list[set[str]] = []
    for effect in effects:
        grown = [
            group | {effect}
            for group in sets
            if all(frozenset((effect, other)) in alike for other in group)
        ]
        pairs = [
            {other, effect} for other in effects if other < effect and {other, effect} in alike
        ]
        sets += [new for new in (*grown, *pairs) if new not in sets]
    kept = [group for group in sets if not any(group < other for other in sets)]
    return tuple(sorted(tuple(sorted(group)) for group in kept))


_CALLED: Mapping[str, str] = MappingProxyType(
    {
        "acceleration_rad_s2": "acceleration",
        "after_reversal_s": "the time since a reversal",
        "arm_position_rad": "the arm's angle",
        "frequency_hz": "the frequency of the motion",
        "gearbox_temperature_degc": "the gearbox temperature",
        "load_torque_nm": "the load",
        "order_per_motor_rev": "the motor's angle",
        "recording": "time from recording to recording",
        "time_s": "time",
        "velocity_rad_s": "speed",
    }
)
"""What an effect's main axis is called by who records it."""


def told_apart_by(effect: str, other: str) -> str:
    """Return the measurement that tells two effects apart, in a sentence or two."""
    for alike in card_of(effect).look_alikes:
        if alike.effect == other:
            return alike.told_apart_by
    first, second = (_CALLED[card_of(e).axes[0]] for e in (effect, other))
    return (
        f"Record a cycle in which {first} and {second} vary independently of each other."
        if first != second
        else "Repeat the cycle with more speeds, and over a longer stroke."
    )
