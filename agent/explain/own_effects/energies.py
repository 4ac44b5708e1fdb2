"""What right numbers in the place of a simulation's own effects take off the mismatch."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.answer.result import Curve, Finding
from agent.explain.findings import order_of
from agent.explain.location.regions import AXIS, curve_of
from agent.explain.numbers.model import left_by, predicted
from agent.explain.own_effects.doubted import Doubted
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE
from agent.identify.result import Floats
from agent.physics.effects import CARRIED
from agent.physics.twin import Effect, Twin, TwinError

_SAME_LAW = 0.3  # of a cosine: from there on two torques are the same law's


class Energies:
    """What right numbers in the place of doubted effects take off, as shares of the mismatch.

    Of what the twin as given leaves when its rigid body and plain friction have `moved` to where
    they fit best, or as they are.
    """

    def __init__(self, doubted: Doubted, found: Twin, noise_nm2: float, *, moved: bool) -> None:
        self._table, self._given, self._found = doubted.table, doubted.twin, found
        self.moved, kept = moved, doubted.bare.effects
        laws = [e for e in found.effects if e not in kept]
        self.pairs = self._paired(doubted.places, laws)
        in_place = tuple(law for _, law in self.pairs if law is not None)
        given = self._left(doubted.twin)
        self.mismatch = given - noise_nm2
        right = replace(doubted.twin, effects=(*kept, *in_place))
        self.helped = (given - self._left(right)) / max(self.mismatch, 1e-300)

    @property
    def tells(self) -> bool:
        """Return whether there is a mismatch, and what each law is worth of it is a number."""
        worth = (self.of(place, law) for place, law in self.pairs)
        return self.mismatch > 0.0 and all(math.isfinite(share) for share in worth)

    def _paired(
        self, places: Sequence[int], free: list[Effect]
    ) -> tuple[tuple[int, Effect | None], ...]:
        """Return doubted effects, each with the law that was found in its place, if any was.

        There is one arm, on a spring or in a gap: whatever was found of it is in its place.
        """
        out: list[tuple[int, Effect | None]] = []
        for place in places:
            effect = self._given.effects[place]
            if effect.id in CARRIED:
                law = next((law for law in free if law.id in CARRIED), None)
            else:
                law = self._likest(effect, [law for law in free if law.id == effect.id])
            if law is not None:
                free.remove(law)
            out.append((place, law))
        return tuple(out)

    def _likest(self, effect: Effect, laws: Sequence[Effect]) -> Effect | None:
        """Return the law whose torque is most like an effect's of the twin as given, if any is."""
        own = self._torque(self._given, effect)
        alike = [abs(_cosine(own, self._torque(self._found, law))) for law in laws]
        best = int(np.argmax(alike)) if alike else 0
        return laws[best] if alike and alike[best] >= _SAME_LAW else None

    def of(self, place: int, law: Effect | None) -> float:
        """Return what the simulation's own numbers leave more than what was found in their place.

        All else as it was found.
        """
        others = (e for e in self._found.effects if e != law)
        as_given = (*others, self._given.effects[place])
        more = self._left(replace(self._found, effects=as_given)) - self._left(self._found)
        return more / self.mismatch

    def rmse_with(self, place: int, law: Effect | None) -> float:
        """Return what is left with the simulation's own numbers, all else as it was found, rms."""
        return math.sqrt(self.of(place, law) * self.mismatch + self._left(self._found))

    def drawn(self, place: int, found: Finding) -> Curve | None:
        """Return a finding's curve with what the simulation itself has along it."""
        curve, effect = found.curve, self._given.effects[place]
        if curve is None or curve.variable != AXIS.get(effect.id):
            return curve
        table = self._table
        rows = np.flatnonzero(table.sliding)
        theta = np.array([getattr(self._found, name) for name in BASE])
        scene = Scene(table, theta, np.zeros(table.sliding.shape[0]))
        own = curve_of(
            scene,
            rows,
            effect.id,
            found.form,
            self._torque(self._given, effect),
            np.zeros(rows.shape[0]),
            independent=1.0,
            order=order_of(scene, found.parameters),
        )
        if own is None:
            return curve
        given_nm = _read_at(curve, own)
        return replace(curve, given_nm=given_nm) if np.isfinite(given_nm).any() else curve

    def times(self, place: int, law: Effect | None) -> float:
        """Return how many times as strong as the simulation's the joint's effect is, rms."""
        if law is None:
            return 0.0
        own = self._torque(self._given, self._given.effects[place])
        size = float(np.linalg.norm(own))
        found = float(np.linalg.norm(self._torque(self._found, law)))
        return found / size if size > 0.0 else math.inf

    def _left(self, twin: Twin) -> float:
        table = self._table
        try:
            left = left_by(twin, table)
        except TwinError:  # of numbers that no joint has together
            return math.inf
        if self.moved:
            left = refit(table, table.target_nm - left)[1]
        rows = table.sliding & np.isfinite(left)
        return float(np.mean(left[rows] ** 2)) if rows.any() else math.inf

    def _torque(self, twin: Twin, effect: Effect) -> Floats:
        """Return what one effect adds to a twin's torque, shape (m,)."""
        table, plain = self._table, replace(twin, effects=())
        try:
            added = predicted(table, replace(twin, effects=(effect,))) - predicted(table, plain)
        except TwinError:
            return np.zeros(np.count_nonzero(table.sliding))
        return np.asarray(np.nan_to_num(added[table.sliding]))


def _read_at(curve: Curve, own: Curve) -> Floats:
    """Return another curve of the same axis where a curve is drawn, shape (m,).

    A friction law jumps at zero velocity, and is read on its own side.
    """
    out = np.full(curve.at.shape[0], np.nan)
    for side in (curve.at < 0.0, curve.at >= 0.0):
        there = (own.at < 0.0) == bool((curve.at[side] < 0.0).any())
        if side.any() and there.any():
            out[side] = np.interp(curve.at[side], own.at[there], own.line_nm[there])
    return out


def _cosine(one: Floats, other: Floats) -> float:
    size = float(np.linalg.norm(one) * np.linalg.norm(other))
    return float(one @ other) / size if size > 0.0 else 0.0
