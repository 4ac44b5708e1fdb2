"""The lead of the motor over its arm: lost motion, and the two encoders' skew in time.

The lead is motor angle less gear ratio times arm angle. It differs between the two directions by
the lost motion; what it has in proportion to velocity is the two encoders' skew.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats, Parameter
from agent.identify.reversals.turns import Motion, Track, standing
from agent.identify.signals.lowpass import lowpass
from agent.identify.uncertainty import student_975

LEAST_TURNS = 4
_TAKEN_UP = 1.5  # times the lost motion: travel after a turn from which the arm surely follows
_PUSHING = 0.5  # of the usual torque
_RINGING = 0.4  # of a swing
_FOLLOWS = 0.75  # of the motor's velocity
_LEAST_SAMPLES = 5
_SLOW, _SLOW_HZ = 0.02, 20.0  # of the sampling rate: cutoff of the motor's motion beside the arm's
_ALIKE = 5  # samples: what is left over them on average is ringing rather than noise


@dataclass(frozen=True)
class Lead:
    """Regression of the lead on direction and the arm's motion, jackknifed by reversal.

    Parameters
    ----------
    lost_motion, skew_s : Parameter
    middle_rad : dict of int to float
        For every recording the lead in the middle of the lost motion.
    value, skew : float
        Lost motion in rad and skew in s, identified or not.
    """

    lost_motion: Parameter
    skew_s: Parameter
    middle_rad: dict[int, float]
    value: float
    skew: float


def lead_of(motion: Motion) -> Lead | None:
    """Regress the lead where the arm follows; the travel that this takes is found in two rounds.

    None where too few turns go on for longer than that.
    """
    lost = 0.0
    found: tuple[Floats, Floats, tuple[int, ...]] | None = None
    for _ in range(3):
        found = _round(motion, _TAKEN_UP * lost)
        if found is None:
            return None
        lost = 2.0 * abs(float(found[0][0]))
    weights, half, recordings = found if found is not None else (np.zeros(0), np.zeros(0), ())
    value, spread = 2.0 * float(weights[0]), 2.0 * float(half[0])
    if value <= spread:
        limit = max(value + spread, 0.0)
        parameter = Parameter.not_identified(
            f"not identified: lost motion is below {1e3 * limit:.2g} mrad of the motor, within "
            "the encoders' noise"
        )
    else:
        parameter = Parameter(value, (value - spread, value + spread))
    skew, late = float(weights[1]), float(half[1])
    return Lead(
        parameter,
        Parameter(skew, (skew - late, skew + late)),
        {r: float(w) for r, w in zip(recordings, weights[3:], strict=True)},
        value,
        skew,
    )


def _round(motion: Motion, beyond_rad: float) -> tuple[Floats, Floats, tuple[int, ...]] | None:
    """Return weights, half intervals and the recordings of the constants, from settled samples."""
    recordings = tuple(sorted({t.recording for t in motion.tracks}))
    turns = [t for track in motion.tracks for t in _turns_of(track, recordings, beyond_rad)]
    if len(turns) < LEAST_TURNS:
        return None
    weights, half, beyond = _by_turn(turns)
    # Ringing and the gear's own errors are alike at all reversals, which leaving one out does not
    # show: a weight may err by what is left of them.
    columns = np.concatenate([turn.columns for turn in turns])
    size = np.sqrt(np.mean(columns**2, axis=0))
    return weights, half + beyond / np.where(size > 0.0, size, 1.0), recordings


class _Turn(NamedTuple):
    """The settled samples after one reversal: regressors, instruments, both (n, p), and the lead.

    The regressors are direction, the arm's velocity and acceleration, and a constant for each
    recording; the instruments have the motor's slow motion in the arm's place.
    """

    columns: Floats
    instruments: Floats
    lead: Floats


def _turns_of(track: Track, recordings: Sequence[int], beyond_rad: float) -> Iterator[_Turn]:
    """Yield the reversals of a track after which the arm follows for long enough."""
    filtered = track.filtered(np.asarray(track.lead_rad))
    # The arm's own motion, not the motor's: an arm that still rings winds up its gear.
    arm = np.gradient(track.position_rad - filtered, track.period_s)
    load = np.gradient(arm, track.period_s)
    slow_hz = min(max(_SLOW / track.period_s, _SLOW_HZ), track.cutoff_hz)
    slow = lowpass(track.measured_rad, track.period_s, slow_hz)
    drives = np.gradient(slow, track.period_s)
    pushes = np.gradient(drives, track.period_s)
    # A soft gear lets the arm stick and slip: where it stands, its friction may be anything.
    # Judged by its slow motion: by chance, an encoder's noise follows, too.
    behind = lowpass(arm, track.period_s, slow_hz)
    follows = behind * np.sign(drives) > _FOLLOWS * np.abs(drives)
    for settled in _settled(track, beyond_rad):
        index = settled[follows[settled]]
        if index.size < _LEAST_SAMPLES:
            continue
        way = np.sign(track.velocity_rad_s[index])
        offset = np.tile([float(track.recording == r) for r in recordings], (index.size, 1))
        yield _Turn(
            np.column_stack((way, arm[index], load[index], offset)),
            np.column_stack((way, drives[index], pushes[index], offset)),
            filtered[index],
        )


def _by_turn(turns: Sequence[_Turn]) -> tuple[Floats, Floats, float]:
    """Return weights, half intervals with one reversal left out at a time, and what is left.

    The arm's encoder errs in the lead and, twice differentiated, in the arm's acceleration alike:
    least squares take that for a gear that gives, at the lost motion's cost. The motor's slow
    motion is an instrument that knows nothing of it (instrumental variables).
    """
    count = len(turns)
    gram = np.stack([turn.instruments.T @ turn.columns for turn in turns])
    moment = np.stack([turn.instruments.T @ turn.lead for turn in turns])
    weights = _solved(gram.sum(axis=0), moment.sum(axis=0))
    without = np.stack(
        [
            _solved(gram.sum(axis=0) - g, moment.sum(axis=0) - m)
            for g, m in zip(gram, moment, strict=True)
        ]
    )
    spread = without - without.mean(axis=0)
    deviation = np.sqrt((count - 1.0) / count * np.sum(spread**2, axis=0))
    half = np.asarray(student_975(count - 1.0) * deviation)
    even = np.full(_ALIKE, 1.0 / _ALIKE)
    left = (turn.lead - turn.columns @ weights for turn in turns)
    rest = np.concatenate([np.convolve(own, even, "valid") for own in left])
    return weights, half, float(np.sqrt(np.mean(rest**2)))


def _solved(gram: Floats, moment: Floats) -> Floats:
    """Return ``gram^-1 moment``; columns may depend on each other or be zero."""
    size = np.sqrt(np.abs(np.diag(gram)))
    size = np.where(size > 0.0, size, 1.0)
    inverse = np.linalg.pinv(gram / np.outer(size, size), rcond=1e-12)
    return np.asarray(inverse @ (moment / size) / size)


def _settled(track: Track, beyond_rad: float) -> list[NDArray[np.intp]]:
    """Return for every turn the samples after it in which the motor drives the arm."""
    # A motor that hardly pushes any more may be pushed by its arm, from the other flank.
    push = track.filtered(track.torque_nm) * np.sign(track.velocity_rad_s)
    moving = ~standing(track)
    usable = moving & (push > _PUSHING * float(np.median(np.abs(push[moving]))))
    out = []
    ends = [*(turn.at for turn in track.turns[1:]), track.time_s.size]
    for turn, end in zip(track.turns, ends, strict=True):
        index = np.arange(turn.at, end)
        away = np.abs(track.position_rad[index] - track.position_rad[turn.at])
        # The first part of a swing still rings from the arm's being caught up.
        least = max(beyond_rad, _RINGING * float(away.max()), track.resolution_rad)
        index = index[usable[index] & (away > least)]
        if index.size >= _LEAST_SAMPLES:
            out.append(index)
    return out


def in_time(track: Track, skew_s: float) -> Floats:
    """Return the lead with the arm's angle moved to the motor's time, shape (n,).

    Not the lead less skew times velocity: while the motor crosses the gap its arm stands.
    """
    assert track.lead_rad is not None
    arm = track.position_rad - track.lead_rad
    at_once = np.interp(track.time_s + skew_s, track.time_s, arm)
    return np.asarray(track.lead_rad + arm - at_once, dtype=np.float64)
