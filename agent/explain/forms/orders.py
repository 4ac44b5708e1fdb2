"""Which orders per revolution stand out in a residual: a scan over the motor's angle."""

from __future__ import annotations

import math
from typing import Literal

import numpy as np

from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

Weighting = Literal["torque", "friction", "inertia"]
_HIGHEST = 64.0  # per motor turn
_PEAKS = 5
_BINS_PER_WAVE = 4.0
_FEWEST_WAVES = 3.0  # in the range that was driven: fewer are a trend


def strong_orders(scene: Scene, weighting: Weighting) -> tuple[float, ...]:
    """Return the orders per motor turn at which the residual has most energy, strongest first.

    Parameters
    ----------
    scene : Scene
    weighting : {"torque", "friction", "inertia"}
        Whether the wave keeps its sign (ripple), follows the velocity's sign (friction), or grows
        with the square of the speed (kinematic error).
    """
    table = scene.table
    if not scene.has("position_rad"):
        return ()
    rows = table.sliding
    position = table.rows["position_rad"][rows]
    velocity = table.rows["velocity_rad_s"][rows]
    residual = scene.residual_nm[rows]
    weight = {
        "torque": np.ones_like(velocity),
        "friction": np.sign(velocity),
        "inertia": (velocity / scene.fastest) ** 2,
    }[weighting]
    turns = float(np.ptp(position)) / (2.0 * math.pi)
    highest = min(_HIGHEST, 0.5 * table.cutoff_hz * 2.0 * math.pi / scene.slowest)
    if turns <= 0.0 or highest * turns < _FEWEST_WAVES:
        return ()
    out: list[float] = []
    for _ in range(_PEAKS):
        order, power = _spectrum(position, residual * weight, weight**2, turns, highest)
        power[order * turns < _FEWEST_WAVES] = 0.0
        best = int(np.argmax(power))
        if power[best] <= 0.0:
            break
        out.append(snapped(float(order[best]), 1.0 / turns, table.gear_ratio))
        # A strong order's side lobes are higher than the peaks of weaker ones: it is taken out.
        residual = _without(residual, out[-1] * position, weight)
    return tuple(dict.fromkeys(out))


def _without(residual_nm: Floats, angle_rad: Floats, weight: Floats) -> Floats:
    """Return a residual, shape (n,), less the weighted wave at an angle that fits it best."""
    wave = np.stack((weight * np.cos(angle_rad), weight * np.sin(angle_rad)), axis=-1)
    return np.asarray(residual_nm - wave @ np.linalg.solve(wave.T @ wave, wave.T @ residual_nm))


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


def half_a_line(scene: Scene) -> tuple[float]:
    """Return half the width of an order's line over the stroke, per motor turn."""
    lower, upper = scene.span("position_rad")
    return (0.5 * 2.0 * math.pi / max(upper - lower, 1e-9),)


def snapped(order: float, resolution: float, gear_ratio: float) -> float:
    """Return the order moved to a whole number per motor or arm turn within half the resolution."""
    if abs(order - round(order)) < 0.5 * resolution and round(order) >= 1:
        return float(round(order))
    per_arm = order * gear_ratio
    if abs(per_arm - round(per_arm)) < 0.5 * resolution * gear_ratio and resolution < order:
        return round(per_arm) / gear_ratio if resolution * gear_ratio < 1.0 else order
    return order
