"""Torque that is periodic in the motor's position: which orders, how large, how sure.

Cogging, current offsets, gear mesh and wave generators leave ``a cos(k q) + b sin(k q)`` in the
torque of a pass at constant velocity, k periods per motor turn, whole or (behind a gear) not. The
strongest order that stands out of its local background is found, refined and taken out of the
passes, until none is left (CLEAN; Högbom, Astron. Astrophys. Suppl. 15 (1974) 417). Torque whose
sign follows the velocity is friction that varies along the position; that takes both directions
and a recorded angle to see, and where these are missing the result says so.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from agent.identify.order_spectrum import (
    BACKGROUND_DOF,
    AnglePass,
    Grid,
    Spectrum,
    grid_for,
    spectrum_of,
)
from agent.identify.preprocess import read_motion
from agent.identify.result import Floats, Parameter
from agent.identify.signals import Signals
from agent.identify.uncertainty import student_975
from agent.identify.windows import find_windows

SCHEMA = "stribeck.ripple/1"
RIPPLE, FRICTION, BOTH, UNDECIDED = (
    "torque-ripple",
    "position-dependent-friction",
    "torque-ripple and position-dependent-friction",
    "undecided",
)
_ALPHA = 0.01  # chance of one false order in the whole scan
_MASKED = 0.8  # of the distance at which two orders can be told apart
_MOST_LINES = 20
_LEAST_TURNS = 0.8
_ENOUGH_TURNS = 5.0
_LEAST_SAMPLES = 100
_SLOW = 4.0  # times the slowest pass that turns far enough
_REPELLED = 0.7  # of it, in refinement
_REFINED_BY = 0.1  # of it, in one step
_COMPARABLE = 0.5  # of the longest pass: shorter ones tell fewer orders apart
_REFINEMENTS = 3


@dataclass(frozen=True)
class RippleLine:
    """One order that stands out.

    Parameters
    ----------
    order_per_motor_rev, order_per_arm_rev : Parameter
        Periods per turn of motor and of arm; need not be whole.
    amplitude_nm : Parameter
        Amplitude (half of peak to peak) of the part that `kind` names.
    kind : str
        Which effects of the contract it can be: `RIPPLE`, `FRICTION`, `BOTH` or `UNDECIDED`.
    reason : str
        Why the kind is undecided; empty otherwise.
    p_value : float
        Chance of such a peak anywhere in the scan without any ripple.
    velocity_rad_s, amplitude_of_pass_nm : tuple of float
        Every pass's velocity and amplitude.
    """

    order_per_motor_rev: Parameter
    order_per_arm_rev: Parameter
    amplitude_nm: Parameter
    kind: str
    reason: str
    p_value: float
    velocity_rad_s: tuple[float, ...]
    amplitude_of_pass_nm: tuple[float, ...]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "order_per_motor_rev": self.order_per_motor_rev.to_json(),
            "order_per_arm_rev": self.order_per_arm_rev.to_json(),
            "amplitude_nm": self.amplitude_nm.to_json(),
            "kind": self.kind,
            "reason": self.reason,
            "p_value": self.p_value,
            "velocity_rad_s": list(self.velocity_rad_s),
            "amplitude_of_pass_nm": list(self.amplitude_of_pass_nm),
        }


@dataclass(frozen=True)
class Ripple:
    """What was found in one axis's recordings; `lines` by falling amplitude.

    `order`, `amplitude_nm` and `threshold_nm`, shape (k,), are for the picture: root mean square
    over the passes, and the amplitude from which a single order counts.
    """

    recordings: tuple[str, ...]
    decidable: bool
    reasons: tuple[str, ...]
    lines: tuple[RippleLine, ...] = ()
    order: Floats = field(default_factory=lambda: np.zeros(0))
    amplitude_nm: Floats = field(default_factory=lambda: np.zeros(0))
    threshold_nm: Floats = field(default_factory=lambda: np.zeros(0))
    passes: int = 0
    notes: tuple[str, ...] = ()

    def at(self, order_per_motor_rev: float) -> RippleLine | None:
        """Return the line whose order's interval, or a tenth of an order, holds this order."""
        for line in self.lines:
            found = line.order_per_motor_rev
            low, high = found.ci95 if found.ci95 is not None else (found.value, found.value)
            if min(low, found.value - 0.1) <= order_per_motor_rev <= max(high, found.value + 0.1):
                return line
        return None

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.ripple/1` document."""
        scanned = [float(self.order[0]), float(self.order[-1])] if self.order.size else None
        return {
            "schema": SCHEMA,
            "recordings": list(self.recordings),
            "decidable": self.decidable,
            "reasons": list(self.reasons),
            "passes": self.passes,
            "scanned_order_per_motor_rev": scanned,
            "lines": [line.to_json() for line in self.lines],
            "notes": list(self.notes),
        }


def find_ripple(recordings: Sequence[Signals], *, highest_order: float | None = None) -> Ripple:
    """Find the orders at which the torque of slow, steady passes is periodic in motor position.

    Parameters
    ----------
    recordings : sequence of Signals
        All of one axis.
    highest_order : float, optional
        Highest order per motor turn; else as far as the sampling carries.

    Raises
    ------
    ValueError
        Without recordings, with different gear ratios, or with a highest order not above zero.
    """
    _check(recordings, highest_order)
    names = tuple(s.name for s in recordings)
    passes = [p for s in recordings for p in _passes_of(s)]
    usable = [p for p in passes if p.turns >= _LEAST_TURNS and p.angle_rad.size >= _LEAST_SAMPLES]
    if not usable:
        return Ripple(names, decidable=False, reasons=(_why_not(passes),))
    enough = min(_ENOUGH_TURNS, max(p.turns for p in usable))
    slowest = min(abs(p.velocity_rad_s) for p in usable if p.turns >= enough)
    slow = [p.compact() for p in usable if abs(p.velocity_rad_s) <= _SLOW * slowest]
    longest = max(p.turns for p in slow)
    usable = [p for p in slow if p.turns >= _COMPARABLE * longest]
    grid = grid_for(usable, highest_order)
    if grid.highest <= 2.0 * grid.lowest:
        reason = (
            f"not identified: at {slowest:.3g} rad/s the samples carry orders up to "
            f"{grid.highest:.2g} only; sample faster or turn slower"
        )
        return Ripple(names, decidable=False, reasons=(reason,))
    return _search(names, usable, grid, recordings[0].gear_ratio)


def _check(recordings: Sequence[Signals], highest_order: float | None) -> None:
    if not recordings:
        raise ValueError("expected at least one recording, got none")
    if len({s.gear_ratio for s in recordings}) > 1:
        raise ValueError("expected recordings of one axis, got different gear ratios")
    if highest_order is not None and not (math.isfinite(highest_order) and highest_order > 0.0):
        raise ValueError(f"expected a highest order above 0, got {highest_order}")


def _why_not(passes: Sequence[AnglePass]) -> str:
    if not passes:
        return (
            "not identified: there is no pass at constant velocity; turn slowly and steadily "
            "through some motor turns, both ways"
        )
    turns = max(p.turns for p in passes)
    return (
        f"not identified: the longest steady pass covers {turns:.2g} motor turns; drive one at "
        "constant velocity through at least one turn, better ten, both ways"
    )


def _passes_of(signals: Signals) -> list[AnglePass]:
    """Return a recording's steady passes over motor angle, integrated where none was recorded."""
    motion = read_motion(signals)
    velocity = motion.own_velocity_rad_s()
    out = []
    for window in find_windows(motion):
        index = np.arange(window.start, window.stop)
        index = index[signals.valid[index] & np.isfinite(velocity[index])]
        if index.size < 2:
            continue
        recorded = signals.position_rad
        if recorded is not None and float(np.ptp(recorded[index])) > 0.0:
            angle = recorded[index]
        else:
            step = np.diff(signals.time_s[index])
            mean = 0.5 * (velocity[index][1:] + velocity[index][:-1])
            angle, recorded = np.concatenate(([0.0], np.cumsum(step * mean))), None
        torque = signals.torque_nm[index]
        out.append(
            AnglePass(angle, torque, window.velocity_rad_s, recorded is not None, signals.name)
        )
    return out


def _groups(passes: Sequence[AnglePass]) -> list[list[int]]:
    """Return which passes share a phase: those of one direction with a recorded angle."""
    groups: list[list[int]] = [[i] for i, p in enumerate(passes) if not p.absolute]
    for forward in (True, False):
        same = [i for i, p in enumerate(passes) if p.absolute and (p.velocity_rad_s > 0) == forward]
        if same:
            groups.append(same)
    return groups


def _tail(statistic: Floats, groups: int) -> Floats:
    """Return the chance that noise exceeds ``sum over groups of |c|^2 / (2 var)``.

    An F distribution with 2 g and g x `BACKGROUND_DOF` degrees of freedom: the background is
    itself an estimate.
    """
    from scipy.special import fdtrc

    tail = fdtrc(2.0 * groups, groups * BACKGROUND_DOF, statistic / groups)
    return np.asarray(tail, dtype=np.float64)


def _evidence(spectrum: Spectrum, groups: Sequence[Sequence[int]]) -> Floats:
    """Return the statistic of every order, passes of a group added in phase, shape (k,)."""
    total = np.zeros(spectrum.order.size)
    for group in groups:
        weight = 1.0 / spectrum.variance_nm2[list(group)]
        summed = np.sum(weight * spectrum.amplitude_nm[list(group)], axis=0)
        total += np.abs(summed) ** 2 / (2.0 * weight.sum(axis=0))
    return total


def _search(names: tuple[str, ...], passes: list[AnglePass], grid: Grid, gear: float) -> Ripple:
    """Take out order after order until none stands out."""
    groups = _groups(passes)
    orders: list[float] = []
    chances: list[float] = []
    first: Spectrum | None = None
    while True:
        rest = [p.without(orders)[0] for p in passes]
        spectrum = spectrum_of(rest, grid)
        first = spectrum if first is None else first
        statistic = _evidence(spectrum, groups)
        # Closer to an order that is out already, its own change along the pass would be found.
        for order in orders:
            statistic[np.abs(spectrum.order - order) < _MASKED * grid.apart] = 0.0
        best = int(np.argmax(statistic))
        chance = float(_tail(statistic[best : best + 1], len(groups))[0]) * grid.independent
        if chance > _ALPHA or len(orders) == _MOST_LINES:
            break
        orders.append(float(spectrum.order[best]))
        chances.append(chance)
        orders = _refined(passes, orders, grid)
    lines = [
        _line(passes, groups, spectrum, orders, i, chances[i], gear) for i in range(len(orders))
    ]
    lines.sort(key=lambda line: -line.amplitude_nm.value)
    power = np.mean(np.abs(first.amplitude_nm) ** 2, axis=0)
    level = -math.log(_ALPHA / grid.independent)
    threshold = np.sqrt(2.0 * level * np.mean(spectrum.variance_nm2, axis=0))
    return Ripple(
        names,
        decidable=True,
        reasons=(),
        lines=tuple(lines),
        order=spectrum.order,
        amplitude_nm=np.sqrt(power),
        threshold_nm=threshold,
        passes=len(passes),
        notes=_notes(passes),
    )


def _notes(passes: Sequence[AnglePass]) -> tuple[str, ...]:
    notes = []
    if not all(p.absolute for p in passes):
        notes.append(
            "no position was recorded; the angle is the integral of the velocity, so orders carry "
            "its error and the phase is unknown"
        )
    turns = min(p.turns for p in passes)
    if turns < 3.0:
        notes.append(
            f"the shortest pass covers {turns:.2g} motor turns; orders closer than {1 / turns:.2g} "
            "cannot be told apart"
        )
    return tuple(notes)


def _refined(passes: Sequence[AnglePass], orders: list[float], grid: Grid) -> list[float]:
    """Return the orders after some Gauss-Newton steps, amplitudes and phases free in each pass."""
    orders = list(orders)
    reach = _REFINED_BY * grid.apart
    for _ in range(_REFINEMENTS):
        gain, curvature = np.zeros(len(orders)), np.zeros(len(orders))
        for p in passes:
            columns = p.columns(orders)
            basis, _ = np.linalg.qr(columns)
            theta = np.linalg.lstsq(columns, p.torque_nm, rcond=None)[0]
            rest = p.torque_nm - columns @ theta
            noise = max(float(rest @ rest) / rest.size, 1e-300)
            for i in range(len(orders)):
                cos, sin = columns[:, 3 + 2 * i], columns[:, 4 + 2 * i]
                a, b = theta[3 + 2 * i], theta[4 + 2 * i]
                slope = p.angle_rad * (b * cos - a * sin)
                slope = slope - basis @ (basis.T @ slope)
                gain[i] += float(slope @ rest) / noise
                curvature[i] += float(slope @ slope) / noise
        step = gain / np.maximum(curvature, 1e-300)
        for i, change in enumerate(np.clip(step, -reach, reach)):
            moved = orders[i] + float(change)
            # Two orders must not run into each other: their amplitudes would grow without bound.
            others = [k for j, k in enumerate(orders) if j != i]
            if all(abs(moved - k) >= _REPELLED * grid.apart for k in others):
                orders[i] = moved
    return orders


def _line(
    passes: Sequence[AnglePass],
    groups: Sequence[Sequence[int]],
    spectrum: Spectrum,
    orders: Sequence[float],
    i: int,
    chance: float,
    gear: float,
) -> RippleLine:
    """Put one order's numbers together."""
    at = int(np.argmin(np.abs(spectrum.order - orders[i])))
    variance = spectrum.variance_nm2[:, at]
    pairs = np.stack([p.without(orders)[1][i] for p in passes])
    size = np.hypot(pairs[:, 0], pairs[:, 1])
    length = np.array([float(np.ptp(p.angle_rad)) for p in passes])
    information = float(np.sum(size**2 * length**2 / (12.0 * variance)))
    half = student_975(BACKGROUND_DOF) / math.sqrt(max(information, 1e-300))
    order = Parameter(orders[i], (orders[i] - half, orders[i] + half))
    amplitude, kind, reason = _amplitude(passes, groups, pairs, variance)
    return RippleLine(
        order,
        Parameter(gear * orders[i], (gear * (orders[i] - half), gear * (orders[i] + half))),
        amplitude,
        kind,
        reason,
        min(chance, 1.0),
        tuple(p.velocity_rad_s for p in passes),
        tuple(float(s) for s in size),
    )


def _amplitude(
    passes: Sequence[AnglePass],
    groups: Sequence[Sequence[int]],
    pairs: Floats,
    variance: Floats,
) -> tuple[Parameter, str, str]:
    """Return the amplitude, what it can be, and why that may be undecided."""
    absolute = [g for g in groups if passes[g[0]].absolute]
    if not absolute:
        power = pairs[:, 0] ** 2 + pairs[:, 1] ** 2 - 2.0 * variance
        scatter = float(np.var(power, ddof=1)) / power.size if power.size > 1 else 0.0
        value = math.sqrt(max(float(power.mean()), 0.0))
        mean_variance = float(variance.mean()) / power.size
        spread = max(mean_variance, scatter / (4.0 * max(value, 1e-300) ** 2))
        reason = "no position was recorded, so the two directions' phases cannot be compared"
        return _with_interval(value, spread, power.size), UNDECIDED, reason
    means = [_mean_of_group(pairs[list(g)], variance[list(g)]) for g in absolute]
    if len(means) == 1:
        (pair, spread), count = means[0], len(absolute[0])
        reason = (
            "one direction only: ripple and friction that varies along the position look alike; "
            "drive the same passes backwards"
        )
        return _with_interval(float(np.hypot(*pair)), spread, count), UNDECIDED, reason
    (plus, spread_plus), (minus, spread_minus) = means
    even, odd = 0.5 * (plus + minus), 0.5 * (plus - minus)
    spread = 0.25 * (spread_plus + spread_minus)
    limit = student_975(BACKGROUND_DOF) * math.sqrt(2.0 * spread)
    size_even, size_odd = float(np.hypot(*even)), float(np.hypot(*odd))
    kind = RIPPLE if size_even >= size_odd else FRICTION
    if min(size_even, size_odd) > max(limit, 0.2 * max(size_even, size_odd)):
        kind = BOTH
    return _with_interval(max(size_even, size_odd), spread, len(passes)), kind, ""


def _mean_of_group(pairs: Floats, variance: Floats) -> tuple[Floats, float]:
    """Return the weighted mean (cos, sin) of passes in phase, and its variance per component.

    Scatter between the passes counts where it is the larger: ripple that is not quite the same.
    """
    weight = 1.0 / variance
    mean = (weight @ pairs) / weight.sum()
    spread = 1.0 / float(weight.sum())
    if len(pairs) > 1:
        chi2 = float(np.sum(weight[:, np.newaxis] * (pairs - mean) ** 2)) / (2.0 * len(pairs) - 2.0)
        spread *= max(1.0, chi2)
    return np.asarray(mean, dtype=np.float64), spread


def _with_interval(value: float, spread: float, passes: int) -> Parameter:
    """Return the amplitude with its interval, never below zero."""
    half = student_975(BACKGROUND_DOF if passes < 2 else 2.0 * passes) * math.sqrt(spread)
    return Parameter(value, (max(value - half, 0.0), value + half))
