"""The flexible joint from recordings of motor torque and motion (thesis 4.2 and 4.3).

The prediction error is that of the torque, with the measured motion as input: the noise is in the
torque, the loop is closed, and the motion is measured a thousand times better than it is commanded.
This keeps the arm, which nobody measures, a stable filter of the motor's acceleration, where the
thesis' simulation from torque to velocity integrates every torque error; and it makes all
parameters linear but the shape of the resonance, whose start is read from the frequency response.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np

from agent.identify.flexible.chain import Kind
from agent.identify.flexible.checks import why_not
from agent.identify.flexible.intervals import parameters_of, physical
from agent.identify.flexible.preparation import (
    Prepared,
    Track,
    prepare,
    quietest_cutoff_hz,
    tracks_of,
)
from agent.identify.flexible.projection import (
    Point,
    Problem,
    bounds_of,
    descend,
    evaluate,
)
from agent.identify.flexible.result import FlexibleFit, Start, joint_of
from agent.identify.flexible.spectra import (
    frequency_range_hz,
    frequency_response,
    second_modes,
    start_shape,
)
from agent.identify.result import Floats, Parameter
from agent.identify.signals import Signals
from agent.identify.uncertainty import correlation_time
from agent.physics.friction import COULOMB_VISCOUS, LAWS, FrictionLaw

_DECADES = 1.0  # to either side of the start values: two decades in all
_SAME = 1e-4  # relative difference of costs that one minimum may have
_BAND = 8.0  # cutoff, of the highest start frequency
_EVIDENCE = 5.0  # log-likelihood that flexibility must gain for each of its parameters
_PLAIN = 0.1  # of the rigid body's squared residual
_SEEN = 0.9  # of the cutoff


@dataclass(frozen=True)
class Options:
    """How to fit.

    Parameters
    ----------
    kind : {"two-mass", "three-mass"}
    friction : str
        Name of a law in `agent.physics.friction.LAWS`.
    starts : int
        Of the search: the one from the frequency response, and random ones over two decades
        around it.
    seed : int
        Of the random starts.
    gravity : bool
        Whether gravity on the arm is part of the model; needs a position.
    """

    kind: Kind = "two-mass"
    friction: str = COULOMB_VISCOUS.name
    starts: int = 20
    seed: int = 0
    gravity: bool = False

    def __post_init__(self) -> None:
        if self.friction not in LAWS:
            raise ValueError(f"friction: expected one of {', '.join(LAWS)}, got {self.friction!r}")
        if self.kind not in ("two-mass", "three-mass"):
            raise ValueError(f"kind: expected two-mass or three-mass, got {self.kind!r}")
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
    shape = _start(Problem(stretches, None, options.law, options.gravity), "two-mass")
    # The band need not be wider than what the joint shows: less noise, fewer samples.
    wanted_hz = _BAND * math.exp(shape[0]) / (2.0 * math.pi)
    if wanted_hz < cutoff_hz:
        narrower = _prepared(tracks, wanted_hz)
        if narrower:
            stretches, cutoff_hz = narrower, wanted_hz
    shape = _start(Problem(stretches, None, options.law, options.gravity), options.kind)
    return _search(stretches, shape, cutoff_hz, options, recordings[0].gear_ratio)


def refused(options: Options, reasons: Sequence[str]) -> FlexibleFit:
    """Return a result without numbers."""
    problem = Problem((), options.kind, options.law, options.gravity)
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


def _rigid(problem: Problem) -> Point:
    """Return the rigid body, fitted like the flexible joint."""
    box = bounds_of(problem, 1.0, 1.0, _fastest(problem))
    start = np.zeros(problem.search_size)
    start[:-1] = _friction_start(problem)
    return descend(problem, start, box)[0]


def _friction_start(problem: Problem) -> Floats:
    """Return a start for friction's searched parameters: the middle of their ranges."""
    fastest = _fastest(problem)
    ends = [r.bounds(fastest / 300.0, fastest) for r in problem.law.ranges]
    return np.array([0.5 * (math.log(a) + math.log(b)) for a, b in ends])


def _fastest(problem: Problem) -> float:
    return max(float(np.max(np.abs(p.track.velocity_rad_s))) for p in problem.stretches)


