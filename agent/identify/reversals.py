"""What the joint does where it turns round: presliding laws, and the gear's clearance.

Around a reversal friction is a spring that yields: Dahl, Bliman-Sorine and LuGre differ in how.
Their hidden state is simulated on the measured motion of each reversal; all that is linear
(levels, damping, viscous slope, inertia, offset) is projected out, so that one to three space
constants and shares are searched. Intervals leave out one reversal after another. The clearance
comes from the arm's encoder where there is one; motor-side signals alone cannot tell it from
presliding.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.identify.preprocess import read_motion
from agent.identify.result import Floats, Parameter
from agent.identify.signals import Signals
from agent.identify.uncertainty import student_975
from agent.physics.friction_dynamic import Dahl, LuGre

LAWS = ("dahl", "bliman-sorine", "lugre")
_LEAST_REVERSALS = 4
_LEAST_SAMPLES = 20
_MOST_SAMPLES = 1500  # of one reversal, half before and half after
_MOVING = 5e-3  # of the fastest speed: below, the joint is called standing
_LOOSE = math.log(3.0)
_RESOLVED = 3.0  # samples within the space constant


@dataclass(frozen=True)
class Reversal:
    """One reversal: samples `start` to `stop` of its recording, turning round at `at`."""

    recording: int
    start: int
    at: int
    stop: int
    forward_before: bool


@dataclass(frozen=True)
class PreslidingFit:
    """One presliding law fitted to all reversals; `heldout_rmse_nm` leaves out one at a time."""

    law: str
    parameters: dict[str, Parameter]
    rmse_nm: float
    heldout_rmse_nm: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "law": self.law,
            "parameters": {name: p.to_json() for name, p in self.parameters.items()},
            "rmse_nm": self.rmse_nm,
            "heldout_rmse_nm": self.heldout_rmse_nm,
        }


@dataclass(frozen=True)
class ReversalFit:
    """What the reversals carry; `backlash_rad` is motor side, peak to peak."""

    reversals: int
    reason: str
    presliding: tuple[PreslidingFit, ...]
    backlash_rad: Parameter

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "reversals": self.reversals,
            "reason": self.reason,
            "presliding": [fit.to_json() for fit in self.presliding],
            "backlash_rad": self.backlash_rad.to_json(),
        }


@dataclass(frozen=True)
class _Segment:
    time_s: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats
    torque_nm: Floats


def find_reversals(signals: Signals, recording: int = 0) -> tuple[Reversal, ...]:
    """Return where the velocity changes sign, each with the motion around it."""
    velocity = read_motion(signals).own_velocity_rad_s()
    known = np.flatnonzero(np.isfinite(velocity) & signals.valid)
    if known.size < _LEAST_SAMPLES:
        return ()
    fastest = float(np.quantile(np.abs(velocity[known]), 0.98))
    moving = known[np.abs(velocity[known]) > _MOVING * fastest]
    sign = np.sign(velocity[moving])
    turns = np.flatnonzero(sign[1:] != sign[:-1])
    ends = np.concatenate(([known[0]], moving[turns], [known[-1]]))
    out = []
    for i, turn in enumerate(turns, start=1):
        before = (int(ends[i - 1]) + int(ends[i])) // 2 if i > 1 else int(ends[0])
        after = (int(ends[i]) + int(ends[i + 1])) // 2 if i < turns.size else int(ends[-1])
        at = (int(moving[turn]) + int(moving[turn + 1])) // 2
        start, stop = max(before, at - _MOST_SAMPLES // 2), min(after, at + _MOST_SAMPLES // 2)
        if min(at - start, stop - at) >= _LEAST_SAMPLES // 2:
            out.append(Reversal(recording, start, at, stop, bool(sign[turn] > 0)))
    return tuple(out)


def identify_reversals(
    recordings: Sequence[Signals], position_arm_rad: Sequence[Floats | None] | None = None
) -> ReversalFit:
    """Identify presliding and clearance from the reversals of one axis's recordings.

    Parameters
    ----------
    recordings : sequence of Signals
    position_arm_rad : sequence of ndarray or None, optional
        The output-side encoder on the recordings' own samples.
    """
    arms = position_arm_rad if position_arm_rad is not None else [None] * len(recordings)
    found = [r for i, s in enumerate(recordings) for r in find_reversals(s, i)]
    gap = _backlash(recordings, arms, found)
    if len(found) < _LEAST_REVERSALS:
        reason = (
            f"not identified: {len(found)} reversals; record at least {_LEAST_REVERSALS}, slow "
            "enough that several samples fall into the first 0.01 rad"
        )
        return ReversalFit(len(found), reason, (), gap)
    segments = [_segment(recordings[r.recording], r) for r in found]
    fits = tuple(_fit(law, segments) for law in LAWS)
    return ReversalFit(len(found), "", fits, gap)


def _segment(signals: Signals, reversal: Reversal) -> _Segment:
    velocity = read_motion(signals).own_velocity_rad_s()
    index = np.arange(reversal.start, reversal.stop)
    index = index[signals.valid[index] & np.isfinite(velocity[index])]
    time_s, v = signals.time_s[index], velocity[index]
    return _Segment(time_s, v, np.gradient(v, time_s), signals.torque_nm[index])


def _columns(law: str, log_shape: Floats, s: _Segment) -> Floats:
    """Return the law's columns and those of viscous slope, inertia and offset, shape (n, m)."""
    shape = np.exp(log_shape)
    time_s, v = s.time_s, s.velocity_rad_s
    start = float(np.sign(v[: _LEAST_SAMPLES // 2].mean()))
    if law == "dahl":
        states = [Dahl(1.0, 1.0 / float(shape[0])).torque_nm(time_s, v, start)]
    elif law == "bliman-sorine":
        slow = float(shape[0])
        fast = slow * float(shape[1] / (1.0 + shape[1]))
        states = [Dahl(1.0, 1.0 / e).torque_nm(time_s, v, start) for e in (fast, slow)]
    else:
        bristles = LuGre(1.0, 0.0, float(shape[1]), float(shape[2]), 1.0 / float(shape[0]))
        plain = bristles.torque_nm(time_s, v, start)
        with_damping = LuGre(
            1.0, 0.0, float(shape[1]), float(shape[2]), 1.0 / float(shape[0]), 1.0
        ).torque_nm(time_s, v, start)
        states = [plain, with_damping - plain]
    return np.stack([*states, v, s.acceleration_rad_s2, np.ones_like(v)], axis=-1)


def _starts(law: str, segments: Sequence[_Segment]) -> tuple[Floats, Floats]:
    """Return lower and upper bounds of the logarithms of the law's shape."""
    step = float(
        np.median([np.median(np.abs(s.velocity_rad_s[1:]) * np.diff(s.time_s)) for s in segments])
    )
    travel = float(
        np.median([np.sum(np.abs(s.velocity_rad_s[1:]) * np.diff(s.time_s)) for s in segments])
    )
    fastest = max(float(np.abs(s.velocity_rad_s).max()) for s in segments)
    lower, upper = [1e-2 * step], [travel]
    if law == "bliman-sorine":
        lower, upper = [*lower, 0.05], [*upper, 9.0]
    if law == "lugre":
        lower, upper = [*lower, 1e-3, 2e-3 * fastest], [*upper, 5.0, fastest]
    return np.log(lower), np.log(upper)


def _minimise(
    law: str, segments: Sequence[_Segment], start: Floats, bounds: tuple[Floats, Floats]
) -> tuple[Floats, Floats, float]:
    """Return the shape's logarithms, the linear weights and the sum of squares."""
    from scipy.optimize import least_squares

    target = np.concatenate([s.torque_nm for s in segments])

    def solve(x: Floats) -> tuple[Floats, Floats]:
        columns = np.concatenate([_columns(law, x, s) for s in segments])
        theta = np.linalg.lstsq(columns, target, rcond=None)[0]
        return np.asarray(theta), np.asarray(columns @ theta - target)

    def residuals(x: Floats) -> Floats:
        return solve(x)[1]

    inside = np.clip(start, bounds[0] + 1e-6, bounds[1] - 1e-6)
    found = least_squares(residuals, inside, bounds=bounds, max_nfev=40)
    x = np.asarray(found.x, dtype=np.float64)
    theta, rest = solve(x)
    return x, theta, float(rest @ rest)


def _fit(law: str, segments: Sequence[_Segment]) -> PreslidingFit:
    bounds = _starts(law, segments)
    tries = [
        _minimise(law, segments, bounds[0] + share * (bounds[1] - bounds[0]), bounds)
        for share in (0.35, 0.5, 0.65)
    ]
    x, theta, squares = min(tries, key=lambda t: t[2])
    count = len(segments)
    values = np.concatenate((x, theta))
    without, heldout = [], []
    for i, unseen in enumerate(segments):
        others = [s for j, s in enumerate(segments) if j != i]
        x_i, theta_i, _ = _minimise(law, others, x, bounds)
        without.append(np.concatenate((x_i, theta_i)))
        miss = _columns(law, x_i, unseen) @ theta_i - unseen.torque_nm
        heldout.append(float(np.mean(miss**2)))
    spread = np.stack(without) - np.mean(without, axis=0)
    deviation = np.sqrt((count - 1.0) / count * np.sum(spread**2, axis=0))
    half = student_975(count - 1.0) * deviation
    parameters = _named(law, values, half, x.size, _at_bound(x, bounds), segments)
    samples = sum(s.torque_nm.size for s in segments)
    return PreslidingFit(
        law, parameters, math.sqrt(squares / samples), math.sqrt(float(np.mean(heldout)))
    )


def _at_bound(x: Floats, bounds: tuple[Floats, Floats]) -> list[bool]:
    return [
        bool(v - low < 1e-3 or high - v < 1e-3) for v, low, high in zip(x, *bounds, strict=True)
    ]


def _named(
    law: str,
    values: Floats,
    half: Floats,
    shapes: int,
    at_bound: Sequence[bool],
    segments: Sequence[_Segment],
) -> dict[str, Parameter]:
    """Return the parameters under their names, those that are not carried with the reason."""
    shape_names = {
        "dahl": ("space_constant_rad",),
        "bliman-sorine": ("space_constant_rad", "fast_over_rest"),
        "lugre": ("space_constant_rad", "static_extra_share", "stribeck_velocity_rad_s"),
    }[law]
    level_names = {
        "dahl": ("coulomb_nm",),
        "bliman-sorine": ("fast_nm", "slow_nm"),
        "lugre": ("coulomb_nm", "damping_nm_s_per_rad"),
    }[law]
    linear = (*level_names, "viscous_nm_s_per_rad", "inertia_kg_m2", "torque_offset_nm")
    step = min(
        float(np.quantile(np.abs(np.diff(s.time_s) * s.velocity_rad_s[1:]), 0.1)) for s in segments
    )
    out: dict[str, Parameter] = {}
    for i, name in enumerate(shape_names):
        value = math.exp(values[i])
        if at_bound[i]:
            reason = "not identified: the data push it to the end of its range"
        elif half[i] > _LOOSE:
            reason = "not identified: its order of magnitude differs from reversal to reversal"
        elif i == 0 and value < _RESOLVED * step:
            reason = "not identified: friction turns within a few samples; reverse more slowly"
        else:
            out[name] = Parameter(
                value, (math.exp(values[i] - half[i]), math.exp(values[i] + half[i]))
            )
            continue
        out[name] = Parameter.not_identified(reason)
    for i, name in enumerate(linear, start=shapes):
        value = float(values[i])
        sign = -1.0 if name == "slow_nm" else 1.0
        ends = sorted((sign * value - half[i], sign * value + half[i]))
        if name in level_names and sign * value <= 0.0:
            out[name] = Parameter.not_identified("not identified: it came out negative")
        else:
            out[name] = Parameter(sign * value, (float(ends[0]), float(ends[1])))
    if "fast_over_rest" in out:
        out["fast_share"] = _share(out.pop("fast_over_rest"))
    stiff, level = out["space_constant_rad"], out.get("coulomb_nm")
    if level is not None:
        out["stiffness_nm_per_rad"] = _stiffness(stiff, level)
    return out


def _share(ratio: Parameter) -> Parameter:
    """Return the fast element's space constant as a share of the slow one's, x/(1 + x)."""
    if ratio.ci95 is None:
        return ratio
    low, high = (end / (1.0 + end) for end in ratio.ci95)
    return Parameter(ratio.value / (1.0 + ratio.value), (low, high))


def _stiffness(length: Parameter, level: Parameter) -> Parameter:
    """Return level over space constant; both intervals count."""
    if length.ci95 is None or level.ci95 is None:
        return Parameter.not_identified(length.reason or level.reason)
    value = level.value / length.value
    parts = (
        math.log(length.ci95[1] / length.value),
        (level.ci95[1] - level.value) / level.value,
    )
    factor = math.exp(math.hypot(*parts))
    return Parameter(value, (value / factor, value * factor))


def _backlash(
    recordings: Sequence[Signals],
    arms: Sequence[Floats | None],
    found: Sequence[Reversal],
) -> Parameter:
    """Return how far the motor turns at a reversal before the arm follows, from the arm's angle."""
    steps = []
    for r in found:
        signals, arm = recordings[r.recording], arms[r.recording]
        if arm is None or signals.position_rad is None:
            continue
        lead = signals.position_rad - signals.gear_ratio * arm
        tail = max((r.stop - r.at) // 3, 3)
        head = max((r.at - r.start) // 3, 3)
        before, after = lead[r.start : r.start + head], lead[r.stop - tail : r.stop]
        change = float(np.nanmean(after) - np.nanmean(before))
        steps.append(-change if r.forward_before else change)
    if len(steps) < _LEAST_REVERSALS:
        return Parameter.not_identified(
            "not identified: motor-side signals alone cannot tell clearance from presliding and "
            "elasticity; record position_arm_rad over at least "
            f"{_LEAST_REVERSALS} reversals"
        )
    values = np.array(steps)
    half = student_975(values.size - 1.0) * float(values.std(ddof=1)) / math.sqrt(values.size)
    mean = float(values.mean())
    if mean <= half:
        return Parameter.not_identified(
            f"not identified: lost motion is below {mean + half:.2g} rad of the motor, within noise"
        )
    return Parameter(
        mean,
        (mean - half, mean + half),
        reason="lost motion: it includes what the gear's elasticity winds up under friction",
    )
