"""What one order of ripple is: how large, how sure, which of two effects, and what it does.

Torque whose sign does not follow the velocity is ripple; torque whose sign does is friction that
varies along the position. The two directions' phases tell them apart; where only one was driven,
or no angle was recorded, that is said. What the ripple does to the motion is the stutter of the
position at the same order.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.identify.ripple.background import BACKGROUND_DOF
from agent.identify.ripple.order_spectrum import AnglePass, Grid, spectrum_of
from agent.identify.ripple.search import Found, in_phase
from agent.identify.uncertainty import student_975

RIPPLE, FRICTION, BOTH, UNDECIDED = (
    "torque-ripple",
    "position-dependent-friction",
    "torque-ripple and position-dependent-friction",
    "undecided",
)
_CHANCE = 0.01  # of passes that are alike to be taken for unlike ones
_NO_POSITION = "no position was recorded"


@dataclass(frozen=True)
class RippleLine:
    """One order that stands out.

    Parameters
    ----------
    order_per_motor_rev, order_per_arm_rev : Parameter
        Periods per turn of motor and of arm; need not be whole.
    amplitude_nm : Parameter
        Amplitude (half of peak to peak) of the part that `kind` names.
    stutter_rad : Parameter
        Amplitude of the position about its straight line at this order, root mean square over
        the passes.
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
    stutter_rad: Parameter
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
            "stutter_rad": self.stutter_rad.to_json(),
            "kind": self.kind,
            "reason": self.reason,
            "p_value": self.p_value,
            "velocity_rad_s": list(self.velocity_rad_s),
            "amplitude_of_pass_nm": list(self.amplitude_of_pass_nm),
        }


def lines_of(
    passes: Sequence[AnglePass], found: Found, grid: Grid, gear_ratio: float
) -> tuple[RippleLine, ...]:
    """Put every order's numbers together, by falling amplitude."""
    pairs = np.stack([p.without(found.orders)[1] for p in passes])
    stutters = stutter_at(passes, found.orders, grid)
    lines = [
        _line(passes, found, pairs[:, i], stutters[i], i, gear_ratio)
        for i in range(len(found.orders))
    ]
    return tuple(sorted(lines, key=lambda line: -line.amplitude_nm.value))


def torque_at(passes: Sequence[AnglePass], orders: Sequence[float], grid: Grid) -> list[Parameter]:
    """Return the torque's amplitude in N m at given orders, root mean square over the passes."""
    return _amplitudes(passes, orders, grid)


def stutter_at(passes: Sequence[AnglePass], orders: Sequence[float], grid: Grid) -> list[Parameter]:
    """Return the position's amplitude in rad at given orders, root mean square over the passes."""
    motions = [m for p in passes if (m := p.of_motion()) is not None]
    if not motions:
        return [Parameter.not_identified(_NO_POSITION) for _ in orders]
    return _amplitudes(motions, orders, grid)


def stutter_chances(
    passes: Sequence[AnglePass], orders: Sequence[float], grid: Grid
) -> list[float]:
    """Return the chance of each order's stutter from the position's noise alone; NaN without one.

    The sum over the passes of ``|c|^2 / (2 var)`` has an F distribution, as the backgrounds are
    estimates themselves.
    """
    from scipy.special import fdtrc

    motions = [m for p in passes if (m := p.of_motion()) is not None]
    if not motions:
        return [math.nan for _ in orders]
    count = float(len(motions))
    return [
        float(
            fdtrc(
                2.0 * count,
                count * BACKGROUND_DOF,
                np.mean(np.sum(pairs**2, axis=1) / (2.0 * variance)),
            )
        )
        for pairs, variance in _measured(motions, orders, grid)
    ]


def _amplitudes(
    passes: Sequence[AnglePass], orders: Sequence[float], grid: Grid
) -> list[Parameter]:
    """Return amplitudes without regard to phase, each with its own local background."""
    return [_size(pairs, variance) for pairs, variance in _measured(passes, orders, grid)]


def _measured(
    passes: Sequence[AnglePass], orders: Sequence[float], grid: Grid
) -> list[tuple[Floats, Floats]]:
    """Return every order's (cos, sin) in each pass, shape (p, 2), and their variance, (p,)."""
    rest = spectrum_of(passes, grid, orders)
    at = [int(np.argmin(np.abs(rest.order - k))) for k in orders]
    pairs = np.stack([p.without(orders)[1] for p in passes])
    return [(pairs[:, i], rest.variance[:, place]) for i, place in enumerate(at)]


