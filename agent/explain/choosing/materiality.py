"""How much squared error an effect must remove to be worth a name.

`least_gain` is the amount; `beyond` asks that a gain be surely as much, and `worth` of what takes
the last of a mismatch away no more than that it is.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.search import Library
from agent.explain.rows.floor import noise_floor
from agent.explain.rows.strata import STEADY
from agent.explain.rows.table import Table
from agent.explain.rows.usual import as_usual
from agent.identify.result import Floats

MATERIAL = 0.02
"""Of the mismatch's energy, and of the energy of all that was recorded beside the prediction."""

CLOSE = 1.10
"""Up to so many times the noise floor nothing is looked for any more, and what is left is noise."""

FAR = 1.25
"""From so many times the noise floor something is missing, even where no axis shows it."""

A_GOOD_PART = 0.3
"""Of what stands above the noise: what takes so much is no effect of many."""

_MOST = 0.5  # of what stands above the noise
_OF_NOISE = 0.06  # of the band's noise: a quarter of its amplitude; less matters to nobody
_SEEN = 0.25  # of the band's noise: half its amplitude stands out, however noisy the raw torque is

_STANDS_OUT = 3.0  # of the band's noise: twice the noise is left without it, and that is a mismatch

_SURELY = 2.0  # standard errors over the blocks
_CLEARLY = 0.5  # of the least gain: so far beyond it no scatter over the blocks is asked


def beyond(gain: Floats, least: float) -> float:
    """Return how far a gain is beyond the least that is worth a name: negative is not enough.

    A gain is known to its scatter over the blocks. Close above the least it must be beyond it by
    two standard errors: else the joint may have less than that of the effect. What is half as much
    again is enough however it is spread: what is met seldom has all of its gain in a few blocks.

    Parameters
    ----------
    gain : ndarray, shape (b,)
        Squared error that a term removes from every block of unseen data.
    least : float
        As `least_gain` says; 0 for what needs no size.
    """
    return float(gain.sum()) - least - min(_SURELY * scatter_of(gain), _CLEARLY * least)


def worth(without: Floats, whole: Floats, least: float, noise: float) -> float:
    """Return how far a term's gain is beyond the least that is worth a name, as `beyond` does.

    What takes all that is left to the noise, from far above it, need not surely be as much: beside
    it stands no other cause, and without it the rest would have no name. Nor need what surely takes
    a good part of what stands above the noise. And what surely takes most of it, far above the
    noise, need not stand out of the noise as it was recorded.

    Parameters
    ----------
    without, whole : ndarray, shape (b,)
        Squared error of every block of unseen data without and with the term.
    least : float
        As `least_gain` says; 0 for what needs no size.
    noise : float
        Squared error that noise alone makes, as `noise_energy` says.
    """
    gain, before = without - whole, float(without.sum())
    completes = before > FAR**2 * noise and float(whole.sum()) <= CLOSE**2 * noise
    above = before - noise if before > CLOSE**2 * noise > 0.0 else math.inf
    total, surely = float(gain.sum()), _SURELY * scatter_of(gain)
    if before > FAR**2 * noise and total >= max(_MOST * above, surely):
        return total - min(least, _OF_NOISE * noise)
    if completes or total >= max(A_GOOD_PART * above, surely):
        return total - least
    return beyond(gain, least)


def scatter_of(gain: Floats) -> float:
    """Return the standard error of a gain's sum over the blocks, shape (b,)."""
    return float(np.std(gain)) * math.sqrt(gain.shape[0])


def noise_energy(library: Library, terms: Sequence[Candidate]) -> float:
    """Return the weighted squared error that noise alone makes beside a model's terms."""
    left = np.zeros(library.scene.table.used.shape[0])
    left[library.weighing.rows] = library.residual(terms) / library.weighing.weight
    floor_nm = noise_floor(library.scene.table, left).value_nm
    in_band = floor_nm**2 if floor_nm > 0.0 else 0.0
    return in_band * float(np.sum(library.weighing.weight**2))


def least_gain(
    library: Library,
    plain: Floats,
    terms: Sequence[Candidate],
    *,
    beside_wrong_numbers: bool = False,
) -> float:
    """Return the least weighted squared error that a term must remove to be worth a name.

    Two percent of what the refitted twin leaves where the first recording was made (`rows.usual`),
    but no more than what would leave twice the noise, however much stands beside it; and of the
    residual as it was recorded, in which most of the noise lies above the band that is compared:
    every joint has some effects that are lost in that, significant or not. But not of that, where
    one term surely takes most of a mismatch: without it the answer would be that it has no name.

    Parameters
    ----------
    library : Library
    plain : ndarray, shape (b,)
        Squared error of every block on unseen data, without any term.
    terms : sequence of Candidate
        The model with the term: its noise is what other missing physics enlarges least.
    beside_wrong_numbers : bool
        Whether numbers of the twin are wrong: then the residual is that of the twin as given.
    """
    weighing, table = library.weighing, library.scene.table
    rows = float(np.sum(weighing.weight**2))
    in_band = noise_energy(library, terms) / rows
    moved = _own_numbers_nm2(library) if beside_wrong_numbers else 0.0
    recorded = MATERIAL * (in_band + above_band_nm2(table) + moved)
    noise = max(_OF_NOISE * in_band, min(recorded, _SEEN * in_band))
    if _is_most(library, plain, terms, in_band * rows):
        noise = _OF_NOISE * in_band
    return max(of_mismatch(library, plain, in_band * rows), noise * rows)


def _is_most(library: Library, plain: Floats, terms: Sequence[Candidate], noise: float) -> bool:
    """Return whether one term surely takes most of a mismatch, which had no name without it."""
    before = float(plain.sum())
    if len(terms) != 1 or not before > CLOSE**2 * noise > 0.0:
        return False
    gain = plain - library.errors(terms)
    return float(gain.sum()) >= max(_MOST * (before - noise), _SURELY * scatter_of(gain))


def of_mismatch(library: Library, plain: Floats, noise: float) -> float:
    """Return the part of a mismatch that is worth a name, weighted squared error.

    Parameters
    ----------
    library : Library
    plain : ndarray, shape (b,)
        Squared error of every block on unseen data, without any term.
    noise : float
        Squared error that noise alone makes, as `noise_energy` says.
    """
    mismatch = as_usual(library.scene.table, library.weighing, plain)
    return min(MATERIAL * mismatch, _STANDS_OUT * noise) if noise > 0.0 else MATERIAL * mismatch


def _own_numbers_nm2(library: Library) -> float:
    """Return the mean square that refitting the twin's own numbers removes, N m squared."""
    weight = library.weighing.weight
    given, refitted = library.target / weight, library.residual([]) / weight
    return max(float(np.mean(given**2) - np.mean(refitted**2)), 0.0)


def above_band_nm2(table: Table) -> float:
    """Return the mean square of the torque above the band in steady motion, N m squared."""
    steady = table.used & (table.stratum == STEADY)
    thinned_away_nm2 = np.array([run.thinned_away_nm2 for run in table.runs])[table.run]
    above = ((table.rows["torque_nm"] - table.measured_nm) ** 2 + thinned_away_nm2)[steady]
    above = above[np.isfinite(above)]
    return float(np.mean(above)) if above.size else 0.0
