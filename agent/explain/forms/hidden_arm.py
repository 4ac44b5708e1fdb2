"""The arm behind a soft or loose gear, simulated on the measured motion of the motor.

Everything is per unit of the arm's inertia, so that the shaft's torque is proportional to that
inertia: it is the one linear number. The arm has dry friction of its own, which gives way like a
spring before it slips; without that an arm would stop dead and ring otherwise than real ones do.
Gravity decides on which side of a gap the arm rests; without a gap it only shifts the twist.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.explain.rows.arm_motion import ArmMotion
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_STEPS_PER_SWING = 16.0
_CLOSELY, _LEAST_DAMPED = 13.0, 0.01  # steps: a resonance is then off by a hundredth of its width
_STEPS_PER_DRAG = 4.0
_LET_GO = 2.0  # loads: a spring that is let go swings to twice its own
_HARDEST = 16.0  # gear's springs: friction that is harder before it slips is as good as rigid


@dataclass(frozen=True)
class HiddenArm:
    """What is behind the gear, per unit of the arm's inertia.

    Parameters
    ----------
    frequency_hz : float
        Of the arm's swing on the gear's spring while the motor is held.
    damping_ratio : float
        Of that swing.
    friction_rad_s2 : float
        The arm's dry friction over its inertia; time and use change it as they do the joint's.
    reach_rad : float
        How far that friction gives way, like a spring, before it slips, seen from the motor.
    half_gap_rad : float
        Half of the gear's clearance, seen from the motor.
    inertia_share : float, optional
        The arm's share of the whole inertia, which says how hard gravity pulls it; as it was found
        where the law's own numbers do not say.
    film_per_s : float
        Damping of what is between the teeth of a gap, over the arm's inertia: it drags the arm
        along while they are apart.
    oil_per_s : float
        The arm's viscous friction over its inertia.
    stiffening_per_rad2 : float
        By which share of itself the spring is stiffer at a twist of 1 rad, seen from the motor; it
        grows with the twist's square.
    parting_share : float
        Share of the damping of teeth in contact that holds them back as they part.
    """

    frequency_hz: float
    damping_ratio: float
    friction_rad_s2: float = 0.0
    reach_rad: float = 1.0
    half_gap_rad: float = 0.0
    inertia_share: float | None = None
    film_per_s: float = 0.0
    oil_per_s: float = 0.0
    stiffening_per_rad2: float = 0.0
    holds_rad_s2: float = 0.0
    travel_rad: float = 1.0
    parting_share: float = 0.0

    def extra_rad_s2(self, scene: Scene) -> Floats:
        """Return the shaft's torque less that of a stiff gear, over the arm's inertia, (N,)."""
        return mean_extra_rad_s2(self, (self.half_gap_rad,), scene)

    def shaft_rad_s2(self, motion: ArmMotion, pull_rad_s2: Floats) -> Floats:
        """Return the shaft's torque over the arm's inertia, shape (M,) as the motion has it.

        Parameters
        ----------
        motion : ArmMotion
        pull_rad_s2 : ndarray, shape (M,)
            What the arm is held against over its inertia: its weight, and oil.
        """
        (shaft,) = self.shafts_rad_s2(motion, pull_rad_s2, (self.half_gap_rad,))
        return np.asarray(shaft)

    def shafts_rad_s2(
        self,
        motion: ArmMotion,
        pull_rad_s2: Floats,
        half_gaps_rad: Sequence[float],
        lighter_per_s2: Floats | None = None,
        *,
        closely: bool = False,
    ) -> Floats:
        """Return the same of arms that have other gaps and are alike in all else, shape (a, M).

        What the arm is held against may be less by `lighter_per_s2`, shape (M,), for every radian
        that it is behind the motor. `closely` the spring swings as often as it says, however little
        it is damped: a step of a sixteenth of a swing makes it faster by half a percent.
        """
        from agent.physics.kernels_arm import shaft_rad_s2

        omega = 2.0 * math.pi * self.frequency_hz
        # Stiffer friction would ask for smaller steps, and the band would not show the difference.
        reach = max(self.reach_rad, self.friction_rad_s2 / (_HARDEST * omega**2), 1e-12)
        hardest = omega**2 + self.friction_rad_s2 / reach + self.holds_rad_s2 / self.travel_rad
        fastest_hz = math.sqrt(hardest) / (2.0 * math.pi)
        per_swing = _STEPS_PER_SWING
        if closely and not half_gaps_rad[0]:
            width = math.sqrt(max(self.damping_ratio, _LEAST_DAMPED))
            per_swing = max(per_swing, _CLOSELY / width)
        steps_per_s = per_swing * fastest_hz * max(self.damping_ratio, 1.0)
        steps_per_s = max(steps_per_s, _STEPS_PER_DRAG * self.film_per_s)
        steps_per_s *= self._stiffened(motion.stiff_rad_s2 + pull_rad_s2, omega)
        starts, stops, periods = motion.bridged.longest_first
        friction = self.friction_rad_s2 * motion.worn_share
        lighter = np.zeros_like(pull_rad_s2) if lighter_per_s2 is None else lighter_per_s2
        out = np.zeros((len(half_gaps_rad), motion.bridged.size))
        steps = np.maximum(np.ceil(steps_per_s * periods), 1.0).astype(np.int64)
        held = (self.holds_rad_s2, self.travel_rad) if self.holds_rad_s2 else None
        for several in np.unique(steps):
            alike = steps == several
            shaft_rad_s2(
                motion.velocity_rad_s,
                pull_rad_s2,
                lighter,
                friction,
                starts[alike],
                stops[alike],
                periods[alike],
                omega,
                self.damping_ratio,
                reach,
                np.array(half_gaps_rad, dtype=np.float64),
                self.film_per_s,
                self.parting_share,
                self.stiffening_per_rad2,
                held,
                int(several),
                out,
            )
        return out

    def _stiffened(self, load_rad_s2: Floats, omega: float) -> float:
        """Return how many times faster a stiffening spring swings under twice its hardest load."""
        if not self.stiffening_per_rad2:
            return 1.0
        hardest = float(np.max(np.abs(load_rad_s2), initial=0.0))
        linear = _LET_GO * (hardest + self.friction_rad_s2) / omega**2
        # Where the cube bears all of the load, and where the linear spring does, it is no more.
        twist = min(linear, float(np.cbrt(linear / self.stiffening_per_rad2)))
        return math.sqrt(1.0 + 3.0 * self.stiffening_per_rad2 * twist**2)


def mean_extra_rad_s2(arm: HiddenArm, half_gaps_rad: Sequence[float], scene: Scene) -> Floats:
    """Return the mean of what arms add that differ in their gaps, shape (N,).

    Oil brakes the arm by the motor's smooth speed, from which its own is never far. See
    `HiddenArm.extra_rad_s2`.

    Parameters
    ----------
    arm : HiddenArm
        Behind any of the gaps.
    half_gaps_rad : sequence of float
        All above zero, or one that is zero.
    scene : Scene
    """
    from agent.physics.kernels_arm import less_stiff

    motion = scene.loose_arm if half_gaps_rad[0] > 0.0 else scene.sprung_arm
    share = scene.arm_share if arm.inertia_share is None else arm.inertia_share
    inertia = share * inertia_of(scene)
    pull, lighter = motion.weight_nm / inertia, motion.lighter_nm_per_rad / inertia
    if arm.oil_per_s:
        pull += arm.oil_per_s * motion.oil_rad_s
    shafts = arm.shafts_rad_s2(motion, pull, half_gaps_rad, lighter, closely=scene.closely)
    own = arm.friction_rad_s2, motion.worn_share
    out = less_stiff(shafts, pull, motion.stiff_rad_s2, motion.drawn, *own)
    return motion.bridged.recorded(out)


def inertia_of(scene: Scene) -> float:
    """Return the refitted twin's inertia, kg m2, kept away from zero."""
    return max(float(scene.theta[0]), 1e-12)
