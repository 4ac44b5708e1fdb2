"""Where a finding lives: its curve over the axis that its physics names, and connected regions."""

from __future__ import annotations

import math
from collections.abc import Mapping
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from agent.explain.result import Curve, Region
from agent.explain.scene import Scene
from agent.identify.result import Floats

_BINS = 40
_FEWEST = 5
_OF_FLOOR = 0.2
_NORMAL = 1.96
_SIMULTANEOUS = 3.0  # standard errors: about 95 % over forty bins at once
_FOLLOWS_SIGN = frozenset(
    {
        "load-dependent-friction",
        "temperature-dependent-friction",
        "position-dependent-friction",
        "friction-drift",
    }
)

AXIS: Mapping[str, str] = MappingProxyType(
    {
        "stribeck": "velocity_rad_s",
        "viscous-nonlinear": "velocity_rad_s",
        "direction-asymmetry": "velocity_rad_s",
        "torque-offset": "velocity_rad_s",
        "wrong-number": "velocity_rad_s",
        "load-dependent-friction": "load_torque_nm",
        "temperature-dependent-friction": "gearbox_temperature_degc",
        "torque-constant-error": "motor_temperature_degc",
        "position-dependent-friction": "arm_position_rad",
        "cable-force": "arm_position_rad",
        "local-fault": "arm_position_rad",
        "gravity-imbalance": "arm_position_rad",
        "friction-drift": "recording",
        "presliding-hysteresis": "after_reversal_s",
        "backlash": "after_reversal_s",
        "joint-flexibility": "after_reversal_s",
        "measurement-delay": "acceleration_rad_s2",
        "torque-saturation": "acceleration_rad_s2",
        "inertia-error": "acceleration_rad_s2",
        "torque-ripple": "order_per_motor_rev",
        "kinematic-error": "order_per_motor_rev",
        "resolver-error": "order_per_motor_rev",
    }
)
"""The axis on which each effect is drawn and located."""


def axis_values(scene: Scene, variable: str, order: float = 0.0) -> Floats:
    """Return an axis of contract section 6 at the rows, shape (n,); phase in rad for an order."""
    rows, table = scene.table.rows, scene.table
    if variable == "arm_position_rad":
        return scene.arm_rows()
    if variable == "load_torque_nm":
        return scene.load_rows()
    if variable == "recording":
        return table.run.astype(np.float64)
    if variable == "after_reversal_s":
        speed = np.maximum(np.abs(rows["velocity_rad_s"]), 1e-9)
        # Half of the speed is the mean over a ramp: good enough to draw against.
        return 2.0 * rows["travel_rad"] / speed
    if variable.startswith("order_per_"):
        return np.mod(order * rows["position_rad"], 2.0 * np.pi)
    return rows[variable]


def curve_of(
    scene: Scene,
    rows: NDArray[np.int64],
    effect: str,
    added_nm: Floats,
    left_nm: Floats,
    *,
    independent: float,
    order: float = 0.0,
) -> Curve | None:
    """Return an effect over its axis.

    Parameters
    ----------
    scene : Scene
    rows : ndarray of int, shape (m,)
        The table's rows that are used.
    effect : str
    added_nm, left_nm : ndarray, shape (m,)
        What the effect adds at the rows, and what the whole model leaves.
    independent : float
        Share of the rows that counts as independent.
    order : float
        For effects that repeat with an angle.
    """
    variable = AXIS[effect]
    values = axis_values(scene, variable, order)[rows]
    if not np.isfinite(values).all():
        return None
    sign = np.ones(rows.shape[0])
    if effect in _FOLLOWS_SIGN:
        sign = np.sign(scene.table.rows["velocity_rad_s"][rows])
    edges = _edges(values, variable)
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.shape[0] - 2)
    count = np.bincount(index, minlength=edges.shape[0] - 1).astype(np.float64)
    kept = count >= _FEWEST
    if np.count_nonzero(kept) < 2:
        return None

    def mean(x: Floats) -> Floats:
        return np.asarray(
            (np.bincount(index, x, minlength=count.shape[0]) / np.maximum(count, 1.0))[kept]
        )

    at, line = mean(values), mean(sign * added_nm)
    data = line + mean(sign * left_nm)
    square = mean(left_nm**2)
    error = np.sqrt(square / np.maximum(count[kept] * independent, 1.0))
    return Curve(
        variable=variable,
        at=at,
        line_nm=line,
        lower_nm=line - _SIMULTANEOUS * error,
        upper_nm=line + _SIMULTANEOUS * error,
        bin_at=at,
        bin_nm=data,
        bin_ci_nm=_NORMAL * error,
    )


