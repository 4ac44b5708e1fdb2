"""The arm behind a spring, a gap, or both: one arm, simulated once behind the measured motor.

The spring bears outside the gap only: ``k D(x) + k3 D(x)^3`` of the dead-zone twist D. A twin that
has both effects says the arm in `joint-flexibility`, and of `backlash` only the gap.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.physics.backlash import DeadZone
from agent.physics.beginnings import begins_at_rest, drawn_at_first
from agent.physics.effects.card import (
    EffectCard,
    Floats,
    Form,
    Numbers,
    Parameter,
    not_negative,
    positive,
)
from agent.physics.effects.driving import STEPS_PER_RAD, driven, in_a_row, known_of, start_of
from agent.physics.effects.motion import Base, Motion
from agent.physics.flexibility import TwoMass
from agent.physics.seen_arm import SeenArm

_YIELD_RAD = 0.01
_DAMPED, _LEAST_DAMPED = 0.1, 0.01  # damping ratios, between which a swing asks for finer steps
_SPREAD = "half_gap_spread"
_LATE = "encoder_late_s"
_SILENT = {"arm_yield_rad": _YIELD_RAD}  # defaults that say nothing against another entry's number


@dataclass(frozen=True)
class Carrier:
    """What carries the arm: its spring, and the gap in it."""

    arm_inertia_kg_m2: float
    stiffness_nm_per_rad: float
    damping_nm_s_per_rad: float = 0.0
    cubic_stiffness_nm_per_rad3: float = 0.0
    half_gap_rad: float = 0.0
    arm_coulomb_nm: float = 0.0
    arm_yield_rad: float = _YIELD_RAD
    film_damping_nm_s_per_rad: float = 0.0
    arm_viscous_nm_s_per_rad: float = 0.0
    hysteresis_nm: float = 0.0
    hysteresis_travel_rad: float = 1.0
    parting_damping_share: float = 0.0

    def extra_nm(self, motion: Motion, base: Base, widths: Sequence[float] = (1.0,)) -> Floats:
        """Return the shaft's torque less that of a stiff gear, shape (n,).

        The motor's own share of the twin's inertia is what the arm leaves of it.

        Parameters
        ----------
        motion, base
            As for every effect.
        widths : sequence of float
            Of the gap, over its own: the mean is taken of the arms behind each.
        """
        motion = motion.unfiltered
        stiff = self.arm_inertia_kg_m2 * motion.acceleration_rad_s2 + base.weight_nm(motion)
        # The twin's friction is motor's and arm's together: only what the spring does to the arm's
        # part is extra.
        dry = self._drawn(motion) if base.yields and self.half_gap_rad else motion.direction
        stiff = stiff + self.arm_coulomb_nm * base.worn_share(motion) * dry
        stiff = stiff + self.arm_viscous_nm_s_per_rad * motion.velocity_rad_s
        return np.asarray(self.shaft_nm(motion, base, widths) - stiff)

    def _drawn(self, motion: Motion) -> Floats:
        """Return how far the arm's friction is drawn out behind a stiff gear, -1 to 1, (n,)."""
        from agent.physics.kernels import slipping

        time, velocity = motion.need("time_s"), motion.velocity_rad_s
        known, out = known_of(time, velocity), np.full_like(velocity, np.nan)
        stiffness, level = np.array([1.0 / self.arm_yield_rad]), np.ones(1)
        start = drawn_at_first(velocity[known], motion.direction[known])
        out[known] = slipping(time[known].copy(), velocity[known].copy(), stiffness, level, start)
        return out

    def shaft_nm(self, motion: Motion, base: Base, widths: Sequence[float] = (1.0,)) -> Floats:
        """Return the torque with which the motor carries the arm, shape (n,), simulated.

        See `extra_nm`.
        """
        from agent.physics.kernels_carried import carried_arms

        law = TwoMass(
            1.0,
            self.arm_inertia_kg_m2,
            self.stiffness_nm_per_rad,
            self.damping_nm_s_per_rad,
            self.cubic_stiffness_nm_per_rad3,
        )
        gaps = [DeadZone(width * self.half_gap_rad, law.stiffness_nm_per_rad) for width in widths]
        memory_s = 2.0 * self.arm_inertia_kg_m2 / max(self.damping_nm_s_per_rad, 1e-300)
        answer_s = math.sqrt(self.arm_inertia_kg_m2 / self.stiffness_nm_per_rad)
        time, position, velocity, own = in_a_row(motion, memory_s)
        known = known_of(motion.need("time_s"), motion.need("position_rad"), motion.velocity_rad_s)
        longest_s = float(np.max(np.diff(time), initial=0.0))
        per_rad = STEPS_PER_RAD * self._finer()
        steps = math.ceil(per_rad * self._rate_per_s(motion, base) * longest_s)
        angle, speed = driven(
            time, position, velocity, answer_s, by_velocity=motion.velocity_raw_rad_s is not None
        )
        # An arm on a spring stands still before it is set off; in a gap it lies where it is pushed.
        still = not self.half_gap_rad and begins_at_rest(speed)
        start = (0.0, 0.0) if still else start_of(time, speed, math.pi * answer_s)
        worn = base.worn_share(motion)[known]
        before = np.full(time.shape[0] - worn.shape[0], worn[0])
        friction_nm = self.arm_coulomb_nm * np.concatenate((before, worn))
        each = carried_arms(
            time,
            angle,
            speed,
            law.arm_inertia_kg_m2,
            law.stiffness_nm_per_rad,
            law.cubic_stiffness_nm_per_rad3,
            law.damping_nm_s_per_rad,
            np.array([gap.half_gap_rad for gap in gaps]),
            base.gravity_sin_nm,
            base.gravity_cos_nm,
            base.gear_ratio,
            steps,
            *start,
            friction_nm,
            self.arm_yield_rad,
            self.film_damping_nm_s_per_rad,
            self.arm_viscous_nm_s_per_rad,
            self.hysteresis_nm,
            self.hysteresis_travel_rad,
            self.parting_damping_share,
        )
        shaft = np.full_like(motion.velocity_rad_s, np.nan)
        shaft[known] = np.mean(each, axis=0)[own]
        return shaft

    def _finer(self) -> float:
        """Return how many times as many steps a swing asks for: the less it is damped, the more.

        A step of 0.1 rad makes it faster by 0.04 %, which shows at a resonance that is narrow.
        """
        if self.half_gap_rad:
            return 1.0
        critical = 2.0 * math.sqrt(self.stiffness_nm_per_rad * self.arm_inertia_kg_m2)
        ratio = max(self.damping_nm_s_per_rad / critical, _LEAST_DAMPED)
        return max(math.sqrt(_DAMPED / ratio), 1.0)

    def _rate_per_s(self, motion: Motion, base: Base) -> float:
        """Return how fast the arm moves by itself: its swing, stiffened by load, and damping."""
        inertia, stiffness = self.arm_inertia_kg_m2, self.stiffness_nm_per_rad
        if self.cubic_stiffness_nm_per_rad3:
            fastest = float(np.nanmax(np.abs(motion.acceleration_rad_s2), initial=0.0))
            load = inertia * fastest + abs(base.gravity_sin_nm) + abs(base.gravity_cos_nm)
            # A spring that is let go swings to twice its load.
            stiffness += 3.0 * self.cubic_stiffness_nm_per_rad3 * (2.0 * load / stiffness) ** 2
        stiffness += self.hysteresis_nm / self.hysteresis_travel_rad
        damping = self.damping_nm_s_per_rad + self.film_damping_nm_s_per_rad
        return float(np.sqrt(stiffness / inertia) + damping / inertia)


