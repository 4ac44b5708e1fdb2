"""Which experiment tells tied effects apart soonest, and how long it must be driven.

Every tied fit is simulated on a menu of safe changes to the cycle, its rivals are refitted to the
recordings and the experiment together, and the menu is ranked by the expected gain in log density
per second (T-optimality: see `experiment_gain`).
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from agent.explain.aliases import told_apart_by
from agent.explain.choice import Term
from agent.explain.experiment_gain import Duel, Experiment, Hypothesis
from agent.explain.experiment_menu import Proposal, menu
from agent.explain.experiment_motion import elsewhere
from agent.explain.result import NextExperiment
from agent.explain.search import Candidate, Library
from agent.explain.words import NAMES
from trajectories import AxisLimits

DECISIVE = 10.0
"""Difference in log density at which a tie is called broken."""

_ENOUGH, _PLENTY = 20.0, 100.0  # to decide; to rank: more is no better
_LONGEST_S = 1800.0  # of driving: an experiment that needs more is none
_MOST_RIVALS = 3
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
    paired = effect in _PAIR and term.scored.form.name in _PAIR_FORMS
    if paired:
        partner = next(iter(_PAIR - {effect}))
        hypotheses = [h for h in hypotheses if h.effect != partner]
    out: list[NextExperiment] = []
    if len(hypotheses) > 1:
        others = [t.candidate for k, t in enumerate(terms) if k != index]
        out += _ranked(library, others, hypotheses, floor_nm, limits)
        if not out:
            out.append(_set_up_only(effect, [h.effect for h in hypotheses[1:]]))
    if paired:
        out.append(_set_up_only(effect, [partner]))
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
    proposals = menu(library.scene, limits)
    out = []
    for load in sorted({part.load for proposal in proposals for part in proposal.parts}):
        alike = [p for p in proposals if p.parts[0].load == load]
        parts = [part for proposal in alike for part in proposal.parts]
        experiments = duel.on(elsewhere(library.scene, parts))
        first = 0
        for proposal in alike:
            runs = range(first, first + len(proposal.parts))
            first += len(proposal.parts)
            worth = _worth(experiments.only(runs), proposal)
            if worth is not None:
                out.append(_as_experiment(proposal, worth, hypotheses, library))
    return sorted(out, key=lambda e: -e.gain_per_s)


@dataclass(frozen=True)
class _Worth:
    """What a proposal gains when driven once, and how often it must be driven."""

    gain_per_s: float
    times: int


def _worth(experiment: Experiment, proposal: Proposal) -> _Worth | None:
    """Return what a proposal is worth; None where it does not decide within the longest time."""

    def decides(times: int) -> bool:
        return experiment.gain(float(times), _ENOUGH) >= DECISIVE

    low, high = 0, max(1, math.floor(_LONGEST_S / proposal.driven_s))
    if not decides(high):
        return None
    if decides(1):
        high = 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if decides(middle) else (middle, high)
    whole_s = proposal.set_up_s + high * proposal.driven_s
    return _Worth(experiment.gain(float(high), _PLENTY) / whole_s, high)


def _as_experiment(
    proposal: Proposal, worth: _Worth, hypotheses: Sequence[Hypothesis], library: Library
) -> NextExperiment:
    seconds = worth.times * proposal.driven_s
    effects = tuple(h.effect for h in hypotheses)
    often = "" if worth.times == 1 else f", {worth.times} times"
    wait = f" {proposal.set_up}" if proposal.set_up else ""
    placed = library.scene.has("position_rad")
    return NextExperiment(
        sentence=(
            f"{proposal.what}{often}: {math.ceil(seconds)} s of driving should tell "
            f"{_listed(effects)} apart.{wait}"
        ),
        tells_apart=effects,
        seconds=seconds,
        gain_per_s=worth.gain_per_s,
        trajectory=proposal.trajectory.to_json() if placed else None,
        set_up=proposal.set_up,
    )


def _set_up_only(effect: str, rivals: Sequence[str]) -> NextExperiment:
    """Return what else decides where no motion does."""
    advice = " ".join(dict.fromkeys(told_apart_by(effect, rival) for rival in rivals))
    effects = (effect, *rivals)
    return NextExperiment(
        sentence=(
            "No motion within the strokes, speeds and accelerations of these recordings tells "
            f"{_listed(effects)} apart: the one copies the other. In general: {advice}"
        ),
        tells_apart=effects,
        seconds=math.nan,
        gain_per_s=0.0,
        set_up=advice,
    )


def _listed(effects: Sequence[str]) -> str:
    names = [NAMES[effect] for effect in effects]
    return f"{', '.join(names[:-1])} and {names[-1]}"
