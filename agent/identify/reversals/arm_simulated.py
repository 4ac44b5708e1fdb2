"""Clearance by simulating the arm, where that explains torque and both encoders to their noise.

What the regressions of `arm` say is where the fit starts and the bounds that it has to keep: a
gear which is not like the simulated one leaves more than noise, or ends elsewhere, and then their
wide intervals stay.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.identify.reversals.arm_record import ArmRecord, record_of
from agent.identify.reversals.arm_simulation import MOTOR, TWICE, Numbers
from agent.identify.reversals.result import Clearance
from agent.identify.reversals.turns import Motion

if TYPE_CHECKING:
    from agent.identify.reversals.arm_fit import ArmFit

_MISFIT = 1.02  # of the noise's mean square: more, and the gear is not like the simulated one
_NEARLY = 1.10  # of it: up to here the simulated arm's values are nearer than the regressions'
_CHANCE = 3.0  # standard errors of that
_DOUBT = 1.64  # standard errors of that: one gear in twenty leaves more by chance
_ALIKE = 2.0  # standard errors: what is left at one reversal knows of what is left at another
_COARSE = 0.8  # of the torque balance's noise: steps twice as strong as the torque's own draw it
_FAR = 3.0  # times the regressions' half interval: further off, one of both is wrong
_MOST = 60_000  # samples: five seconds of a processor for 18 000
_LATE = 50.0  # samples
_LOOSE = 0.5  # of the value
_SHARE = 0.4  # of the joint's inertia, the arm's at first
_DAMPED = 0.15  # of critical, at first


def sharpened(
    motion: Motion,
    known: Clearance,
    joint: tuple[float, float],
    middle_rad: Mapping[int, float],
) -> Clearance:
    """Return the clearance of a simulated arm, or the known one where that does not hold.

    Parameters
    ----------
    motion : Motion
        Tracks with the arm's angle.
    known : Clearance
        From the regressions.
    joint : tuple of float
        The whole joint's inertia in kg m^2 and viscous friction in N m s/rad.
    middle_rad : mapping of int to float
        For every recording the motor's lead over the arm, in the middle of the lost motion.
    """
    from agent.identify.reversals.arm_fit import fit_arm

    records, places = _records(motion, middle_rad)
    if not known.lost_motion_rad.identified:
        return known
    if not records or joint[0] <= 0.0:
        return _alone(known)
    start = _start(records, places, known, joint)
    if abs(float(start.x[5])) > _LATE * min(record.period_s for record in records):
        return _alone(known)
    gap = known.backlash_rad.identified
    found = fit_arm(records, start, gap=gap)
    if found is None:
        return _alone(known)
    chance, steps = math.sqrt(2.0 / found.readings), _of_steps(records, found.at)
    # A gear that is a little unlike this one errs by what neither noise nor reversals tell.
    unlike = found.likeness > _ALIKE or found.misfit > 1.0 + _DOUBT * chance
    sharp = _clearance(found, known, 1.0 + steps if unlike or steps > _COARSE else 1.0)
    limit = _MISFIT + _CHANCE * chance
    holds = found.misfit <= limit and _agrees(sharp, known)
    return sharp if holds else _both(sharp, known, by_arm=found.misfit <= _NEARLY)


def _records(
    motion: Motion, middle_rad: Mapping[int, float]
) -> tuple[list[ArmRecord], list[float]]:
    """Return the first tracks, as many as can be simulated in seconds, and their middles."""
    out: list[ArmRecord] = []
    places: list[float] = []
    turns = 0
    for track in motion.tracks:
        record = record_of(track, turns)
        if record is None or track.recording not in middle_rad:
            continue
        if sum(r.size for r in out) + record.size > _MOST:
            break
        out.append(record)
        places.append(middle_rad[track.recording])
        turns += len(track.turns)
    return out, places


def _start(
    records: list[ArmRecord], places: list[float], known: Clearance, joint: tuple[float, float]
) -> Numbers:
    """Return numbers near the regressions' own; arm and motor share what those do not tell."""
    inertia, viscous = joint
    gap = known.backlash_rad.value if known.backlash_rad.identified else 0.0
    wind_up = max(known.lost_motion_rad.value - gap, 0.01 * known.lost_motion_rad.value)
    pushed = float(np.median([np.median(np.abs(r.torque_nm[r.slides])) for r in records]))
    if known.compliance_rad_per_nm.identified:
        stiffness = 1.0 / known.compliance_rad_per_nm.value
        arm = 0.5 * wind_up * stiffness
    else:
        arm = 0.5 * pushed
        stiffness = 2.0 * arm / wind_up
    share = _SHARE * inertia
    damping = 2.0 * _DAMPED * math.sqrt(stiffness * share)
    skew = known.encoder_skew_s.value
    x = [gap, *np.log([stiffness, damping, share, arm]).tolist(), skew, 0.0, 0.0]
    w = [inertia - share, max(pushed - arm, 0.1 * pushed), viscous]
    return Numbers(np.array([*x, *places]), np.array([*w, *np.zeros(len(records))]))


