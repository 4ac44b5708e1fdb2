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
from agent.physics.derivative import slope_over
from agent.physics.effects.card import (
    EffectCard,
    Floats,
    Form,
    Numbers,
    Parameter,
    not_negative,
    positive,
)
from agent.physics.effects.motion import Base, Motion
from agent.physics.flexibility import TwoMass
from agent.physics.gaps import between, bridge

_STEPS_PER_RAD = 10.0  # of the arm's own swing: the error of its steps is then below 0.1 %
_FEWEST = 3  # samples that have a slope and something left
_NOISE_SAMPLES = 200  # that the noise is read from
_AS_NOISE = 1.5  # times the noise: more is motion
_FORGOTTEN = 5.0  # time constants of a swing that dies away
_LEAST_MEMORY_S, _MOST_MEMORY_S = 1.0, 10.0
_YIELD_RAD = 0.01
_SPREAD = "half_gap_spread"
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
        known, out = _known(time, velocity), np.full_like(velocity, np.nan)
        stiffness, level = np.array([1.0 / self.arm_yield_rad]), np.ones(1)
        start = float(motion.direction[known][0])
        out[known] = slipping(time[known].copy(), velocity[known].copy(), stiffness, level, start)
        return out

    def shaft_nm(self, motion: Motion, base: Base, widths: Sequence[float] = (1.0,)) -> Floats:
        """Return the torque with which the motor carries the arm, shape (n,), simulated.

        See `extra_nm`.
        """
        from agent.physics.kernels import carried_arm

        law = TwoMass(
            1.0,
            self.arm_inertia_kg_m2,
            self.stiffness_nm_per_rad,
            self.damping_nm_s_per_rad,
            self.cubic_stiffness_nm_per_rad3,
        )
        gaps = [DeadZone(width * self.half_gap_rad, law.stiffness_nm_per_rad) for width in widths]
        time, position, velocity, own = self._in_a_row(motion)
        known = _known(motion.need("time_s"), motion.need("position_rad"), motion.velocity_rad_s)
        longest_s = float(np.max(np.diff(time), initial=0.0))
        steps = math.ceil(_STEPS_PER_RAD * self._rate_per_s(motion, base) * longest_s)
        angle, speed = self._driven(
            time, position, velocity, by_velocity=motion.velocity_raw_rad_s is not None
        )
        start = self._start(time, speed)
        worn = base.worn_share(motion)[known]
        before = np.full(time.shape[0] - worn.shape[0], worn[0])
        friction_nm = self.arm_coulomb_nm * np.concatenate((before, worn))
        each = [
            carried_arm(
                time,
                angle,
                speed,
                law.arm_inertia_kg_m2,
                law.stiffness_nm_per_rad,
                law.cubic_stiffness_nm_per_rad3,
                law.damping_nm_s_per_rad,
                gap.half_gap_rad,
                base.gravity_sin_nm,
                base.gravity_cos_nm,
                base.gear_ratio,
                steps,
                *start,
                friction_nm,
                self.arm_yield_rad,
                self.film_damping_nm_s_per_rad,
                self.arm_viscous_nm_s_per_rad,
            )[own]
            for gap in gaps
        ]
        shaft = np.full_like(motion.velocity_rad_s, np.nan)
        shaft[known] = np.mean(each, axis=0)
        return shaft

    def _in_a_row(self, motion: Motion) -> tuple[Floats, Floats, Floats, slice]:
        """Return time, angle and speed of the motor, (m,), and where those of the motion stand.

        Stretches before it that the arm remembers stand before it, with the samples that were lost.
        """
        remembers_s = (
            2.0 * _FORGOTTEN * self.arm_inertia_kg_m2 / max(self.damping_nm_s_per_rad, 1e-300)
        )
        parts = motion.in_a_row(min(max(remembers_s, _LEAST_MEMORY_S), _MOST_MEMORY_S))
        joined: tuple[Floats, ...] = ()
        for part in parts:
            here = part if part is motion else part.unfiltered
            columns = here.need("time_s"), here.need("position_rad"), here.velocity_rad_s
            known = _known(*columns)
            stretch = tuple(column[known] for column in columns)
            joined = _bridged(joined, stretch) if joined else stretch
        # Copies: a loop is compiled anew for every mixture of writeable and read-only columns.
        time, position, velocity = (column.copy() for column in joined)
        return time, position, velocity, slice(time.shape[0] - stretch[0].shape[0], time.shape[0])

    def _driven(
        self,
        time_s: Floats,
        position_rad: Floats,
        velocity_rad_s: Floats,
        *,
        by_velocity: bool,
    ) -> tuple[Floats, Floats]:
        """Return the motor's angle and speed that drive the spring, each shape (n,).

        The angle is the quieter of two, and the speed is that angle's own: a damper between two
        channels that disagree would make torque of their difference. Where what is compared takes
        its acceleration from the unfiltered velocity, the arm is driven by that as well.

        A position of coarse steps, or one that is not quite in step with the velocity, would shake
        a stiff spring; a noisy velocity, summed up, would let a soft one wander. White noise of the
        velocity adds up for as long as the spring takes to answer.
        """
        steps = np.diff(time_s)
        answer_s = math.sqrt(self.arm_inertia_kg_m2 / self.stiffness_nm_per_rad)
        wander = _white(velocity_rad_s) * math.sqrt(float(np.mean(steps)) * answer_s)
        if not by_velocity and wander > _white(position_rad):
            return position_rad.copy(), slope_over(time_s, position_rad)
        # The end slopes correct the trapezoids (Euler and Maclaurin): angle and speed would differ
        # by (w T)^2 / 12 else, which a stiff damper turns into a lag.
        turn = np.diff(slope_over(time_s, velocity_rad_s)) * steps**2 / 12.0
        way = 0.5 * (velocity_rad_s[1:] + velocity_rad_s[:-1]) * steps - turn
        summed = position_rad[0] + np.concatenate(([0.0], np.cumsum(way)))
        return summed, velocity_rad_s.copy()

    def _start(self, time_s: Floats, velocity_rad_s: Floats) -> tuple[float, float]:
        """Return acceleration and velocity that the arm starts with.

        One noisy sample would make a soft arm ring for long: a straight line is laid through up to
        half a swing, as far as it departs from the samples by no more than their noise.
        """
        half_swing_s = np.pi * np.sqrt(self.arm_inertia_kg_m2 / self.stiffness_nm_per_rad)
        count = int(np.searchsorted(time_s, time_s[0] + half_swing_s, side="right"))
        count = min(max(count, _FEWEST), time_s.shape[0])
        if count < _FEWEST:
            return 0.0, float(velocity_rad_s[0])
        curvature = np.abs(np.diff(velocity_rad_s[:_NOISE_SAMPLES], n=2))
        noise_rad_s = float(np.median(curvature)) / (0.6745 * np.sqrt(6.0))
        while True:
            since, speed = time_s[:count] - time_s[0], velocity_rad_s[:count]
            away = since - np.mean(since)
            slope = float(away @ speed / (away @ away))
            first = float(np.mean(speed) - slope * np.mean(since))
            left = float(np.std(speed - slope * away))
            if count == _FEWEST or left <= _AS_NOISE * noise_rad_s:
                return slope, first
            count = max(_FEWEST, 2 * count // 3)

    def _rate_per_s(self, motion: Motion, base: Base) -> float:
        """Return how fast the arm moves by itself: its swing, stiffened by load, and damping."""
        inertia, stiffness = self.arm_inertia_kg_m2, self.stiffness_nm_per_rad
        if self.cubic_stiffness_nm_per_rad3:
            fastest = float(np.nanmax(np.abs(motion.acceleration_rad_s2), initial=0.0))
            load = inertia * fastest + abs(base.gravity_sin_nm) + abs(base.gravity_cos_nm)
            # A spring that is let go swings to twice its load.
            stiffness += 3.0 * self.cubic_stiffness_nm_per_rad3 * (2.0 * load / stiffness) ** 2
        damping = self.damping_nm_s_per_rad + self.film_damping_nm_s_per_rad
        return float(np.sqrt(stiffness / inertia) + damping / inertia)


def shaken_nm(
    time_s: Floats,
    angle_rad: Floats,
    velocity_rad_s: Floats,
    acceleration_rad_s2: Floats,
    inertia_kg_m2: float,
    swing_rad_s: float,
    damping_ratio: float,
) -> Floats:
    """Return what a spring bears of an arm that its other end shakes, shape (n,), N m.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
    angle_rad, velocity_rad_s, acceleration_rad_s2 : ndarray, shape (n,)
        Of that other end; the arm follows it stiffly at first.
    inertia_kg_m2 : float
        Of the arm.
    swing_rad_s, damping_ratio : float
        Of the arm on its spring while that end is held.
    """
    from agent.physics.kernels import carried_arm

    out = np.full_like(time_s, np.nan)
    known = _known(time_s, angle_rad, velocity_rad_s)
    longest_s = float(np.max(np.diff(time_s[known]), initial=0.0))
    rate_per_s = swing_rad_s * (1.0 + 2.0 * damping_ratio)
    out[known] = carried_arm(
        time_s[known].copy(),
        angle_rad[known].copy(),
        velocity_rad_s[known].copy(),
        inertia_kg_m2,
        inertia_kg_m2 * swing_rad_s**2,
        0.0,
        2.0 * damping_ratio * swing_rad_s * inertia_kg_m2,
        0.0,
        0.0,
        0.0,
        1.0,
        math.ceil(_STEPS_PER_RAD * rate_per_s * longest_s),
        float(acceleration_rad_s2[known][0]),
        float(velocity_rad_s[known][0]),
        np.zeros(known.stop - known.start),
        _YIELD_RAD,
        0.0,
        0.0,
    )
    return out


def _bridged(before: Sequence[Floats], after: Sequence[Floats]) -> tuple[Floats, ...]:
    """Return time, angle and speed of two stretches, with the samples that were lost in between."""
    (time, position, velocity), (time_after, position_after, velocity_after) = before, after
    period_s = float(np.mean(np.diff(time_after))) if time_after.shape[0] > 1 else np.inf
    gap_s = time_after[:1] - time[-1:]
    share = between(max(round(float(gap_s[0]) / period_s) - 1, 0))
    went = position_after[:1] - position[-1:]
    speeds = bridge(velocity[-1:], velocity_after[:1], went, gap_s, share)
    ends = np.concatenate((velocity[-1:], speeds, velocity_after[:1]))
    way = np.cumsum(0.5 * (ends[1:] + ends[:-1])) * gap_s / (share.shape[0] + 1)
    return (
        np.concatenate((time, time[-1] + share * gap_s, time_after)),
        np.concatenate((position, position[-1] + way[:-1], position_after)),
        np.concatenate((velocity, speeds, velocity_after)),
    )


def _known(time_s: Floats, *columns: Floats) -> slice:
    """Return the samples that are known, or refuse motion with a hole in it."""
    finite = np.flatnonzero(np.isfinite(time_s) & np.isfinite(columns).all(axis=0))
    if not finite.size or finite.size != finite[-1] - finite[0] + 1:
        raise ValueError("expected time_s, position_rad and velocity_rad_s without a hole")
    known = slice(int(finite[0]), int(finite[-1]) + 1)
    if np.any(np.diff(time_s[known]) <= 0.0):
        raise ValueError("time_s: expected strictly increasing samples")
    return known


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


def _white(values: Floats) -> float:
    """Return the standard deviation of a channel's white noise, from third differences."""
    if values.shape[0] < 4:
        return 0.0
    return float(np.sqrt(np.mean(np.diff(values, n=3) ** 2) / 20.0))


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
                    **_ARM_FRICTION,
                },
                _flexible_alone,
                equation="tau_s - Ja a - gravity; Ja aa = tau_s - gravity,"
                " tau_s = k x + k3 x^3 + d dx/dt, x = q - qa",
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
                    "damping_nm_s_per_rad": not_negative(
                        0.0, "d, of the teeth in contact; they push, and do not pull"
                    ),
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
        ),
        ("after_reversal_s", "acceleration_rad_s2"),
        ("position_rad",),
    ),
)
"""Effects of the arm behind the gear."""
