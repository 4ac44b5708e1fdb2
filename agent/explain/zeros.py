"""Recordings whose torque has a zero of their own each: found, and put on one zero.

No twin can know the zero of a recording. So each is taken off its torque, and everything is asked
once more. A hold-out's is one number that is read off the hold-out itself.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.explain.answer.amounts import torque
from agent.explain.answer.fits import Fit
from agent.explain.answer.result import Explanation, Finding
from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.search import Library
from agent.explain.choosing.shares import shares_of
from agent.explain.forms.zeros import OWN_ZEROS
from agent.explain.rows.half_seconds import half_seconds, worth_of
from agent.explain.rows.run import Run
from agent.explain.rows.table import GRAVITY_AT, TooShortError, tabulate
from agent.explain.study import Study
from agent.explain.taken_off import taken_off, told_beside
from agent.identify.result import Floats, Parameter

_EFFECT = "torque-offset"
_SHOWN = 20  # recordings by name
_SURELY = 1.96
_APART = 0.05  # of a constant: with less of it that is not gravity's, gravity is one
_BEYOND = 5.0  # standard deviations of a sum of squares


@dataclass(frozen=True)
class Zeros:
    """The zeros of recordings.

    Parameters
    ----------
    names : tuple of str
        Of the recordings to learn from.
    zeros_nm : tuple of float
        One for each of them.
    spread : Parameter
        Their root mean square about their mean.
    probability, share : float
        Of the finding.
    energy_nm2 : float
        Mean square torque that they account for.
    without_nm : float
        What the refitted twin leaves that does not know them, rms.
    sure : bool
        Whether they differ by more than slow noise makes of so long recordings.
    """

    names: tuple[str, ...]
    zeros_nm: tuple[float, ...]
    spread: Parameter
    probability: float
    share: float
    energy_nm2: float
    without_nm: float
    sure: bool

    def finding(self) -> Finding:
        """Return them as a finding."""
        most = torque(max(abs(zero) for zero in self.zeros_nm))
        told = f"The torque has another zero in each recording, by up to {most}."
        return taken_off(
            _EFFECT,
            OWN_ZEROS,
            told,
            {"zero_spread_nm": self.spread},
            probability=self.probability,
            share=self.share,
            without_nm=self.without_nm,
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
        tuple(run.name for run in found.table.runs),
        tuple(zeros.tolist()),
        Parameter(spread, (max(spread - half, 0.0), spread + half)),
        max(terms[i].probability for i in own),
        share,
        share * max(refitted_nm2 - floor_nm**2, 0.0),
        math.sqrt(refitted_nm2),
        _differ(zeros, errors),
    )


def _differ(zeros_nm: Floats, errors_nm: Floats) -> bool:
    """Return whether zeros differ surely by more than their errors, shape (r,) each.

    Without the one furthest from the others, too: what sets one recording apart may be anything.
    """
    furthest = int(np.argmax(np.abs(zeros_nm - np.median(zeros_nm))))
    others = np.arange(zeros_nm.size) != furthest
    return _apart(zeros_nm, errors_nm) and _apart(zeros_nm[others], errors_nm[others])


def _apart(zeros_nm: Floats, errors_nm: Floats) -> bool:
    weight = 1.0 / np.maximum(errors_nm, 1e-300) ** 2
    away = zeros_nm - float(weight @ zeros_nm) / float(weight.sum())
    free = zeros_nm.size - 1
    return float(weight @ away**2) > free + _BEYOND * math.sqrt(2.0 * free)


def _beside(library: Library, terms: Sequence[Candidate]) -> tuple[Floats, Floats]:
    """Return every recording's zero beside terms and the twin's own numbers, and its error, N m.

    On a stroke so short that gravity is nearly a constant, gravity stays what the twin says.
    """
    table, weighing = library.scene.table, library.weighing
    run, count = table.run[weighing.rows], len(table.runs)
    shares = (run[:, np.newaxis] == np.arange(count)) * weighing.weight[:, np.newaxis]
    model, pulls = library.model(terms), np.isin(np.flatnonzero(table.carried), GRAVITY_AT)
    weight = model[:, : pulls.size][:, pulls]
    alike = basis_of(weight)
    apart = weighing.weight - alike @ (alike.T @ weighing.weight)
    if float(apart @ apart) < _APART * float(weighing.weight @ weighing.weight):
        model = np.delete(model, np.flatnonzero(pulls), axis=1)
    columns = np.concatenate([shares, model], axis=1)
    found = np.linalg.lstsq(columns, library.target, rcond=None)[0]
    left = np.full(table.used.shape[0], np.nan)
    left[weighing.rows] = (library.target - columns @ found) / weighing.weight
    means = [half_seconds(left[piece.rows], piece) for piece in table.pieces]
    sizes = np.bincount(
        [piece.run for piece in table.pieces],
        [np.count_nonzero(np.isfinite(own)) for own in means],
        count,
    )
    together = np.concatenate(means)
    known = together[np.isfinite(together)]
    scatter = float(np.std(known)) if known.size else math.inf
    worth = worth_of(means) / max(float(sizes.sum()), 1.0)
    return found[:count], np.asarray(scatter / np.sqrt(np.maximum(worth * sizes, 1e-3)))


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
    own = [f"{name} {torque(nm)}" for name, nm in zip(zeros.names, zeros.zeros_nm, strict=True)]
    more = f", {len(own) - _SHOWN} more" if len(own) > _SHOWN else ""
    reason = (
        f"the recordings' zeros ({', '.join(own[:_SHOWN])}{more}) were taken off their torque "
        "before everything else was judged, and twin.toml does not hold them: a drive that "
        "measures its current sensor's zero whenever it is switched on does so"
    )
    if held_out:
        reason += "; that of each hold-out was read off the hold-out itself, one number each"
    return told_beside(answer, zeros.finding(), zeros.energy_nm2, as_given, reason)


def _taken_off(run: Run, zero_nm: float) -> Run:
    return replace(run, signals=replace(run.signals, torque_nm=run.signals.torque_nm - zero_nm))