def _of_steps(records: list[ArmRecord], at: Numbers) -> float:
    """Return the encoder's share of the noise that the motor's torque balance has, 0 to 1.

    At a steady speed an encoder passes its steps at a steady rate, and their error is a row of
    lines: between them it is a third of what even noise would be, in the turns it is all of it. An
    inertia that is put right for even noise comes out 1 to 3 % too large, and draws the gap. That
    is nothing where the torque's own noise outweighs what the steps become as torque.
    """
    inertia, stencil = float(at.w[MOTOR.index("inertia")]), float(np.linalg.norm(TWICE))
    shaken = [inertia * stencil * r.motor_error_rad / r.period_s**2 for r in records]
    return max(s**2 / (s**2 + r.torque_error_nm**2) for s, r in zip(shaken, records, strict=True))


def _clearance(found: ArmFit, known: Clearance, wider: float) -> Clearance:
    """Return what the fit says, with intervals so many times as wide as its scatter."""
    x = found.at.x
    gap, stiffness, arm = float(x[0]), math.exp(float(x[1])), math.exp(float(x[4]))
    wind_up = 2.0 * arm / stiffness
    lost, compliance = _unit(found, 0), _unit(found, 1)
    lost += wind_up * (_unit(found, 4) - _unit(found, 1))

    def parameter(value: float, gradient: Floats) -> Parameter:
        half = wider * found.half_width(gradient) * math.sqrt(max(found.misfit, 1.0))
        return Parameter(value, (value - half, value + half))

    return Clearance(
        "arm-encoder",
        parameter(gap, _unit(found, 0)) if 0 in found.free else known.backlash_rad,
        parameter(gap + wind_up, lost),
        parameter(1.0 / stiffness, -compliance / stiffness),
        parameter(float(x[5]), _unit(found, 5)),
    )


def _unit(found: ArmFit, place: int) -> Floats:
    out = np.zeros(found.at.x.size + found.at.w.size)
    out[place] = 1.0
    return out


def _agrees(sharp: Clearance, known: Clearance) -> bool:
    """Tell whether every value is near the regressions' own, and is told to some purpose."""
    before = known.named()
    for name, parameter in sharp.named().items():
        if parameter.ci95 is None:
            continue
        low, high = parameter.ci95
        # Lateness may be none at all; the others are lengths, and a length is told or it is not.
        if name != "encoder_skew_s" and not high - low < 2.0 * _LOOSE * parameter.value:
            return False
        wide = before[name].ci95
        if wide is not None:
            middle, half = 0.5 * (wide[0] + wide[1]), 0.5 * (wide[1] - wide[0])
            if abs(parameter.value - middle) > _FAR * half:
                return False
    return True


def _alone(known: Clearance) -> Clearance:
    """Return the regressions' values where no simulated arm stands beside them.

    Gap and compliance come from the torque, with the lead as measured, and bend with what the
    encoders' noise does to it: by up to 2.3 half intervals. They reach as far as a simulated arm
    would have been believed.
    """
    return replace(
        known,
        backlash_rad=_wider(known.backlash_rad),
        compliance_rad_per_nm=_wider(known.compliance_rad_per_nm),
    )


def _wider(known: Parameter) -> Parameter:
    if known.ci95 is None:
        return known
    low, high = known.ci95
    least, most = (
        known.value - _FAR * (known.value - low),
        known.value + _FAR * (high - known.value),
    )
    return replace(known, ci95=(max(least, 0.0), most))


def _both(sharp: Clearance, known: Clearance, *, by_arm: bool) -> Clearance:
    """Return the regressions' values with intervals that reach to the simulated arm's, too.

    Neither is right about such a gear, and how far they differ is the least that both may err by.
    Where hardly more than noise is left the arm's are the nearer ones, and stand in the interval.
    """
    other = sharp.named()
    return Clearance(
        known.source,
        **{name: _reaching(p, other[name], by_arm) for name, p in known.named().items()},
    )


def _reaching(known: Parameter, other: Parameter, by_arm: bool) -> Parameter:
    """Return a parameter with an interval that is as wide as its distance from another."""
    if known.ci95 is None or not other.identified:
        return known
    low, high = known.ci95
    reach = abs(other.value - known.value)
    down = min(reach, known.value) if known.value > 0.0 else reach
    value = other.value if by_arm else known.value
    return Parameter(value, (min(low, known.value - down), max(high, known.value + reach)))
