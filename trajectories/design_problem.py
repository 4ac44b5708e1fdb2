"""What makes a stair better than another: the criterion of the search.

It is Bayesian D-optimality on scaled parameters (Chaloner and Verdinelli, Statistical Science 10
(1995) 273, section 2.2): half the logarithm of the determinant of the information, in units of one
hundred percent of each parameter's size, with that hundred percent as prior. The friction law is
not linear in its parameters, so its part is the mean over the members of a prior.

A determinant may rise while single numbers get worse. So it is maximised under a constraint, in
the sense of Cook and Wong (Journal of the American Statistical Association 89 (1994) 687): no
number is to err more than in a `plain` stair, of rising speeds, that takes longer.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from trajectories.design_information import Belief, TorqueNoise, friction_information, usable_s
from trajectories.design_layout import Layout, Room, Strokes, held_in

Floats = NDArray[np.float64]

GRID_RATIO = 1.1
"""Neighbouring candidates differ by this much: far enough to be two points of a curve."""

_HELD = 10.0  # a number's lack counts ten times what another's gain does


@dataclass(frozen=True)
class Problem:
    """What is asked, in a form that is quick to evaluate.

    Parameters
    ----------
    room : Room
    grid_rad_s : ndarray, shape (g,)
        Rising speeds to choose from.
    belief, noise : Belief, TorqueNoise
    centre_rad, direction : float
        Motor position about which strokes lie, and where they lead: +1 or -1.
    settle_s : float
        Lost at the start of every dwell.
    speeds_min, speeds_max : int
        How many different speeds at least; how many dwells a way at most.
    plain : Layout, optional
        A stair beside which no number is to be worse.
    """

    room: Room
    grid_rad_s: Floats
    belief: Belief
    noise: TorqueNoise
    centre_rad: float
    direction: float
    settle_s: float
    speeds_min: int
    speeds_max: int
    plain: Layout | None = None

    @cached_property
    def columns(self) -> Floats:
        """Scaled sensitivities on the grid, shape (members, g, p)."""
        return self.belief.columns(self.grid_rad_s)

    @cached_property
    def _plain_errors(self) -> tuple[Floats, Floats] | None:
        """Logarithms of the plain stair's standard errors."""
        if self.plain is None:
            return None
        seen_s = usable_s(self.plain.dwells_s, self.settle_s)
        if seen_s.min() <= 0.0:
            return None
        columns = self.belief.columns(self.plain.speeds_rad_s)
        return _log_errors(self._friction(columns, seen_s), self._body(self.plain))

    def layout(self, strokes: Strokes) -> Layout | None:
        """Return strokes with their dwells, or None where there is no room for them."""
        if any(a[0] == b[0] for stroke in strokes for a, b in pairwise(stroke)):
            return None  # one speed, held twice without a ramp between
        groups = [[(float(self.grid_rad_s[i]), share) for i, share in s] for s in strokes]
        return held_in(groups, self.room)

    def has(self, strokes: Strokes) -> bool:
        """Tell whether there are these speeds, and room for them."""
        known = all(i < self.grid_rad_s.size for stroke in strokes for i, _ in stroke)
        return known and self.worth(strokes) > -np.inf

    def worth(self, strokes: Strokes, *, held: bool = False) -> float:
        """Return the criterion; minus infinity where there is no room.

        With `held`, what single numbers lack to the plain stair is taken off.
        """
        layout = self.layout(strokes)
        if layout is None:
            return -np.inf
        seen_s: dict[int, float] = {}
        picks = (i for stroke in strokes for i, _ in stroke)
        usable = usable_s(layout.dwells_s, self.settle_s).tolist()
        for i, one_s in zip(picks, usable, strict=True):
            seen_s[i] = seen_s.get(i, 0.0) + one_s
        if len(seen_s) < self.speeds_min or min(seen_s.values()) <= 0.0:
            return -np.inf
        rising = sorted(seen_s)
        friction = self._friction(self.columns[:, rising], np.array([seen_s[i] for i in rising]))
        body = self._body(layout)
        of_friction = np.mean(np.linalg.slogdet(friction)[1])
        value = 0.5 * float(of_friction + np.linalg.slogdet(body)[1])
        return value - _HELD * self._lack(friction, body) if held else value

    def lack(self, strokes: Strokes) -> float:
        """Return by how much numbers err more than in the plain stair: a sum of logarithms."""
        return (self.worth(strokes) - self.worth(strokes, held=True)) / _HELD

    def _friction(self, columns: Floats, seen_s: Floats) -> Floats:
        """Return the friction law's information with its prior, shape (members, p, p)."""
        information = friction_information(columns, 0.5 * self.noise.density_nm2_s / seen_s)
        return information + np.eye(information.shape[-1])

    def _body(self, layout: Layout) -> Floats:
        """Return the rigid body's information with its prior, shape (4, 4)."""
        gram = layout.body_gram(self.room, self.centre_rad, self.direction, self.belief.gear_ratio)
        scales = self.belief.body_scales
        out = gram * np.outer(scales, scales) / self.noise.density_nm2_s + np.eye(scales.size)
        return np.asarray(out, dtype=np.float64)

    def _lack(self, friction: Floats, body: Floats) -> float:
        """Return what `lack` does, of information."""
        theirs = self._plain_errors
        if theirs is None:
            return 0.0
        lacks = (
            np.maximum(own - plain, 0.0).sum(axis=-1)
            for own, plain in zip(_log_errors(friction, body), theirs, strict=True)
        )
        return float(sum(np.mean(lack) for lack in lacks))


def _log_errors(friction: Floats, body: Floats) -> tuple[Floats, Floats]:
    """Return logarithms of standard errors, shapes (members, p) and (4,)."""
    covariances = np.linalg.inv(friction), np.linalg.inv(body)
    of_friction, of_body = (np.diagonal(c, axis1=-2, axis2=-1) for c in covariances)
    return 0.5 * np.log(of_friction), 0.5 * np.log(of_body)
