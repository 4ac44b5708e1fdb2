"""What limits an answer as a whole, said beside it: what stood in, was left out, or may mislead."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.explain.answer.amounts import percent
from agent.explain.answer.fits import Edges
from agent.explain.answer.sentences import RIGHT_AFTER_S, only_heard
from agent.explain.at_edges import edges_said
from agent.explain.choosing.by_use import clock_or_use
from agent.explain.choosing.heard import BACKLASH
from agent.explain.choosing.materiality import FAR
from agent.explain.choosing.weighted import DELAY
from agent.explain.closest import closest_said
from agent.explain.driven import driven_or_heavier
from agent.explain.driven_range import (
    carries,
    hangs_free,
    may_be_warmth,
    otherwise_warm,
    own_law_unseen,
)
from agent.explain.moved import moved_said
from agent.explain.numbers.late_velocity import is_velocitys
from agent.explain.numbers.warm_constant import right_at_degc
from agent.explain.off_alike import off_alike_said
from agent.explain.plausible import another_joint, below_zero_said, far_off, turned_gravity
from agent.explain.rows.blows import Blows
from agent.explain.rows.pieces import thinned
from agent.explain.rows.table import Table
from agent.explain.shaken import shaken_said
from agent.explain.study import Study
from agent.explain.verdict import far_from_given
from agent.explain.warm_magnets import warm_magnets_said
from agent.identify.diagnosis import scaled_velocity
from agent.identify.signals.preprocess import left_out_of, read_motion

_CLOSER = 1.1  # of the refitted energy, at least: else refitting has brought nothing
_OTHERWISE_WARM_K = 10.0  # magnets lose less than 2 % over it
_MANY_WITHOUT = 0.005  # of the rows
_LATE_S = 5e-4  # of a velocity: less is no more than its last difference


def bear_in_mind(found: Study, edges: Edges | None, *, by_motor: bool) -> tuple[str, ...]:
    """Return what limits the answer as a whole.

    Parameters
    ----------
    found : Study
    edges : Edges or None
        What is not compared right after starts and reversals, where the twin is far off there.
    by_motor : bool
        Whether the motor's temperature stands in for the gearbox's.
    """
    turned = "" if found.table.simulated else turned_gravity(found.numbers, found.twin)
    negative = below_zero_said(found.impossible, found.twin)
    out = [said for said in (_far_off(found), negative, turned) if said]
    if by_motor:
        out.append(
            "the gearbox temperature was not recorded: the motor's stands in for it, and friction "
            "and torque constant are judged by the same thermometer"
        )
    if not found.floor.value_nm > 0.0:
        out.append(
            "the noise floor could not be measured, as no speed was held long enough"
            f"{_cut_up(found)}: what is left may be noise or not"
        )
    if found.table.simulated:
        out.append(
            "the simulation questioned is the recordings' own torque_simulated_nm; twin.toml holds "
            "what was found beside the plain numbers of a twin that stands for it; if it moved in "
            "a loop of its own instead of as recorded, delays, swings and what yields right after "
            "reversals may be that loop's"
        )
    if any(wrong.effect == "torque-constant-error" for wrong in found.numbers):
        out.append(
            "a wrong torque constant and a simulation whose numbers are all off by one factor are "
            "the same to these recordings: one number that is known otherwise, as the inertia or a "
            "weight, decides"
        )
    used = clock_or_use(found.library, found.choice)
    springs = hangs_free(found), carries(found)
    arm = *springs, driven_or_heavier(found), shaken_said(found), _bent_by(found)
    warmth = otherwise_warm(found), own_law_unseen(found), may_be_warmth(found)
    told = (
        *warmth,
        off_alike_said(found),
        moved_said(found),
        used,
        *arm,
        _right_when_cold(found),
        warm_magnets_said(found),
    )
    out += [said for said in told if said]
    if not found.choice.terms and not found.numbers and _bent(found):
        out.append(
            "the simulation as given is clearly above the noise: its own numbers, refitted, come "
            "closer, and these recordings do not say which of them is wrong"
        )
    blows = found.library.scene.blows
    if blows is not None and BACKLASH not in _effects(found):
        swings = "joint-flexibility" in _effects(found)
        out.append(only_heard(blows.ringing, *_right_after(found, blows), swings=swings))
    motions = [read_motion(run.signals) for run in found.table.runs]
    signals = edges_said(edges), _late_velocity(found), scaled_velocity(motions)
    out += [said for said in signals if said]
    closest = closest_said(found)
    noise = _more_than_the_floor(found, beside=bool(closest))
    if noise:
        out.append(noise)
    if closest:
        out.append(closest)
    out += _left_out(found.table)
    out += [said for run in found.table.runs for said in left_out_of(run.signals)]
    compared = {piece.run for piece in found.table.pieces}
    for index, run in enumerate(found.table.runs):
        if index not in compared:
            out.append(f"{run.name} was left out: no stretch of it is long enough to be compared")
    return tuple(out)


def _far_off(found: Study) -> str:
    """Return that numbers are far from the twin's, where the answer does not begin with that."""
    if found.table.simulated or another_joint(found.numbers, found.twin):
        return ""
    return far_off((*found.numbers, *found.impossible), found.twin)


