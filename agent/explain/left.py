"""What is left of a mismatch when all that was found is known, held against the noise."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Cell, Floor
from agent.explain.choosing.materiality import CLOSE
from agent.explain.rows.floor import steady_windows, variance_about_trend
from agent.explain.rows.lines import Line
from agent.explain.rows.noise_in_kind import FEWEST, is_noise_in_kind
from agent.explain.rows.slow_noise import is_foretold_by_its_fast_part
from agent.explain.rows.table import Table
from agent.explain.rows.unrepeated import does_not_come_again
from agent.explain.rows.usual import usual_rows
from agent.identify.result import Floats

LOUDER = 2.0
"""Times the noise at held speeds: up to there what is left may be noise."""

_HARDLY = 0.1  # of what stands above the noise at held speeds: so little is no place
_MOSTLY = 0.5  # of what is left at held speeds
_SHOWN = 0.3  # of what stands above the noise at held speeds: louder noise goes along no axis


@dataclass(frozen=True)
class Left:
    """What an extended twin leaves.

    Parameters
    ----------
    table : Table
    rows : ndarray of int, shape (m,)
        Of the table, that were learnt from.
    residual_nm : ndarray, shape (m,)
        What is left there.
    floor : Floor
    cells : tuple of Cell
        Its deficiency map.
    lines : tuple of Line
        What swings at a frequency of its own in it.
    """

    table: Table
    rows: NDArray[np.int64]
    residual_nm: Floats
    floor: Floor
    cells: tuple[Cell, ...]
    lines: tuple[Line, ...]

    @property
    def noise_nm(self) -> float:
        """Return the noise floor; where what is left is louder noise, or slower, that."""
        return self.left_nm if self.noise_all_the_same else self._floor_nm

    @property
    def usual(self) -> NDArray[np.bool_]:
        """Return which of the weighing's rows were asked about, shape (m,): see `rows.usual`."""
        return usual_rows(self.table, self.rows)

    @property
    def ratio(self) -> float:
        """Return the root mean square of what is left over the noise, where it was asked about."""
        return 1.0 if self.noise_all_the_same else self.over_floor

    @property
    def over_floor(self) -> float:
        """Return the same over the noise floor, whatever kind of noise is left."""
        return self.left_nm / self._floor_nm if self._floor_nm > 0.0 else 1.0

    @cached_property
    def louder_noise(self) -> bool:
        """Return whether what is left is noise, but more than where a speed is held."""
        if not self.floor.value_nm > 0.0 or not CLOSE < self.over_floor <= LOUDER:
            return False
        if self._shown > _SHOWN * (1.0 - self.over_floor**-2):
            return False
        return is_noise_in_kind(self.table, self.rows, self.residual_nm)

    @cached_property
    def slower_noise(self) -> bool:
        """Return whether what is left is noise that is slow in part, which the floor leaves out."""
        if not self._has_no_place or self.over_floor > LOUDER:
            return False
        return is_foretold_by_its_fast_part(self.table, *self._asked)

    @cached_property
    def unrepeated_noise(self) -> bool:
        """Return whether what is left does not come again where the same place is passed again."""
        if not self._has_no_place:
            return False
        return does_not_come_again(self.table, *self._asked, self.floor.repeats_nm)

    @property
    def _shown(self) -> float:
        """Return the greatest share of what is left that goes along an axis, surely."""
        return max((cell.gain for cell in self.cells if cell.counts), default=0.0)

    @property
    def _asked(self) -> tuple[NDArray[np.int64], Floats]:
        """Return the rows that were asked about, and what is left there."""
        return self.rows[self.usual], self.residual_nm[self.usual]

    @property
    def _has_no_place(self) -> bool:
        """Return whether more than the floor is left, and shows next to nothing of it anywhere.

        Slow noise has few independent samples, and along one of a hundred cells of a map it shows.
        """
        if not self.floor.value_nm > 0.0 or not self.over_floor > CLOSE:
            return False
        hardly = self._shown <= _HARDLY * (1.0 - self.over_floor**-2)
        return hardly and not any(line.matters for line in self.lines)

    @cached_property
    def is_brief(self) -> bool:
        """Return whether most of what is left where a speed is held is over within half a second.

        As blows are, and no slow noise is.
        """
        left = np.full(self.table.used.shape[0], np.nan)
        left[self.rows] = self.residual_nm
        windows = [(left[window], worth) for window, worth in steady_windows(self.table)]
        whole = [(own, worth) for own, worth in windows if np.isfinite(own).all()]
        if not whole:
            return False
        brief = np.mean([variance_about_trend(own, worth) for own, worth in whole])
        return bool(brief > _MOSTLY * np.mean([np.mean(own**2) for own, _ in whole]))

    @property
    def noise_all_the_same(self) -> bool:
        """Return whether what is left is more than the floor, and noise all the same."""
        return self.louder_noise or self.slower_noise or self.unrepeated_noise

    @property
    def without_measure(self) -> bool:
        """Return whether no noise floor was to be had, and what is left is surely not noise."""
        return self._is_told_by_its_kind and not self._is_noise_in_kind

    @property
    def noise_or_unknown_nm(self) -> float:
        """Return the noise: the floor, else what is left where it is noise in kind; 0 for neither.

        Without a speed that is held no floor is measured. What keeps no memory and comes in no
        spells is noise all the same, and no part of a mismatch.
        """
        if self.floor.value_nm > 0.0:
            return self.floor.value_nm
        return self.left_nm if self._is_told_by_its_kind and self._is_noise_in_kind else 0.0

    @property
    def _is_told_by_its_kind(self) -> bool:
        return not self.floor.value_nm > 0.0 and self.rows.shape[0] >= FEWEST

    @cached_property
    def _is_noise_in_kind(self) -> bool:
        return is_noise_in_kind(self.table, self.rows, self.residual_nm)

    @property
    def left_nm(self) -> float:
        """Return the root mean square of what is left where it was asked about."""
        return math.sqrt(float(np.mean(self.residual_nm[self.usual] ** 2)))

    @property
    def _floor_nm(self) -> float:
        """Return the noise floor; where it was not to be had, what the best cell would leave."""
        if self.floor.value_nm > 0.0:
            return self.floor.value_nm
        return math.sqrt(float(np.mean(self.residual_nm**2)) * max(1.0 - self._shown, 0.0))
