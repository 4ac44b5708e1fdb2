"""The inner loop of the simulation, as plain Python that numba compiles when it is first used."""

from __future__ import annotations

import math

from agent.identify.result import Floats


def simulate_steps(
    transition: Floats,
    torque_now: Floats,
    torque_next: Floats,
    friction_gain: Floats,
    load_gain: Floats,
    friction: Floats,
    gravity: Floats,
    cubic: float,
    period_s: float,
    torque: Floats,
    state: Floats,
    position: Floats,
    velocity: Floats,
) -> None:
    """Step ``x' = A x + B (torque - friction) + E gravity`` exactly; dry friction implicitly.

    The linear part is the matrix exponential, exact for torque that runs straight between its
    samples. Dry friction is constant within a step and solves the step's own inclusion: the motor
    sticks exactly when a friction within its level brings it to rest at the step's end, and slips
    otherwise, so that it can neither chatter nor creep, for any stiffness and any step.

    Parameters
    ----------
    transition : ndarray, shape (m, m)
        ``exp(A T)``; the motor's velocity is state 0.
    torque_now, torque_next, friction_gain, load_gain : ndarray, shape (m,)
        Response of the state, within a step, to torque at its two ends, to a constant motor
        torque, and to a constant torque on the last mass.
    friction : ndarray, shape (4,)
        Coulomb level, extra level at standstill, Stribeck velocity, exponent.
    gravity : ndarray, shape (3,)
        Torques on sine and cosine of the arm angle; gear ratio.
    cubic : float
        Torque of the spring per third power of its twist; zero where there is more than one mass.
    torque, position, velocity : ndarray, shape (n,)
        Input, and outputs, of which element 0 is the initial condition.
    state : ndarray, shape (m,)
        Initial state; overwritten.
    """
    states = state.shape[0]
    fresh = state.copy()
    slope = friction_gain[0]
    has_gravity = gravity[0] != 0.0 or gravity[1] != 0.0
    for k in range(torque.shape[0] - 1):
        load = 0.0
        # Gravity and the Stribeck line are scalar copies of `agent.physics.rigid_body` and
        # `agent.physics.friction`: the compiled loop cannot call NumPy's broadcasting laws, and
        # would lose its speed to an array a sample. A test holds them to the laws.
        if has_gravity:
            angle = position[k] / gravity[2]
            load = gravity[0] * math.sin(angle) + gravity[1] * math.cos(angle)
        stiff = 0.0
        if cubic != 0.0:
            # At the twist in the middle of the step: at its beginning it would come half a step
            # late and swing by itself.
            twist = state[1] + 0.5 * period_s * (state[0] - state[2])
            stiff = cubic * twist * twist * twist
        for i in range(states):
            total = torque_now[i] * torque[k] + torque_next[i] * torque[k + 1]
            total -= load_gain[i] * (load - stiff) + friction_gain[i] * stiff
            for j in range(states):
                total += transition[i, j] * state[j]
            fresh[i] = total
        level = friction[0]
        if friction[1] > 0.0:
            level += friction[1] * math.exp(-((abs(state[0]) / friction[2]) ** friction[3]))
        free = fresh[0]
        if free > level * slope:
            force = level
        elif free < -level * slope:
            force = -level
        else:
            force = free / slope
        for i in range(states):
            fresh[i] -= friction_gain[i] * force
        if -level < force < level:
            fresh[0] = 0.0
        position[k + 1] = position[k] + 0.5 * period_s * (state[0] + fresh[0])
        for i in range(states):
            state[i] = fresh[i]
        velocity[k + 1] = state[0]


def swing_steps(
    transition: Floats,
    force_now: Floats,
    force_next: Floats,
    scale: float,
    linear: Floats,
    twist: Floats,
    rate: Floats,
) -> None:
    """Step ``y'' + 2 z w y' + w^2 y = scale (x + y)^3`` from rest, for x that is given.

    The linear part is the matrix exponential, exact for a force that runs straight between
    samples; the force at a step's end follows from the twist there, which three corrections find.

    Parameters
    ----------
    transition : ndarray, shape (2, 2)
        Of twist and rate.
    force_now, force_next : ndarray, shape (2,)
        Response within a step to the force at its two ends.
    scale : float
        The cubic spring over the inertia, negative.
    linear : ndarray, shape (n,)
        The twist x of the linear spring.
    twist, rate : ndarray, shape (n,)
        Outputs y and y', whose element 0 is zero.
    """
    y = v = 0.0
    now = scale * linear[0] ** 3
    for k in range(1, linear.shape[0]):
        y0 = transition[0, 0] * y + transition[0, 1] * v + force_now[0] * now
        v0 = transition[1, 0] * y + transition[1, 1] * v + force_now[1] * now
        ahead = now
        for _ in range(3):
            y = y0 + force_next[0] * ahead
            ahead = scale * (linear[k] + y) ** 3
        y, v, now = y0 + force_next[0] * ahead, v0 + force_next[1] * ahead, ahead
        twist[k], rate[k] = y, v
