"""The arm simulated inside the fit: most likely gear, friction, motion and places at once.

Gauss and Newton's steps, the motor's true motion eliminated (`arm_elimination`). At first the arm
is driven by the smoothed motion, and steps are shortened until they gain; then the motion follows,
too, and half steps bring both to rest. What the motion's own noise adds to an arm's path on average
is taken from the numbers last. Every reversal is left out by one step for the intervals,
which so hold whatever the reversals differ in, and are no narrower than the noise of torque and
encoders makes them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.reversals.arm_elimination import Reduced, bent, reduced
from agent.identify.reversals.arm_likeness import likeness
from agent.identify.reversals.arm_record import ArmRecord
from agent.identify.reversals.arm_simulation import MOTOR, SHAPE, Numbers
from agent.identify.uncertainty import student_975

_FIRST, _SECOND = 15, 24  # steps at most
_GAINED = 3e-3  # of the squares: less is not worth another step
_STILL = 2.0  # standard errors: from here on what moves is when teeth touch and part
_HALF = 0.5  # of a step from then on: whole ones go to and fro about where they lead to
_SETTLING, _AGAIN = 8, 4  # such steps, and the last of them that are averaged
_LONGEST = 0.5  # of a logarithm, at once
_FIRMER = 7  # times by ten, without a gain


@dataclass(frozen=True)
class ArmFit:
    """What a simulated arm says.

    Parameters
    ----------
    at : Numbers
        The most likely ones.
    free : tuple of int
        Which of ``(x, w)`` were free.
    misfit : float
        Mean square of what is left, in units of the noise.
    covariance : ndarray, shape (k, k)
        Of the free numbers, reversals left out one by one.
    of_noise : ndarray, shape (k, k)
        The same as the noise of torque and encoders alone makes it.
    reversals : int
        How many were left out.
    readings : float
        How many they were.
    likeness : float
        Of what is left at different reversals, see `arm_likeness`.
    """

    at: Numbers
    free: tuple[int, ...]
    misfit: float
    covariance: Floats
    of_noise: Floats
    reversals: int
    readings: float
    likeness: float

    def half_width(self, gradient: Floats) -> float:
        """Return half of the 95 % interval of a function with this gradient over ``(x, w)``."""
        own = gradient[list(self.free)]
        variance = max(float(own @ each @ own) for each in (self.covariance, self.of_noise))
        return student_975(self.reversals - 1.0) * math.sqrt(variance)


def fit_arm(records: list[ArmRecord], start: Numbers, *, gap: bool) -> ArmFit | None:
    """Return the most likely numbers, or None where the steps come to no end."""
    try:
        # A trial may be a gear that swings off to infinity; then there is nothing to solve.
        with np.errstate(all="ignore"):
            return _fitted(records, start, gap=gap)
    except (np.linalg.LinAlgError, ValueError):
        return None


def _fitted(records: list[ArmRecord], start: Numbers, *, gap: bool) -> ArmFit | None:
    count = len(records)
    free = tuple(i for i in range(len(SHAPE) + len(MOTOR) + 2 * count) if gap or i != 0)
    # A soft gear's arm under load hangs as under another load with other places and offsets: where
    # nothing tells them apart they change places in every step, and nothing else moves.
    loads = {SHAPE.index("load_nm"), *range(len(SHAPE), len(SHAPE) + count)}
    loads |= set(range(len(SHAPE) + count + len(MOTOR), len(SHAPE) + len(MOTOR) + 2 * count))
    asked = np.array([i not in loads for i in free])
    motions = [record.smooth_rad for record in records]
    at = _approached(records, motions, start, free)
    settled: list[Numbers] = []
    near = False
    for _ in range(_SECOND):
        parts = _parts(records, motions, at, free)
        columns, rest = _joined(parts)
        step, error = _step(columns, rest, 0.0)
        if not np.isfinite(step).all():
            return None
        still = float(np.max(np.abs(step / error), where=asked, initial=0.0)) < _STILL
        near = near or still
        step = _bounded(_HALF * step if near else step, free)
        at = at.moved(_spread(step, free, at))
        settled = [*settled, at] if still else []
        if len(settled) == _SETTLING:
            last = settled[-_AGAIN:]
            middle = Numbers(
                np.mean([each.x for each in last], axis=0),
                np.mean([each.w for each in last], axis=0),
            )
            return _finished(records, _straight(records, motions, middle, free, parts), free, parts)
        motions = [
            motion + part.motion[:, -1] - part.motion[:, :-1] @ step
            for motion, part in zip(motions, parts, strict=True)
        ]
    return None


def _straight(
    records: list[ArmRecord],
    motions: list[Floats],
    at: Numbers,
    free: tuple[int, ...],
    parts: list[Reduced],
) -> Numbers:
    """Return numbers less what the motion's noise, which no average is rid of, makes of them."""
    columns, _ = _joined(parts)
    bend = [
        bent(record, number, motion, at)
        for number, (record, motion) in enumerate(zip(records, motions, strict=True))
    ]
    return at.moved(_spread(_step(columns, np.concatenate(bend), 0.0)[0], free, at))


