"""Whether what is left lies in moments: a start, a collision, a hand on the arm, a glitch."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.amounts import percent
from agent.explain.rows.run import Run
from agent.explain.rows.table import Table
from agent.identify.result import Floats
from agent.numbers import significant

_BIN_S = 0.1
_AROUND_S = 0.25
_BEGINNING_S = 1.0
_IN_MOTION = 0.05  # of the greatest speed
_HALF = 0.5  # of what is left
_FEW = 0.01  # of all bins: more are no moments, and an effect has its places
_SPELLS, _LONGEST = 3, 3  # and tenths of a second of each: friction after a rest lasts longer
_CLEAR = 1.25  # times the noise floor: less is noise, which has its moments, too


@dataclass(frozen=True)
class Moments:
    """Some tenths of a second that hold most of what is left.

    Parameters
    ----------
    at : tuple of (int, str, float)
        Index and name of a recording, and its time where a tenth of a second begins, s.
    share : float
        Of what is left above the noise.
    begins : bool
        Whether it is how recordings begin in motion, each of them for a second.
    """

    at: tuple[tuple[int, str, float], ...]
    share: float
    begins: bool = False

    @property
    def comes_back(self) -> bool:
        """Return whether it is in several recordings, for another reason than how they begin."""
        return not self.begins and len({run for run, _, _ in self.at}) > 1

    def among(self, places: Sequence[int]) -> Moments:
        """Return the same where the recordings are these of a longer list."""
        return replace(self, at=tuple((places[run], name, t) for run, name, t in self.at))

    def said(self, *, apart: bool) -> str:
        """Return what is said of them, which were left out (`apart`) or not."""
        if self.begins:
            return (
                "recordings begin in motion, and how an arm behind a soft or loose gear swings "
                "then nobody knows: the first second of each was left out, which settles more"
            )
        where = ", ".join(f"at {significant(t, 3)} s of {name}" for _, name, t in self.at)
        done = (
            "they were left out, and what is said holds for the rest"
            if apart
            else "look at those rows, and leave them out if they are not the joint's"
        )
        return (
            f"{percent(self.share)} of what the simulation left lies in moments, {where} (a start, "
            f"a collision, a hand on the arm, a glitch of the logger): {done}"
        )


def in_moments(
    table: Table, rows: NDArray[np.int64], left_nm: Floats, floor_nm: float
) -> Moments | None:
    """Return the moments in which half of what is left lies; None where it lies in more than few.

    What follows nothing that was recorded is looked for in vain along speeds, places and loads, and
    hides what does.

    Parameters
    ----------
    table : Table
    rows : ndarray of int, shape (m,)
        Of the table: those compared.
    left_nm : ndarray, shape (m,)
        What is left there.
    floor_nm : float
        Their noise.
    """
    energy = left_nm**2
    if not floor_nm > 0.0 or float(np.mean(energy)) < (_CLEAR * floor_nm) ** 2:
        return None
    bins = np.floor(table.rows["time_s"][rows] / _BIN_S).astype(np.int64)
    cells, own, count = np.unique(
        np.stack((table.run[rows], bins), axis=1), axis=0, return_inverse=True, return_counts=True
    )
    above = np.bincount(own, energy) - count * floor_nm**2
    loudest = np.argsort(-above)
    share = np.cumsum(above[loudest]) / float(energy.sum() - energy.size * floor_nm**2)
    few = int(np.searchsorted(share, _HALF)) + 1
    if few > _FEW * count.size:
        return None
    at = sorted((int(run), int(k)) for run, k in cells[loudest[:few]])
    if not _are_brief(at):
        return None
    named = tuple((run, table.runs[run].name, k * _BIN_S) for run, k in at)
    return Moments(named, float(share[few - 1]))


def in_beginnings(table: Table) -> Moments | None:
    """Return how recordings begin, where some of them do in motion; None where none does.

    Parameters
    ----------
    table : Table
    """
    time_s, speed = table.rows["time_s"], np.abs(table.rows["velocity_rad_s"])
    at = []
    for index, run in enumerate(table.runs):
        own = np.flatnonzero(table.run == index)
        if own.size and speed[own[0]] > _IN_MOTION * float(np.max(speed[own])):
            at.append((index, run.name, float(time_s[own[0]])))
    return Moments(tuple(at), 0.0, begins=True) if at else None


def _are_brief(at: Sequence[tuple[int, int]]) -> bool:
    """Return whether tenths of a second, (run, number) in order, are few spells and short ones."""
    spells: list[list[tuple[int, int]]] = []
    for run, k in at:
        if spells and spells[-1][-1][0] == run and k - spells[-1][-1][1] <= _LONGEST:
            spells[-1].append((run, k))
        else:
            spells.append([(run, k)])
    longest = max(spell[-1][1] - spell[0][1] + 1 for spell in spells)
    return len(spells) <= _SPELLS and longest <= _LONGEST


def without(runs: Sequence[Run], moments: Moments) -> tuple[Run, ...]:
    """Return recordings without the rows of moments, and those within a quarter of a second."""
    out = list(runs)
    for index, _, start_s in moments.at:
        signals = out[index].signals
        after = signals.time_s - start_s
        lasts_s = _BEGINNING_S if moments.begins else _BIN_S + _AROUND_S
        near = (after > -_AROUND_S) & (after < lasts_s)
        kept = replace(signals, valid=signals.valid & ~near)
        out[index] = replace(out[index], signals=kept)
    return tuple(out)