def _edges(values: Floats, variable: str) -> Floats:
    if variable == "recording":
        return np.append(np.unique(values) - 0.5, float(values.max()) + 0.5)
    low, high = (float(x) for x in np.quantile(values, [0.002, 0.998]))
    if variable == "after_reversal_s":
        return np.geomspace(max(low, 1e-3), max(high, 2e-3), _BINS + 1)
    if variable == "velocity_rad_s":
        # As many samples in every bin: a stair holds few speeds, and most of them slow.
        return np.unique(np.quantile(values, np.linspace(0.0, 1.0, _BINS + 1)))
    return np.linspace(low, max(high, low + 1e-12), _BINS + 1)


def regions_of(
    scene: Scene, rows: NDArray[np.int64], curve: Curve, floor_nm: float, order: float = 0.0
) -> tuple[Region, ...]:
    """Return connected sets of an axis where the band excludes zero by a fifth of the floor.

    Parameters
    ----------
    scene : Scene
    rows : ndarray of int, shape (m,)
    curve : Curve
    floor_nm : float
    order : float
        For effects that repeat with an angle: the region is the order's line.
    """
    if curve.variable.startswith("order_per_"):
        position = scene.table.rows["position_rad"][rows]
        half = np.pi / max(float(np.ptp(position)), 1e-9)
        return (Region(curve.variable, order - half, order + half),)
    limit = _OF_FLOOR * floor_nm
    if curve.variable == "recording":
        return (Region("recording", float(curve.at.min()), float(curve.at.max())),)
    outside = (curve.lower_nm > limit) | (curve.upper_nm < -limit)
    if not outside.any():
        return ()
    values = axis_values(scene, curve.variable)[rows]
    seconds = _row_seconds(scene)
    energy = float(np.sum(curve.line_nm**2))
    edges = np.flatnonzero(np.diff(outside.astype(np.int8), prepend=0, append=0))
    out = []
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        low, high = float(curve.at[begin]), float(curve.at[end - 1])
        inside = (values >= low) & (values <= high)
        share = float(np.sum(curve.line_nm[begin:end] ** 2)) / energy if energy else 0.0
        out.append(Region(curve.variable, low, high, seconds * float(inside.sum()), share))
    joined = _across_zero(out, curve)
    return tuple(sorted(joined, key=lambda region: -region.share))


def _across_zero(regions: list[Region], curve: Curve) -> list[Region]:
    """Join a region below zero speed with the one above, where no bin lies between them."""
    if curve.variable != "velocity_rad_s":
        return regions
    below = [r for r in regions if r.upper < 0.0]
    above = [r for r in regions if r.lower > 0.0]
    if not below or not above:
        return regions
    left, right = max(below, key=lambda r: r.upper), min(above, key=lambda r: r.lower)
    if np.any((curve.at > left.upper) & (curve.at < right.lower)):
        return regions
    both = Region(
        curve.variable,
        left.lower,
        right.upper,
        left.seconds + right.seconds,
        left.share + right.share,
    )
    return [both, *(r for r in regions if r not in (left, right))]


def _row_seconds(scene: Scene) -> float:
    """Return how much time one row stands for."""
    pieces = scene.table.pieces
    total = math.fsum((p.rows.stop - p.rows.start) * p.period_s * p.stride for p in pieces)
    count: int = sum(p.rows.stop - p.rows.start for p in pieces)
    return total / max(count, 1)
