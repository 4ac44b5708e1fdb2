"""The hidden arm's equation of motion, compiled. Import this late: numba is slow to load."""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from agent.identify.result import Floats


@njit(cache=True)
def shaft_rad_s2(
    velocity: Floats,
    weight: Floats,
    period_s: float,
    omega: float,
    damping: float,
    friction: float,
    reach: float,
    half_gap: float,
    steps: int,
) -> Floats:
    """Return the shaft's torque over the arm's inertia, rad/s2, shape (n,).

    At first the arm follows the motor, its friction drawn out, its weight borne. The teeth of a gap
    push; they do not pull.
    """
    out = np.empty(velocity.shape[0])
    dt = period_s / steps
    stiffness, damper = omega * omega, 2.0 * damping * omega
    arm, drawn = velocity[0], 0.0
    if arm > 0.0:
        drawn = 1.0
    elif arm < 0.0:
        drawn = -1.0
    borne = weight[0] + friction * drawn
    twist = borne / stiffness
    if borne != 0.0:
        twist += math.copysign(half_gap, borne)
    push = 0.0  # the arm's speed stands half a step behind its twist, which damping must not feel
    for i in range(velocity.shape[0]):
        slope = (velocity[i + 1] - velocity[i]) / steps if i + 1 < velocity.shape[0] else 0.0
        for j in range(steps):
            motor = velocity[i] + slope * j
            pressed = abs(twist) - half_gap
            pull = 0.0
            if pressed > 0.0:
                pull = stiffness * math.copysign(pressed, twist)
                pull += damper * (motor - arm - 0.5 * dt * push)
                if half_gap > 0.0 and pull * twist < 0.0:
                    pull = 0.0
            if j == 0:
                out[i] = pull
            push = pull - weight[i] - friction * drawn
            arm += dt * push
            drawn = min(max(drawn + dt * arm / reach, -1.0), 1.0)
            twist += dt * (motor + 0.5 * slope - arm)
    return out