def _start(rigid: Problem, kind: Kind) -> Floats:
    """Return the chain's shape from the frequency response, friction taken out."""
    point = _rigid(rigid)
    linear = point.linear.copy()
    linear[0] = 0.0
    rest, row = [], 0
    columns = rigid.all_columns(point.search)
    for p in rigid.stretches:
        n = p.torque_nm.shape[0]
        rest.append((p.torque_nm - columns[row : row + n] @ linear) * p.usable)
        row += n
    shape = start_shape(*frequency_response(rigid.stretches, rest))
    if kind == "two-mass":
        return shape
    # One swinging mass first; then the second mode that explains most beside it.
    nonlinear = point.search
    low_hz, high_hz = frequency_range_hz(rigid.stretches)
    one = Problem(rigid.stretches, "two-mass", rigid.law, rigid.has_gravity)
    box = bounds_of(one, low_hz, high_hz, _fastest(one))
    known = descend(one, np.concatenate((shape, nonlinear)), box)[0].search[: one.shape_size]
    two = Problem(rigid.stretches, kind, rigid.law, rigid.has_gravity)
    return min(
        second_modes(known, low_hz, high_hz),
        key=lambda trial: evaluate(two, np.concatenate((trial, nonlinear))).cost,
    )


def _search(
    stretches: tuple[Prepared, ...],
    shape: Floats,
    cutoff_hz: float,
    options: Options,
    gear_ratio: float,
) -> FlexibleFit:
    """Descend from every start and keep the lowest minimum."""
    problem = Problem(stretches, options.kind, options.law, options.gravity)
    rigid_problem = Problem(stretches, None, options.law, options.gravity)
    rigid = _rigid(rigid_problem)
    low_hz, high_hz = frequency_range_hz(stretches)
    box = bounds_of(problem, low_hz, high_hz, _fastest(problem))
    centre = np.concatenate((shape, rigid.search[:-1], [0.0]))
    rng = np.random.default_rng(options.seed)
    found: list[tuple[Point, bool]] = []
    for number in range(options.starts):
        start = centre.copy()
        if number:
            reach = math.log(10.0) * _DECADES
            start[:-1] += rng.uniform(-reach, reach, centre.shape[0] - 1)
        found.append(descend(problem, start, box))
    best = min(found, key=lambda pair: pair[0].cost)[0]
    count = best.residual.shape[0]
    starts = tuple(
        Start(
            "random" if number else "frequency-response",
            math.sqrt(point.cost / count),
            _outcome(point, best, converged),
        )
        for number, (point, converged) in enumerate(found)
    )
    reasons = _not_excited(problem, best, rigid, cutoff_hz)
    if reasons:
        return refused(options, reasons)
    parameters, condition = parameters_of(problem, best, box)
    scatter = float(np.linalg.norm(problem.target - problem.target.mean()))
    return FlexibleFit(
        options.kind,
        options.friction,
        True,
        (),
        parameters,
        rmse_nm=math.sqrt(best.cost / count),
        rigid_rmse_nm=math.sqrt(rigid.cost / count),
        fit_percent=100.0 * (1.0 - math.sqrt(best.cost) / scatter),
        rigid_fit_percent=100.0 * (1.0 - math.sqrt(rigid.cost) / scatter),
        condition_number=condition,
        cutoff_hz=cutoff_hz,
        starts=starts,
        gear_ratio=gear_ratio,
        joint=joint_of(physical(problem, best.search, best.linear), gear_ratio),
        rigid=joint_of(physical(rigid_problem, rigid.search, rigid.linear), gear_ratio),
    )


def _outcome(point: Point, best: Point, converged: bool) -> Literal["best", "local", "unfinished"]:
    if point.cost <= best.cost * (1.0 + _SAME):
        return "best"
    return "local" if converged else "unfinished"


def _not_excited(problem: Problem, best: Point, rigid: Point, cutoff_hz: float) -> list[str]:
    """Return why the minimum says nothing about a resonance, where that is so."""
    advice = (
        "record a triangle wave of velocity with high jerk, ten periods or more, at 250 Hz or more"
    )
    samples = best.residual.shape[0] / correlation_time([best.residual])
    gain = 0.5 * samples * math.log(max(rigid.cost, 1e-300) / max(best.cost, 1e-300))
    extra = problem.shape_size + 1
    # Missing structure makes what is left look like few samples; a tenth is no chance, still.
    if gain < _EVIDENCE * extra and best.cost > _PLAIN * rigid.cost:
        return [
            f"no resonance is excited above the noise: a rigid joint explains as much; {advice}"
        ]
    values = physical(problem, best.search, best.linear)
    seen = [v for name, v in values.items() if name.startswith("antiresonance")]
    if max(seen) > _SEEN * cutoff_hz:
        return [
            f"the resonance lies outside of what the recording shows (up to {cutoff_hz:.3g} Hz); "
            "record at a higher rate"
        ]
    if min(best.linear[0], best.linear[1]) <= 0.0:
        return [f"motor and arm cannot be told apart: one inertia comes out as zero; {advice}"]
    return []
