"""Clearance, wind-up and encoder skew from the arm's own encoder.

The lead is motor angle less gear ratio times arm angle. It differs between the two directions by
the lost motion; what it has in proportion to velocity is the two encoders' skew in time. Gap and
wind-up part in the torque: with the measured lead as the gear's twist, the motor carries
``k D(lead)`` besides its own friction and inertia, where D is the dead zone (thesis 3.6). A gap
leaves the motor without load while the lead crosses it; a spring loads it from the start. From
there the arm is simulated (`arm_simulated`).
"""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats, Parameter
from agent.identify.reversals.arm_simulated import sharpened
from agent.identify.reversals.data import data_of
from agent.identify.reversals.laws import Range, ReversalLaw
from agent.identify.reversals.result import Clearance
from agent.identify.reversals.search import Solution, solve
from agent.identify.reversals.selection import not_better
from agent.identify.reversals.turns import Motion, Track, standing
from agent.identify.signals.lowpass import lowpass
from agent.identify.uncertainty import student_975
from agent.physics.backlash import dead_zone

_TAKEN_UP = 1.5  # times the lost motion: travel after a turn from which the arm surely follows
_PUSHING = 0.5  # of the usual torque
_RINGING = 0.4  # of a swing
_FOLLOWS = 0.75  # of the motor's velocity
_LEAST_TURNS = 4
_LEAST_SAMPLES = 5
_SLOW, _SLOW_HZ = 0.02, 20.0  # of the sampling rate: cutoff of the motor's motion beside the arm's
_ALIKE = 5  # samples: what is left over them on average is ringing rather than noise
_STIFF = 0.2  # of the lost motion: a wind-up that is smaller is not told well


@dataclass(frozen=True)
class _Lead:
    """Regression of the lead on direction and the arm's motion, jackknifed by reversal."""

    lost_motion: Parameter
    skew_s: Parameter
    middle_rad: dict[int, float]
    value: float
    skew: float


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
    if own.turns < _LEAST_TURNS:
        return None
    lead = _regress(own)
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


def _regress(motion: Motion) -> _Lead | None:
    """Regress the lead where the arm follows; the travel that this takes is found in two rounds."""
    lost = 0.0
    found: tuple[Floats, Floats, tuple[int, ...]] | None = None
    for _ in range(3):
        found = _round(motion, _TAKEN_UP * lost)
        if found is None:
            return None
        lost = 2.0 * abs(float(found[0][0]))
    weights, half, recordings = found if found is not None else (np.zeros(0), np.zeros(0), ())
    value, spread = 2.0 * float(weights[0]), 2.0 * float(half[0])
    if value <= spread:
        limit = max(value + spread, 0.0)
        parameter = Parameter.not_identified(
            f"not identified: lost motion is below {1e3 * limit:.2g} mrad of the motor, within "
            "the encoders' noise"
        )
    else:
        parameter = Parameter(value, (value - spread, value + spread))
    skew, late = float(weights[1]), float(half[1])
    return _Lead(
        parameter,
        Parameter(skew, (skew - late, skew + late)),
        {r: float(w) for r, w in zip(recordings, weights[3:], strict=True)},
        value,
        skew,
    )


def _round(motion: Motion, beyond_rad: float) -> tuple[Floats, Floats, tuple[int, ...]] | None:
    """Return weights, half intervals and the recordings of the constants, from settled samples."""
    recordings = tuple(sorted({t.recording for t in motion.tracks}))
    rows: list[Floats] = []
    beside: list[Floats] = []
    target: list[Floats] = []
    turn: list[NDArray[np.intp]] = []
    for track in motion.tracks:
        filtered = track.filtered(np.asarray(track.lead_rad))
        # The arm's own motion, not the motor's: an arm that still rings winds up its gear.
        arm = np.gradient(track.position_rad - filtered, track.period_s)
        load = np.gradient(arm, track.period_s)
        slow_hz = min(max(_SLOW / track.period_s, _SLOW_HZ), track.cutoff_hz)
        slow = lowpass(track.measured_rad, track.period_s, slow_hz)
        drives = np.gradient(slow, track.period_s)
        pushes = np.gradient(drives, track.period_s)
        # A soft gear lets the arm stick and slip: where it stands, its friction may be anything.
        # Judged by its slow motion: by chance, an encoder's noise follows, too.
        behind = lowpass(arm, track.period_s, slow_hz)
        follows = behind * np.sign(drives) > _FOLLOWS * np.abs(drives)
        for settled in _settled(track, beyond_rad):
            index = settled[follows[settled]]
            if index.size < _LEAST_SAMPLES:
                continue
            way = np.sign(track.velocity_rad_s[index])
            offset = np.tile([float(track.recording == r) for r in recordings], (index.size, 1))
            rows.append(np.column_stack((way, arm[index], load[index], offset)))
            beside.append(np.column_stack((way, drives[index], pushes[index], offset)))
            target.append(filtered[index])
            turn.append(np.full(index.size, len(turn)))
    if len(turn) < _LEAST_TURNS:
        return None
    columns, lead = np.concatenate(rows), np.concatenate(target)
    weights, half, beyond = _by_turn(columns, np.concatenate(beside), lead, np.concatenate(turn))
    # Ringing and the gear's own errors are alike at all reversals, which leaving one out does not
    # show: a weight may err by what is left of them.
    size = np.sqrt(np.mean(columns**2, axis=0))
    return weights, half + beyond / np.where(size > 0.0, size, 1.0), recordings


