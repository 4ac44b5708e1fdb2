"""Where a finding lives: its curve over the axis that its physics names, and connected regions.

An effect that is local (a bump, friction at low speed) lives where its law has at least a fifth of
its greatest torque; one that works along all of its axis lives wherever that axis was driven.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Curve, Region
from agent.explain.forms.constant import SATURATES
from agent.explain.rows.pieces import Piece
from agent.explain.rows.scene import Scene
from agent.explain.rows.strata import after_a_turn
from agent.explain.rows.table import BASE
from agent.identify.result import Floats, Parameter

_BINS = 40
_FEWEST = 5
_VISIBLE = 0.2  # of a law's greatest torque: there it ends
_FINE, _BLUR = 200, 9  # narrow bins, and how many of them are seen as one
_LEAST_SHARE = 0.02
_NORMAL = 1.96
_SIMULTANEOUS = 3.0  # standard errors: about 95 % over forty bins at once
_FOLLOWS_SIGN = frozenset(
    {
        "load-dependent-friction",
        "temperature-dependent-friction",
        "position-dependent-friction",
        "friction-drift",
        "presliding-hysteresis",
    }
)
_LOCAL = frozenset({"stribeck", "presliding-hysteresis", "backlash", "local-fault"})
_AT_A_PLACE, _HANGS_FREE = "center_arm_rad", "hangs free"
_TO_BOTH_SIDES = "dent_nm"
_MOST_ENERGY, _SEEN = 0.95, 2.0  # an effect's energy; how far beyond that its curve is drawn
_RESONANCE = (0.5, 2.0)  # times its frequency
_HALF_ORDER = 0.5
_CARRIED = (
    ("arm_share", "inertia_kg_m2"),
    ("arm_friction_share", "coulomb_nm"),
    ("arm_viscous_share", "viscous_nm_s_per_rad"),
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
        return rows["since_s"]
    if variable.startswith("order_per_"):
        return np.mod(order * rows["position_rad"], 2.0 * np.pi)
    return rows[variable]


def _axis_of(effect: str, form: str) -> str:
    """Return the axis along which an effect lives, by which of its laws it has."""
    return "load_torque_nm" if form == SATURATES else AXIS[effect]


def curve_of(
    scene: Scene,
    rows: NDArray[np.int64],
    effect: str,
    form: str,
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
    effect, form : str
    added_nm, left_nm : ndarray, shape (m,)
        What the effect adds at the rows, and what the whole model leaves.
    independent : float
        Share of the rows that counts as independent.
    order : float
        For effects that repeat with an angle.
    """
    variable = _axis_of(effect, form)
    values = axis_values(scene, variable, order)[rows]
    if not np.isfinite(values).all():
        return None
    sign = np.sign(scene.table.rows["velocity_rad_s"][rows])
    if not _follows_sign(effect, added_nm, sign):
        sign = np.ones(rows.shape[0])
    if variable == "after_reversal_s":
        after = _after(scene, rows, added_nm)
        values, sign, added_nm, left_nm = (x[after] for x in (values, sign, added_nm, left_nm))
        near = values <= _SEEN * _fades_at(values, added_nm)
        values, sign, added_nm, left_nm = (x[near] for x in (values, sign, added_nm, left_nm))
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


def _fades_at(values: Floats, added_nm: Floats) -> float:
    """Return the place along an axis up to which an effect has 95 % of its energy."""
    order = np.argsort(values)
    energy = np.cumsum(added_nm[order] ** 2)
    end = int(np.searchsorted(energy, _MOST_ENERGY * float(energy[-1])))
    return float(values[order][min(end, values.shape[0] - 1)])


def _follows_sign(effect: str, added_nm: Floats, sign: Floats) -> bool:
    """Return whether an effect turns with the velocity; a local fault may rub, or push."""
    if effect == "local-fault":
        return abs(float(sign @ added_nm)) > abs(float(added_nm.sum()))
    return effect in _FOLLOWS_SIGN


