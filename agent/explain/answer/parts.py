"""What a finding's sentence is made of, so that a page can say each part once, where it belongs."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass, replace

from agent.explain.answer.fits import Holdout
from agent.explain.answer.located import Finding
from agent.explain.answer.names import COSTS_NO_TORQUE, OWN_NUMBER, effect_name
from agent.numbers import fixed

_NEXT_SENTENCE = re.compile(r"(?<=\.) (?=[A-Z0-9±])")
_DETAIL = re.compile(r" \(([^)]*)\)")
_WORTH = "This explains "
_SMALL = 0.10  # of the mismatch: one reads it as of no account
_MATTERS = 1.5  # times the error: far beyond what chance makes of it
_PLAIN = 3.0  # times: from there on tenths say nothing


@dataclass(frozen=True)
class Parts:
    """A finding's sentence, taken apart.

    Parameters
    ----------
    lead : str
        The sentence that is read from afar.
    place : str
        Of it, where and how much; empty where it is not said so.
    worth : str
        What it explains, where that is a sentence of its own.
    caveat : str
        What must be known beside it.
    """

    lead: str
    place: str
    worth: str
    caveat: str


def first_sentence(text: str) -> tuple[str, str]:
    """Return the first sentence of a text, and the others."""
    first, *others = _NEXT_SENTENCE.split(text, maxsplit=1)
    return first, "".join(others)


def parts_of(finding: Finding) -> Parts:
    """Return what a finding's sentence is made of."""
    lead, rest = first_sentence(finding.sentence)
    worth, caveat = first_sentence(rest) if rest.startswith(_WORTH) else ("", rest)
    return Parts(lead, _place(lead, finding.effect), worth, caveat)


def _place(lead: str, effect: str) -> str:
    """Return where and how much, with what an effect's name has in brackets; without its name."""
    for mark in (";", ":"):  # the main finding's, and any other's: see `finding_sentence`
        begin, named, rest = lead.partition(f"{mark} {effect_name(effect)}")
        if named:
            detail = _DETAIL.match(rest)
            return f"{begin}: {detail[1]}." if detail else f"{begin}."
    return ""


def times_without(finding: Finding, holdout: Holdout | None, floor_nm: float) -> float:
    """Return how many times as large the error would be without a finding; NaN if not to be told.

    A share says how much of the first error an effect carries. Beside an effect that carries nearly
    all of it a share is small, though the error that is left in the end may be many times as large
    without it. This is told where the share is below a tenth and the error half as large again. It
    is compared with the greater of the error on unseen data and the noise, below which no error of
    other recordings is.
    """
    if holdout is None or holdout.unsure or finding.energy_share >= _SMALL:
        return math.nan
    if finding.form == OWN_NUMBER or finding.effect in COSTS_NO_TORQUE:
        return math.nan
    known = [v for v in (holdout.extended.rmse_nm, floor_nm) if math.isfinite(v)]
    error_nm = max(known, default=0.0)
    times = finding.holdout_rmse_without_nm / error_nm if error_nm > 0.0 else math.nan
    return times if times >= _MATTERS else math.nan


def as_large(times: float) -> str:
    """Return how many times as large an error is: whole, unless it is little more than once."""
    return f"{fixed(times, 0 if times >= _PLAIN else 1)} times as large"


def without_it(times: float) -> str:
    """Return how large the error would be, as it ends a sentence."""
    return f"without it the error would be {as_large(times)}"


def weighed(finding: Finding, holdout: Holdout | None, floor_nm: float) -> Finding:
    """Return a finding whose sentence says what its small share hides."""
    times = times_without(finding, holdout, floor_nm)
    if not math.isfinite(times):
        return finding
    parts = parts_of(finding)
    told = [text for text in (parts.lead, parts.worth) if text]
    told[-1] = f"{told[-1].removesuffix('.')}, but {without_it(times)}."
    return replace(finding, sentence=" ".join([*told, *[parts.caveat] * bool(parts.caveat)]))
