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

from agent.identify.flexible.attenuation import without_motion_noise
from agent.identify.flexible.chain import Kind
from agent.identify.flexible.checks import why_not
from agent.identify.flexible.descent import approach, bounds_of, descend
from agent.identify.flexible.intervals import parameters_of, physical
from agent.identify.flexible.modes import approach_chain, second_mode_starts
from agent.identify.flexible.preparation import (
    Prepared,
    Track,
    even_cutoff_hz,
    prepare,
    quietest_cutoff_hz,
    tracks_of,
)
from agent.identify.flexible.projection import Point, Problem, evaluate
from agent.identify.flexible.result import FlexibleFit, Start, joint_of
from agent.identify.flexible.spectra import (
    PLACES,
    frequency_range_hz,
    frequency_response,
    start_shapes,
)
from agent.identify.result import Floats, Parameter
from agent.identify.signals import Signals
from agent.identify.uncertainty import correlation_time
from agent.physics.friction import COULOMB_VISCOUS, LAWS, FrictionLaw

_DECADES = 1.0  # to either side of the start values: two decades in all
_SAME = 1e-4  # relative difference of costs that one minimum may have
_BAND = 8.0  # cutoff, of the highest start frequency
_LEAST_MOTOR = 0.05  # of the whole inertia: what start values may say of the motor's
_RESONANCE = 2.0  # cutoff, of the resonance, at least
_FALSE_ALARMS = 1e-3  # of joints that are rigid
# Structure that no model here has makes the samples look few; what leaves a tenth of the rigid
# joint's squared residual, though, is no chance.
_PLAIN = 0.1
_SEEN = 0.9  # of the cutoff: nearer to it, the filter leaves of a resonance its flank alone


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
    wanted_hz = _wanted_cutoff_hz(stretches, tracks, options)
    if wanted_hz < cutoff_hz:
        narrower = _prepared(tracks, wanted_hz)
        if narrower:
            stretches, cutoff_hz = narrower, wanted_hz
    starts = _starts(Problem(stretches, None, options.law, options.gravity), options.kind)
    if not starts:
        return refused(
            options,
            ["a second resonance is not excited; fit two masses, or record with higher jerk"],
        )
    return _search(stretches, starts, cutoff_hz, options, recordings[0].gear_ratio)


def _wanted_cutoff_hz(
    stretches: tuple[Prepared, ...], tracks: Sequence[Track], options: Options
) -> float:
    """Return how wide the band need be: less noise, fewer samples.

    Not much wider than what the joint shows, and not so wide that noise of the motion prevails;
    but the resonance stays inside.
    """
    start = _starts(Problem(stretches, None, options.law, options.gravity), "two-mass")[0]
    problem = Problem(stretches, "two-mass", options.law, options.gravity)
    motor, arm = evaluate(problem, start).linear[:2]
    held_hz = math.exp(start[0]) / (2.0 * math.pi)
    share = max(motor / max(motor + arm, 1e-300), _LEAST_MOTOR)
    quiet_hz = even_cutoff_hz(tracks, share * (motor + arm))
    free_hz = held_hz / math.sqrt(share)
    return min(_BAND * held_hz, max(quiet_hz, _RESONANCE * free_hz))


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
    box = bounds_of(problem, 1.0, 1.0, problem.fastest_rad_s)
    start = np.zeros(problem.search_size)
    start[:-1] = _friction_start(problem)
    return descend(problem, start, box)[0]


def _friction_start(problem: Problem) -> Floats:
    """Return a start for friction's searched parameters: the middle of their ranges."""
    fastest = problem.fastest_rad_s
    ends = [r.bounds(fastest / 300.0, fastest) for r in problem.law.ranges]
    return np.array([0.5 * (math.log(a) + math.log(b)) for a, b in ends])


def _starts(rigid: Problem, kind: Kind) -> list[Floats]:
    """Return starts of the search from the frequency response, friction taken out, best first."""
    point = _rigid(rigid)
    inertia, *others = point.linear
    rest, row = [], 0
    columns = rigid.all_columns(point.search)
    for p in rigid.stretches:
        own = columns[row : row + p.torque_nm.shape[0]]
        row += own.shape[0]
        # About standstill nobody knows friction: a gap there would ring at all frequencies.
        rest.append(np.where(p.usable, p.torque_nm - own[:, 1:] @ others, own[:, 0] * inertia))
    one = Problem(rigid.stretches, "two-mass", rigid.law, rigid.has_gravity)
    shapes = start_shapes(*frequency_response(rigid.stretches, rest))
    starts = [np.concatenate((shape, point.search)) for shape in shapes]
    start = min(starts, key=lambda s: evaluate(one, s).cost)
    if kind == "two-mass":
        return [start]
    # One swinging mass first; then second modes that explain most beside it.
    low_hz, high_hz = frequency_range_hz(rigid.stretches)
    box = bounds_of(one, low_hz, high_hz, one.fastest_rad_s)
    known = descend(one, start, box)[0].search
    return second_mode_starts(one, known, low_hz, high_hz)


def _search(
    stretches: tuple[Prepared, ...],
    centres: Sequence[Floats],
    cutoff_hz: float,
    options: Options,
    gear_ratio: float,
) -> FlexibleFit:
    """Descend from every start and keep the lowest minimum."""
    problem = Problem(stretches, options.kind, options.law, options.gravity)
    rigid_problem = Problem(stretches, None, options.law, options.gravity)
    rigid = _rigid(rigid_problem)
    low_hz, high_hz = frequency_range_hz(stretches)
    box = bounds_of(problem, low_hz, high_hz, problem.fastest_rad_s)
    toward = approach if options.kind == "two-mass" else approach_chain
    found = [descend(problem, centre, box) for centre in centres]
    rng = np.random.default_rng(options.seed)
    reach = math.log(10.0) * _DECADES
    for _ in range(options.starts - 1):
        start = centres[0].copy()
        start[:-1] += rng.uniform(-reach, reach, start.shape[0] - 1)
        found.append(descend(problem, toward(problem, start, box), box))
    best = min(found, key=lambda pair: pair[0].cost)[0]
    count = best.residual.shape[0]
    starts = tuple(
        Start(
            "random" if number >= len(centres) else "frequency-response",
            math.sqrt(point.cost / count),
            _outcome(point, best, converged),
        )
        for number, (point, converged) in enumerate(found)
    )
    reasons = _not_excited(problem, best, rigid, cutoff_hz)
    if reasons:
        return refused(options, reasons)
    best = without_motion_noise(problem, best)
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


def _wanted_gain(problem: Problem, samples: float) -> float:
    """Return the log-likelihood by which a flexible joint must beat the rigid one.

    Half a log of the samples for each parameter more (Schwarz 1978), and the log of how many
    places the resonance was sought at over the false alarms allowed: the best of many places
    explains more noise than any one of them.
    """
    added = problem.shape_size + 1
    return 0.5 * added * math.log(max(samples, 2.0)) + math.log(PLACES / _FALSE_ALARMS)


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
    if gain < _wanted_gain(problem, samples) and best.cost > _PLAIN * rigid.cost:
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
