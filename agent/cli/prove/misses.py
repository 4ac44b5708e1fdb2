"""What was missed, case by case: nothing in a score is hidden in a mean."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from agent.cli.prove.case import CRASHED
from agent.cli.prove.plan import OUTSIDER

Case = Mapping[str, Any]

_REFUSED = (CRASHED, "not-decidable")  # other verdicts' reasons only limit what was said


def is_miss(case: Case) -> bool:
    """Return whether a case is not fully right: wrong, missing or additional names.

    Parameters
    ----------
    case : mapping
        One of the `cases` of a `stribeck.proof/1` document.
    """
    score = case["score"]
    if case["group"] == OUTSIDER:
        return not score["not_misnamed"]
    return not score["exact"]


def miss_lines(cases: Sequence[Case]) -> list[str]:
    """Return one line a case that is not fully right: seed, what was concealed, what was said."""
    missed = [case for case in cases if is_miss(case)]
    if not missed:
        return ["not fully right: none"]
    return [
        f"not fully right: {len(missed)} (seed, design, SNR: concealed -> said; () is tied)",
        *(f"  {_line(case)}" for case in missed),
    ]


def _line(case: Case) -> str:
    score = case["score"]
    concealed = " + ".join(score["truth"]) or "nothing"
    return (
        f"{case['seed']} {case['design']} {case['snr']:g}: {concealed} -> {_said(case)} "
        f"[{score['verdict']}]"
    )


def _said(case: Case) -> str:
    """Return the findings with their alternatives in brackets, or why there is none."""
    parts = []
    answer = case["explanation"]
    for finding in answer.get("findings", []):
        tied = ", ".join(a["effect"] for a in finding["alternatives"])
        parts.append(f"{finding['effect']} ({tied})" if tied else finding["effect"])
    reasons = answer.get("reasons", [])[:1] if answer["verdict"] in _REFUSED else []
    why = "".join(f" ({reason})" for reason in reasons)
    return " + ".join(parts) or f"no name{why}"
