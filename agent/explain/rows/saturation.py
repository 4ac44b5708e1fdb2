"""Torque that a drive clips, found in the signals themselves.

A twin that is driven by the measured motion sees nothing missing where a drive is at its limit: the
motion simply is slower than it was asked to be. What gives it away is torque that stays at one
greatest value while the velocity falls further and further short of its command. Elsewhere the
drive answers such a growing error with torque; how much torque is learnt from these recordings.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.table import Table
from agent.identify.result import Floats

_SMOOTHED_S = 0.01
_TOP = 0.9995  # quantile of the torque that the limit is looked for at
_WITHIN = 3.0  # standard deviations of the torque's noise
_SHIFTS = 20
_BENT = 0.5  # of the half width that is looked at: the middle of a wave's top bends by 0.72 of it
_MOSTLY = 0.6  # of the time at the top must be flat
_SHORTEST_S = 0.03
_FEWEST_TOPS = 2
_LONG_S, _BY_FAR = 0.2, 2.0  # one top is enough that lasts so long, and lacks so much more
_PARTS = 4  # in which one top is compared with itself
_LEAST_SHARE = 0.001
_AFTER_S = 0.3  # in which the velocity catches up
_ANSWER_S = 0.02  # in which a drive's loop answers an error
_CLEAR = 0.9  # quantile: changes of the error that are larger than noise
_UNANSWERED = 4.0  # times what is taken for flat: so much torque is missing
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
        How many flat tops there are at which the velocity falls short.
    share : float
        Of all samples, those at the limit.
    shortfall_rad_s : float
        By how much the velocity falls further behind its command during a flat top, median.
    missing_nm : float
        With how much torque the drive answers such a shortfall elsewhere, at least; median.
    """

    limit_nm: float
    limit_ci95_nm: tuple[float, float]
    tops: int
    share: float
    shortfall_rad_s: float
    missing_nm: float


@dataclass(frozen=True)
class _Tops:
    """Flat tops among the full-rate samples, and the half width that was taken for flat."""

    limit_nm: float
    near_nm: float
    spans: tuple[tuple[int, int], ...]
    flat: NDArray[np.bool_]


def saturation_evidence(table: Table) -> SaturationEvidence | None:
    """Return what tells of a torque limit, or nothing.

    Nothing means that no torque stays at a greatest value, that the velocity keeps up there, or
    that no command was recorded: steady acceleration has flat torque, too, and only the command
    tells them apart (`has_command`).

    Parameters
    ----------
    table : Table
    """
    tops = _flat_tops(table)
    if tops is None or not has_command(table):
        return None
    error = _boxed(table, _wanted(table) - table.full["velocity_rad_s"])
    answer = _answer(table, error, tops)
    behind = error * np.sign(table.full["torque_nm"])
    grown = np.array([float(np.nanmax(behind[a:b]) - behind[a]) for a, b in tops.spans])
    clear = answer * grown > _UNANSWERED * tops.near_nm
    kept = [span for span, short in zip(tops.spans, clear, strict=True) if short]
    if len(kept) < _FEWEST_TOPS:
        missing = answer * grown > _BY_FAR * _UNANSWERED * tops.near_nm
        if not any(missing & (_seconds(table, tops.spans) >= _LONG_S)):
            return None
    torque = np.abs(table.full["torque_nm"])
    parts = [np.array_split(torque[_middle(span)], 1 if kept[1:] else _PARTS) for span in kept]
    levels = np.array([float(np.mean(part)) for several in parts for part in several])
    middle = float(np.mean(levels))
    step = _step_nm(torque)
    spread = 1.96 * math.sqrt(float(np.var(levels, ddof=1)) / levels.shape[0] + step**2 / 12.0)
    return SaturationEvidence(
        limit_nm=middle,
        limit_ci95_nm=(middle - spread, middle + spread),
        tops=len(kept),
        share=float(np.mean(tops.flat)),
        shortfall_rad_s=float(np.median(grown[clear])),
        missing_nm=answer * float(np.median(grown[clear])),
    )


def has_command(table: Table) -> bool:
    """Return whether it was recorded what the motion was asked to be."""
    return any(table.has(name) for name in ("velocity_command_rad_s", "position_command_rad"))