def carried_parts_nm(
    flexible: Numbers | None, gap: Numbers | None, motion: Motion, base: Base
) -> dict[str, Floats]:
    """Return what spring and gap add to the torque of a stiff gear, by effect, each (n,).

    Parameters
    ----------
    flexible, gap : mapping of str to float, optional
        The numbers of `joint-flexibility` and `backlash`; None where the twin has none.
    motion, base
        As for every effect.

    Raises
    ------
    ValueError
        Both effects describe the arm, and not alike; or neither does.
    """
    if flexible is None and gap is None:
        return {}
    if _is_seen(flexible) or _is_seen(gap):
        if flexible is not None and gap is not None:
            raise ValueError(
                "joint-flexibility and backlash carry the same arm: where its encoder shows it,"
                " that is all of it; leave one of them out"
            )
        seen = {"joint-flexibility": flexible, "backlash": gap}
        return {name: _seen_nm(p, motion, base) for name, p in seen.items() if p is not None}
    if gap is None:
        return {"joint-flexibility": _loaded(flexible or {}, base).extra_nm(motion, base)}
    one = {name: value for name, value in gap.items() if name != _SPREAD}
    both = _loaded(_merged(flexible, one), base)
    spread = gap.get(_SPREAD, 0.0)
    widths = (1.0 - spread, 1.0, 1.0 + spread) if spread else (1.0,)
    loose = both.extra_nm(motion, base, widths)
    if flexible is None:
        return {"backlash": loose}
    spring = _loaded(flexible, base).extra_nm(motion, base)
    return {"joint-flexibility": spring, "backlash": loose - spring}