def _by_turn(
    columns: Floats, instruments: Floats, lead: Floats, turn: NDArray[np.intp]
) -> tuple[Floats, Floats, float]:
    """Return weights, half intervals with one reversal left out at a time, and what is left.

    The arm's encoder errs in the lead and, twice differentiated, in the arm's acceleration alike:
    least squares take that for a gear that gives, at the lost motion's cost. The motor's slow
    motion is an instrument that knows nothing of it (instrumental variables).
    """
    count = int(turn[-1]) + 1
    parts = [(instruments[turn == g], columns[turn == g], lead[turn == g]) for g in range(count)]
    gram = np.stack([z.T @ x for z, x, _ in parts])
    moment = np.stack([z.T @ y for z, _, y in parts])
    weights = _solved(gram.sum(axis=0), moment.sum(axis=0))
    without = np.stack(
        [
            _solved(gram.sum(axis=0) - g, moment.sum(axis=0) - m)
            for g, m in zip(gram, moment, strict=True)
        ]
    )
    spread = without - without.mean(axis=0)
    deviation = np.sqrt((count - 1.0) / count * np.sum(spread**2, axis=0))
    half = np.asarray(student_975(count - 1.0) * deviation)
    even = np.full(_ALIKE, 1.0 / _ALIKE)
    rest = np.concatenate([np.convolve(y - x @ weights, even, "valid") for _, x, y in parts])
    return weights, half, float(np.sqrt(np.mean(rest**2)))


def _solved(gram: Floats, moment: Floats) -> Floats:
    """Return ``gram^-1 moment``; columns may depend on each other or be zero."""
    size = np.sqrt(np.abs(np.diag(gram)))
    size = np.where(size > 0.0, size, 1.0)
    inverse = np.linalg.pinv(gram / np.outer(size, size), rcond=1e-12)
    return np.asarray(inverse @ (moment / size) / size)


def _settled(track: Track, beyond_rad: float) -> list[NDArray[np.intp]]:
    """Return for every turn the samples after it in which the motor drives the arm."""
    # A motor that hardly pushes any more may be pushed by its arm, from the other flank.
    push = track.filtered(track.torque_nm) * np.sign(track.velocity_rad_s)
    moving = ~standing(track)
    usable = moving & (push > _PUSHING * float(np.median(np.abs(push[moving]))))
    out = []
    ends = [*(turn.at for turn in track.turns[1:]), track.time_s.size]
    for turn, end in zip(track.turns, ends, strict=True):
        index = np.arange(turn.at, end)
        away = np.abs(track.position_rad[index] - track.position_rad[turn.at])
        # The first part of a swing still rings from the arm's being caught up.
        least = max(beyond_rad, _RINGING * float(away.max()), track.resolution_rad)
        index = index[usable[index] & (away > least)]
        if index.size >= _LEAST_SAMPLES:
            out.append(index)
    return out


def _columns(track: Track, gap_rad: float) -> Floats:
    """Return the motor's dry friction, the gear's twist and, where it bears, the twist's rate."""
    assert track.lead_rad is not None
    twist = dead_zone(track.lead_rad, 0.5 * gap_rad)
    rate = np.gradient(track.filtered(track.lead_rad), track.period_s)
    return np.stack((np.sign(track.velocity_rad_s), twist, rate * (twist != 0.0)), axis=-1)


def _gap_or_spring(
    motion: Motion, range_: Range, lead: _Lead, viscous_nm_s_per_rad: float
) -> tuple[Clearance, tuple[float, float]]:
    """Fit the motor's torque with the measured lead as the gear's twist, with and without a gap.

    The twist is measured at every sample: no law's memory of where the motor turned is in it.
    Beside the clearance, the inertia and viscous friction of the motor and all that it carries.
    """
    tracks = tuple(
        replace(
            track,
            lead_rad=_in_time(track, lead.skew) - lead.middle_rad[track.recording],
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


def _in_time(track: Track, skew_s: float) -> Floats:
    """Return the lead with the arm's angle moved to the motor's time, shape (n,).

    Not the lead less skew times velocity: while the motor crosses the gap its arm stands.
    """
    assert track.lead_rad is not None
    arm = track.position_rad - track.lead_rad
    at_once = np.interp(track.time_s + skew_s, track.time_s, arm)
    return np.asarray(track.lead_rad + arm - at_once, dtype=np.float64)


def _width(parted: Solution, lead: _Lead, refusal: str) -> Parameter:
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


def _compliance(found: Solution, lead: _Lead, gap: Parameter) -> Parameter:
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