def _line(
    passes: Sequence[AnglePass],
    found: Found,
    pairs: Floats,
    stutter: Parameter,
    i: int,
    gear: float,
) -> RippleLine:
    """Put one order's numbers together."""
    order = found.orders[i]
    at = int(np.argmin(np.abs(found.rest.order - order)))
    variance = found.rest.variance[:, at]
    size = np.hypot(pairs[:, 0], pairs[:, 1])
    # As for a mean below: weights that are estimates cost a little, here those of all passes.
    cost = 1.0 + 4.0 * (1.0 - 1.0 / len(passes)) / BACKGROUND_DOF
    half = student_975(BACKGROUND_DOF) * math.sqrt(cost / max(found.information[i], 1e-300))
    amplitude, kind, reason = _kind(passes, pairs, variance)
    return RippleLine(
        Parameter(order, (order - half, order + half)),
        Parameter(gear * order, (gear * (order - half), gear * (order + half))),
        amplitude,
        stutter,
        kind,
        reason,
        found.chances[i],
        tuple(p.velocity_rad_s for p in passes),
        tuple(float(s) for s in size),
    )


def _kind(
    passes: Sequence[AnglePass], pairs: Floats, variance: Floats
) -> tuple[Parameter, str, str]:
    """Return the amplitude, what it can be, and why that may be undecided."""
    absolute = [g for g in in_phase(passes) if passes[g[0]].absolute]
    if not absolute:
        reason = f"{_NO_POSITION}, so the two directions' phases cannot be compared"
        return _size(pairs, variance), UNDECIDED, reason
    means = [_mean_in_phase(pairs[list(g)], variance[list(g)]) for g in absolute]
    if len(means) == 1:
        pair, spread, dof = means[0]
        reason = (
            "one direction only: ripple and friction that varies along the position look alike; "
            "drive the same passes backwards"
        )
        return _with_interval(float(np.hypot(*pair)), spread, dof), UNDECIDED, reason
    (plus, spread_plus, dof_plus), (minus, spread_minus, dof_minus) = means
    even, odd = 0.5 * (plus + minus), 0.5 * (plus - minus)
    spread = 0.25 * (spread_plus + spread_minus)
    # Welch and Satterthwaite: the mean of two variances has the degrees of freedom of both.
    dof = (spread_plus + spread_minus) ** 2 / (
        spread_plus**2 / dof_plus + spread_minus**2 / dof_minus
    )
    limit = student_975(dof) * math.sqrt(2.0 * spread)
    size_even, size_odd = float(np.hypot(*even)), float(np.hypot(*odd))
    kind = RIPPLE if size_even >= size_odd else FRICTION
    if min(size_even, size_odd) > max(limit, 0.2 * max(size_even, size_odd)):
        kind = BOTH
    return _with_interval(max(size_even, size_odd), spread, dof), kind, ""


def _size(pairs: Floats, variance: Floats) -> Parameter:
    """Return the root mean square amplitude of passes whose phases are not compared."""
    power = pairs[:, 0] ** 2 + pairs[:, 1] ** 2 - 2.0 * variance
    count = power.size
    value = math.sqrt(max(float(power.mean()), 0.0))
    spread = float(variance.mean()) / count
    if count < 2:
        return _with_interval(value, spread, BACKGROUND_DOF)
    # Amplitudes that differ by more than their noise are spread themselves.
    scatter = float(np.var(power, ddof=1)) / count / (4.0 * max(value**2, 2.0 * spread * count))
    if _unlike(scatter / spread, count - 1.0, count * BACKGROUND_DOF):
        return _with_interval(value, scatter, count - 1.0)
    return _with_interval(value, spread, count * BACKGROUND_DOF)


def _mean_in_phase(pairs: Floats, variance: Floats) -> tuple[Floats, float, float]:
    """Return the weighted mean (cos, sin), its variance per component and degrees of freedom.

    Where passes differ by more than their backgrounds explain, their own scatter is the variance:
    ripple that is not quite the same in each.
    """
    weight = 1.0 / variance
    mean = np.asarray((weight @ pairs) / weight.sum(), dtype=np.float64)
    share = weight / weight.sum()
    # Weights that are estimates themselves cost a little: Meier, Biometrics 9 (1953) 59.
    spread = (1.0 + 4.0 * float(share @ (1.0 - share)) / BACKGROUND_DOF) / float(weight.sum())
    count = len(pairs)
    if count < 2:
        return mean, spread, BACKGROUND_DOF
    own = 2.0 * count - 2.0
    ratio = float(np.sum(weight[:, np.newaxis] * (pairs - mean) ** 2)) / own
    if _unlike(ratio, own, count * BACKGROUND_DOF):
        return mean, spread * ratio, own
    return mean, spread, count * BACKGROUND_DOF


def _unlike(ratio: float, dof: float, background_dof: float) -> bool:
    """Return whether a ratio of variances is too large for chance (F test)."""
    from scipy.special import fdtrc

    return float(fdtrc(dof, background_dof, ratio)) < _CHANCE


def _with_interval(value: float, spread: float, dof: float) -> Parameter:
    """Return the amplitude with its interval, never below zero."""
    half = student_975(dof) * math.sqrt(spread)
    return Parameter(value, (max(value - half, 0.0), value + half))