def _loaded(numbers: Numbers, base: Base) -> Carrier:
    """Return what carries the arm with its payload."""
    carrier = Carrier(**numbers)
    inertia = carrier.arm_inertia_kg_m2 + base.payload_inertia_kg_m2
    return replace(carrier, arm_inertia_kg_m2=inertia)


def _merged(flexible: Numbers | None, gap: Numbers) -> dict[str, float]:
    """Return one arm's numbers from two effects."""
    if flexible is None:
        if "arm_inertia_kg_m2" not in gap:
            raise ValueError(
                "backlash: expected arm_inertia_kg_m2 and stiffness_nm_per_rad of the arm behind"
                " the gap, or joint-flexibility beside it"
            )
        return dict(gap)
    for name in gap:
        # Damping has a default of zero, which says nothing against the spring's own.
        if name in flexible and gap[name] not in (flexible[name], _SILENT.get(name, 0.0)):
            raise ValueError(
                f"joint-flexibility and backlash carry the same arm: {name} is {flexible[name]:g}"
                f" and {gap[name]:g}; leave it out of backlash"
            )
    return {**gap, **flexible}


def _flexible_alone(p: Numbers, motion: Motion, base: Base) -> Floats:
    return carried_parts_nm(p, None, motion, base)["joint-flexibility"]


def _gap_alone(p: Numbers, motion: Motion, base: Base) -> Floats:
    return carried_parts_nm(None, p, motion, base)["backlash"]


def _is_seen(numbers: Numbers | None) -> bool:
    """Tell whether an entry's arm is followed by its own encoder, and not simulated."""
    return numbers is not None and _LATE in numbers


def _seen_nm(p: Numbers, motion: Motion, base: Base) -> Floats:
    """Return what the arm's motion, as its encoder has it, adds to a stiff gear's torque, (n,)."""
    inertia = p["arm_inertia_kg_m2"] + base.payload_inertia_kg_m2
    arm, motor = motion.need("position_arm_rad"), motion.need("position_rad")
    law = SeenArm(inertia, p[_LATE])
    return law.extra_nm(motion.need("time_s"), base.gear_ratio * arm, motor)


