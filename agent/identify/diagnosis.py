"""Reasons, in plain words, why recordings do not carry an estimate; and warnings about them."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.identify.result import Floats, RigidBodyFit
from agent.identify.signals.arrays import Signals
from agent.identify.signals.frames import objections_of_frames
from agent.identify.signals.preprocess import Motion, read_motion
from agent.identify.signals.windows import SteadyWindow
from agent.numbers import significant

_SAMPLES = 100
_MOVING = 100
_KEPT = 0.5
_MEMORY = 0.8
_SATURATED = 0.2
_FACTOR = 0.1
_SCALED = 0.01  # of a velocity, in every recording: no estimate of it from the position is so bad
_WRAPS = 0.5
_WANDERS = 2.0  # times what it moves in a two-hundredth of the time
_FASTEST_RAD_S = 2000.0  # 19 000 rpm: motors of joints turn at 10 000 at most
_MOST_TURNS = 5.0  # of an arm behind a gear
_COASTS_S = 60.0  # joints, drives and bare motors stop by their friction within seconds
_CLOCKS = ((1e3, "milliseconds"), (1e6, "microseconds"), (1e9, "nanoseconds"))
_MOST_HZ = 1e5  # no recording of a joint is as fast
_IN_DEGREES = "as if its motion were in degrees, and not in radians"
ONE_WAY = "the joint moves in one direction only: friction cannot be told from gravity and offset"
_LEAST = 1e-12  # rad, or rad/s: slower than any clock's hand
_LEAST_NM = 1e-15  # no drive's torque is as fine: what moves less, stands still


def refusals(motions: Sequence[Motion]) -> tuple[str, ...]:
    """Return why the recordings cannot be used at all; empty where they can.

    Every reason is returned, not only the first.
    """
    reasons: list[str] = []
    for motion in motions:
        reasons += _of_recording(motion)
    ratios = {motion.signals.gear_ratio for motion in motions}
    if len(ratios) > 1:
        shown = ", ".join(f"{r:g}" for r in sorted(ratios))
        reasons.append(f"the recordings have different gear ratios ({shown}): not one axis")
    return tuple(reasons)


def _of_recording(motion: Motion) -> list[str]:
    """Return what speaks against one recording."""
    signals, name = motion.signals, motion.signals.name
    valid = int(np.count_nonzero(signals.valid))
    if valid < _SAMPLES:
        return [f"{name}: only {valid} valid samples; at least {_SAMPLES} are needed"]
    reasons = []
    total = signals.valid.shape[0] + signals.samples_lost
    if valid < _KEPT * total:
        reasons.append(f"{name}: only {valid} of {total} samples are left; too many frames lost")
    else:
        reasons += objections_of_frames(motion)
    velocity = np.concatenate(motion.velocity_rad_s) if motion.velocity_rad_s else np.zeros(0)
    fastest = float(np.max(np.abs(velocity), initial=0.0))
    moving = int(np.count_nonzero(np.abs(velocity) > 0.02 * fastest)) if fastest > 0.0 else 0
    if moving == 0:
        return [*reasons, f"{name}: the joint does not move"]
    if fastest <= 4.0 * motion.velocity_noise_rad_s:
        rate_hz = motion.timing.sample_rate_hz
        return [
            *reasons,
            f"{name}: the velocity is no more than its own noise; the joint does not move, or "
            f"{rate_hz:.3g} Hz is too slow for its motion",
        ]
    if moving < _MOVING:
        reasons.append(f"{name}: only {moving} samples of motion; at least {_MOVING} are needed")
    reasons += _of_torque(motion)
    reasons += _of_rate(motion)
    reasons += _of_units(motion)
    return reasons


def _of_torque(motion: Motion) -> list[str]:
    """Return what is wrong with the torque: frozen, or cut off."""
    name = motion.signals.name
    torque = motion.signals.torque_nm[motion.signals.valid]
    frozen = never_changes(motion)
    if frozen:
        return [frozen]
    low, high = float(torque.min()), float(torque.max())
    moved = np.diff(torque) != 0.0
    still = np.diff(np.flatnonzero(np.concatenate(([True], moved, [True]))))
    if still.size and still.max() > 0.5 * torque.size:
        return [f"{name}: the torque is frozen during more than half of the recording"]
    if np.unique(torque).size < 50:
        return []
    share = max(float(np.mean(torque == high)), float(np.mean(torque == low)))
    if share > _SATURATED:
        return [f"{name}: the torque is cut off at a limit during {100 * share:.0f} % of the time"]
    return []


def stands_still(motion: Motion) -> str:
    """Return that the joint moves less than any encoder sees; nothing where it moves."""
    signals = motion.signals
    position = signals.position_rad
    where = np.zeros(1) if position is None else position[signals.valid]
    fastest = max((float(np.abs(v).max(initial=0.0)) for v in motion.velocity_rad_s), default=0.0)
    if fastest > _LEAST or float(np.ptp(where)) > _LEAST:
        return ""
    return f"{signals.name}: the joint does not move"


def never_changes(motion: Motion) -> str:
    """Return that the torque is one and the same all along; nothing where it is not."""
    torque = motion.signals.torque_nm[motion.signals.valid]
    low, high = float(torque.min(initial=np.inf)), float(torque.max(initial=-np.inf))
    if high - low > max(1e-9 * max(abs(high), abs(low)), _LEAST_NM):
        return ""
    name = motion.signals.name
    if not torque.size:
        return f"{name}: no sample has torque and motion"
    return f"{name}: the torque never changes ({high:g} N m): check that it is the right object"


def _of_rate(motion: Motion) -> list[str]:
    """Refuse a rate at which the velocity has changed altogether by the next sample."""
    now = np.concatenate([v[:-1] for v in motion.velocity_rad_s])
    then = np.concatenate([v[1:] for v in motion.velocity_rad_s])
    power = float(np.sqrt((now @ now) * (then @ then)))
    memory = float(now @ then) / power if power > 0.0 else 0.0
    if memory >= _MEMORY:
        return []
    return [
        f"{motion.signals.name}: sampled at {motion.timing.sample_rate_hz:.3g} Hz, too slow for "
        "this motion: the velocity is another one at every sample"
    ]


def _of_units(motion: Motion) -> list[str]:
    """Refuse a velocity that is not the derivative of the position."""
    driven, covered = _driven_and_covered(motion)
    if not driven.size:
        return []
    if not (driven.any() and covered.any()):
        return [f"{motion.signals.name}: position and velocity do not move together"]
    factor = _factor(driven, covered)
    if abs(factor - 1.0) <= _FACTOR:
        return []
    if not _proportional(driven, covered):
        return [f"{motion.signals.name}: position and velocity do not belong to the same motion"]
    return [_another_unit(motion, factor)]


def unlikely_units(motions: Sequence[Motion]) -> list[str]:
    """Return what motors and arms hardly do, and what it may be instead; empty where all is likely.

    A recording in degrees has no sign of it: its inertia comes out a 57th, and its gravity none.
    """
    said = []
    for motion in motions:
        name, position = motion.signals.name, motion.signals.position_rad
        fast = too_fast(motion)
        where = np.zeros(1) if position is None else position[motion.signals.valid]
        turns = float(np.ptp(where)) / (2.0 * np.pi * motion.signals.gear_ratio)
        if fast:
            said.append(fast)
        elif motion.signals.gear_ratio > 1.0 and turns > _MOST_TURNS:
            said.append(f"{name}: the arm would turn {turns:.0f} times, {_IN_DEGREES}")
    return said


def too_fast(motion: Motion) -> str:
    """Return that a motor would turn as fast as none does; nothing where it is likely."""
    fastest = max((float(np.abs(v).max(initial=0.0)) for v in motion.velocity_rad_s), default=0.0)
    if fastest <= _FASTEST_RAD_S:
        return ""
    rpm = fastest * 30.0 / np.pi
    return f"{motion.signals.name}: the motor would turn at {rpm:.0f} rpm, {_IN_DEGREES}"


def coasts_too_long(motions: Sequence[Motion], body: RigidBodyFit | None) -> list[str]:
    """Return that a joint would coast for minutes, and what it may be; empty where it would not.

    From its fastest speed Coulomb friction alone stops it within ``J v / F_C``. Time in another
    unit has no other sign: with a thousandth of the speed and a millionth of the acceleration
    friction stays as it is, and the inertia makes up for it.
    """
    needed = None if body is None else [body.parameters[n] for n in ("inertia_kg_m2", "coulomb_nm")]
    if needed is None or not all(p.identified and p.value > 0.0 for p in needed):
        return []
    speeds = [np.abs(v).max(initial=0.0) for motion in motions for v in motion.velocity_rad_s]
    coasts_s = needed[0].value * float(max(speeds, default=0.0)) / needed[1].value
    if coasts_s < _COASTS_S:
        return []
    clock = next((unit for a_s, unit in _CLOCKS if coasts_s / a_s < _COASTS_S), _CLOCKS[-1][1])
    return [
        f"by its inertia and friction the joint would coast for {coasts_s / 60.0:.3g} min, as if "
        f"its time were in {clock}, and not in seconds"
    ]


def no_joint_records(recordings: Sequence[Signals]) -> str:
    """Return what no joint can have recorded: a frozen torque, two units; nothing where all may be.

    What an estimate asks of recordings beyond this (samples, rate, both directions) each of them
    asks for itself; on these two none can stand.
    """
    for signals in recordings:
        motion = read_motion(signals)
        said = (
            never_changes(motion)
            or not_measured(motion)
            or stands_still(motion)
            or in_another_unit(motion)
            or arm_elsewhere(motion)
        )
        if said:
            return said
    return ""


def not_measured(motion: Motion) -> str:
    """Return that the velocity is zero all along while the position moves; nothing where it is not.

    Some drivers fill a channel that they do not measure with zeros. A joint that is held trembles
    about one place; a spell of its trembling is as much as the whole.
    """
    driven, covered = _driven_and_covered(motion)
    if not covered.size or driven.any():
        return ""
    if not float(np.ptp(np.cumsum(covered))) > _WANDERS * float(np.abs(covered).max()):
        return ""
    return (
        f"{motion.signals.name}: the velocity is zero all along while the position moves: leave "
        "that column out, and it is taken from the position"
    )


def in_another_unit(motion: Motion) -> str:
    """Return that position and velocity are in different units; nothing where they may agree.

    One factor between the two all along, and not 1. A position that wraps or stands still, or a
    joint that does, tells nothing.
    """
    driven, covered = _driven_and_covered(motion)
    if not (driven.any() and covered.any()) or not _proportional(driven, covered):
        return ""
    factor = _factor(driven, covered)
    return "" if abs(factor - 1.0) <= _FACTOR else _another_unit(motion, factor)


def scaled_velocity(motions: Sequence[Motion]) -> str:
    """Return that the velocity is some percent off the position's rate; nothing where it is not.

    A few percent are no unit, and a scale that one of the two has wrong.
    """
    known = [value for value in map(_velocity_over_rate, motions) if math.isfinite(value)]
    if not known or (min(known) < 1.0 + _SCALED and max(known) > 1.0 - _SCALED):
        return ""
    share = float(np.median(known)) - 1.0
    way = "more" if share > 0.0 else "less"
    return (
        f"the velocity is {significant(100.0 * abs(share), 2)} % {way} than the position's rate: "
        "one of the two is scaled wrong, and inertia and viscous friction are off by as much "
        "where it is the velocity"
    )


def _velocity_over_rate(motion: Motion) -> float:
    """Return the velocity over the position's rate; not a number where that is not known."""
    driven, covered = _driven_and_covered(motion)
    if not (driven.any() and covered.any()) or not _proportional(driven, covered):
        return math.nan
    return 1.0 / _factor(driven, covered)


