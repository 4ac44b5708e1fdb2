"""One opened case: was the right thing said? Label and explanation are JSON; nothing else counts.

An effect's id counts, and every id that the label lists as naming the same columns. A small effect
of the joint that reaches 2 % of the residual's energy may be named as well. Any other name is
false; whether the joint has no such thing at all, or less than 2 % of it, is told apart.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import Any

from agent.cli.prove.numbers import Located, Measured, located, measured

Document = Mapping[str, Any]
UNKNOWN_VERDICTS = frozenset({"unexplained", "partly-explained"})
_SMALL_SET = 2
_FIRST_CELLS = 3
_AXIS_WORDS: Mapping[str, str] = {"after_reversal_rad": "after_reversal_s"}


@dataclass(frozen=True)
class Score:
    """What one case counts.

    Parameters
    ----------
    truth : tuple of str
        The concealed effects.
    named : tuple of str
        The effects of the findings, the greatest share first.
    verdict, expected_verdict : str
    first_right : bool
        The first name is a concealed effect's.
    first_set : tuple of str
        The first name and its alternatives.
    set_right : bool
        A concealed effect is among them.
    covered : bool
        Every concealed effect is named, or is an alternative of a name.
    exact : bool
        Every concealed effect is named, and nothing false.
    absent, too_small : tuple of str
        False names: of what the joint does not have, and of what it has less than 2 % of.
    cell_right : bool or None
        One of the map's first three cells is along the concealed effect's axis.
    baseline_right, baseline_exact : bool
        The first term by error-reduction ratio is a concealed effect's; the first terms, as many as
        are concealed, are all of them. The baseline is told how many there are.
    floor_ratio : float or None
        Root mean square on the hold-outs over the noise floor that the tool found.
    located, measured : tuples
        Of each concealed effect that is named: where, and with which numbers.
    """

    truth: tuple[str, ...]
    named: tuple[str, ...]
    verdict: str
    expected_verdict: str
    first_right: bool
    first_set: tuple[str, ...]
    set_right: bool
    covered: bool
    exact: bool
    absent: tuple[str, ...]
    too_small: tuple[str, ...]
    cell_right: bool | None
    baseline: tuple[str, ...]
    baseline_right: bool
    baseline_exact: bool
    floor_ratio: float | None
    located: tuple[Located, ...] = ()
    measured: tuple[Measured, ...] = field(default=())

    @property
    def in_small_set(self) -> bool:
        """Return whether the first name is right, or one of two that stay tied is."""
        return self.first_right or (self.set_right and len(self.first_set) <= _SMALL_SET)

    @property
    def not_misnamed(self) -> bool:
        """Return whether the tool said that something stays unknown, and no false name."""
        return self.verdict in UNKNOWN_VERDICTS and not self.absent and not self.too_small

    @property
    def verdict_right(self) -> bool:
        """Return whether the verdict is the label's; tied is right where the effect is known."""
        tied = self.verdict == "tied" and self.expected_verdict == "explained"
        return tied or self.verdict == self.expected_verdict

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return asdict(self) | {
            "in_small_set": self.in_small_set,
            "not_misnamed": self.not_misnamed,
            "verdict_right": self.verdict_right,
        }


def score(label: Document, explanation: Document, baseline: Sequence[str]) -> Score:
    """Return what a case counts.

    Parameters
    ----------
    label : mapping
        As it was sealed.
    explanation : mapping
        A `stribeck.explanation/1` document; of one that crashed, only the verdict.
    baseline : sequence of str
        Effects by error-reduction ratio, the first term first.
    """
    concealed = label["effects"]
    truths = [_ids(effect) for effect in concealed]
    worth = set().union(*(_ids(n) for n in label["nuisances"] if n["counts_as_true"]))
    there = set().union(*(_ids(n) for n in label["nuisances"]))
    any_truth: set[str] = set().union(*truths)
    findings = explanation.get("findings", [])
    names = [str(finding["effect"]) for finding in findings]
    false = [n for n in names if n not in any_truth | worth]
    # A small effect that is worth naming may come first; it is not the answer.
    answers = [f for f in findings if f["effect"] in any_truth or f["effect"] not in worth]
    first = _said(answers[0]) if answers else ()
    said = [set(_said(finding)) for finding in findings]
    picks = tuple(baseline)
    holdout = explanation.get("holdout") or {}
    return Score(
        truth=tuple(str(effect["effect"]) for effect in concealed),
        named=tuple(names),
        verdict=str(explanation["verdict"]),
        expected_verdict=str(label["expected_verdict"]),
        first_right=bool(first) and first[0] in any_truth,
        first_set=first,
        set_right=bool(any_truth & set(first)),
        covered=_all_in(truths, set().union(*said)),
        exact=_all_in(truths, set(names)) and not false,
        absent=tuple(n for n in false if n not in there),
        too_small=tuple(n for n in false if n in there),
        cell_right=_cell_right(concealed, explanation.get("map", [])),
        baseline=picks,
        baseline_right=bool(picks) and picks[0] in any_truth,
        baseline_exact=_all_in(truths, set(picks[: len(truths)])),
        floor_ratio=holdout.get("floor_ratio"),
        located=tuple(
            located(e, f, explanation.get("band_hz")) for e, f in _pairs(concealed, findings)
        ),
        measured=tuple(m for e, f in _pairs(concealed, findings) for m in measured(e, f)),
    )


def _ids(effect: Document) -> set[str]:
    """Return all ids that are right for an effect."""
    return {str(effect["effect"]), *(str(other) for other in effect["also"])}


def _said(finding: Document) -> tuple[str, ...]:
    """Return a finding's name and its alternatives."""
    return (str(finding["effect"]), *(str(a["effect"]) for a in finding["alternatives"]))


def _all_in(truths: Sequence[set[str]], names: set[str]) -> bool:
    """Return whether every concealed effect has one of its ids among names."""
    return all(ids & names for ids in truths)


def _pairs(
    concealed: Sequence[Document], findings: Sequence[Document]
) -> list[tuple[Document, Document]]:
    """Return every concealed effect with the finding that names it, the greatest share first."""
    out = []
    for effect in concealed:
        same = [f for f in findings if f["effect"] in _ids(effect)]
        if same:
            out.append((effect, max(same, key=lambda f: float(f["energy_share"]))))
    return out


def _cell_right(concealed: Sequence[Document], cells: Sequence[Document]) -> bool | None:
    """Return whether the map's first cells point along a concealed effect's axis.

    The map is of the refitted twin: an effect that shows only without a refit has no cell in it.
    """
    seen = [effect for effect in concealed if effect["basis"] == "refitted"]
    if not seen or not cells:
        return None
    wanted = {region["variable"] for effect in seen for region in effect["where"]}
    axes = [str(cell["axis"]).split()[0] for cell in cells[:_FIRST_CELLS]]
    return any(_AXIS_WORDS.get(axis, axis) in wanted for axis in axes)
