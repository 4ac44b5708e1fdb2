"""Which finding tells of a law of a twin."""

from __future__ import annotations

from collections.abc import Container, Sequence

from agent.explain.answer.result import Finding
from agent.physics.twin import Effect


def finding_of(law: Effect, findings: Sequence[Finding], paired: Container[int]) -> Finding | None:
    """Return the finding that tells of a law; None for none.

    Parameters
    ----------
    law : Effect
    findings : sequence of Finding
    paired : container of int
        Ranks of those that tell of other laws.
    """
    own = [f for f in findings if f.effect == law.id and f.rank not in paired]
    numbers = law.numbers

    def apart(finding: Finding) -> float:
        shared = finding.parameters.keys() & numbers.keys()
        sizes = ((finding.parameters[name].value, numbers[name]) for name in shared)
        return sum(abs(a - b) / (abs(a) + abs(b) + 1e-12) for a, b in sizes)

    return min(own, key=apart, default=None)