def _flat_tops(table: Table) -> _Tops | None:
    """Return stretches of the greatest torque, if they are flatter than the tops of waves."""
    torque = table.full["torque_nm"]
    smooth = np.abs(_boxed(table, torque))
    noise = max(_noise_nm(torque[piece.full]) for piece in table.pieces)
    finite = smooth[np.isfinite(smooth)]
    if finite.size < 2 or float(finite.max()) <= 0.0:
        return None
    top = float(np.quantile(finite, _TOP))
    near = max(_WITHIN * noise, _step_nm(np.abs(torque)), 1e-3 * top)
    limit = top
    for _ in range(_SHIFTS):
        # The noise's own peaks are above the limit: it lies where the samples are densest.
        close = finite[np.abs(finite - limit) <= near]
        if not close.size:
            return None
        limit = float(np.median(close))
    flat = np.abs(smooth - limit) <= near
    lasting = _lasting(table, flat)
    spans = [span for span in lasting if _bend_nm(torque, span) <= _BENT * near]
    held = np.zeros(flat.shape[0], dtype=np.bool_)
    for a, b in spans:
        held[a:b] = True
    if sum(b - a for a, b in spans) < _MOSTLY * sum(b - a for a, b in lasting):
        return None
    if not spans or float(np.mean(held)) < _LEAST_SHARE:
        return None
    return _Tops(limit, near, tuple(spans), held)


def _seconds(table: Table, spans: Sequence[tuple[int, int]]) -> Floats:
    """Return how long each of some stretches lasts, s, shape (k,)."""
    time = table.full["time_s"]
    return np.array([float(time[b - 1] - time[a]) for a, b in spans])


def _bend_nm(torque: Floats, span: tuple[int, int]) -> float:
    """Return by how much a parabola through the middle of a stretch rises and falls, N m.

    At its ends torque still comes to the limit, or leaves it: a limited top is bent there, too.
    """
    middle = torque[_middle(span)]
    away = np.linspace(-1.0, 1.0, middle.shape[0])
    return float(np.ptp(np.polyval(np.polyfit(away, middle, 2), away)))


def _middle(span: tuple[int, int]) -> slice:
    """Return a stretch without a fifth of it at either end; three samples at least."""
    margin = (span[1] - span[0]) // 5
    return slice(span[0] + margin, span[1] - margin)


def _noise_nm(torque: Floats) -> float:
    """Return the standard deviation from sample to sample, robust to what the torque does."""
    rough = np.diff(torque, n=3)
    rough = rough[np.isfinite(rough)]
    return float(np.median(np.abs(rough))) / (_GAUSS * math.sqrt(20.0)) if rough.size else 0.0


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


def _wanted(table: Table) -> Floats:
    """Return the velocity as commanded, rad/s, shape (N,)."""
    full = table.full
    if table.has("velocity_command_rad_s"):
        return full["velocity_command_rad_s"]
    wanted = np.empty_like(full["torque_nm"])
    for piece in table.pieces:
        wanted[piece.full] = np.gradient(full["position_command_rad"][piece.full], piece.period_s)
    return wanted


def _boxed(table: Table, values: Floats) -> Floats:
    """Return the moving average over a hundredth of a second, shape (N,)."""
    out = np.empty_like(values)
    for piece in table.pieces:
        width = min(max(1, round(_SMOOTHED_S / piece.period_s)), piece.full.stop - piece.full.start)
        out[piece.full] = np.convolve(values[piece.full], np.full(width, 1.0 / width), mode="same")
    return out


def _answer(table: Table, error: Floats, tops: _Tops) -> float:
    """Return by how much torque the drive answers a change of the velocity's error, N m s/rad.

    Away from the flat tops; where it does not answer at all, nothing can be missing: 0.
    """
    torque = _boxed(table, table.full["torque_nm"])
    apart = ~_followed(table, tops.flat)
    errors, torques = [], []
    for piece in table.pieces:
        step = max(1, round(_ANSWER_S / piece.period_s))
        at = np.arange(piece.full.start, piece.full.stop - step)
        at = at[apart[at] & apart[at + step]]
        errors.append(error[at + step] - error[at])
        torques.append(torque[at + step] - torque[at])
    moved, answered = np.concatenate(errors), np.concatenate(torques)
    good = np.isfinite(moved) & np.isfinite(answered)
    moved, answered = moved[good], answered[good]
    if not moved.size:
        return 0.0
    clear = np.abs(moved) > np.quantile(np.abs(moved), _CLEAR)
    size = float(np.abs(moved[clear]).sum())
    return max(float(np.sum(np.sign(moved[clear]) * answered[clear])) / size, 0.0) if size else 0.0


def _followed(table: Table, flat: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Return the flat tops and the time after them in which the velocity catches up, (N,)."""
    out = flat.copy()
    for piece in table.pieces:
        count = np.cumsum(flat[piece.full].astype(np.int64))
        reach = round(_AFTER_S / piece.period_s)
        before = np.concatenate((np.zeros(min(reach, count.shape[0]), np.int64), count[:-reach]))
        out[piece.full] |= count > before[: count.shape[0]]
    return out
