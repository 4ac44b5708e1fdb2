"""An arm behind a soft or loose gear, over its inertia, compiled. Import this late: numba is slow.

`agent.physics.flexibility.TwoMass` with its cubic spring, behind the dead zone of
`agent.physics.backlash`, as `kernels_carried.carried_arms` has it, but for searches: they try
hundreds of arms, and need no more of each than the band of a comparison shows.

A step waits for the one before it, so that one arm alone leaves most of a processor idle: stretches
of recordings, and arms of several gaps, are followed side by side, in lanes that a vector unit
takes together, and in blocks of lanes that do not wait for each other.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit
from numpy.typing import NDArray

Floats = NDArray[np.float64]

_LANES, _MOST_BLOCKS = 8, 3
_STIFFEST = 0.1  # of a spring's: so much of it a weight leaves that pulls ever more
_NEWTON = 20  # steps: from the linear twist down, ever closer
_ARM, _TWIST, _DRAWN, _PUSH = 0, _LANES, 2 * _LANES, 3 * _LANES
_MOTOR, _SLOPE, _WEIGHT, _LIGHTER, _DRY = (k * _LANES for k in range(4, 9))
_PULL, _DT, _GAP, _HELD = (k * _LANES for k in range(9, 13))
_DRIVE, _BLOCK = 5 * _LANES, 13 * _LANES
_CHUNK = 32  # samples that are laid out at a time


@njit(cache=True, nogil=True)
def shaft_rad_s2(
    velocity: Floats,
    weight: Floats,
    lighter: Floats,
    friction: Floats,
    starts: NDArray[np.int64],
    stops: NDArray[np.int64],
    period_s: Floats,
    omega: float,
    damping: float,
    reach: float,
    half_gaps: Floats,
    film: float,
    parting: float,
    stiffening: float,
    held: tuple[float, float] | None,
    steps: int,
    out: Floats,
) -> None:
    """Put the shaft's torque over the arm's inertia, rad/s2, at some stretches into `out`, (a, N).

    At first the arm follows the motor, its friction drawn out, its weight borne. The teeth of a gap
    push, and pull by a part of their damping at most. The film between them does both.

    Parameters
    ----------
    velocity, weight, friction : ndarray, shape (N,)
        The motor's speed, rad/s, and the arm's weight and dry friction over its inertia, rad/s2.
    lighter : ndarray, shape (N,)
        By how much less it weighs for every radian that it is behind the motor, 1/s2.
    starts, stops : ndarray of int, shape (p,)
        Where the stretches begin and end.
    period_s : ndarray, shape (p,)
        Between two samples of each.
    omega, damping : float
        The arm's swing while the motor is held, rad/s, and its damping ratio.
    reach : float
        How far friction gives way before it slips, rad.
    half_gaps : ndarray, shape (a,)
        Half of the clearance of each of the arms, which are alike but for that, rad.
    film : float
        Damping of what is between the teeth over the arm's inertia, 1/s.
    parting : float
        Share of the damping of teeth in contact that holds them back as they part.
    stiffening : float
        By which share of itself the spring is stiffer at a twist of 1 rad, 1/rad^2.
    held : tuple of float, or None
        What the spring's inner friction holds over the arm's inertia, rad/s2, and the twist over
        which that is drawn out, rad. Compiled apart without: most springs have none.
    steps : int
        Of the integration, between two samples.
    out : ndarray, shape (a, N)
    """
    arms = half_gaps.shape[0]
    asked = arms * starts.shape[0]
    blocks = min(_MOST_BLOCKS, -(-asked // _LANES))
    state = np.zeros(blocks * _BLOCK)
    drives = np.zeros((_CHUNK, blocks, _DRIVE))
    at, stop = np.zeros(blocks * _LANES, dtype=np.int64), np.zeros(blocks * _LANES, dtype=np.int64)
    which = np.zeros(blocks * _LANES, dtype=np.int64)
    following = 0
    while True:
        for lane in range(at.shape[0]):
            if at[lane] == stop[lane]:
                place = lane // _LANES * _BLOCK + lane % _LANES
                state[place : place + _BLOCK - _LANES + 1 : _LANES] = 0.0
                if following < asked:
                    stretch, which[lane] = following // arms, following % arms
                    at[lane], stop[lane] = starts[stretch], stops[stretch]
                    state[_DT + place] = period_s[stretch] / steps
                    state[_GAP + place] = half_gaps[which[lane]]
                    i = at[lane]
                    first = velocity[i], weight[i], lighter[i], friction[i]
                    _begin(state, place, *first, omega, half_gaps[which[lane]], stiffening)
                    following += 1
        if not np.any(at < stop):
            break
        together = np.min((stop - at)[at < stop])
        for begin in range(0, together, _CHUNK):
            samples = min(_CHUNK, together - begin)
            _laid_out(drives, samples, at, stop, velocity, weight, lighter, friction, steps)
            for sample in range(samples):
                _driven(state, drives, sample)
                _sample(state, omega, damping, reach, film, parting, stiffening, held, steps)
                _kept(state, drives, sample)
            _told(drives, samples, at, stop, which, out)


@njit(cache=True, nogil=True)
def less_stiff(
    shafts: Floats,
    weight: Floats,
    stiff: Floats,
    drawn: Floats,
    friction: float,
    worn: Floats,
) -> Floats:
    """Return the mean torque of shafts less that of a stiff gear, over the arm's inertia, (N,).

    Parameters
    ----------
    shafts : ndarray, shape (a, N)
    weight, stiff, drawn, worn : ndarray, shape (N,)
        The arm's weight over its inertia, the acceleration of an arm behind a stiff gear, how far
        its friction is drawn out there, and what time and use have made of that friction.
    friction : float
        That friction over the arm's inertia, rad/s2.
    """
    arms, out = shafts.shape[0], np.empty(weight.shape[0])
    for i in range(out.shape[0]):
        torque = 0.0
        for arm in range(arms):
            torque += shafts[arm, i]
        out[i] = torque / arms - weight[i] - stiff[i] - friction * worn[i] * drawn[i]
    return out


@njit(cache=True, nogil=True)
def _begin(
    state: Floats,
    place: int,
    velocity: float,
    weight: float,
    lighter: float,
    friction: float,
    omega: float,
    half_gap: float,
    stiffening: float,
) -> None:
    """Let an arm follow the motor at first."""
    drawn = 0.0
    if velocity > 0.0:
        drawn = 1.0
    elif velocity < 0.0:
        drawn = -1.0
    linear = (weight + friction * drawn) / max(omega * omega + lighter, _STIFFEST * omega * omega)
    twist = linear
    for _ in range(_NEWTON if stiffening > 0.0 else 0):
        bent = stiffening * twist * twist
        twist -= (twist * (1.0 + bent) - linear) / (1.0 + 3.0 * bent)
    if twist != 0.0:
        twist += math.copysign(half_gap, twist)
    state[_ARM + place], state[_TWIST + place], state[_DRAWN + place] = velocity, twist, drawn


@njit(cache=True, nogil=True)
def _laid_out(
    drives: Floats,
    samples: int,
    at: NDArray[np.int64],
    stop: NDArray[np.int64],
    velocity: Floats,
    weight: Floats,
    lighter: Floats,
    friction: Floats,
    steps: int,
) -> None:
    """Put what drives every lane's arm at its next samples side by side, (sample, block, lane).

    A vector that is read right after its parts were written one by one makes a processor wait.
    """
    for lane in range(at.shape[0]):
        block, own = lane // _LANES, lane % _LANES
        if at[lane] < stop[lane]:
            for sample in range(samples):
                i = at[lane] + sample
                slope = (velocity[i + 1] - velocity[i]) / steps if i + 1 < stop[lane] else 0.0
                drives[sample, block, own] = velocity[i]
                drives[sample, block, _LANES + own] = slope
                drives[sample, block, 2 * _LANES + own] = weight[i]
                drives[sample, block, 3 * _LANES + own] = lighter[i]
                drives[sample, block, 4 * _LANES + own] = friction[i]


@njit(cache=True, nogil=True, inline="always")
def _driven(state: Floats, drives: Floats, sample: int) -> None:
    """Put what drives every lane's arm at a sample into its state."""
    for block in range(drives.shape[1]):
        for own in range(_DRIVE):
            state[block * _BLOCK + _MOTOR + own] = drives[sample, block, own]


