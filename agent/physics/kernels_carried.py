"""Arms that a motor carries through a spring, a gap or both, compiled. Import this late.

Apart from `kernels_arm`, which follows the same arm for searches: here it is as a twin has it.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_ARM, _SPEED, _PUSH, _DRAWN, _WOUND, _HELD, _BEGAN, _SINE, _COSINE = range(9)  # of a carried arm


@njit(cache=True)
def carried_arms(
    time_s: Floats,
    position_rad: Floats,
    velocity_rad_s: Floats,
    inertia: float,
    stiffness: float,
    cubic: float,
    damping: float,
    half_gaps: Floats,
    gravity_sin: float,
    gravity_cos: float,
    gear_ratio: float,
    substeps: int,
    acceleration: float,
    velocity: float,
    dry: Floats,
    dry_travel: float,
    film: float,
    viscous: float,
    holds: float,
    travel: float,
    parting: float,
) -> Floats:
    """Return the torques, shape (a, n), with which the motor carries arms behind springs.

    They are alike but for their `half_gaps`, shape (a,), and move side by side: a step waits for
    the one before it, but not for another arm's.

    The arm's own friction is `dry`, shape (n,); before it slips it gives way like a spring, over
    `dry_travel`.
    And `viscous`, which grows with its speed.
    A `film` drags the arm along, whether its teeth touch or not.
    The spring's inner friction `holds` a torque, in full when the twist has gone on for about its
    `travel`; nothing at first.
    Of the damping of teeth in contact a share of `parting` holds them back as they part.

    At first the arm rides on the spring with `velocity` (the motor's first where it is NaN) and
    `acceleration`; in a gap it lies where they press it.
    Between samples the motor's angle is the cubic with the measured angles and velocities; the arm
    moves by velocity Verlet steps, of second order and without energy of their own: `substeps` in
    the longest step between samples, fewer in shorter ones.
    """
    out = np.empty((half_gaps.shape[0], time_s.shape[0]))
    per_inertia, per_ratio = 1.0 / inertia, 1.0 / gear_ratio
    per_dry_travel, per_travel, has_film = 1.0 / dry_travel, 1.0 / travel, film != 0.0
    longest = 0.0
    for k in range(1, time_s.shape[0]):
        longest = max(longest, time_s[k] - time_s[k - 1])
    angle = position_rad[0] / gear_ratio
    weight = gravity_sin * math.sin(angle) + gravity_cos * math.cos(angle)
    drawn = 0.0
    if dry[0] != 0.0 and velocity_rad_s[0] != 0.0:
        drawn = math.copysign(1.0, velocity_rad_s[0])
    speed = velocity_rad_s[0] if math.isnan(velocity) else velocity
    hang = weight + dry[0] * drawn + viscous * speed + inertia * acceleration
    state = np.empty((half_gaps.shape[0], 9))
    for a in range(half_gaps.shape[0]):
        own, half_gap = state[a], half_gaps[a]
        arm = position_rad[0] - _hung(hang, stiffness, cubic, half_gap)
        own[_ARM], own[_SPEED], own[_PUSH], own[_DRAWN] = arm, speed, acceleration, drawn
        own[_WOUND], own[_HELD] = _pressed(position_rad[0] - arm, half_gap), 0.0
        out[a, 0] = hang
    for k in range(1, time_s.shape[0]):
        dt = time_s[k] - time_s[k - 1]
        q0, q1 = position_rad[k - 1], position_rad[k]
        v0, v1 = velocity_rad_s[k - 1] * dt, velocity_rad_s[k] * dt
        steps = max(1, math.ceil(substeps * dt / longest - 1e-9))
        share = 1.0 / steps
        h, per_s = dt * share, 1.0 / dt
        for own in state:
            # Gravity along an interval by its Taylor series: a sine a step would cost most of all.
            angle = own[_ARM] * per_ratio
            own[_BEGAN], own[_SINE], own[_COSINE] = own[_ARM], math.sin(angle), math.cos(angle)
        for i in range(1, steps + 1):
            u = i * share
            motor, rate = _between(u, q0, v0, q1, v1), 0.0
            if damping != 0.0 or has_film:
                rate = _rate_between(u, q0, v0, q1, v1) * per_s
            for a in range(half_gaps.shape[0]):
                own, half_gap = state[a], half_gaps[a]
                push, ahead = own[_PUSH], 0.0
                half = own[_SPEED] + 0.5 * h * push
                arm = own[_ARM] + h * half
                drawn = min(max(own[_DRAWN] + h * half * per_dry_travel, -1.0), 1.0)
                if damping != 0.0 or has_film:
                    ahead = rate - half - 0.5 * h * push
                wound = _pressed(motor - arm, half_gap)
                pull = stiffness * wound + cubic * wound * wound * wound
                if holds != 0.0:
                    own[_HELD] = _drawn_on(own[_HELD], (wound - own[_WOUND]) * per_travel)
                    pull += holds * own[_HELD]
                torque = _borne(wound, ahead, pull, damping, half_gap, film, parting)
                sine, cosine = _turned(own[_SINE], own[_COSINE], (arm - own[_BEGAN]) * per_ratio)
                weight = gravity_sin * sine + gravity_cos * cosine
                push = (torque - weight - dry[k] * drawn - viscous * half) * per_inertia
                own[_ARM], own[_SPEED], own[_PUSH] = arm, half + 0.5 * h * push, push
                own[_DRAWN], own[_WOUND], out[a, k] = drawn, wound, torque
    return out


@njit(cache=True)
def _hung(torque: float, stiffness: float, cubic: float, half_gap: float) -> float:
    """Return how far the motor is ahead of an arm that hangs on it with a torque."""
    twist = _twist(torque, stiffness, cubic)
    if torque > 0.0:
        return twist + half_gap
    return twist - half_gap if torque < 0.0 else twist


@njit(cache=True)
def _between(u: float, q0: float, v0: float, q1: float, v1: float) -> float:
    """Return the cubic that has value and slope q0 and v0 at u = 0, and q1 and v1 at u = 1."""
    w = u - 1.0
    early = q0 * (1 + 2 * u) * w * w + v0 * u * w * w
    return early + (q1 * u * u * (3 - 2 * u) + v1 * u * u * w)


@njit(cache=True)
def _rate_between(u: float, q0: float, v0: float, q1: float, v1: float) -> float:
    """Return the slope of `_between`."""
    w = u - 1.0
    return 6 * u * w * (q0 - q1) + v0 * w * (3 * u - 1) + v1 * u * (3 * u - 2)


@njit(cache=True)
def _pressed(twist: float, half_gap: float) -> float:
    """Return what a twist leaves of it beyond a gap."""
    if twist > half_gap:
        return twist - half_gap
    return min(twist + half_gap, 0.0)


@njit(cache=True)
def _drawn_on(held: float, travels: float) -> float:
    """Return how far inner friction is drawn out, -1 to 1, after so many of its travels."""
    lost = held * held if held * travels > 0.0 else 0.0
    return min(max(held + travels * (1.0 - lost), -1.0), 1.0)


@njit(cache=True)
def _borne(
    pressed: float,
    ahead: float,
    pull: float,
    damping: float,
    half_gap: float,
    film: float,
    parting: float,
) -> float:
    """Return the torque of a gear whose spring pulls, and whose twist grows by `ahead` a second."""
    if half_gap == 0.0:
        return pull + (damping + film) * ahead
    if pressed == 0.0:
        return film * ahead
    drag = damping * ahead
    pull += drag
    # Without a gap the spring holds both ways; teeth push, and pull by their damping at most.
    least = math.copysign(parting * drag, -pressed)
    return (pull if (pull - least) * pressed > 0.0 else least) + film * ahead


@njit(cache=True)
def _turned(sine: float, cosine: float, by_rad: float) -> tuple[float, float]:
    """Return sine and cosine of an angle that is a little larger, to fourth order."""
    sin = by_rad * (1 - by_rad * by_rad * (1 / 6))
    cos = 1 - 0.5 * by_rad * by_rad * (1 - by_rad * by_rad * (1 / 12))
    return sine * cos + cosine * sin, cosine * cos - sine * sin


@njit(cache=True)
def _twist(torque: float, stiffness: float, cubic: float) -> float:
    """Return the twist at which a spring with a cubic part bears a torque (Newton)."""
    twist = torque / stiffness
    for _ in range(20):
        slope = stiffness + 3.0 * cubic * twist * twist
        twist -= (stiffness * twist + cubic * twist * twist * twist - torque) / slope
    return twist


@njit(cache=True)
def dragged_arm(
    position_rad: Floats,
    velocity_rad_s: Floats,
    period_s: float,
    substeps: int,
    gear: Floats,
    arm_rad: float,
    rate_rad_s: float,
) -> tuple[Floats, Floats, Floats]:
    """Return arm angle and the teeth's torque at every substep, and its velocity at the samples.

    A motor drags an arm with dry friction through gap and spring: `gear` holds the gap, the
    spring, its damper, and the arm's inertia, dry friction, viscous friction and constant load.
    Teeth push, but do not pull. Between samples the motor's angle is the cubic with the given
    angles and velocities; dry friction takes away as much momentum as it can in each substep.
    The arm's angle leaps over its velocity, which is known half a substep before: what damps is
    taken where the angle is, by half of what the velocity gained last (second order in substeps).
    """
    samples, h, per_s = position_rad.shape[0], period_s / substeps, 1.0 / period_s
    half, stiffness, damping, viscous, load = 0.5 * gear[0], gear[1], gear[2], gear[5], gear[6]
    gain, dry, share = h / gear[3], h * gear[4] / gear[3], 1.0 / substeps
    arm, rate, gained = arm_rad, rate_rad_s, 0.0
    angle = np.empty((samples - 1) * substeps + 1)
    torque, speed = np.empty(angle.shape[0]), np.empty(samples)
    for k in range(samples):
        last = k == samples - 1
        q0, v0 = position_rad[k], velocity_rad_s[k] * period_s
        way = v0 if last else position_rad[k + 1] - q0
        v1 = v0 if last else velocity_rad_s[k + 1] * period_s
        square, cube = 3.0 * way - 2.0 * v0 - v1, v0 + v1 - 2.0 * way
        for j in range(1 if last else substeps):
            u = j * share
            twist, tooth = q0 + u * (v0 + u * (square + u * cube)) - arm, 0.0
            here = rate + 0.5 * gained
            if twist > half or twist < -half:
                ahead = (v0 + u * (2.0 * square + u * 3.0 * cube)) * per_s - here
                if twist > 0.0:
                    tooth = max(stiffness * (twist - half) + damping * ahead, 0.0)
                else:
                    tooth = min(stiffness * (twist + half) + damping * ahead, 0.0)
            if j == 0:
                speed[k] = here
            torque[k * substeps + j] = tooth
            angle[k * substeps + j] = arm
            before = rate
            rate += gain * (tooth - load - viscous * here)
            if rate > dry:
                rate -= dry
            elif rate < -dry:
                rate += dry
            else:
                rate = 0.0
            gained = rate - before
            arm += h * rate
    return angle, torque, speed
