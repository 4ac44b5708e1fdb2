"""The verdict, and how much of the mismatch stays unexplained."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.answer.result import Finding, Verdict
from agent.explain.answer.ties import is_tied
from agent.explain.choosing.materiality import CLOSE, FAR
from agent.explain.choosing.shares import unseen_nm2
from agent.explain.location.regions import AXIS
from agent.explain.numbers.model import predicted
from agent.explain.rows.refit import refit
from agent.explain.study import Study

_MOST_LEFT = 0.30  # of the mismatch: with more left over, what was named explains too little
_OUTWEIGHS = 0.5  # of what was named: so much of what is left along one axis unsays it
_MUCH = 0.05  # of the torque, rms
_CELL_BETTER = 1.20
_STILL_VARIES = 0.15  # of what is left, along the axis of the main finding

MUCH_LEFT = 0.5 * _MOST_LEFT
"""Of the mismatch: with more left over, it is explained in part."""

OWN_NUMBERS = frozenset(
    {"inertia-error", "wrong-number", "gravity-imbalance", "torque-constant-error"}
)
"""What the twin's own numbers can be wrong by: named even where physics beside them is not."""

SHOWN = frozenset({"torque-saturation"})
"""What the signals show by themselves: named however much of the mismatch it leaves."""


def verdict_of(study: Study, findings: Sequence[Finding], left_share: float) -> Verdict:
    """Return the verdict of contract section 6.

    Parameters
    ----------
    study : Study
    findings : sequence of Finding
    left_share : float
        Of the mismatch, what stays.
    """
    shown = any(cell.counts for cell in study.left_cells)
    missing = study.left.ratio > (CLOSE if shown else FAR) or left_without_measure(study, findings)
    lined = any(line.matters for line in study.lines)
    if not study.choice.terms:
        if (missing or lined) and findings:
            return "partly-explained"
        little = left_share <= MUCH_LEFT and _explained_before(study)
        if lined or (missing and not little):
            return "unexplained"
        if not findings:
            return "unexplained" if far_from_given(study) else "no-mismatch"
        return "tied" if is_tied(findings) else "explained"
    plain, full = float(study.choice.plain.sum()), float(study.choice.full.sum())
    best_cell = max((cell.gain for cell in study.cells if cell.counts), default=0.0)
    outdone = best_cell * plain > _CELL_BETTER * (plain - full) and study.left.ratio > CLOSE
    much = left_share > MUCH_LEFT
    # A swing above the band unsays nothing that was named within it.
    within = min(left_share, _left_within(study)) if lined else left_share
    # Without a floor nobody knows how many times the noise is left; its kind shows that it is none.
    far = study.left.ratio > FAR or study.left.without_measure
    too_little = within > _MOST_LEFT and (far or _outweighed(study))
    if missing and (too_little or outdone or (much and _misshapen(study))):
        return "unexplained"
    if (missing or lined) and much:
        return "partly-explained"
    return "tied" if is_tied(findings) else "explained"


def left_without_measure(study: Study, findings: Sequence[Finding]) -> bool:
    """Return whether more than noise stays beside what is named, though no floor says how much.

    Without a name there is nothing to hold it against: it may be noise, as long as it is little of
    the torque.
    """
    named = study.choice.terms or study.denied or any(f.effect in SHOWN for f in findings)
    return (bool(named) or _is_much(study)) and study.left.without_measure


def _is_much(study: Study) -> bool:
    """Return whether what is left is more of the torque than drives and laws are exact to."""
    rows = study.library.weighing.rows[study.left.usual]
    torque, left = study.table.measured_nm[rows], study.model.residual_nm[study.left.usual]
    return float(left @ left) > _MUCH**2 * float(torque @ torque)


def _left_within(study: Study) -> float:
    return left_share(study, above_band=False)


def far_from_given(study: Study) -> bool:
    """Return whether the twin as given, which has seen none of this, is clearly above the noise.

    Then there is a mismatch, whatever of it has a name. Slow noise, which every refit leaves and no
    floor measured within half a second contains, is none.
    """
    library, floor_nm = study.library, study.left.noise_nm
    if not study.floor.value_nm > 0.0:
        return False
    given = unseen_nm2(library, np.zeros((library.target.shape[0], 0)))
    refitted = unseen_nm2(library, library.base)
    noise = min(max(refitted, floor_nm**2), (CLOSE * floor_nm) ** 2)
    return given > FAR**2 * noise


def _explained_before(study: Study) -> bool:
    """Return whether what a twin's effects explain is what its mismatch is to be judged by.

    What stays beside a name in one explanation must not have become a mismatch in the next, which
    is given the twin that the first one wrote.
    """
    known = study.twin.effects and not study.table.simulated and not study.choice.terms
    return bool(known) and study.left.ratio <= FAR


def _mismatch_nm2(study: Study) -> float:
    """Return the mean square that the refitted twin leaves; that of the bare one, see above."""
    rows, table = study.library.weighing.rows[study.left.usual], study.table
    if not _explained_before(study):
        return float(np.mean(study.refitted_nm[rows] ** 2))
    effects_nm = table.given_nm - predicted(table, replace(study.twin, effects=()))
    return float(np.mean(refit(table, -effects_nm)[1][rows] ** 2))


def _outweighed(study: Study) -> bool:
    """Return whether what is left has an axis that matters next to what was named.

    Close to the noise, the joint's own small effects and slow noise are a large part of a small
    mismatch. Spread over many axes, they do not unsay a name that explains far more than any.
    """
    plain, full = float(study.choice.plain.sum()), float(study.choice.full.sum())
    still = max((cell.gain for cell in study.left_cells if cell.counts), default=0.0)
    return still * full > _OUTWEIGHS * (plain - full)


def _misshapen(study: Study) -> bool:
    """Return whether what is left varies most along the very axis that the main finding explains.

    A law that leaves a curve along its own axis has the place, and not the shape: it is no name.
    """
    cells = [c for c in study.left_cells if c.counts and not c.axis.startswith("frequency_hz")]
    main = max(study.choice.terms, key=lambda term: term.scored.screened)
    return (
        study.left.ratio > FAR
        and bool(cells)
        and cells[0].gain > _STILL_VARIES
        and cells[0].axis == AXIS[main.scored.form.effect]
    )


def left_share(study: Study, findings: Sequence[Finding] = (), *, above_band: bool = True) -> float:
    """Return which share of the refitted twin's mismatch, above the noise, the findings leave.

    Zero where what is left is noise: a mismatch that was hardly there cannot be left over. Where
    nobody knows how loud noise is, all of it counts that is not noise in kind.

    Parameters
    ----------
    study : Study
    findings : sequence of Finding
        What is named; what the signals show by themselves is no part of the study's model.
    above_band : bool
        Whether what swings of its own above the compared band is a part of the mismatch.
    """
    # What swings of its own is outside the band, or passes for noise where little else is left.
    apart = sum(
        line.energy_nm2
        for line in study.lines
        if line.matters and (above_band if not line.in_band else study.left.ratio <= CLOSE)
    )
    without_measure = left_without_measure(study, findings)
    if study.left.ratio <= CLOSE and not study.choice.terms and not apart and not without_measure:
        return 0.0
    noise = 0.0 if without_measure else study.left.noise_nm**2
    before = max(_mismatch_nm2(study) - noise, 0.0) + apart
    after = max(float(np.mean(study.model.residual_nm[study.left.usual] ** 2)) - noise, 0.0) + apart
    return min(after / before, 1.0) if before > 0.0 else 0.0
