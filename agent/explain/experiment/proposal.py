"""Which experiment tells tied effects apart soonest, and how long it must be driven.

Every tied fit is simulated on a menu of safe changes to the cycle, its rivals are refitted to the
recordings and the experiment together, and the menu is ranked by the expected gain in log density
per second (T-optimality: see `experiment_gain`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from agent.explain.answer.names import NAMES
from agent.explain.answer.result import NextExperiment, PlannedRun
from agent.explain.choosing.aliases import told_apart_by
from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.experiment.gain import Duel, Experiment, Hypothesis
from agent.explain.experiment.menu import Proposal, menu
from agent.explain.experiment.motion import elsewhere
from trajectories import AxisLimits, lasting

DECISIVE = 10.0
"""Difference in log density at which a tie is called broken."""

_ENOUGH, _PLENTY = 20.0, 100.0  # to decide; to rank: more is no better
_LONGEST_S = 1800.0  # of driving: an experiment that needs more is none
_NO_MOTION = (
    "Within the strokes, speeds and accelerations of these recordings half an hour of driving does "
    "not tell {}."
)
_TOO_SELDOM = "At these recordings' sampling rate no cycle can be followed that would tell {}."
_SLIDING = "While the joint slides, no motion tells {}."
_UNTOLD = "These recordings do not tell {}."
_MOST_RIVALS = 3
_WARMTH_OR_USE = {"temperature-dependent-friction", "friction-drift"}
_PAIR = frozenset({"torque-offset", "direction-asymmetry"})
_PAIR_FORMS = frozenset({"constant", "Coulomb"})


def next_experiments(
    library: Library,
    terms: Sequence[Term],
    index: int,
    floor_nm: float,
    limits: AxisLimits | None = None,
) -> tuple[NextExperiment, ...]:
    """Return what to run to tell a term from its rivals, the soonest decided first.

    Parameters
    ----------
    library : Library
        Of the recordings.
    terms : sequence of Term
        The model's; the rivals are those of `terms[index]`.
    index : int
    floor_nm : float
        Noise floor in the table's band.
    limits : AxisLimits, optional
        Of the axis. Without them no experiment leaves the positions, speeds and accelerations that
        the recordings show.

    Returns
    -------
    tuple of NextExperiment
        Empty where nothing is tied. Where no motion of this axis decides, the only entry is a
        change of the set-up, without a trajectory.
    """
    term = terms[index]
    hypotheses = [Hypothesis(term.scored, term.probability)]
    hypotheses += [Hypothesis(r.scored, r.probability) for r in term.rivals[:_MOST_RIVALS]]
    effect = term.scored.form.effect
    partner = next(iter(_PAIR - {effect}))
    # With its viscous part an asymmetry is no copy; tied with its partner it may not have that one.
    paired = effect in _PAIR and (
        term.scored.form.name in _PAIR_FORMS or any(h.effect == partner for h in hypotheses[1:])
    )
    if paired:
        hypotheses = [h for h in hypotheses if h.effect != partner]
    others = [t.candidate for k, t in enumerate(terms) if k != index]
    out: list[NextExperiment] = []
    # No cycle of the menu could be followed at a sampling rate that shows held speeds alone.
    followed = not all(piece.slow for piece in library.scene.table.pieces)
    if len(hypotheses) > 1 and floor_nm > 0.0 and followed:
        out = _ranked(library, others, hypotheses, floor_nm, limits)
    told = {name for experiment in out for name in experiment.tells_apart}
    left = [h.effect for h in hypotheses[1:] if h.effect not in told]
    if left:
        out.append(set_up_only(effect, left, _NO_MOTION if followed else _TOO_SELDOM))
    if paired:
        out.append(set_up_only(effect, [partner], _SLIDING))
    return tuple(out)


def _ranked(
    library: Library,
    others: Sequence[Candidate],
    hypotheses: Sequence[Hypothesis],
    floor_nm: float,
    limits: AxisLimits | None,
) -> list[NextExperiment]:
    """Return the menu's entries that decide within reasonable time, the best first."""
    duel = Duel.of(library, others, hypotheses, floor_nm)
    placed = library.scene.has("position_rad")
    proposals = menu(library.scene, limits)
    out = []
    for load in sorted({part.load for proposal in proposals for part in proposal.parts}):
        alike = [p for p in proposals if p.parts[0].load == load]
        experiments = duel.on(elsewhere(library.scene, [proposal.parts for proposal in alike]))
        first = 0
        for proposal in alike:
            runs = range(first, first + len(proposal.parts))
            first += len(proposal.parts)
            worth = _worth(experiments.only(runs), proposal)
            if worth is not None:
                out.append(_as_experiment(proposal, worth, hypotheses, placed=placed))
    return sorted(out, key=lambda e: -e.gain_per_s)