def _late_velocity(found: Study) -> str:
    """Return what a velocity is that comes later than the position; nothing where none does."""
    late_s = found.table.late_s
    if abs(late_s) > _LATE_S:
        later = "later" if late_s > 0.0 else "earlier"
        said = f"the velocity is reported {1e3 * abs(late_s):.1f} ms {later} than the position"
        if DELAY in _effects(found):
            return f"{said}: it was brought in step, and the torque's delay is against both"
        return f"{said}, with which the torque is in step: it was brought in step with both"
    if any(is_velocitys(own, found.table) for own in found.model.parameters):
        return (
            "the velocity alone is late, and twin.toml holds that as a torque before the motion: "
            "a velocity taken from the position needs neither"
        )
    return ""


def _more_than_the_floor(found: Study, *, beside: bool) -> str:
    """Return why what is left is more than the floor and noise nevertheless; empty where not.

    Parameters
    ----------
    found : Study
    beside : bool
        Whether what comes closest to it is said, too.
    """
    if not all(found.in_twin(term.scored.form) for term in found.choice.terms):
        return ""  # what a law leaves that no simulation bears out is not told to be noise
    times = f"what is left is {found.left.over_floor:.1f} times the noise"
    if (
        BACKLASH in _effects(found)
        and found.left.over_floor > FAR
        and found.left.noise_all_the_same
    ):
        return f"{times}: an arm that bounces in a gap is not foretold to its last blow"
    if found.left.louder_noise and not any(line.matters for line in found.lines):
        how = "as short" if beside else "noise all the same"
        return (
            f"{times} at held speeds, and {how}: it goes on for no longer than the filter's "
            "memory, and comes in no spells"
        )
    if found.left.slower_noise:
        how = "as even" if beside else "noise all the same"
        return (
            f"{times} within half a second, and {how}: it is slow in part, no slower than its "
            "fast part foretells (flicker), and follows nothing that was recorded"
        )
    if found.left.unrepeated_noise:
        how = "by chance" if beside else "noise all the same"
        return (
            f"{times} within half a second, and {how}: it does not come again where the same "
            "recording passes the same place at the same speed, and leans to no side"
        )
    return ""


def left_out_of_the_proof(unseen: Table, learnt: Table) -> tuple[str, ...]:
    """Return which samples of what was held out were not compared, for reasons of their own.

    Parameters
    ----------
    unseen, learnt : Table
        As they were compared.
    """
    out = []
    if unseen.creep_rad_s > learnt.creep_rad_s:
        out.append(
            "in what was held out friction is not fully there below "
            f"{unseen.creep_rad_s:.2g} rad/s, as where a joint creeps on between two moves; those "
            "samples were left out of the proof"
        )
    if unseen.arm_forgets is not None and learnt.arm_forgets is None:
        out.append(
            "as what was held out begins nobody knows how the arm hangs on its gear: "
            f"{unseen.arm_forgets.seconds:.2g} s from the first motion on were left out of the "
            "proof"
        )
    return tuple(out)


