"""Torque that is periodic in the motor's position: which orders, how large, how sure.

Cogging, current offsets, gear mesh and wave generators leave ``a cos(k q) + b sin(k q)`` in the
torque of a pass at constant velocity, k periods per motor turn, whole or (behind a gear) not. The
orders are found by `ripple_search`; what each of them is, says `ripple_line`.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from agent.identify.diagnosis import no_joint_records
from agent.identify.result import Floats
from agent.identify.ripple.line import RippleLine, lines_of
from agent.identify.ripple.order_spectrum import AnglePass, Grid, grid_for
from agent.identify.ripple.search import search, with_settled_heads
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.windows import SteadyWindow, find_windows

SCHEMA = "stribeck.ripple/1"
_LEAST_TURNS = 0.8
_ENOUGH_TURNS = 5.0
_LEAST_SAMPLES = 100
_SLOW = 4.0  # times the slowest pass that turns far enough
_COMPARABLE = 0.5  # of the longest pass: shorter ones tell fewer orders apart


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
    impossible = no_joint_records(recordings)
    if impossible:
        return Ripple(names, decidable=False, reasons=(f"not identified: {impossible}",))
    passes = [p for s in recordings for p in passes_of(s)]
    slow = slow_passes(passes)
    if not slow:
        return Ripple(names, decidable=False, reasons=(_why_not(passes),))
    grid = grid_for(slow, highest_order)
    if grid.highest <= 2.0 * grid.lowest:
        slowest = min(abs(p.velocity_rad_s) for p in slow)
        reason = (
            f"not identified: at {slowest:.3g} rad/s the samples carry orders up to "
            f"{grid.highest:.2g} only; sample faster or turn slower"
        )
        return Ripple(names, decidable=False, reasons=(reason,))
    return _described(names, slow, grid, recordings[0].gear_ratio)


def _described(names: tuple[str, ...], passes: list[AnglePass], grid: Grid, gear: float) -> Ripple:
    """Find the orders and say what they are."""
    passes, found = with_settled_heads(search(passes, grid), passes, grid)
    power = np.mean(np.abs(found.first.amplitude) ** 2, axis=0)
    return Ripple(
        names,
        decidable=True,
        reasons=(),
        lines=lines_of(passes, found, grid, gear),
        order=found.rest.order,
        amplitude_nm=np.sqrt(power),
        threshold_nm=found.level(grid.independent),
        passes=len(passes),
        notes=_notes(passes),
    )


def slow_passes(passes: Sequence[AnglePass]) -> list[AnglePass]:
    """Return the slow passes that turn far enough to tell orders apart; none if none does."""
    usable = [p for p in passes if p.turns >= _LEAST_TURNS and p.angle_rad.size >= _LEAST_SAMPLES]
    if not usable:
        return []
    enough = min(_ENOUGH_TURNS, max(p.turns for p in usable))
    slowest = min(abs(p.velocity_rad_s) for p in usable if p.turns >= enough)
    slow = [p.compact() for p in usable if abs(p.velocity_rad_s) <= _SLOW * slowest]
    longest = max(p.turns for p in slow)
    return [p for p in slow if p.turns >= _COMPARABLE * longest]


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


def passes_of(signals: Signals) -> list[AnglePass]:
    """Return a recording's steady passes over motor angle, integrated where none was recorded."""
    motion = read_motion(signals)
    velocity = motion.own_velocity_rad_s()
    out = []
    heads = {w.stop: w for w in find_windows(motion, with_heads=True)}
    for window in find_windows(motion):
        own = _pass(signals, velocity, window)
        longer = heads.get(window.stop, window)
        if own is not None and longer.start < window.start:
            own = replace(own, whole=_pass(signals, velocity, longer))
        out += [own] if own is not None else []
    return out


def _pass(signals: Signals, velocity: Floats, window: SteadyWindow) -> AnglePass | None:
    """Return one window's samples over motor angle; None where there are none."""
    index = np.arange(window.start, window.stop)
    index = index[signals.valid[index] & np.isfinite(velocity[index])]
    if index.size < 2:
        return None
    recorded = signals.position_rad
    stutter = None
    if recorded is not None and float(np.ptp(recorded[index])) > 0.0:
        angle = recorded[index]
        line = np.polynomial.Polynomial.fit(signals.time_s[index], angle, 1)
        stutter = np.asarray(angle - line(signals.time_s[index]), dtype=np.float64)
    else:
        step = np.diff(signals.time_s[index])
        mean = 0.5 * (velocity[index][1:] + velocity[index][:-1])
        angle, recorded = np.concatenate(([0.0], np.cumsum(step * mean))), None
    torque = signals.torque_nm[index]
    absolute = recorded is not None
    return AnglePass(angle, torque, window.velocity_rad_s, absolute, signals.name, stutter)


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
            "cannot be told apart and shift each other by more than the intervals say"
        )
    return tuple(notes)