def _approached(
    records: list[ArmRecord], motions: list[Floats], start: Numbers, free: tuple[int, ...]
) -> Numbers:
    """Return numbers from which undamped steps lead on, the motion being the smoothed one."""
    at, firm = start, 1e-3
    columns, rest = _joined(_parts(records, motions, at, free))
    for _ in range(_FIRST):
        before = after = float(rest @ rest)
        for _ in range(_FIRMER):
            step = _bounded(_step(columns, rest, firm)[0], free)
            trial = at.moved(_spread(step, free, at))
            further = _joined(_parts(records, motions, trial, free))
            after = float(further[1] @ further[1])
            if after < before:
                break
            firm *= 10.0
        if not after < before:
            break
        firm = max(0.1 * firm, 1e-9)
        at, (columns, rest) = trial, further
        if before - after < _GAINED * before:
            break
    return at


def _parts(
    records: list[ArmRecord], motions: list[Floats], at: Numbers, free: tuple[int, ...]
) -> list[Reduced]:
    return [
        reduced(record, number, motion, at, free)
        for number, (record, motion) in enumerate(zip(records, motions, strict=True))
    ]


def _joined(parts: list[Reduced]) -> tuple[Floats, Floats]:
    return np.concatenate([p.columns for p in parts]), np.concatenate([p.rest for p in parts])


def _step(columns: Floats, rest: Floats, firm: float) -> tuple[Floats, Floats]:
    """Return a damped step and the standard errors that the noise alone would make."""
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scaled = columns / scale
    gram = scaled.T @ scaled
    inverse = np.linalg.pinv(gram + firm * np.eye(gram.shape[0]), rcond=1e-12, hermitian=True)
    return inverse @ (scaled.T @ rest) / scale, np.sqrt(np.diag(inverse)) / scale


def _bounded(step: Floats, free: tuple[int, ...]) -> Floats:
    own = np.array([1 <= i <= 4 for i in free])
    return np.where(own, np.clip(step, -_LONGEST, _LONGEST), step)


def _spread(step: Floats, free: tuple[int, ...], at: Numbers) -> Floats:
    out = np.zeros(at.x.size + at.w.size)
    out[list(free)] = step
    return out


def _finished(
    records: list[ArmRecord], at: Numbers, free: tuple[int, ...], parts: list[Reduced]
) -> ArmFit:
    """Leave every reversal out by one step, and ask whether what is left is noise."""
    columns, rest = _joined(parts)
    turn = np.concatenate([p.turn for p in parts])
    scale = np.sqrt(np.einsum("ij,ij->j", columns, columns))
    scaled = columns / scale
    order = np.argsort(turn, kind="stable")
    starts = np.flatnonzero(np.diff(turn[order], prepend=-1))
    outer = (scaled[:, :, np.newaxis] * scaled[:, np.newaxis, :])[order]
    gram = np.add.reduceat(outer, starts, axis=0)
    moment = np.add.reduceat((scaled * rest[:, np.newaxis])[order], starts, axis=0)
    total = gram.sum(axis=0)
    without = np.linalg.pinv(total - gram, rcond=1e-12, hermitian=True)
    shifts = np.einsum("gij,gj->gi", without, moment)
    count = starts.size
    size = np.outer(scale, scale)
    covariance = (count - 1.0) / count * shifts.T @ shifts / size
    of_noise = np.linalg.pinv(total, rcond=1e-12, hermitian=True) / size
    readings = max(sum(part.counted for part in parts), 1.0)
    return ArmFit(
        at,
        free,
        float(rest @ rest) / readings,
        covariance,
        of_noise,
        count,
        readings,
        likeness(records, parts),
    )