_GAP = {
    "half_gap_rad": not_negative(),
    _SPREAD: Parameter(
        0.0,
        lower=0.0,
        upper=1.0,
        meaning="share by which the gap is narrower and wider along its turn: the torque is the"
        " mean over three such gaps, as one path of an arm that bounces is no prediction",
    ),
    "film_damping_nm_s_per_rad": not_negative(
        0.0, "of what is between the teeth: it drags the arm along while they are apart"
    ),
    "parting_damping_share": Parameter(
        0.0,
        lower=0.0,
        upper=1.0,
        meaning="share of the contact's damping that holds the teeth back as they part; 1: a plain"
        " damper beside the spring, 0: teeth that only push",
    ),
}
_ARM_FRICTION = {
    "arm_coulomb_nm": not_negative(
        0.0, "Fa, the arm's part of the twin's Coulomb level; it drifts as that does"
    ),
    "arm_yield_rad": positive(
        _YIELD_RAD, meaning="how far it gives way, seen from the motor, before it slips"
    ),
    "arm_viscous_nm_s_per_rad": not_negative(0.0, "the arm's part of the twin's viscous friction"),
}

_SEEN = "arm that its own encoder shows"
_OF_A_SEEN_ARM = {"arm_inertia_kg_m2": positive(), _LATE: Parameter()}

CARDS = (
    EffectCard(
        "joint-flexibility",
        "The gear gives way like a spring, so that the arm rings after every change of speed.",
        (
            Form(
                "arm behind a spring",
                TwoMass.law,
                {
                    "arm_inertia_kg_m2": positive(),
                    "stiffness_nm_per_rad": positive(),
                    "damping_nm_s_per_rad": not_negative(0.0),
                    "cubic_stiffness_nm_per_rad3": not_negative(0.0),
                    "hysteresis_nm": not_negative(
                        0.0, "h, what its inner friction holds (0: a spring without loss)"
                    ),
                    "hysteresis_travel_rad": positive(
                        1.0, meaning="s, twist over which that is drawn out; h/s is its stiffness"
                    ),
                    **_ARM_FRICTION,
                },
                _flexible_alone,
                equation="tau_s - Ja a - gravity; Ja aa = tau_s - gravity,"
                " tau_s = k x + k3 x^3 + h z + d dx/dt, x = q - qa;"
                " dz/dx = (1 - z^2)/s away from z = 0, 1/s towards it",
            ),
            Form(
                _SEEN,
                SeenArm.law,
                {
                    "stiffness_nm_per_rad": positive(
                        meaning="k, by which the encoders come apart; no torque needs it"
                    ),
                    **_OF_A_SEEN_ARM,
                },
                _flexible_alone,
            ),
        ),
        ("frequency_hz", "acceleration_rad_s2", "after_reversal_s"),
        ("position_rad",),
    ),
    EffectCard(
        "backlash",
        "The gear has play: at a reversal the motor moves alone before it meets the arm again.",
        (
            Form(
                "gap before the arm",
                DeadZone.law,
                {
                    **_GAP,
                    "arm_inertia_kg_m2": positive(
                        meaning=TwoMass.law.parameters["arm_inertia_kg_m2"]
                    ),
                    "stiffness_nm_per_rad": positive(),
                    "damping_nm_s_per_rad": not_negative(0.0, "d, of the teeth in contact"),
                    **_ARM_FRICTION,
                },
                _gap_alone,
                equation="tau_s - Ja a - gravity; Ja aa = tau_s - gravity,"
                " tau_s = k D(x) + c dx/dt, x = q - qa, c of the film",
            ),
            Form(
                "gap in a flexible gear",
                DeadZone.law,
                _GAP,
                _gap_alone,
                equation="tau_s = k D(x) + k3 D(x)^3 in place of joint-flexibility's k x + k3 x^3",
            ),
            Form(
                _SEEN,
                SeenArm.law,
                {
                    "half_gap_rad": not_negative(
                        meaning="half of what the encoders come apart by; no torque needs it"
                    ),
                    **_OF_A_SEEN_ARM,
                },
                _gap_alone,
            ),
        ),
        ("after_reversal_s", "acceleration_rad_s2"),
        ("position_rad",),
    ),
)
"""Effects of the arm behind the gear."""