@dataclass(frozen=True)
class _Worth:
    """What a proposal is worth.

    Parameters
    ----------
    rivals : tuple of int
        Numbers of the hypotheses that it tells from the first.
    times : int
        How often it must be driven for that.
    gain_per_s : float
        Expected gain in log density over the rivals, for a second of driving and setting up.
    """

    rivals: tuple[int, ...]
    times: int
    gain_per_s: float


def _worth(experiment: Experiment, proposal: Proposal) -> _Worth | None:
    """Return what a proposal is worth; None where it decides nothing within the longest time."""
    hypotheses = experiment.duel.hypotheses
    most = max(1, math.floor(_LONGEST_S / proposal.driven_s))
    # As warm as the recordings ended, and right after them: there only the shapes of the two laws
    # differ, which neither has for sure.
    goes_on = all(part.warmth == 1.0 and part.later == 0.0 for part in proposal.parts)

    def decides(rival: int, times: int) -> bool:
        if goes_on and {hypotheses[0].effect, hypotheses[rival].effect} == _WARMTH_OR_USE:
            return False
        return experiment.gain(rival, float(times), _ENOUGH) >= DECISIVE

    rivals = tuple(j for j in range(1, len(hypotheses)) if decides(j, most))
    if not rivals:
        return None
    low, high = 0, most
    if all(decides(j, 1) for j in rivals):
        high = 1
    while high - low > 1:
        middle = (low + high) // 2
        enough = all(decides(j, middle) for j in rivals)
        low, high = (low, middle) if enough else (middle, high)
    gained = sum(
        hypotheses[j].probability * experiment.gain(j, float(high), _PLENTY) for j in rivals
    ) / sum(h.probability for h in hypotheses[1:])
    return _Worth(rivals, high, gained / (proposal.set_up_s + high * proposal.driven_s))


def _as_experiment(
    proposal: Proposal, worth: _Worth, hypotheses: Sequence[Hypothesis], *, placed: bool
) -> NextExperiment:
    """Return a proposal as what an explanation says; without a place it cannot be driven."""
    seconds = worth.times * proposal.driven_s
    rivals = tuple(hypotheses[j].effect for j in worth.rivals)
    often = "" if worth.times == 1 else f", {worth.times} times"
    wait = f" {proposal.set_up}" if proposal.set_up else ""
    return NextExperiment(
        sentence=(
            f"{proposal.what}{often}: {lasting(math.ceil(seconds))} of driving should tell "
            f"{_told(hypotheses[0].effect, rivals)}.{wait}"
        ),
        tells_apart=(hypotheses[0].effect, *rivals),
        seconds=seconds,
        gain_per_s=worth.gain_per_s,
        trajectory=proposal.trajectory.to_json() if placed else None,
        set_up=proposal.set_up,
        runs=tuple(PlannedRun(worth.times, p.warmth, p.load) for p in proposal.parts),
    )


def set_up_only(effect: str, rivals: Sequence[str], why: str = _UNTOLD) -> NextExperiment:
    """Return what else decides where none of the menu's motions does, and why none does."""
    advice = " ".join(dict.fromkeys(told_apart_by(effect, rival) for rival in rivals))
    return NextExperiment(
        sentence=f"{why.format(_told(effect, rivals))} What does: {advice}",
        tells_apart=(effect, *rivals),
        seconds=math.nan,
        gain_per_s=0.0,
        set_up=advice,
    )


def _told(effect: str, rivals: Sequence[str]) -> str:
    """Return who is told from whom, in words."""
    return f"{NAMES[effect]} from {' and from '.join(NAMES[rival] for rival in rivals)}"
