"""The head of an answer: one sentence to be read from afar, and a line for each other thing."""

from __future__ import annotations

import math
import re
from collections.abc import Sequence
from dataclasses import dataclass

from agent.explain.answer.amounts import percent
from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.own_effect import finding_name
from agent.explain.answer.result import Explanation, Finding
from agent.explain.answer.sentences import shared
from agent.explain.answer.small_share import times_without, without_it
from agent.explain.answer.ties import first_tie
from agent.explain.answer.words import TOLD, smaller_sentence, tie_sentence, what_stays
from agent.report.explanation.words import LITTLE, decidable, heading, verdict_words

_NEXT_SENTENCE = re.compile(r"(?<=\.) (?=[A-Z0-9±])")


@dataclass(frozen=True)
class Head:
    """What is said before any list or picture; caveats, places and numbers stand further below.

    Parameters
    ----------
    first : str
        The answer in one sentence.
    worth : str
        What that explains, where the sentence does not say so.
    further : tuple of str
        The other findings, a line each.
    rest : tuple of str
        What has no name, what all of it is worth, and what is not told apart.
    """

    first: str
    worth: str = ""
    further: tuple[str, ...] = ()
    rest: tuple[str, ...] = ()

    def says(self, sentence: str) -> bool:
        """Tell whether a sentence stands here, as it is or as one that goes on."""
        return any(sentence.rstrip(".") in line for line in (self.first, *self.further))


def head_of(explanation: Explanation, *, listed: bool = False) -> Head:
    """Return the head of an explanation.

    Parameters
    ----------
    explanation : Explanation
    listed : bool
        Whether the causes of a tie are listed beneath, each with its probability.
    """
    if not decidable(explanation):
        return Head(explanation.sentence or verdict_words(explanation).meaning)
    if not explanation.findings:
        first, rest = _first_sentence(explanation.sentence or verdict_words(explanation).meaning)
        return Head(first, rest=(rest,) if rest else ())
    main, *others = explanation.told
    said = main.said
    smaller = smaller_sentence(len(explanation.findings))
    told = [main, *others[: TOLD - 1]]
    further = [_line(told, at, explanation) for at in range(1, len(told))]
    if smaller:
        further.append(smaller)
    first, worth = said.lead, said.worth
    if explanation.unit_off:  # no cause that is named holds before that is put right
        first, worth, further = explanation.unit_off, "", [said.lead, *further]
    return Head(
        first,
        worth,
        tuple(further),
        (*what_stays(explanation), *([] if listed else _tie(explanation))),
    )


def _first_sentence(text: str) -> tuple[str, str]:
    """Return the first sentence of a text, and the others."""
    first, *others = _NEXT_SENTENCE.split(text, maxsplit=1)
    return first, "".join(others)


def _tie(explanation: Explanation) -> list[str]:
    """Return what is not told apart, and what decides where no experiment beneath says so."""
    tied = first_tie(explanation.findings)
    if tied is None:
        return []
    return [tie_sentence(tied, to_decide=explanation.next_experiment is None)]


def _line(told: Sequence[Finding], at: int, explanation: Explanation) -> str:
    """Return a finding beside the main one: its name and worth, or the number that is wrong.

    Where one above it has the same name, it says which of the two it is.
    """
    finding = told[at]
    if not finding.said.place or finding.effect in {above.effect for above in told[:at]}:
        return finding.said.lead
    return f"{heading(finding_name(finding))}: {_worth(finding, explanation)}."


def _worth(finding: Finding, explanation: Explanation) -> str:
    times = times_without(finding, explanation.holdout, explanation.floor.value_nm)
    if math.isfinite(times):
        return without_it(times)
    beside_numbers = any(f.form == OWN_NUMBER for f in explanation.findings)
    share = percent(max(finding.energy_share, LITTLE))
    return f"{share} of {shared(finding.form, beside_numbers=beside_numbers)}"
