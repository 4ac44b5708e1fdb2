"""From recordings with reversals to presliding and clearance, or to why they are not there."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from agent.identify.diagnosis import no_joint_records
from agent.identify.result import Parameter
from agent.identify.reversals.arm import arm_clearance
from agent.identify.reversals.data import Data, columns_of, data_of
from agent.identify.reversals.laws import LAWS, Range, range_of
from agent.identify.reversals.parameters import parameters_of
from agent.identify.reversals.result import (
    LEFT_OUT,
    Clearance,
    PreslidingFit,
    ReversalFit,
    Trace,
    nothing,
)
from agent.identify.reversals.search import Solution, solve
from agent.identify.reversals.selection import not_better, objection, select
from agent.identify.reversals.sentence import judged, undecided, verdict
from agent.identify.reversals.turns import Motion, read_tracks
from agent.identify.signals.arrays import Signals
from agent.identify.signals.saturation import is_limited

_NO_POSITION = (
    "not identified: position was not recorded. Friction around a reversal follows the travel "
    "since the turn; from a velocity alone its noise is taken for inertia and for damping, and "
    "another law is named; record position_rad, at 500 Hz or faster"
)
_LEAST_REVERSALS = 4
_LEAST_SAMPLES = 8  # between four fifths of the speed before a turn and after it
_SLOW_HZ = 20.0  # slower, what looks like noise may be motion
_SILENT = 1.5  # times the torque's noise
_TRACES = 12
_SOFT = 0.5  # of the arm's own friction: decelerated harder, the arm does not stand in the gap


def identify_reversals(recordings: Sequence[Signals]) -> ReversalFit:
    """Identify presliding and clearance from the reversals of one axis's recordings.

    Parameters
    ----------
    recordings : sequence of Signals
        All of one axis; `position_arm_rad` is used where it was recorded. Those without a position
        are left out, and it is said.

    Raises
    ------
    ValueError
        Without recordings, or with different gear ratios.
    """
    if not recordings:
        raise ValueError("expected at least one recording, got none")
    if len({s.gear_ratio for s in recordings}) > 1:
        raise ValueError("expected recordings of one axis, got different gear ratios")
    names = tuple(s.name for s in recordings)
    placed = [signals for signals in recordings if signals.position_rad is not None]
    motion = read_tracks(placed)
    data = data_of(motion) if motion.turns else None
    reason = _why_not(motion) if placed else _NO_POSITION
    if data is not None and not reason:
        impossible = no_joint_records(placed)
        reason = f"not identified: {impossible}" if impossible else _no_friction(placed, data)
    if reason or data is None:
        return ReversalFit(
            names, False, (reason,), motion.turns, math.nan, (), nothing(reason), undecided(reason)
        )
    range_ = range_of(motion)
    solutions = {name: solve(law, data, range_) for name, law in LAWS.items()}
    presliding = [s for s in solutions.values() if s.law.presliding]
    chosen, reasons = select(presliding, data, range_)
    rivals = [s for s in solutions.values() if not s.law.presliding]
    winner, more = _rivals(chosen, rivals, data, range_)
    fits = tuple(
        PreslidingFit(
            name,
            s is winner,
            {**reasons, **more}[name],
            parameters_of(s, range_),
            s.rmse_nm,
            s.heldout_rmse_nm,
        )
        for name, s in solutions.items()
    )
    clearance = _clearance(motion, range_, fits, chosen, winner, solutions["backlash"])
    notes = _notes(winner, clearance)
    unplaced = [signals.name for signals in recordings if signals.position_rad is None]
    if unplaced:
        notes += (f"{LEFT_OUT} position_rad was not recorded: {', '.join(unplaced)}",)
    found = ReversalFit(
        names,
        True,
        (),
        motion.turns,
        range_.finest_rad,
        fits,
        clearance,
        verdict(
            next(f for f in fits if f.selected),
            clearance,
            range_.finest_rad,
            _left(winner, solutions["coulomb"], data.noise_nm),
        ),
        notes,
        _traces(winner, data),
    )
    return judged(found, data.noise_nm)


def _left(winner: Solution, plain: Solution, noise_nm: float) -> float:
    """Return which share of what plain Coulomb friction leaves above the noise is still left."""
    before = plain.rmse_nm**2 - noise_nm**2
    return max(winner.rmse_nm**2 - noise_nm**2, 0.0) / before if before > 0.0 else 0.0


def _why_not(motion: Motion) -> str:
    """Return why the recordings carry no reversal to learn from; empty where they do."""
    if not motion.tracks and motion.rate_hz < _SLOW_HZ:
        return (
            f"not identified: at {motion.rate_hz:.3g} Hz motion cannot be told from noise; record "
            "at 100 Hz or faster"
        )
    if not motion.tracks:
        return (
            "not identified: the joint does not move; swing it to and fro slowly "
            "(a reversals trajectory)"
        )
    forward, backward = motion.moved
    if not (forward and backward):
        return (
            f"not identified: the joint turned {'forwards' if forward else 'backwards'} only; "
            "swing it to and fro, at least four reversals"
        )
    samples = [turn.samples for track in motion.tracks for turn in track.turns]
    if not samples or float(np.median(samples)) < _LEAST_SAMPLES:
        rate = motion.rate_hz
        enough = _LEAST_SAMPLES / max(float(np.median(samples)), 1.0) if samples else 10.0
        seen = f"{float(np.median(samples)):.0f}" if samples else "fewer than 8"
        return (
            f"not identified: at {rate:.4g} Hz a reversal is over within {seen} samples; record "
            f"at {max(rate * enough, 100.0):.0f} Hz or faster, or reverse more slowly"
        )
    if motion.turns < _LEAST_REVERSALS:
        return (
            f"not identified: {motion.turns} reversal{'s' if motion.turns > 1 else ''}; record at "
            f"least {_LEAST_REVERSALS}, better twenty, of several amplitudes"
        )
    return ""


def _no_friction(placed: Sequence[Signals], data: Data) -> str:
    """Return why the torque is not what the joint asks for; empty where it may be."""
    limited = [signals.name for signals in placed if is_limited(signals)]
    if limited:
        return (
            f"not identified: the torque is cut off at a limit in {', '.join(limited)}; reverse "
            "more gently, or raise the limit"
        )
    if _pushes(data):
        return (
            "not identified: friction comes out negative: torque and velocity have opposite signs; "
            "turn one of them"
        )
    return _silent(data)


def _pushes(data: Data) -> bool:
    """Return whether the torque is lower on the way forwards than backwards."""
    velocity = data.common[:, 0]
    middle = float(np.mean(data.torque_nm[velocity > 0.0])) if (velocity > 0.0).any() else 0.0
    back = float(np.mean(data.torque_nm[velocity < 0.0])) if (velocity < 0.0).any() else 0.0
    return middle - back < -_SILENT * data.noise_nm


def _silent(data: Data) -> str:
    """Return that the torque holds nothing but its noise; empty where it holds more."""
    if float(np.std(data.torque_nm)) > _SILENT * data.noise_nm:
        return ""
    return (
        "not identified: the torque is the same in both directions, within its noise; check that "
        "torque_nm is the motor's torque"
    )


def _rivals(
    chosen: Solution, rivals: Sequence[Solution], data: Data, range_: Range
) -> tuple[Solution, Mapping[str, str]]:
    """Return the winner over wind-up and clearance, too, and why each was or was not."""
    winner, reasons = chosen, {}
    for rival in rivals:
        refusal = objection(rival, range_) or not_better(winner, rival, data)
        if refusal:
            reasons[rival.law.name] = refusal
            continue
        reasons[winner.law.name] = f"{rival.law.name} predicts unseen reversals better"
        reasons[rival.law.name] = f"predicts unseen reversals better than {winner.law.name}"
        winner = rival
    return winner, reasons


def _clearance(
    motion: Motion,
    range_: Range,
    fits: Sequence[PreslidingFit],
    chosen: Solution,
    winner: Solution,
    backlash: Solution,
) -> Clearance:
    """Return the clearance from the arm's encoder, else from the motor's side where that tells."""
    viscous = chosen.value("viscous_nm_s_per_rad")
    by_arm = arm_clearance(motion, range_, viscous)
    if by_arm is not None:
        return by_arm
    empty = nothing("not identified: record the arm's position (position_arm_rad)")
    named = next(f for f in fits if f.law == "backlash").parameters
    gap = named["backlash_rad"]
    if winner is not backlash or not gap.identified:
        why = (
            "not identified: from the motor's side a clearance cannot be told from "
            f"{_rival_in_words(winner)}; record the arm's position (position_arm_rad), or the same "
            "reversals under a load"
        )
        return Clearance("motor-side", Parameter.not_identified(why), *_three(empty))
    arm, inertia = named["arm_coulomb_nm"], named["arm_inertia_kg_m2"]
    hardest = max(float(np.abs(t.acceleration_rad_s2).max()) for t in motion.tracks)
    if inertia.value > 0.0 and inertia.value * hardest > _SOFT * arm.value:
        why = (
            "not identified: at these accelerations the arm swings on within the gap; reverse "
            f"with less than {_SOFT * arm.value / inertia.value:.2g} rad/s² of the motor"
        )
        return Clearance("motor-side", Parameter.not_identified(why), *_three(empty))
    return Clearance("motor-side", _with_flank(gap, named["wind_up_rad"]), *_three(empty))


def _with_flank(gap: Parameter, wind_up: Parameter) -> Parameter:
    """Return the gap with the flanks' wind-up in its interval.

    An arm that is hit bounces, and the motor runs on by some of what the flank gives: from the
    motor's side alone the two are one travel.
    """
    if gap.ci95 is None or not wind_up.identified:
        return gap
    low, high = gap.ci95
    reason = "the interval holds the wind-up, which the motor's side does not tell from the gap"
    return Parameter(
        gap.value, (max(low - wind_up.value, 0.0), high + wind_up.value), reason=reason
    )


def _three(empty: Clearance) -> tuple[Parameter, Parameter, Parameter]:
    return empty.lost_motion_rad, empty.compliance_rad_per_nm, empty.encoder_skew_s


def _rival_in_words(winner: Solution) -> str:
    if winner.law.name == "wind-up":
        return "the gear's wind-up"
    return "presliding" if winner.law.name != "coulomb" else "Coulomb friction"


def _notes(winner: Solution, clearance: Clearance) -> tuple[str, ...]:
    notes = []
    if winner.law.name in ("dahl", "bliman-sorine", "lugre") and clearance.source == "motor-side":
        notes.append(
            "from the motor's side, contacts that give before they slip and a gear that winds up "
            "under the arm's own friction look much alike; the arm's encoder tells them apart"
        )
    if winner.misfit > 1.0:
        notes.append(
            f"no law explains these reversals fully: {winner.misfit:.1f} times the torque's noise "
            "is left, and the intervals are as much wider"
        )
    if winner.law.name == "lugre":
        notes.append("LuGre's exponent was held at 2")
    return tuple(notes)


def _traces(winner: Solution, data: Data) -> tuple[Trace, ...]:
    """Return torque over travel since the turn, less what every joint has, for some reversals."""
    own = len(winner.law.levels)
    friction = columns_of(winner.law, data, winner.x)[:, :own] @ winner.weights[:own]
    measured = friction + winner.residual_nm
    index = np.concatenate(data.kept)
    out: list[Trace] = []
    number = 0
    for track in data.motion.tracks:
        for turn in track.turns:
            mine = np.flatnonzero(data.turn == number)
            mine = mine[index[mine] >= turn.at]
            number += 1
            sign = -1.0 if turn.forward_before else 1.0
            away = sign * (track.position_rad[index[mine]] - track.position_rad[turn.at])
            out.append(Trace(away, sign * measured[mine], sign * friction[mine]))
    return tuple(out[:: max(1, len(out) // _TRACES)][:_TRACES])
