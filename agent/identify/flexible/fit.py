"""The flexible joint from recordings of motor torque and motion (thesis 4.2 and 4.3).

The prediction error is that of the torque, with the measured motion as input: the noise is in the
torque, the loop is closed, and the motion is measured a thousand times better than it is commanded.
This keeps the arm, which nobody measures, a stable filter of the motor's acceleration, where the
thesis' simulation from torque to velocity integrates every torque error; and it makes all
parameters linear but the shape of the resonance, whose start is read from the frequency response.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.flexible.chain import Kind, chain_of
from agent.identify.flexible.checks import why_not
from agent.identify.flexible.excitation import (
    hardly_excited,
    lonely_minimum,
    no_third_mass,
    not_excited,
    notes_of,
    wrong_minimum,
)
from agent.identify.flexible.intervals import parameters_of, physical
from agent.identify.flexible.noise import even_cutoff_hz, quietest_cutoff_hz
from agent.identify.flexible.preparation import Prepared, Track, prepare, tracks_of
from agent.identify.flexible.projection import Point, Problem, evaluate
from agent.identify.flexible.result import FlexibleFit, joint_of
from agent.identify.flexible.reversals import through_reversals
from agent.identify.flexible.rivals import Lack, lack_of
from agent.identify.flexible.search import Found, lowest_minimum
from agent.identify.flexible.starts import rigid_minimum, starts_of
from agent.identify.flexible.stiff_spring import from_motion
from agent.identify.flexible.twist import stiffened
from agent.identify.flexible.unbiased import without_motion_noise
from agent.identify.result import Floats, Parameter
from agent.identify.signals.arrays import Signals
from agent.physics.friction import COULOMB_VISCOUS, LAWS, FrictionLaw

_BAND = 8.0  # cutoff, of the highest start frequency
_LEAST_MOTOR = 0.05  # of the whole inertia: what start values may say of the motor's
_RESONANCE = 2.0  # cutoff, of the resonance, at least
_NOISY = (
    "the measured position's noise tells as much of the masses as the motion does; record a "
    "triangle wave of velocity with higher jerk, with a finer encoder, or fit fewer masses"
)
_STIFFENS = 0.1  # of the squared residual: what a stiffening spring explains to be taken unasked


@dataclass(frozen=True)
class Options:
    """How to fit.

    Parameters
    ----------
    kind : {"two-mass", "three-mass"}
    friction : str
        Name of a law in `agent.physics.friction.LAWS`.
    starts : int
        Of the search: from the frequency response (three masses: from several second modes beside
        the first), and one less than this many random ones over two decades around it.
    seed : int
        Of the random starts.
    gravity : bool
        Whether gravity on the arm is part of the model; needs a position.
    cubic : bool or None
        Whether the spring of a two-mass joint has a cubic part; None takes one where the
        recordings show it.
    """

    kind: Kind = "two-mass"
    friction: str = COULOMB_VISCOUS.name
    starts: int = 20
    seed: int = 0
    gravity: bool = False
    cubic: bool | None = None

    def __post_init__(self) -> None:
        if self.friction not in LAWS:
            raise ValueError(f"friction: expected one of {', '.join(LAWS)}, got {self.friction!r}")
        if self.kind not in ("two-mass", "three-mass"):
            raise ValueError(f"kind: expected two-mass or three-mass, got {self.kind!r}")
        if self.cubic and self.kind != "two-mass":
            raise ValueError("cubic: expected a two-mass joint; that of three has linear springs")
        if self.starts < 1:
            raise ValueError(f"starts: expected 1 or more, got {self.starts}")

    @property
    def law(self) -> FrictionLaw:
        """Return the friction law."""
        return LAWS[self.friction]


def fit_flexible(recordings: Sequence[Signals], options: Options | None = None) -> FlexibleFit:
    """Identify a flexible joint.

    Parameters
    ----------
    recordings : sequence of Signals
        Of one axis: a triangle wave, a stair, or both; motor torque, and position or velocity.
    options : Options, optional

    Returns
    -------
    FlexibleFit
        With intervals; or not decidable, with reasons and no numbers.
    """
    options = options or Options()
    if not recordings:
        raise ValueError("recordings: expected at least one, got none")
    if len({s.gear_ratio for s in recordings}) > 1:
        raise ValueError("recordings: expected one gear ratio; these are of different axes")
    tracks = [t for s in recordings for t in tracks_of(s)]
    reasons = why_not(recordings, tracks)
    if options.gravity and any(t.position_rad is None for t in tracks):
        reasons.append("gravity needs the arm's angle; record the motor position, too")
    if reasons:
        return refused(options, reasons)
    cutoff_hz = quietest_cutoff_hz(tracks)
    stretches = _prepared(tracks, cutoff_hz)
    if not stretches:
        return refused(
            options,
            [
                f"the measured position is too noisy above {cutoff_hz:.2g} Hz for the length of "
                "the recording; record longer, with a finer encoder"
            ],
        )
    quietest_hz, wanted_hz = cutoff_hz, _wanted_cutoff_hz(stretches, tracks, options)
    if wanted_hz < cutoff_hz:
        narrower = _prepared(tracks, wanted_hz)
        if narrower:
            stretches, cutoff_hz = narrower, wanted_hz
    starts = starts_of(Problem(stretches, None, options.law, options.gravity), options.kind)
    if not starts:
        return refused(
            options,
            ["a second resonance is not excited; fit two masses, or record with higher jerk"],
        )
    wider_hz = min(quietest_hz, _RESONANCE * _highest_hz(stretches, starts[0], options))
    if options.kind == "three-mass" and wider_hz > cutoff_hz:
        stretches, cutoff_hz = _prepared(tracks, wider_hz), wider_hz
    return _fitted(stretches, starts, cutoff_hz, options, recordings[0].gear_ratio)


def _wanted_cutoff_hz(
    stretches: tuple[Prepared, ...], tracks: Sequence[Track], options: Options
) -> float:
    """Return how wide the band need be: less noise, fewer samples.

    Not much wider than what the joint shows, and not so wide that noise of the motion prevails;
    but the resonance stays inside.
    """
    start = starts_of(Problem(stretches, None, options.law, options.gravity), "two-mass")[0]
    problem = Problem(stretches, "two-mass", options.law, options.gravity)
    motor, arm = evaluate(problem, start).linear[:2]
    held_hz = math.exp(start[0]) / (2.0 * math.pi)
    share = max(motor / max(motor + arm, 1e-300), _LEAST_MOTOR)
    quiet_hz = even_cutoff_hz(tracks, share * (motor + arm))
    free_hz = held_hz / math.sqrt(share)
    return min(_BAND * held_hz, max(quiet_hz, _RESONANCE * free_hz))


def _highest_hz(stretches: tuple[Prepared, ...], start: Floats, options: Options) -> float:
    """Return a start's highest resonance: what tells gear and motor apart lies about it."""
    problem = Problem(stretches, options.kind, options.law, options.gravity)
    motor, arm = problem.feasible(evaluate(problem, start).linear)[:2]
    chain = chain_of(start[: problem.shape_size], max(float(arm), 1e-300))
    swings = chain.resonances_rad_s(max(float(motor), _LEAST_MOTOR * float(arm), 1e-300))
    return float(swings[-1]) / (2.0 * math.pi)


