"""Stamps put right: when rows were sampled, by how far the joint got between them.

A log written by a computer that is no real-time one has rows that were sampled at one instant and
stamped at another, a millisecond or two later or earlier, or counted off with a period that was
not kept. The acceleration is then off by as large a part of itself as the step between two stamps
is, at every corner, and no law carries that.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.identify.signals.sampling import find_stretches, through_neighbours
from agent.numbers import significant

_SLOW = 0.05  # of the greatest speed: below it a step of the encoder is a long time
_LEAST = 0.02  # of a period: less is lost in what a drive's own filter does to its velocity
_FARTHEST = 0.45  # of a period: rows keep their order, and a row told twice is no matter of stamps
_GAP = 1.5  # periods: with more between two stamps, rows are missing
_FEWEST = 200
_SIGMAS = 5.0
_MANY = 25  # rows: a lag lasts for them, an error of a stamp does not
_WEIGHED = 4  # times: the line says how products scatter, and that how they weigh
_LEAST_SCATTER = 1e-3  # of the greatest


def put_right(runs: Sequence[Run]) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Return the runs with their stamps put right, and what is to be said of it; else nothing.

    Parameters
    ----------
    runs : sequence of Run
        As recorded.
    """
    errors = [stamp_errors_s(run) for run in runs]
    sizes_s = [float(np.sqrt(np.mean(own**2))) for own in errors if own is not None]
    if not sizes_s:
        return tuple(runs), ()
    right = tuple(
        run if own is None else _sampled_at(run, run.signals.time_s - own)
        for run, own in zip(runs, errors, strict=True)
    )
    which = "" if len(sizes_s) == len(runs) else f" of {len(sizes_s)} of {len(runs)} recordings"
    return right, (
        f"the stamps{which} are off by {significant(1e3 * max(sizes_s), 2)} ms rms, as how far the "
        "joint got from row to row shows: they were put right",
    )


def stamp_errors_s(run: Run) -> Floats | None:
    """Return by how much each stamp is late, in seconds, shape (n,); None where it does not show.

    From row to row the position moves on by the velocity times the time between. What that lacks is
    ``-v (e_k+1 - e_k)`` of two stamps' errors e, beside noise of the position, which does not grow
    with the speed, and what a late or filtered velocity makes of an acceleration. That lasts for
    many rows: the errors' size s is therefore taken from the product of neighbours, which is
    ``-v v s^2`` for stamps that err by themselves. With it the most probable errors follow, all in
    one (Rauch, Tung, Striebel, AIAA Journal 3 (1965) 1445).

    Without a drive's own velocity even time is tried alone: see `identify.signals.sampling`.

    Parameters
    ----------
    run : Run
        With a position.
    """
    signals = run.signals
    position, velocity = signals.position_rad, signals.velocity_rad_s
    if position is None or not signals.valid.all():
        return None
    if velocity is None:
        return _off_even_time_s(run)
    step_s = np.diff(signals.time_s)
    period_s = float(np.median(step_s))
    between = 0.5 * (velocity[1:] + velocity[:-1])
    fast = np.abs(between) > _SLOW * float(np.quantile(np.abs(velocity), 0.99))
    # The velocity's own bend between two rows is known from the rows beside them.
    bend = np.zeros_like(between)
    bend[1:-1] = (velocity[3:] - velocity[2:-1] - velocity[1:-2] + velocity[:-3]) / 24.0
    lacks = np.diff(position) - (between - bend) * step_s
    fast &= step_s < _GAP * period_s  # where rows are missing, the way between them is not known
    fast &= np.abs(lacks) < 2.0 * np.abs(between) * period_s  # a count that ran over
    lacks -= _lag(np.where(fast, np.diff(velocity), 0.0), np.where(fast, lacks, 0.0))
    pair = fast[1:] & fast[:-1]
    if int(pair.sum()) < _FEWEST:
        return None
    speeds, products = between[1:] * between[:-1], -lacks[1:] * lacks[:-1]
    square_s2, noise_rad2, spread_s2 = _line(speeds[pair], products[pair])
    least_s = _LEAST * period_s
    if square_s2 < _SIGMAS * spread_s2 or square_s2 < least_s**2:
        return None
    error_s = _most_probable(between, lacks, fast, square_s2, noise_rad2)
    error_s = np.clip(error_s, -_FARTHEST * period_s, _FARTHEST * period_s)
    return error_s if np.all(np.diff(signals.time_s - error_s) > 0.0) else None


