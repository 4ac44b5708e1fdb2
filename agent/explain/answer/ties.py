"""Which findings may be another effect, and whether that leaves the answer open."""

from __future__ import annotations

from collections.abc import Sequence

from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.result import Finding

_ASIDE = 0.2  # of the difference to the simulation as given: a number that explains less


_FAR_LIKELIER = 0.8  # from here on what was found and its rivals do not "fit equally well"


def is_far_likelier(finding: Finding) -> bool:
    """Return whether what was found is far likelier than all that it may be in truth."""
    return finding.probability >= _FAR_LIKELIER


def first_tie(findings: Sequence[Finding]) -> Finding | None:
    """Return the first finding that another effect may be in truth."""
    return next((f for f in findings if f.alternatives), None)


def is_tied(findings: Sequence[Finding]) -> bool:
    """Return whether the answer is open between effects, and not a number beside it alone.

    A torque constant that is a percent off, or the inertia, does not take back what is missing.
    """
    laws = any(f.form != OWN_NUMBER for f in findings)
    return any(
        f.alternatives
        for f in findings
        if not (laws and f.form == OWN_NUMBER and f.energy_share < _ASIDE)
    )