def refused(options: Options, reasons: Sequence[str]) -> FlexibleFit:
    """Return a result without numbers."""
    cubes = () if options.cubic else None
    problem = Problem((), options.kind, options.law, options.gravity, cubes)
    names = physical(problem, np.zeros(problem.search_size), np.ones(len(problem.linear_names)))
    reason = "; ".join(reasons)
    return FlexibleFit(
        options.kind,
        options.friction,
        False,
        tuple(reasons),
        {name: Parameter.not_identified(reason) for name in names},
    )


def _prepared(tracks: Sequence[Track], cutoff_hz: float) -> tuple[Prepared, ...]:
    ready = (prepare(t, cutoff_hz) for t in tracks)
    return tuple(p for p in ready if p is not None)


def _fitted(
    stretches: tuple[Prepared, ...],
    centres: Sequence[Floats],
    cutoff_hz: float,
    options: Options,
    gear_ratio: float,
) -> FlexibleFit:
    """Search, and say what was found or why nothing was."""
    problem = Problem(stretches, options.kind, options.law, options.gravity)
    rigid_problem = dataclasses.replace(problem, kind=None)
    rigid = rigid_minimum(rigid_problem)
    if rigid.residual.shape[0] <= problem.search_size + len(problem.linear_names):
        return refused(
            options,
            [
                f"below {cutoff_hz:.2g} Hz, and away from the reversals, too few samples are left: "
                "check that torque_nm is this motion's torque; if so, record longer"
            ],
        )
    found = lowest_minimum(problem, centres, options.starts, options.seed)
    reasons = not_excited(problem, found.point, rigid, cutoff_hz)
    reasons = reasons or wrong_minimum(problem, found.lack)
    if problem.kind == "three-mass" and not reasons:
        # Asked for a third mass, a search finds one in noise, with the arm in the gear's place.
        two = dataclasses.replace(problem, kind="two-mass")
        fewer = lowest_minimum(two, starts_of(rigid_problem, "two-mass"), 1, options.seed)
        reasons = no_third_mass(fewer.lack)
    if reasons:
        return refused(options, reasons)
    best, lack = found.point, found.lack
    stiffens = lack.share_of("stiffening") > _STIFFENS
    if options.cubic or (options.cubic is None and stiffens):
        problem, best = stiffened(problem, best, found.bounds)
        lack = lack_of(problem, best)
    reasons = hardly_excited(best, rigid, lack) or lonely_minimum(problem, lack, found.starts)
    if reasons:
        return refused(options, reasons)
    return _Minimum(problem, best, rigid_problem, rigid, found, lack).described(
        options, cutoff_hz, gear_ratio
    )


