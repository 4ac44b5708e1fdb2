"""Torque that is clipped, found in the signals themselves.

A twin that is driven by the measured motion sees nothing missing where a drive is at its limit: the
motion simply is slower than it was asked to be. What gives it away is torque that stays at one
greatest value while the velocity falls further and further short of its command. Elsewhere the
drive answers such a growing error with torque; how much torque is learnt from these recordings
(`drive_answer`). At the top of a wave the drive gets what it asks for.

Where only the reading ends, at the range of a sensor or of a converter, the joint gets all of the
torque that is asked for, and its motion shows that.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.drive_answer import (
    SMOOTHED_S,
    DriveAnswer,
    boxed,
    drive_answer,
    has_command,
    moved_answer,
    simulated_answer,
    velocity_error,
)
from agent.explain.rows.pieces import thinned
from agent.explain.rows.table import Table
from agent.identify.result import Floats

_TOP = 0.9995  # quantile of the torque that the limit is looked for at
_WITHIN = 3.0  # standard deviations of the averaged torque's noise
_SHIFTS = 20
_SHORTEST_S = 0.04
_WINDOWS_S = (0.04, 0.3)  # over which a drive's answer is learnt: as long as the tops
_FEWEST_TOPS = 2
_LONG_S, _BY_FAR = 0.2, 2.0  # one top is enough that lasts so long, and lacks so much more
_PARTS = 4  # in which one top is compared with itself
_LEAST_SHARE = 0.001
_BEYOND = 0.1  # of the samples that are flat
_AFTER_S = 0.3  # in which the velocity catches up
_UNANSWERED = 4.0  # times the answer's own error, or the noise: so much torque is missing
_AT_LIMIT = 1.0  # of the same: from there on the torque is surely at its limit
_HELD_SPEED = 0.02  # of itself: a speed that changes less is a limited one
_FOLLOWED = 0.5  # of what is missing in the reading: then the joint had it
_THERE = 0.8  # of the samples at which a motion takes clearly more than a limit, at that limit
_GAUSS = 0.6745  # median absolute deviation over standard deviation


@dataclass(frozen=True)
class SaturationEvidence:
    """Torque at a limit while the velocity falls short.

    Parameters
    ----------
    limit_nm : float
        Mean of the torque's size at the flat tops.
    limit_ci95_nm : tuple of float
        From how the flat tops differ, or the parts of a single one, and from the steps in which
        torque is reported.
    tops : int
        How many flat tops there are at which torque is missing.
    share : float
        Of all samples, those at the limit.
    shortfall_rad_s : float
        By how much the velocity is behind its command during a flat top at most, median.
    missing_nm : float
        How much more torque the drive asks for there than is reported, median of the tops' most.
    reading : bool
        Whether only what is reported ends there: the joint moves as with all that was asked for.
    by_motion : bool
        Whether the motion alone says so, as no command was recorded.
    """

    limit_nm: float
    limit_ci95_nm: tuple[float, float]
    tops: int
    share: float
    shortfall_rad_s: float
    missing_nm: float
    reading: bool = False
    by_motion: bool = False


@dataclass(frozen=True)
class _Tops:
    """Flat tops among the full-rate samples, and the half width that was taken for flat."""

    near_nm: float
    spans: tuple[tuple[int, int], ...]
    flat: NDArray[np.bool_]


def saturation_evidence(table: Table) -> SaturationEvidence | None:
    """Return what tells of a torque limit, or nothing.

    Nothing means that no torque stays at a greatest value, that some goes beyond it, that the drive
    asks for no more there, or that it is the speed that is limited. Where no command was recorded
    (`has_command`), the motion alone tells: it takes more than a reading that ends.

    Parameters
    ----------
    table : Table
    """
    tops = _flat_tops(table)
    if tops is None:
        return None
    long_s = float(np.clip(np.median(_seconds(table, tops.spans)), *_WINDOWS_S))
    apart = ~_followed(table, tops.flat)
    if not has_command(table):
        moved = moved_answer(table, apart, long_s)
        return None if moved is None else _passed_over(table, tops, moved)
    answers = (answer(table, apart, long_s) for answer in (simulated_answer, drive_answer))
    found = (_evidence(table, tops, answer) for answer in answers if answer is not None)
    return next((evidence for evidence in found if evidence is not None), None)


def _evidence(table: Table, tops: _Tops, answer: DriveAnswer) -> SaturationEvidence | None:
    """Return what an answer of the drive makes of flat tops; nothing where it asks for no more."""
    torque = np.abs(table.full["torque_nm"])
    missing = [_missing_nm(table, span, answer) for span in tops.spans]
    # What the answer's law misses grows with the time that it is asked for.
    unit = max(answer.error_nm, tops.near_nm)
    units = unit * np.maximum(_seconds(table, tops.spans) / answer.window_s, 1.0)
    most = np.array([float(np.nanmax(m)) for m in missing])
    moving = np.array([not _holds_speed(table, span) for span in tops.spans])
    clear = moving & (most > _UNANSWERED * units)
    alone = (most > _BY_FAR * _UNANSWERED * units) & (_seconds(table, tops.spans) >= _LONG_S)
    if np.count_nonzero(clear) < _FEWEST_TOPS and not np.any(clear & alone):
        return None
    kept = np.flatnonzero(clear)
    held = [_at_limit(table, tops.spans[k], missing[k], _AT_LIMIT * units[k]) for k in kept]
    parts = [np.array_split(torque[at], 1 if kept.shape[0] > 1 else _PARTS) for at in held]
    levels = np.array([float(np.mean(part)) for several in parts for part in several if part.size])
    middle = float(np.mean(levels))
    spread = 1.96 * math.sqrt(_variance_nm2(table, held, levels) + _step_nm(torque) ** 2 / 12.0)
    lacking = np.zeros_like(torque)
    for k in kept:
        lacking[slice(*tops.spans[k])] = np.nan_to_num(np.maximum(missing[k], 0.0))
    grown = [_shortfall(table, tops.spans[k]) for k in kept]
    return SaturationEvidence(
        limit_nm=middle,
        limit_ci95_nm=(middle - spread, middle + spread),
        tops=kept.shape[0],
        share=float(np.mean(lacking > 0.0)),
        shortfall_rad_s=float(np.median(grown)),
        missing_nm=float(np.median(most[kept])),
        reading=answer.up_to_a_constant and _moves_as_asked(table, tops, lacking),
    )


def _passed_over(table: Table, tops: _Tops, answer: DriveAnswer) -> SaturationEvidence | None:
    """Return what the motion alone makes of flat tops; nothing where it takes hardly more there.

    Steady acceleration has flat torque, too, and takes what it has. A reading that ends is there
    whenever the motion takes clearly more, and nowhere else.
    """
    torque = table.full["torque_nm"]
    limit = float(np.median(np.abs(boxed(table, torque)[tops.flat])))
    excess = np.sign(boxed(table, torque)) * answer.asked_nm - limit
    unit = max(answer.error_nm, tops.near_nm)
    most = np.array([float(np.nanmax(excess[a:b])) for a, b in tops.spans])
    kept = np.flatnonzero(most > _UNANSWERED * unit)
    beyond = excess > _UNANSWERED * unit
    if kept.shape[0] < _FEWEST_TOPS or np.mean(tops.flat[beyond]) < _THERE:
        return None
    if np.mean(excess[tops.flat] > -unit) < _THERE:
        return None
    held = [np.arange(*tops.spans[k]) for k in kept]
    levels = np.array([float(np.mean(np.abs(torque[at]))) for at in held])
    middle = float(np.mean(levels))
    spread = 1.96 * math.sqrt(_variance_nm2(table, held, levels) + _step_nm(torque) ** 2 / 12.0)
    return SaturationEvidence(
        limit_nm=middle,
        limit_ci95_nm=(middle - spread, middle + spread),
        tops=kept.shape[0],
        share=float(np.mean(beyond)),
        shortfall_rad_s=0.0,
        missing_nm=float(np.median(most[kept])),
        reading=True,
        by_motion=True,
    )


def _flat_tops(table: Table) -> _Tops | None:
    """Return stretches in which the averaged torque stays at its greatest value, if any."""
    torque = table.full["torque_nm"]
    smooth = np.abs(boxed(table, torque))
    finite = smooth[np.isfinite(smooth)]
    if finite.size < 2 or float(finite.max()) <= 0.0:
        return None
    top = float(np.quantile(finite, _TOP))
    near = max(_WITHIN * _noise_nm(table), _step_nm(np.abs(torque)), 1e-3 * top)
    limit = top
    for _ in range(_SHIFTS):
        # The noise's own peaks are above the limit: it lies where the samples are densest.
        close = finite[np.abs(finite - limit) <= near]
        if not close.size:
            return None
        limit = float(np.median(close))
    spans = _lasting(table, np.abs(smooth - limit) <= near)
    flat = np.zeros(smooth.shape[0], dtype=np.bool_)
    for a, b in spans:
        flat[a:b] = True
    if not spans or float(np.mean(flat)) < _LEAST_SHARE:
        return None
    # A steady acceleration has flat tops as well; at a limit nothing is beyond it.
    if np.count_nonzero(finite > limit + near) > _BEYOND * np.count_nonzero(flat):
        return None
    return _Tops(near, tuple(spans), flat)


def _missing_nm(table: Table, span: tuple[int, int], answer: DriveAnswer) -> Floats:
    """Return how much more a drive asks for than it gives at a top, its way, N m, shape (m,).

    More than at the top's beginning, where its answer is known up to a constant.
    """
    at = slice(*span)
    middle = float(np.median(table.full["torque_nm"][at]))
    given = answer.asked_nm[span[0]] if answer.up_to_a_constant else middle
    asked = math.copysign(1.0, middle) * (answer.asked_nm[at] - given)
    return np.where(np.isfinite(asked), asked, -math.inf)


def _at_limit(
    table: Table, span: tuple[int, int], missing_nm: Floats, clear_nm: float
) -> NDArray[np.int64]:
    """Return the samples of a top at which the drive asks for clearly more than it gives."""
    margin = round(SMOOTHED_S / _period_s(table, span))  # of the average that the top was found by
    at = np.arange(*span)
    sure = at[(missing_nm > clear_nm) & (at < span[1] - margin)]
    return sure if sure.size else at


def _holds_speed(table: Table, span: tuple[int, int]) -> bool:
    """Return whether it is the speed that stays where it is: a limited speed falls short, too."""
    speed = np.abs(table.full["velocity_rad_s"][slice(*span)])
    third = max(1, speed.shape[0] // 3)
    begin, end = float(np.mean(speed[:third])), float(np.mean(speed[-third:]))
    return abs(end - begin) < _HELD_SPEED * max(begin, end)


def _shortfall(table: Table, span: tuple[int, int]) -> float:
    """Return by how much the velocity is behind its command during a top at most, rad/s."""
    at = slice(*span)
    behind = velocity_error(table)[at] * np.sign(np.median(table.full["torque_nm"][at]))
    return float(np.nanmax(behind))


def _variance_nm2(table: Table, held: Sequence[NDArray[np.int64]], levels: Floats) -> float:
    """Return how far one top's level may be off: as levels differ, and as noise moves each."""
    averages = [max(float(np.ptp(table.full["time_s"][at])) / SMOOTHED_S, 1.0) for at in held]
    noise = _noise_nm(table) ** 2 * float(np.mean(1.0 / np.array(averages)))
    return noise + (float(np.var(levels, ddof=1)) if levels.shape[0] > 1 else 0.0)


