"""The arm behind a soft or loose gear, simulated on the measured motion of the motor.

Everything is per unit of the arm's inertia, so that the shaft's torque is proportional to that
inertia: it is the one linear number. The arm's own dry friction holds it at rest until the spring
is wound up far enough; gravity, which only shifts the spring's rest, is left to the base model.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from agent.explain.scene import Scene
from agent.identify.result import Floats

_STEPS_PER_RAD = 12.0  # of the spring's own swing


@njit(cache=True)
def _shaft(
    velocity: Floats,
    period_s: float,
    omega: float,
    damping: float,
    friction: float,
    half_gap: float,
    steps: int,
) -> Floats:
    """Return the shaft's torque over the arm's inertia, rad/s2, shape (n,)."""
    out = np.empty(velocity.shape[0])
    dt = period_s / steps
    stiffness, damper = omega * omega, 2.0 * damping * omega
    # A stretch may begin in full motion: the arm then follows the motor.
    arm = velocity[0]
    start = 0.0
    if velocity[0] > 0.0:
        start = friction
    elif velocity[0] < 0.0:
        start = -friction
    twist = start / stiffness
    if start != 0.0:
        twist += math.copysign(half_gap, start)
    for i in range(velocity.shape[0]):
        slope = (velocity[i + 1] - velocity[i]) / steps if i + 1 < velocity.shape[0] else 0.0
        pull = 0.0
        for j in range(steps):
            motor = velocity[i] + slope * j
            open_ = abs(twist) - half_gap
            if open_ > 0.0:
                pull = stiffness * math.copysign(open_, twist) + damper * (motor - arm)
            else:
                pull = 0.0
            if j == 0:
                out[i] = pull
            arm += dt * pull
            # Dry friction takes what speed it can within the step, and no more: it never drives.
            hold = friction * dt
            if arm > hold:
                arm -= hold
            elif arm < -hold:
                arm += hold
            else:
                arm = 0.0
            twist += dt * (motor - arm)
    return out


def hidden_arm(
    scene: Scene, frequency_hz: float, damping: float, friction_rad_s2: float, half_gap: float = 0.0
) -> Floats:
    """Return the shaft's torque less that of a stiff gear, over the arm's inertia, shape (N,).

    Parameters
    ----------
    scene : Scene
    frequency_hz, damping : float
        Of the arm's swing on its spring while the motor is held.
    friction_rad_s2 : float
        The arm's dry friction over its inertia.
    half_gap : float
        Half of the clearance, rad at the motor.
    """
    omega = 2.0 * math.pi * frequency_hz
    velocity = scene.full("velocity_rad_s")
    stiff = scene.full("acceleration_rad_s2") + friction_rad_s2 * scene.direction
    out = np.zeros(velocity.shape[0])
    for at, period_s in scene.each_piece():
        steps = max(1, math.ceil(_STEPS_PER_RAD * omega * period_s / (2.0 * math.pi)))
        shaft = _shaft(
            np.ascontiguousarray(velocity[at]),
            period_s,
            omega,
            damping,
            friction_rad_s2,
            half_gap,
            steps,
        )
        out[at] = shaft - stiff[at]
    return out
