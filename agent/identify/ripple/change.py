"""What a drive's anticogging does at each order: to its torque, and to the motion.

The reported torque is the drive's current, and what compensates cogging is current too: at low
speed a loop that is fast enough puts out the same torque with compensation and without. What
compensation takes away is the stutter of the position about its straight line. Both are measured
at the same orders and speeds, with and without, and set against each other.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from agent.identify.result import Parameter
from agent.identify.ripple.identification import passes_of, slow_passes
from agent.identify.ripple.line import stutter_at, stutter_chances, torque_at
from agent.identify.ripple.order_spectrum import AnglePass, grid_for
from agent.identify.ripple.search import search
from agent.identify.signals.arrays import Signals

_SAME_SPEED = 0.05
_NOISE = 0.05  # chance of noise alone from which a stutter cannot be told from it

_SMALL = 0.5  # of what it was: where noise hides more, nothing shows that it is gone

GONE, DOWN, SAME, UP, HIDDEN = "gone", "down", "same", "up", "hidden"


@dataclass(frozen=True)
class OrderChange:
    """One order without and with anticogging, amplitudes as root mean squares over the passes.

    Parameters
    ----------
    order_per_motor_rev : float
    torque_nm, stutter_rad : tuple of Parameter
        Without, with.
    stutter_chance : tuple of float
        Chance of such a stutter from the position's noise alone, without and with; NaN where no
        position was recorded.
    """

    order_per_motor_rev: float
    torque_nm: tuple[Parameter, Parameter]
    stutter_rad: tuple[Parameter, Parameter]
    stutter_chance: tuple[float, float]

    @property
    def motion(self) -> str:
        """Return what became of the stutter: `GONE`, `DOWN`, `SAME`, `UP` or `HIDDEN`.

        It is gone where it stood out of the position's noise, does so no more, and the noise is
        low enough to show it; `HIDDEN` where it is not. Empty where it never stood out, or no
        position was recorded.
        """
        before, after = self.stutter_chance
        left = self.stutter_left
        if not before < _NOISE or left.ci95 is None:
            return ""
        low, high = left.ci95
        if after >= _NOISE:
            return GONE if high < _SMALL else HIDDEN
        return DOWN if high < 1.0 else UP if low > 1.0 else SAME

    @property
    def torque_left(self) -> Parameter:
        """Return which share of the torque is left with anticogging."""
        return _ratio(*self.torque_nm)

    @property
    def stutter_left(self) -> Parameter:
        """Return which share of the stutter is left with anticogging."""
        return _ratio(*self.stutter_rad)

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        sides = ("without", "with")
        return {
            "order_per_motor_rev": self.order_per_motor_rev,
            "torque_nm": {s: p.to_json() for s, p in zip(sides, self.torque_nm, strict=True)},
            "torque_left": self.torque_left.to_json(),
            "stutter_rad": {s: p.to_json() for s, p in zip(sides, self.stutter_rad, strict=True)},
            "stutter_left": self.stutter_left.to_json(),
            "stutter_chance": {
                s: None if math.isnan(c) else c
                for s, c in zip(sides, self.stutter_chance, strict=True)
            },
            "motion": self.motion,
        }


@dataclass(frozen=True)
class RippleChange:
    """The comparison at one speed; `orders` by falling torque without anticogging."""

    velocity_rad_s: float
    passes: tuple[int, int]
    orders: tuple[OrderChange, ...]

    def at(self, order_per_motor_rev: float) -> OrderChange | None:
        """Return the order nearest to this one, within a tenth of an order."""
        gaps = [(abs(o.order_per_motor_rev - order_per_motor_rev), o) for o in self.orders]
        gap, nearest = min(gaps, key=lambda pair: pair[0], default=(math.inf, None))
        return nearest if gap <= 0.1 else None

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "velocity_rad_s": self.velocity_rad_s,
            "passes": {"without": self.passes[0], "with": self.passes[1]},
            "orders": [o.to_json() for o in self.orders],
        }


def compare_ripple(
    without: Sequence[Signals], compensated: Sequence[Signals], highest_order: float | None = None
) -> tuple[RippleChange, ...]:
    """Compare slow passes without and with anticogging, at every speed that both have.

    Parameters
    ----------
    without, compensated : sequence of Signals
        Of one axis.
    highest_order : float, optional
        As for `find_ripple`.

    Returns
    -------
    tuple of RippleChange
        By rising speed; empty where no speed was driven both ways, or the samples carry no order.
    """
    sides = [
        slow_passes([p for s in signals for p in passes_of(s)])
        for signals in (without, compensated)
    ]
    out = []
    for speed in _speeds(sides[0]):
        off, on = (
            [p for p in side if abs(abs(p.velocity_rad_s) / speed - 1.0) <= _SAME_SPEED]
            for side in sides
        )
        if on:
            change = _at_speed(speed, off, on, highest_order)
            out += [change] if change is not None else []
    return tuple(out)


def _speeds(passes: Sequence[AnglePass]) -> list[float]:
    """Return the speeds of the passes, those within the tolerance counted as one, rising."""
    out: list[float] = []
    for speed in sorted(abs(p.velocity_rad_s) for p in passes):
        if not out or speed > (1.0 + _SAME_SPEED) * out[-1]:
            out.append(speed)
    return out


def _at_speed(
    speed: float, off: list[AnglePass], on: list[AnglePass], highest_order: float | None
) -> RippleChange | None:
    """Measure both sides at the orders that stand out on either."""
    grid = grid_for([*off, *on], highest_order)
    if grid.highest <= 2.0 * grid.lowest:
        return None
    orders = list(search(off, grid).orders)
    orders += [k for k in search(on, grid).orders if all(abs(k - o) >= grid.apart for o in orders)]
    if not orders:
        return None
    columns = [
        measure(side, orders, grid) for measure in (torque_at, stutter_at) for side in (off, on)
    ]
    noise = [stutter_chances(side, orders, grid) for side in (off, on)]
    changes = [
        OrderChange(order, (torque_off, torque_on), (stutter_off, stutter_on), chances)
        for order, torque_off, torque_on, stutter_off, stutter_on, chances in zip(
            orders, *columns, zip(*noise, strict=True), strict=True
        )
    ]
    changes.sort(key=lambda o: -o.torque_nm[0].value)
    return RippleChange(speed, (len(off), len(on)), tuple(changes))


def _ratio(before: Parameter, after: Parameter) -> Parameter:
    """Return after over before, with the interval of a quotient of independent numbers."""
    if before.ci95 is None or after.ci95 is None:
        return Parameter.not_identified(before.reason or after.reason)
    if before.ci95[0] <= 0.0:
        return Parameter.not_identified("without anticogging it does not stand out of the noise")
    ratio = after.value / before.value
    # The upper halves: the lower ones end at zero.
    relative = (before.ci95[1] - before.value) / before.value
    own = (after.ci95[1] - after.value) / before.value
    half = math.hypot(own, ratio * relative)
    return Parameter(ratio, (max(ratio - half, 0.0), ratio + half))