@dataclass(frozen=True)
class _Minimum:
    """The flexible and the rigid minimum, reversals left out, and what the flexible one lacks."""

    problem: Problem
    point: Point
    rigid_problem: Problem
    rigid: Point
    found: Found
    lack: Lack

    def described(self, options: Options, cutoff_hz: float, gear_ratio: float) -> FlexibleFit:
        """Return what is known of the joint: with its reversals, if nothing is lacking."""
        problem, point, bounds = self.problem, self.point, self.found.bounds
        if not self.lack.rivals:
            problem, point = through_reversals(problem, point, bounds)
        point = from_motion(problem, point, bounds)
        unbiased = without_motion_noise(problem, point, bounds)
        if unbiased is None:
            return refused(options, [_NOISY])
        point = unbiased.point
        parameters, condition = parameters_of(problem, unbiased, bounds, self.lack)
        count, target = self.point.residual.shape[0], self.problem.target
        scatter = float(np.linalg.norm(target - target.mean()))
        rigid = self.rigid
        return FlexibleFit(
            options.kind,
            options.friction,
            True,
            (),
            parameters,
            rmse_nm=math.sqrt(self.point.cost / count),
            rigid_rmse_nm=math.sqrt(rigid.cost / count),
            fit_percent=100.0 * (1.0 - math.sqrt(self.point.cost) / scatter),
            rigid_fit_percent=100.0 * (1.0 - math.sqrt(rigid.cost) / scatter),
            condition_number=condition,
            cutoff_hz=cutoff_hz,
            starts=self.found.starts,
            gear_ratio=gear_ratio,
            notes=notes_of(problem, self.lack),
            joint=joint_of(physical(problem, point.search, point.linear), gear_ratio),
            rigid=joint_of(physical(self.rigid_problem, rigid.search, rigid.linear), gear_ratio),
        )
