"""Clearance, wind-up and encoder skew from the arm's own encoder.

The lead (`arm_lead`) gives the lost motion and the skew. Gap and wind-up part in the torque: with
the measured lead as the gear's twist, the motor carries ``k D(lead)`` besides its own friction and
inertia, where D is the dead zone (thesis 3.6). A gap leaves the motor without load while the lead
crosses it; a spring loads it from the start. From there the arm is simulated (`arm_simulated`).
"""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np

from agent.identify.result import Floats, Parameter
from agent.identify.reversals.arm_lead import LEAST_TURNS, Lead, in_time, lead_of
from agent.identify.reversals.arm_simulated import sharpened
from agent.identify.reversals.data import data_of
from agent.identify.reversals.laws import Range, ReversalLaw
from agent.identify.reversals.result import Clearance
from agent.identify.reversals.search import Solution, solve
from agent.identify.reversals.selection import not_better
from agent.identify.reversals.turns import Motion, Track
from agent.physics.backlash import dead_zone

_STIFF = 0.2  # of the lost motion: a wind-up that is smaller is not told well


def arm_clearance(motion: Motion, range_: Range, viscous_nm_s_per_rad: float) -> Clearance | None:
    """Return clearance, wind-up and skew, or None where too few reversals have the arm's angle.

    Parameters
    ----------
    motion : Motion
        All tracks.
    range_ : Range
        What the recordings can tell apart.
    viscous_nm_s_per_rad : float
        Of the whole joint: what of the skew's slope could be viscous wind-up.
    """
    tracks = tuple(t for t in motion.tracks if _usable(t))
    own = replace(motion, tracks=tracks)
    if own.turns < LEAST_TURNS:
        return None
    lead = lead_of(own)
    if lead is None:
        return _unknown(
            "not identified: no reversal goes on for longer than the gear's lost motion; record "
            "reversals of a larger amplitude"
        )
    if not lead.lost_motion.identified:
        return replace(_unknown(lead.lost_motion.reason), encoder_skew_s=lead.skew_s)
    clearance, joint = _gap_or_spring(own, range_, lead, viscous_nm_s_per_rad)
    return sharpened(own, clearance, joint, lead.middle_rad)


def _usable(track: Track) -> bool:
    return track.lead_rad is not None and bool(np.isfinite(track.lead_rad).all())


def _unknown(reason: str) -> Clearance:
    unknown = Parameter.not_identified(reason)
    return Clearance("arm-encoder", unknown, unknown, unknown, unknown)


def _columns(track: Track, gap_rad: float) -> Floats:
    """Return the motor's dry friction, the gear's twist and, where it bears, the twist's rate."""
    assert track.lead_rad is not None
    twist = dead_zone(track.lead_rad, 0.5 * gap_rad)
    rate = np.gradient(track.filtered(track.lead_rad), track.period_s)
    return np.stack((np.sign(track.velocity_rad_s), twist, rate * (twist != 0.0)), axis=-1)


def _gap_or_spring(
    motion: Motion, range_: Range, lead: Lead, viscous_nm_s_per_rad: float
) -> tuple[Clearance, tuple[float, float]]:
    """Fit the motor's torque with the measured lead as the gear's twist, with and without a gap.

    The twist is measured at every sample: no law's memory of where the motor turned is in it.
    Beside the clearance, the inertia and viscous friction of the motor and all that it carries.
    """
    tracks = tuple(
        replace(
            track,
            lead_rad=in_time(track, lead.skew) - lead.middle_rad[track.recording],
            place_error_rad=0.0,
        )
        for track in motion.tracks
    )
    centred = replace(motion, tracks=tracks)
    data = data_of(centred)
    levels = ("motor_coulomb_nm", "stiffness_nm_per_rad", "gear_damping_nm_s_per_rad")
    spring = ReversalLaw(
        "spring", (), levels, lambda t, _: _columns(t, 0.0), lambda _: np.zeros((0, 2))
    )
    gap = ReversalLaw(
        "gap",
        ("backlash_rad",),
        levels,
        lambda t, shape: _columns(t, float(shape[0])),
        lambda _: np.array([[0.05 * lead.value, 0.999 * lead.value]]),
        grid=(16,),
        step=1e-2,
    )
    plain, parted = solve(spring, data, range_), solve(gap, data, range_)
    refusal = not_better(plain, parted, data)
    found, width = plain if refusal else parted, _width(parted, lead, refusal)
    clearance = Clearance(
        "arm-encoder",
        width,
        lead.lost_motion,
        _compliance(found, lead, width),
        _widened(lead.skew_s, viscous_nm_s_per_rad, found),
    )
    joint = plain.value("inertia_kg_m2"), plain.value("viscous_nm_s_per_rad")
    return clearance, joint


def _width(parted: Solution, lead: Lead, refusal: str) -> Parameter:
    """Return the gap, or that the lost motion is the gear's wind-up."""
    if refusal:
        return Parameter.not_identified(
            "not identified: the gear's torque grows with the lost motion from the start, as a "
            "spring's does; any gap is too small beside it"
        )
    value = parted.value("backlash_rad")
    gradient = np.zeros(parted.shifts.shape[1])
    gradient[0] = 1.0
    half = value * parted.half_width(gradient)
    if lead.lost_motion.ci95 is not None:
        # Where the lead's middle is not known better, the gap is not, either.
        half = math.hypot(half, 0.5 * (lead.lost_motion.ci95[1] - lead.lost_motion.ci95[0]))
    low, high = lead.lost_motion.ci95 if lead.lost_motion.ci95 is not None else (value, value)
    if bool(parted.at_bound.any()) or lead.value - value <= half:
        # No wind-up beside the gap can be seen: then the gap is the lost motion.
        return Parameter(lead.value, (max(min(low, value - half), 0.0), high))
    if value > (1.0 - _STIFF) * lead.value:
        # A stiff spring's flank is steeper than these samples: it comes out too soft, the gap too
        # small, and all of the lost motion may be gap.
        return Parameter(value, (max(value - half, 0.0), high))
    return Parameter(value, (max(value - half, 0.0), min(value + half, high)))


def _compliance(found: Solution, lead: Lead, gap: Parameter) -> Parameter:
    """Return the gear's compliance, rad of motor per N m of motor.

    Beside a gap the spring is known as well as what the gap leaves of the lost motion.
    """
    stiffness = found.value("stiffness_nm_per_rad")
    half = found.upper("stiffness_nm_per_rad") - stiffness
    if stiffness <= half:
        return Parameter.not_identified("not identified: the lead does not load the motor")
    value, low, high = 1.0 / stiffness, 1.0 / (stiffness + half), 1.0 / (stiffness - half)
    if gap.ci95 is not None:
        wind_up = lead.value - gap.value
        least, most = lead.value - gap.ci95[1], lead.value - gap.ci95[0]
        if least < 0.5 * wind_up:
            return Parameter.not_identified(
                "not identified: the wind-up is too small beside the gap; record reversals with a "
                "load"
            )
        low, high = low * least / wind_up, high * most / wind_up
    return Parameter(value, (low, high))


def _widened(skew_s: Parameter, viscous: float, found: Solution) -> Parameter:
    """Return the skew; viscous friction behind the gear's spring looks like some of it."""
    stiffness = found.value("stiffness_nm_per_rad")
    if skew_s.ci95 is None or stiffness <= 0.0:
        return skew_s
    low, high = skew_s.ci95
    return Parameter(skew_s.value, (low - max(viscous, 0.0) / stiffness, high))
