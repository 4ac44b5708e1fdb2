"""Recordings whose torque has a zero of their own each: found, and put on one zero.

No twin can know the zero of a recording. So each is taken off its torque, and everything is asked
once more. A hold-out's is one number that is read off the hold-out itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.answer import words
from agent.explain.answer.amounts import percent, torque
from agent.explain.answer.fits import Fit
from agent.explain.answer.result import Explanation, Finding, Verdict
from agent.explain.answer.said import Said
from agent.explain.choosing.candidate import Candidate
from agent.explain.choosing.search import Library
from agent.explain.choosing.shares import shares_of
from agent.explain.forms.zeros import OWN_ZEROS
from agent.explain.rows.run import Run
from agent.explain.rows.table import TooShortError, tabulate
from agent.explain.study import Study
from agent.identify.result import Floats, Parameter

_EFFECT = "torque-offset"
_SURELY = 1.96


@dataclass(frozen=True)
class Zeros:
    """The zeros of recordings.

    Parameters
    ----------
    zeros_nm : tuple of float
        One for each recording to learn from.
    spread : Parameter
        Their root mean square about their mean.
    probability, share : float
        Of the finding.
    energy_nm2 : float
        Mean square torque that they account for.
    without_nm : float
        What the refitted twin leaves that does not know them, rms.
    """

    zeros_nm: tuple[float, ...]
    spread: Parameter
    probability: float
    share: float
    energy_nm2: float
    without_nm: float

    def finding(self) -> Finding:
        """Return them as a finding."""
        most = torque(max(abs(zero) for zero in self.zeros_nm))
        told = f"The torque has another zero in each recording, by up to {most}."
        return Finding(
            effect=_EFFECT,
            rank=1,
            probability=self.probability,
            energy_share=self.share,
            where=(),
            said=Said(
                told, place=told, worth=f"This explains {percent(self.share)} of the mismatch."
            ),
            parameters={"zero_spread_nm": self.spread},
            holdout_rmse_without_nm=self.without_nm,
            form=OWN_ZEROS,
        )


def own_zeros(found: Study) -> Zeros | None:
    """Return the zeros of a study's recordings; None where they have the same."""
    terms, floor_nm = found.choice.terms, max(found.floor.value_nm, 0.0)
    own = [i for i, term in enumerate(terms) if term.scored.form.name == OWN_ZEROS]
    if not own:
        return None
    library = found.library
    zeros, errors = _beside(library, [t.candidate for i, t in enumerate(terms) if i not in own])
    spread = float(np.std(zeros))
    half = _SURELY * float(np.sqrt(np.mean(errors**2) / errors.size))
    shares = shares_of(library, found.choice.candidates, floor_nm)
    share = min(sum(shares[i] for i in own), 1.0)
    refitted_nm2 = float(np.mean(found.refitted_nm[library.weighing.rows] ** 2))
    return Zeros(
        tuple(zeros.tolist()),
        Parameter(spread, (max(spread - half, 0.0), spread + half)),
        max(terms[i].probability for i in own),
        share,
        share * max(refitted_nm2 - floor_nm**2, 0.0),
        math.sqrt(refitted_nm2),
    )


def _beside(library: Library, terms: Sequence[Candidate]) -> tuple[Floats, Floats]:
    """Return every recording's zero beside terms and the twin's own numbers, and its error, N m."""
    table, weighing = library.scene.table, library.weighing
    run, count = table.run[weighing.rows], len(table.runs)
    shares = (run[:, np.newaxis] == np.arange(count)) * weighing.weight[:, np.newaxis]
    columns = np.concatenate([shares, library.model(terms)], axis=1)
    found = np.linalg.lstsq(columns, library.target, rcond=None)[0]
    left = (library.target - columns @ found) / weighing.weight
    sizes = np.diff(np.append(weighing.starts, left.shape[0]))
    means = np.add.reduceat(left, weighing.starts) / sizes
    errors = np.zeros(count)
    for k in range(count):
        blocks = means[weighing.run[weighing.starts] == k]
        errors[k] = float(np.std(blocks)) / math.sqrt(max(blocks.size, 1))
    return found[:count], errors


def on_one_zero(zeros: Zeros, runs: Sequence[Run]) -> list[Run]:
    """Return recordings with their zeros taken off."""
    return [_taken_off(run, zero) for run, zero in zip(runs, zeros.zeros_nm, strict=True)]


def on_zeros_of_their_own(runs: Sequence[Run], found: Study) -> tuple[Run, ...]:
    """Return recordings that nothing was learnt from without the zero that each shows.

    Parameters
    ----------
    runs : sequence of Run
    found : Study
        Of recordings on one zero.
    """
    return tuple(_taken_off(run, _zero_nm(run, found)) for run in runs)


def _zero_nm(run: Run, found: Study) -> float:
    """Return what a recording shows whichever way it slides; 0 where it slides one way alone."""
    table = found.table
    try:
        own = tabulate(found.extended, (run,), table.cutoff_hz, align_velocity=table.aligned)
    except (TooShortError, ValueError):
        return 0.0
    rows = own.sliding
    way = np.sign(own.rows["velocity_rad_s"][rows])
    if not (way > 0.0).any() or not (way < 0.0).any():
        return 0.0
    columns = np.column_stack((np.ones_like(way), way))
    return float(np.linalg.lstsq(columns, own.target_nm[rows], rcond=None)[0][0])


def beside_zeros(
    answer: Explanation, zeros: Zeros, held_out: Sequence[Run], as_given: Fit
) -> Explanation:
    """Return the answer of recordings on one zero, with the zeros in it.

    Parameters
    ----------
    answer : Explanation
    zeros : Zeros
    held_out : sequence of Run
    as_given : Fit
        Of the twin as given to the recordings as they are.
    """
    reason = (
        "the recordings' zeros were taken off their torque before everything else was judged, and "
        "twin.toml does not hold them: a drive that measures its current sensor's zero whenever it "
        "is switched on does so"
    )
    if held_out:
        reason += "; that of each hold-out was read off the hold-out itself, one number each"
    verdict: dict[Verdict, Verdict] = {
        "no-mismatch": "explained",
        "unexplained": "partly-explained",
    }
    floor_nm = answer.floor.value_nm
    above = max(answer.refitted.rmse_nm**2 - floor_nm**2, 0.0)
    at = sum(f.energy_share * above > zeros.energy_nm2 for f in answer.findings)
    findings = (*answer.findings[:at], zeros.finding(), *answer.findings[at:])
    told = replace(
        answer,
        verdict=verdict.get(answer.verdict, answer.verdict),
        baseline=as_given,
        findings=tuple(replace(f, rank=rank) for rank, f in enumerate(findings, start=1)),
        reasons=(reason, *answer.reasons),
    )
    return replace(told, sentence=words.summary_of(told))


def _taken_off(run: Run, zero_nm: float) -> Run:
    return replace(run, signals=replace(run.signals, torque_nm=run.signals.torque_nm - zero_nm))