def _edges(values: Floats, variable: str) -> Floats:
    if variable == "recording":
        return np.append(np.unique(values) - 0.5, float(values.max()) + 0.5)
    low, high = (float(x) for x in np.quantile(values, [0.002, 0.998]))
    if variable == "after_reversal_s":
        return np.geomspace(max(low, 1e-3), max(high, 2e-3), _BINS + 1)
    if variable == "velocity_rad_s":
        # As many samples in every bin, as a stair holds few speeds; no bin mixes both directions.
        sides = [values[values < 0.0], values[values > 0.0]]
        points = [np.quantile(x, np.linspace(0.0, 1.0, _BINS // 2 + 1)) for x in sides if x.size]
        return np.unique(np.concatenate([*points, [0.0]])) if points else np.array([low, high])
    return np.linspace(low, max(high, low + 1e-12), _BINS + 1)


def regions_of(
    scene: Scene,
    rows: NDArray[np.int64],
    effect: str,
    form: str,
    added_nm: Floats,
    parameters: Mapping[str, Parameter],
    order: float = 0.0,
) -> tuple[Region, ...]:
    """Return where an effect lives, the part with most of its energy first.

    Parameters
    ----------
    scene : Scene
    rows : ndarray of int, shape (m,)
    effect, form : str
    added_nm : ndarray, shape (m,)
        What the effect adds at the rows.
    parameters : mapping of str to Parameter
        The form's own numbers.
    order : float
        For effects that repeat with an angle.
    """
    variable = _axis_of(effect, form)
    if variable.startswith("order_per_"):
        half = min(_HALF_ORDER, 0.5 * order)
        return (Region(variable, order - half, order + half),)
    if "antiresonance_hz" in parameters:
        hz = parameters["antiresonance_hz"].value
        return (Region("frequency_hz", _RESONANCE[0] * hz, _RESONANCE[1] * hz),)
    if effect == "torque-saturation":
        return _where_visible(scene, "torque_nm", scene.table.measured_nm[rows], added_nm)
    if effect == "backlash":
        load = _behind_gear(scene, parameters)[rows]
        return _where_visible(scene, "load_torque_nm", load, added_nm)
    values = axis_values(scene, variable)[rows]
    if effect == "load-dependent-friction" and "arm_share" in parameters:
        values = _behind_gear(scene, parameters)[rows]
    if variable == "after_reversal_s":
        after = _after(scene, rows, added_nm)
        values, added_nm = values[after], added_nm[after]
    if effect in _LOCAL or _AT_A_PLACE in parameters or _HANGS_FREE in form:
        visible = _where_visible(scene, variable, values, added_nm)
        return _one_place(visible) if _TO_BOTH_SIDES in parameters else visible
    return (_whole(scene, variable, values),)


def _one_place(regions: tuple[Region, ...]) -> tuple[Region, ...]:
    """Return the sides of a dent as the one place that they are."""
    if not regions:
        return regions
    low, high = min(r.lower for r in regions), max(r.upper for r in regions)
    seconds, share = (
        math.fsum(part) for part in zip(*((r.seconds, r.share) for r in regions), strict=True)
    )
    return (Region(regions[0].variable, low, high, seconds, share),)


def _after(scene: Scene, rows: NDArray[np.int64], added_nm: Floats) -> NDArray[np.bool_]:
    """Return at which rows, shape (m,), a law is at work that follows a start or a reversal.

    What the filter puts before the turn is none of its place; where that is all, it is taken.
    """
    after = after_a_turn(scene.table.rows, scene.table.pieces)[rows]
    return after if added_nm[after].any() else np.ones(rows.shape[0], dtype=np.bool_)


def _behind_gear(scene: Scene, parameters: Mapping[str, Parameter]) -> Floats:
    """Return what the gear carries at the rows, shape (n,): the arm alone, as a form found it."""
    base, carried = scene.table.base, scene.weight_rows()
    for share, name in _CARRIED:
        if share in parameters:
            at = BASE.index(name)
            carried = carried + parameters[share].value * scene.theta[at] * base[:, at]
    if "arm_share" not in parameters and "arm_inertia_kg_m2" in parameters:
        carried = carried + parameters["arm_inertia_kg_m2"].value * base[:, 0]
    return np.asarray(carried)


def _whole(scene: Scene, variable: str, values: Floats) -> Region:
    """Return all of an axis that was driven."""
    good = values[np.isfinite(values)]
    low, high = (float(x) for x in np.quantile(good, [0.001, 0.999]))
    return Region(variable, low, high, row_seconds(scene.table.pieces) * good.shape[0], 1.0)


def _where_visible(
    scene: Scene, variable: str, values: Floats, added_nm: Floats
) -> tuple[Region, ...]:
    """Return the connected parts of an axis in which a law has a fifth of its greatest torque."""
    good = np.isfinite(values)
    values, size = values[good], np.abs(added_nm[good])
    edges = _fine_edges(scene, variable, values)
    index = np.clip(np.searchsorted(edges, values, side="right") - 1, 0, edges.shape[0] - 2)
    count = np.bincount(index, minlength=edges.shape[0] - 1)
    total = np.asarray(np.bincount(index, size, edges.shape[0] - 1), dtype=np.float64)
    if variable == "after_reversal_s":
        # Reversals differ: what a few of them show at neighbouring times is one place.
        total, spread = (np.convolve(x, np.ones(_BLUR), "same") for x in (total, count))
        mean = total / np.maximum(spread, 1.0)
    else:
        mean = total / np.maximum(count, 1)
    there = np.flatnonzero(count)
    visible = mean[there] >= _VISIBLE * float(mean.max())
    energy = np.bincount(index, size**2, edges.shape[0] - 1)
    ends = np.flatnonzero(np.diff(visible.astype(np.int8), prepend=0, append=0))
    out = []
    for begin, end in zip(ends[::2], ends[1::2], strict=True):
        inside = there[begin:end]
        low, high = float(edges[inside[0]]), float(edges[inside[-1] + 1])
        if variable == "after_reversal_s" and begin == 0:
            low = 0.0  # what lies before the first row is the filter's, not the joint's
        share = float(energy[inside].sum()) / max(float(energy.sum()), 1e-300)
        seconds = row_seconds(scene.table.pieces) * float(count[inside].sum())
        if share >= _LEAST_SHARE:
            out.append(Region(variable, low, high, seconds, share))
    return tuple(sorted(out, key=lambda region: -region.share))


def _fine_edges(scene: Scene, variable: str, values: Floats) -> Floats:
    """Return narrow bins; fine at low speeds, and at short times after a reversal."""
    low, high = float(values.min()), float(values.max())
    if variable == "after_reversal_s":
        return np.geomspace(max(low, 1e-3), max(high, 2e-3), _FINE + 1)
    if variable == "velocity_rad_s":
        slow = scene.slowest
        return np.asarray(
            slow * np.sinh(np.linspace(np.arcsinh(low / slow), np.arcsinh(high / slow), _FINE + 1))
        )
    return np.linspace(low, max(high, low + 1e-12), _FINE + 1)


def row_seconds(pieces: Sequence[Piece]) -> float:
    """Return how much time one row of a table stands for."""
    total = math.fsum((p.rows.stop - p.rows.start) * p.period_s * p.stride for p in pieces)
    count: int = sum(p.rows.stop - p.rows.start for p in pieces)
    return total / max(count, 1)