def _moves_as_asked(table: Table, tops: _Tops, lacking_nm: Floats) -> bool:
    """Return whether the joint moves as if it had what the reading lacks.

    The twin's numbers are fitted away from the tops. At them its torque is the reading's where a
    drive is at its limit; where the reading is, it is what the drive asks for.
    """
    inside = table.band(tops.flat.astype(np.float64))
    rows = table.used & np.isfinite(table.target_nm)
    outside = rows & (np.abs(inside) < 0.02)
    base = table.base[:, table.carried]
    if np.count_nonzero(outside) < 10 * base.shape[1]:
        return False
    numbers = np.linalg.lstsq(base[outside], table.target_nm[outside], rcond=None)[0]
    way = np.sign(thinned(boxed(table, table.full["torque_nm"]), table.pieces))
    more = way * (base @ numbers - table.target_nm)
    lacks = table.band(lacking_nm)
    at = rows & (inside > 0.5)
    size = float(lacks[at] @ lacks[at])
    return size > 0.0 and float(more[at] @ lacks[at]) > _FOLLOWED * size


def _seconds(table: Table, spans: Sequence[tuple[int, int]]) -> Floats:
    """Return how long each of some stretches lasts, s, shape (k,)."""
    time = table.full["time_s"]
    return np.array([float(time[b - 1] - time[a]) for a, b in spans])


