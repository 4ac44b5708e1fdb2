"""Which orders per motor turn stand out in a torque: a scan over the motor's angle.

What has a few waves along the stroke need not repeat: a cable that stiffens, or a bump, looks like
three to eight of them. What repeats is told for each part of the stroke from all the others.
"""

from __future__ import annotations

import math

import numpy as np
from numpy.polynomial.legendre import legvander

from agent.identify.result import Floats

_HIGHEST = 64.0  # per motor turn; in less than a turn as many waves, as an axis may be in metres
_BINS_PER_WAVE = 4.0
FEWEST_WAVES = 3.0  # in the range that was driven: fewer are a trend
MANY_WAVES = 10.0  # no trend and no bump has a line as narrow as that
_MOST_PARTS = 6  # of the stroke
_TREND = 6  # the polynomial along the stroke beside which they are told: three waves as well
_FEWEST_WHOLE, _FEW_WHOLE = 1.5, 4.5  # waves of a whole order, alone along the stroke
_MOST_WHOLE = 64
_ALONE = 0.6  # of what a straight line leaves
_TOLD = 0.75  # of what a wave explains, told from the other parts: half of its size may be off


def orders_of(
    position_rad: Floats,
    torque_nm: Floats,
    weight: Floats,
    highest: float,
    gear_ratio: float,
    count: int,
    *,
    repeating: bool = True,
) -> tuple[float, ...]:
    """Return the orders per motor turn at which a torque has most energy, strongest first.

    Parameters
    ----------
    position_rad, torque_nm : ndarray, shape (n,)
    weight : ndarray, shape (n,)
        By which a wave of that order grows along the motion.
    highest : float
        Order that the band still shows, per motor turn.
    gear_ratio : float
    count : int
        At most so many.
    repeating : bool
        Whether an order of few waves along the stroke must explain each of its parts with what the
        others tell, beside a trend: three quarters of what it explains when fitted to all of them.
    """
    turns = float(np.ptp(position_rad)) / (2.0 * math.pi)
    if turns <= 0.0:
        return ()
    highest = min(_HIGHEST / min(turns, 1.0), highest)
    if highest * turns < FEWEST_WAVES:
        return ()
    out: list[float] = []
    for _ in range(count):
        order, power = _spectrum(position_rad, torque_nm * weight, weight**2, turns, highest)
        power[order * turns < FEWEST_WAVES] = 0.0
        best = int(np.argmax(power))
        if power[best] <= 0.0:
            break
        found = snapped(_peak(order, power, best), 1.0 / turns, gear_ratio)
        if not repeating or _repeats(position_rad, torque_nm, weight, found, found * turns):
            out.append(found)
        # A strong order's side lobes are higher than the peaks of weaker ones: it is taken out.
        torque_nm = _without(torque_nm, found * position_rad, weight)
    return tuple(dict.fromkeys(out))


def order_of_few_waves(position_rad: Floats, torque_nm: Floats, highest: float) -> float | None:
    """Return the whole order of few waves along the stroke that stands alone; None for none.

    A motor's orders are whole numbers of its turn, which a cable or a bump knows nothing of; and
    neither is a sine from end to end.

    Parameters
    ----------
    position_rad, torque_nm : ndarray, shape (n,)
    highest : float
        Order that the band still shows, per motor turn.
    """
    turns = float(np.ptp(position_rad)) / (2.0 * math.pi)
    if not turns > 0.0:
        return None
    first, last = max(math.ceil(_FEWEST_WHOLE / turns), 1), min(_FEW_WHOLE / turns, highest)
    orders = range(first, math.floor(last) + 1)[:_MOST_WHOLE]
    if not orders:
        return None
    trend = np.linalg.qr(np.stack((np.ones_like(position_rad), position_rad), axis=-1))[0]
    left = torque_nm - trend @ (trend.T @ torque_nm)
    taken = []
    for order in orders:
        wave = _wave(order * position_rad, np.ones_like(position_rad))
        wave -= trend @ (trend.T @ wave)
        taken.append(float(np.sum((np.linalg.qr(wave)[0].T @ left) ** 2)))
    best = int(np.argmax(taken))
    return float(orders[best]) if taken[best] > _ALONE * float(left @ left) else None