@njit(cache=True, nogil=True, inline="always")
def _kept(state: Floats, drives: Floats, sample: int) -> None:
    """Put the torque of every lane's shaft where the sample's drive began."""
    for block in range(drives.shape[1]):
        for own in range(_LANES):
            drives[sample, block, own] = state[block * _BLOCK + _PULL + own]


@njit(cache=True, nogil=True)
def _told(
    drives: Floats,
    samples: int,
    at: NDArray[np.int64],
    stop: NDArray[np.int64],
    which: NDArray[np.int64],
    out: Floats,
) -> None:
    """Put the torques of every lane's shaft where they belong, and go on to the next samples."""
    for lane in range(at.shape[0]):
        block, own = lane // _LANES, lane % _LANES
        if at[lane] < stop[lane]:
            for sample in range(samples):
                out[which[lane], at[lane] + sample] = drives[sample, block, own]
            at[lane] += samples


@njit(cache=True, nogil=True)
def _sample(
    states: Floats,
    omega: float,
    damping: float,
    reach: float,
    film: float,
    parting: float,
    stiffening: float,
    held: tuple[float, float] | None,
    steps: int,
) -> None:
    """Move all lanes by one sample; nothing in here branches, so that they move together."""
    stiffness, damper, per_reach = omega * omega, 2.0 * damping * omega, 1.0 / reach
    holds, per_travel = (0.0, 0.0) if held is None else (held[0], 1.0 / held[1])
    for j in range(steps):
        for block in range(states.shape[0] // _BLOCK):
            state = states[block * _BLOCK : (block + 1) * _BLOCK]
            for lane in range(_LANES):
                arm, twist, drawn = state[_ARM + lane], state[_TWIST + lane], state[_DRAWN + lane]
                slope, dt, half_gap = state[_SLOPE + lane], state[_DT + lane], state[_GAP + lane]
                motor = state[_MOTOR + lane] + slope * j
                pressed = abs(twist) - half_gap
                harder = 1.0 + stiffening * pressed * pressed
                pull = stiffness * harder * math.copysign(pressed, twist)
                # The arm's speed stands half a step behind its twist, which damping must not feel.
                ahead = motor - arm - 0.5 * dt * state[_PUSH + lane]
                drag = damper * ahead
                pull += drag
                if held is not None:
                    pull += holds * state[_HELD + lane]
                least = math.copysign(parting * drag, -twist)
                pulls = half_gap > 0.0 and (pull - least) * twist < 0.0
                pull = least if pulls else pull
                pull = (0.0 if pressed <= 0.0 else pull) + film * ahead
                state[_PULL + lane] = pull if j == 0 else state[_PULL + lane]
                weight = state[_WEIGHT + lane] - state[_LIGHTER + lane] * twist
                push = pull - weight - state[_DRY + lane] * drawn
                arm += dt * push
                further = drawn + dt * per_reach * arm
                further = -1.0 if further < -1.0 else further
                state[_DRAWN + lane] = 1.0 if further > 1.0 else further
                wound = dt * (motor + 0.5 * slope - arm)
                state[_TWIST + lane] = twist + wound
                if held is not None:
                    drawn_out = state[_HELD + lane]
                    lost = drawn_out * drawn_out if drawn_out * wound > 0.0 else 0.0
                    more = drawn_out + wound * per_travel * (1.0 - lost)
                    more = -1.0 if more < -1.0 else more
                    state[_HELD + lane] = 1.0 if more > 1.0 else more
                state[_ARM + lane], state[_PUSH + lane] = arm, push