def arm_elsewhere(motion: Motion) -> str:
    """Return that the arm's encoder tells of another motion than the motor's; or nothing.

    A gear twists, has play and wobbles, all of which is little of a stroke.
    """
    signals = motion.signals
    if signals.position_arm_rad is None or signals.position_rad is None:
        return ""
    moved, arm = [np.zeros(0)], [np.zeros(0)]
    for stretch in motion.timing.stretches:
        angles = stretch.on_grid(signals, signals.position_rad)
        step = max(angles.shape[0] // 200, 1)
        moved.append(np.diff(angles[::step]) / signals.gear_ratio)
        arm.append(np.diff(stretch.on_grid(signals, signals.position_arm_rad)[::step]))
    by_motor, by_arm = np.concatenate(moved), np.concatenate(arm)
    if not (by_motor.any() and by_arm.any()) or not _proportional(by_motor, by_arm):
        return ""
    factor = _factor(by_motor, by_arm)
    if abs(factor - 1.0) <= _FACTOR:
        return ""
    name = signals.name
    if abs(factor + 1.0) <= _FACTOR:
        return f"{name}: position_arm_rad counts against position_rad; turn one sign"
    far = (
        f"{name}: position_arm_rad moves {factor:.4g} times as far as position_rad over the gear "
        f"ratio of {signals.gear_ratio:g}"
    )
    if abs(factor / signals.gear_ratio - 1.0) <= _FACTOR:
        return f"{far}: position_rad counts on the arm's side, and not on the motor's"
    return f"{far}: one of the two is in another unit, or the gear ratio is another"


def _driven_and_covered(motion: Motion) -> tuple[Floats, Floats]:
    """Return how far the joint went in short spells, by its velocity and by its position."""
    signals = motion.signals
    covered, driven = [np.zeros(0)], [np.zeros(0)]
    if signals.velocity_rad_s is None or signals.position_rad is None:
        return driven[0], covered[0]
    for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
        position = stretch.on_grid(signals, signals.position_rad)
        step = max(position.shape[0] // 200, 1)
        integral = np.concatenate(([0.0], np.cumsum((velocity[1:] + velocity[:-1]) / 2.0)))
        covered.append(np.diff(position[::step]))
        driven.append(np.diff(integral[::step]) * stretch.period_s)
    return np.concatenate(driven), np.concatenate(covered)


def _proportional(driven: Floats, covered: Floats) -> bool:
    """Return whether both slopes agree: a factor shows in both, a position that wraps in one."""
    # Scaled first: squares of the smallest numbers are nothing.
    one, other = driven / np.abs(driven).max(), covered / np.abs(covered).max()
    both = float(one @ other) ** 2
    return abs(both / (float(one @ one) * float(other @ other)) - 1.0) <= _WRAPS


def _factor(driven: Floats, covered: Floats) -> float:
    fast = np.abs(driven) > 0.3 * np.abs(driven).max()
    return float(np.median(covered[fast] / driven[fast]))


def _another_unit(motion: Motion, factor: float) -> str:
    if abs(factor + 1.0) <= _FACTOR:
        return f"{motion.signals.name}: the position counts against the velocity; turn one sign"
    far = (
        f"{motion.signals.name}: the position moves {factor:.4g} times as far as the velocity says"
    )
    clock = _clock(motion, factor)
    if clock:
        return (
            f"{far}, as if time_s were in {clock}, and not in seconds; or one of the two is in "
            "another unit"
        )
    return f"{far}; one of the two is in another unit, or on the other side of the gear"


def _clock(motion: Motion, factor: float) -> str:
    """Return the unit that time seems to be in; nothing where no clock's unit explains a factor.

    In a thousandth of the unit the same time is a thousand times as long, and so is the way that
    the velocity makes of it. Samples then come too seldom by as much: where they come as they
    should, it is the velocity.
    """
    rate_hz = motion.timing.sample_rate_hz
    fitting = (
        u for a_s, u in _CLOCKS if abs(factor * a_s - 1.0) <= _FACTOR and rate_hz * a_s <= _MOST_HZ
    )
    return next(fitting, "")


def no_curve(windows: Sequence[SteadyWindow]) -> str:
    """Say why steady windows make no friction law: none, one direction, one speed."""
    speeds = np.array([w.velocity_rad_s for w in windows])
    if not speeds.size:
        return "no steady velocity was found"
    if np.all(speeds > 0.0) or np.all(speeds < 0.0):
        return (
            "the joint moves at steady velocity in one direction only: friction cannot be told "
            "from gravity and offset"
        )
    if np.ptp(np.abs(speeds)) <= 0.1 * float(np.abs(speeds).max()):
        return (
            f"there is one steady speed only ({np.abs(speeds).mean():.3g} rad/s): Coulomb cannot "
            "be told from viscous friction"
        )
    return "too few steady speeds are passed in both directions"
