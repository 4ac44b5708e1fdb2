"""An answer of recordings that something was taken off, which is told among its findings."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from agent.explain.answer import words
from agent.explain.answer.amounts import percent
from agent.explain.answer.fits import Fit
from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.result import Explanation, Finding, Verdict
from agent.explain.answer.said import Said
from agent.identify.result import Parameter

_VERDICTS: Mapping[Verdict, Verdict] = {
    "no-mismatch": "explained",
    "unexplained": "partly-explained",
}


def beside_a_finding(verdict: Verdict) -> Verdict:
    """Return a verdict where something has been found beside what it was drawn from."""
    return _VERDICTS.get(verdict, verdict)


def taken_off(
    effect: str,
    form: str,
    told: str,
    parameters: Mapping[str, Parameter],
    *,
    probability: float,
    share: float,
    without_nm: float,
) -> Finding:
    """Return the finding of what some recordings were freed of: it is told by them, not by a place.

    Parameters
    ----------
    effect, form, told : str
        What it is, by its names and in a sentence.
    parameters : mapping of str to Parameter
    probability, share : float
        That it is so; of the mismatch, what it explains.
    without_nm : float
        What unseen data leave without it.
    """
    worth = f"This explains {percent(share)} of the mismatch."
    return Finding(
        effect=effect,
        rank=1,
        probability=probability,
        energy_share=share,
        where=(),
        said=Said(told, place=told, worth=worth),
        parameters=parameters,
        holdout_rmse_without_nm=without_nm,
        form=form,
    )


def told_beside(
    answer: Explanation, finding: Finding, energy_nm2: float, as_given: Fit, reason: str
) -> Explanation:
    """Return the answer with what was taken off as one of its findings, by its energy.

    Parameters
    ----------
    answer : Explanation
    finding : Finding
    energy_nm2 : float
        Mean square torque that it accounts for.
    as_given : Fit
        Of the twin as given to the recordings as they are.
    reason : str
        What was taken off, and what that means.
    """
    at = sum(_energy_nm2(f, answer) > energy_nm2 for f in answer.findings)
    findings = (*answer.findings[:at], finding, *answer.findings[at:])
    told = replace(
        answer,
        verdict=beside_a_finding(answer.verdict),
        baseline=as_given,
        findings=tuple(replace(f, rank=rank) for rank, f in enumerate(findings, start=1)),
        reasons=(reason, *answer.reasons),
    )
    return replace(told, sentence=words.summary_of(told))


def _energy_nm2(finding: Finding, answer: Explanation) -> float:
    """Return the mean square torque that a finding of an answer accounts for."""
    before = answer.baseline if finding.form == OWN_NUMBER else answer.refitted
    floor_nm = answer.floor.value_nm
    return finding.energy_share * max(before.rmse_nm**2 - floor_nm**2, 0.0)