def _bent_by(found: Study) -> str:
    """Return that the motion's noise bends the numbers of an arm; nothing where it does not."""
    if not found.unshaken:
        return ""
    return (
        "the noise of the measured motion shakes the simulated arm: its numbers are told without "
        "that, or not at all, and twin.toml holds the softer and more damped ones that predict "
        "best behind a motion that is measured so"
    )


def _right_after(found: Study, blows: Blows) -> tuple[float, float]:
    """Return which share of what is left, and of the motion, lies right after blows."""
    table, rows = found.table, found.library.weighing.rows
    after = np.zeros(table.full["time_s"].shape[0])
    for piece in table.pieces:
        reach = math.ceil(RIGHT_AFTER_S / piece.period_s)
        there = (blows.instants >= piece.full.start) & (blows.instants < piece.full.stop)
        for at in blows.instants[there]:
            after[at : min(at + reach, piece.full.stop)] = 1.0
    near = thinned(after, table.pieces)[rows] > 0.0
    left = found.model.residual_nm**2
    return float(left[near].sum() / max(float(left.sum()), 1e-300)), float(np.mean(near))


def _right_when_cold(found: Study) -> str:
    """Return at which warmth the simulation's torque constant holds, where it falls with warmth."""
    at_degc = right_at_degc(found.library, found.model)
    if found.numbers or found.table.simulated or at_degc is None:
        return ""
    mean_degc = found.library.scene.mean("motor_temperature_degc")
    if abs(at_degc - mean_degc) < _OTHERWISE_WARM_K:
        return ""
    return (
        f"the simulation's torque constant is right at {at_degc:.0f} °C of the motor; the numbers "
        f"in twin.toml are those at {mean_degc:.0f} °C, the mean of the recordings"
    )


def _left_out(table: Table) -> list[str]:
    """Return which samples were not compared, as no law describes them."""
    out = []
    if table.creep_rad_s > 0.0:
        out.append(
            f"below {table.creep_rad_s:.2g} rad/s friction is not fully there: the joint "
            "creeps before it slips, or what recorded or simulated it smooths friction's sign; "
            "those samples were left out"
        )
    if table.imaged_orders:
        out.append(_images_said(table.imaged_orders))
    if table.arm_forgets is not None:
        out.append(
            f"as a recording begins nobody knows how the arm hangs on its gear: "
            f"{table.arm_forgets.seconds:.2g} s from the first motion on were left out, and "
            "as much after gaps longer than a quarter of its swing"
        )
    return out


def _images_said(orders: Sequence[float]) -> str:
    """Return which waves pass about as often as they were sampled, and that this was left out."""
    waves = " and ".join(f"{order:.3g}" for order in orders)
    return (
        f"at some speeds {waves} waves a turn of the motor pass about as often as torque was "
        "recorded: samples show a slow image of them there, and were left out"
    )


def _effects(found: Study) -> set[str]:
    """Return what the extended twin has, found or known before."""
    known = {effect.id for effect in found.twin.effects}
    return known | {term.scored.form.effect for term in found.choice.terms}


def _bent(found: Study) -> bool:
    """Return whether the simulation as given is far off, and its numbers refitted are all it lacks.

    What has no name bends a refit, too: where far more than noise is left, no number need be wrong.
    """
    if found.left.ratio > FAR:
        return False
    rows = found.library.weighing.rows
    given, refitted = found.table.target_nm[rows], found.refitted_nm[rows]
    return far_from_given(found) and float(given @ given) > _CLOSER * float(refitted @ refitted)


def _cut_up(found: Study) -> str:
    """Return that rows without a number cut the recordings into pieces, where many do."""
    valid = np.concatenate([run.signals.valid for run in found.table.runs])
    without = int(np.count_nonzero(~valid))
    if without < _MANY_WITHOUT * valid.shape[0]:
        return ""
    return (
        f" between the {without} rows ({percent(without / valid.shape[0])}) whose torque or motion "
        "is no number"
    )