def _off_even_time_s(run: Run) -> Floats | None:
    """Return by how much stamps are late where the motion is smooth in even time alone, (n,)."""
    stretches = find_stretches(run.signals).stretches
    if len(stretches) != 1 or stretches[0].resampled or not stretches[0].uneven:
        return None
    return run.signals.time_s - stretches[0].time_s


def _lag(changes: Floats, lacks: Floats) -> Floats:
    """Return what a velocity lacks for being late as a whole, shape (n,).

    By sums over many rows: a stamp's own error is in the change and in what it lacks, with the same
    sign, and of a sum only the first one's and the last one's are left.
    """
    over = np.ones(min(_MANY, changes.shape[0]))
    changed, lacking = (np.convolve(each, over, "same") for each in (changes, lacks))
    energy = float(changed @ changed)
    return changes * (float(changed @ lacking) / energy if energy > 0.0 else 0.0)


def _sampled_at(run: Run, time_s: Floats) -> Run:
    """Return a run that was sampled at other times, shape (n,), brought onto an even grid.

    Where rows are missing it keeps these times: what is no even grid is cut and brought onto one
    later. Small differences from an even grid are not, for stamps are rarely that good.
    """
    signals, count = run.signals, time_s.shape[0]
    even_s = np.linspace(time_s[0], time_s[-1], count)
    if float(np.diff(signals.time_s).max()) > _GAP * float(even_s[1] - even_s[0]):
        return replace(run, signals=replace(signals, time_s=time_s))

    def moved(values: Floats | None) -> Floats | None:
        return None if values is None else through_neighbours(even_s, time_s, values)

    even = replace(
        signals,
        time_s=even_s,
        torque_nm=through_neighbours(even_s, time_s, signals.torque_nm),
        position_rad=moved(signals.position_rad),
        velocity_rad_s=moved(signals.velocity_rad_s),
        gearbox_temperature_degc=moved(signals.gearbox_temperature_degc),
        velocity_command_rad_s=moved(signals.velocity_command_rad_s),
        position_command_rad=moved(signals.position_command_rad),
        position_arm_rad=moved(signals.position_arm_rad),
    )
    columns = {
        name: through_neighbours(even_s, time_s, values) for name, values in run.columns.items()
    }
    return replace(run, signals=even, columns=columns)


def _line(speeds: Floats, products: Floats) -> tuple[float, float, float]:
    """Return slope, intercept and the slope's standard error of a line through products.

    A product scatters by as much as it usually is, most where the joint is fast. Rows weigh by
    that: alike, what is left of the fast rows' scatter would be told as noise at rest. What a
    filtered velocity lacks in corners weighs most where it is slow, and looks like that, too: the
    intercept is the least of any weighing, and none below zero.
    """
    columns = np.stack((speeds, np.ones_like(speeds)), axis=-1)
    weight = np.ones_like(speeds)
    slope, spread, least_noise = 0.0, 0.0, float("inf")
    for _ in range(_WEIGHED):
        gram = np.linalg.inv(columns.T @ (weight[:, np.newaxis] * columns))
        slope, intercept = gram @ (columns.T @ (weight * products))
        left = weight * (products - columns @ np.array([slope, intercept]))
        spread = float(np.sqrt((gram @ (columns.T * left**2) @ columns @ gram)[0, 0]))
        least_noise = min(least_noise, max(float(intercept), 0.0))
        usual = max(slope, 0.0) * np.abs(speeds) + abs(intercept)
        least = _LEAST_SCATTER * float(usual.max())
        if not least > 0.0:
            break
        weight = (least / np.maximum(usual, least)) ** 2
    return float(slope), least_noise, spread


def _most_probable(
    speed: Floats, lacks: Floats, fast: NDArray[np.bool_], square_s2: float, noise_rad2: float
) -> Floats:
    """Return the most probable errors of the stamps, in seconds, shape (n,)."""
    from scipy.linalg import solveh_banded

    weight = np.where(fast, speed**2, 0.0)
    scale = 1.0 / max(2.0 * noise_rad2, 1e-4 * square_s2 * float(np.median(weight[fast])))
    weight = weight * scale
    pull = np.where(fast, speed * lacks, 0.0) * scale
    bands = np.zeros((2, lacks.shape[0] + 1))
    bands[1] = 1.0 / square_s2
    bands[1, :-1] += weight
    bands[1, 1:] += weight
    bands[0, 1:] = -weight
    right = np.zeros(lacks.shape[0] + 1)
    right[:-1] += pull
    right[1:] -= pull
    return np.asarray(solveh_banded(bands, right))