def _period_s(table: Table, span: tuple[int, int]) -> float:
    """Return the sampling period where a stretch is."""
    return next(p.period_s for p in table.pieces if p.full.start <= span[0] < p.full.stop)


def _noise_nm(table: Table) -> float:
    """Return the standard deviation of the averaged torque, robust to what the torque does.

    By third differences of averages that have no sample in common; of the noisiest piece.
    """
    smooth, found = boxed(table, table.full["torque_nm"]), [0.0]
    for piece in table.pieces:
        step = max(1, round(SMOOTHED_S / piece.period_s))
        values = smooth[piece.full]
        if values.shape[0] <= 4 * step:
            continue
        rough = values[3 * step :] - 3.0 * values[2 * step : -step]
        rough = rough + 3.0 * values[step : -2 * step] - values[: -3 * step]
        rough = rough[np.isfinite(rough)]
        found.append(float(np.median(np.abs(rough))) / (_GAUSS * math.sqrt(20.0)))
    return max(found)


def _step_nm(torque: Floats) -> float:
    """Return the step in which torque is reported, or 0 where it has none."""
    values = np.unique(torque[np.isfinite(torque)])
    if values.size > torque.shape[0] // 20:
        return 0.0
    steps = np.diff(values)
    steps = steps[steps > 1e-9 * float(values[-1])]
    return float(np.median(steps)) if steps.size else 0.0


def _lasting(table: Table, flat: NDArray[np.bool_]) -> list[tuple[int, int]]:
    """Return where a flag holds for long enough, pieces apart."""
    out = []
    for piece in table.pieces:
        least = max(3, round(_SHORTEST_S / piece.period_s))
        edges = np.flatnonzero(np.diff(flat[piece.full].astype(np.int8), prepend=0, append=0))
        for begin, end in zip(edges[::2], edges[1::2], strict=True):
            if end - begin >= least:
                out.append((piece.full.start + int(begin), piece.full.start + int(end)))
    return out


def _followed(table: Table, flat: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the flat tops and the time after them in which the velocity catches up, (N,)."""
    out = flat.copy()
    for piece in table.pieces:
        count = np.cumsum(flat[piece.full].astype(np.int64))
        reach = max(round(_AFTER_S / piece.period_s), 1)
        before = np.concatenate((np.zeros(min(reach, count.shape[0]), np.int64), count[:-reach]))
        out[piece.full] |= count > before[: count.shape[0]]
    return out