def _repeats(
    position_rad: Floats, torque_nm: Floats, weight: Floats, order: float, waves: float
) -> bool:
    """Return whether a wave is the same all along the stroke, where it has few periods there."""
    if waves >= MANY_WAVES:
        return True
    along = (position_rad - position_rad.min()) / np.ptp(position_rad)
    parts = min(int(waves), _MOST_PARTS)
    part = np.minimum((parts * along).astype(np.int64), parts - 1)
    columns = np.column_stack((_wave(order * position_rad, weight), torque_nm))
    trend = np.linalg.qr(legvander(2.0 * along - 1.0, _TREND) * weight[:, np.newaxis])[0]
    own = columns - trend @ (trend.T @ columns)
    products = np.stack([own[part == k].T @ own[part == k] for k in range(parts)])
    whole = products.sum(axis=0)
    told = 0.0
    for each in products:
        others = whole - each
        size = np.linalg.lstsq(others[:2, :2], others[:2, 2])[0]
        told += float(2.0 * size @ each[:2, 2] - size @ each[:2, :2] @ size)
    return told > _TOLD * float(whole[2, :2] @ np.linalg.lstsq(whole[:2, :2], whole[:2, 2])[0])


def _without(residual_nm: Floats, angle_rad: Floats, weight: Floats) -> Floats:
    """Return a residual, shape (n,), less the weighted wave at an angle that fits it best."""
    wave = _wave(angle_rad, weight)
    return np.asarray(residual_nm - wave @ np.linalg.solve(wave.T @ wave, wave.T @ residual_nm))


def _wave(angle_rad: Floats, weight: Floats) -> Floats:
    return np.stack((weight * np.cos(angle_rad), weight * np.sin(angle_rad)), axis=-1)


def _spectrum(
    position_rad: Floats, moment: Floats, weight: Floats, turns: float, highest: float
) -> tuple[Floats, Floats]:
    """Return orders and the energy that a wave of each explains, by gridding onto the angle."""
    bins = math.ceil(turns * highest * _BINS_PER_WAVE) + 1
    at = (position_rad - position_rad.min()) / (2.0 * math.pi * turns) * (bins - 1)
    index = np.minimum(at.astype(np.int64), bins - 1)
    sums = np.bincount(index, moment, minlength=bins)
    length = 1 << (2 * bins - 1).bit_length()
    wave = np.abs(np.fft.rfft(sums, length)) ** 2
    order = np.arange(wave.shape[0]) * (bins - 1) / (length * turns)
    power = wave / max(0.5 * float(weight.sum()), 1e-300)
    inside = order <= highest
    return order[inside], np.asarray(power[inside])


def _peak(order: Floats, power: Floats, best: int) -> float:
    """Return where the parabola through a bin and its neighbours is highest."""
    if not 0 < best < power.shape[0] - 1:
        return float(order[best])
    before, at, after = (float(x) for x in power[best - 1 : best + 2])
    bend = before - 2.0 * at + after
    aside = 0.5 * (before - after) / bend if bend < 0.0 else 0.0
    return float(order[best]) + min(max(aside, -0.5), 0.5) * float(order[1] - order[0])


def snapped(order: float, resolution: float, gear_ratio: float) -> float:
    """Return the order moved to a whole number per motor or arm turn within half the resolution."""
    if abs(order - round(order)) < 0.5 * resolution and round(order) >= 1:
        return float(round(order))
    per_arm = order * gear_ratio
    if abs(per_arm - round(per_arm)) < 0.5 * resolution * gear_ratio and resolution < order:
        return round(per_arm) / gear_ratio if resolution * gear_ratio < 1.0 else order
    return order
