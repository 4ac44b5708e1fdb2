"""An explanation as a technician reads it in a terminal of 80 columns."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Sequence

from agent.explain.answer.names import effect_name
from agent.explain.answer.own_effect import finding_name
from agent.explain.answer.result import Explanation, Finding, NextExperiment
from agent.explain.answer.words import after_colon
from agent.numbers import NO_NUMBER
from agent.report.explanation.errors import error_rows, improvement_in_words
from agent.report.explanation.head import Head, head_of
from agent.report.explanation.places import regions_in_words
from agent.report.explanation.rows import parameter_rows
from agent.report.explanation.words import (
    carried,
    decidable,
    found_title,
    heading,
    motion_needed,
    next_command,
    not_judged,
    percent,
    qualification,
    set_up_beside,
    share,
    tells_apart,
    trajectory_hint,
    unexplained_in_words,
    verdict_words,
    what_to_do,
)
from agent.report.rows import ParameterRow

WIDTH = 80
_NAME, _SHARE = 55, 14  # columns of a finding's name and of its share


def explanation_text(explanation: Explanation, *, axis: int | str = "", next_file: str = "") -> str:
    """Return the sentence and the numbers behind it, no line longer than 80 columns.

    Parameters
    ----------
    explanation : Explanation
    axis : int or str
        As the cell numbers it, for the command of the next experiment.
    next_file : str
        Where that experiment's trajectory was written. Commands and file names are never broken.
    """
    head = head_of(explanation)
    lines = [f"{verdict_words(explanation).status}.", *_head(head, explanation)]
    if not decidable(explanation):
        lines += ["", "Why not:", *_items(explanation.reasons)]
        lines += ["", "What to do:", *_items(what_to_do(explanation))]
        return "\n".join(lines)
    lines += ["", *_errors(explanation)]
    if explanation.findings:
        lines += ["", f"{found_title(explanation):<{_NAME}}{'share':>{_SHARE}}{'prob.':>9}"]
        for index, finding in enumerate(explanation.told):
            lines += ["", f"{explanation.beside}:"] if explanation.beside and index == 1 else []
            lines += _finding(finding, explanation, head)
    lines += _unexplained(explanation)
    if explanation.next_experiment is not None:
        lines += ["", *_next(explanation.next_experiment, str(axis), next_file)]
    if explanation.not_judged:
        lines += ["", "Not judged:"]
        lines += _items(
            f"{heading(why)}: {'; '.join(labels)}." for why, labels in not_judged(explanation)
        )
    if explanation.reasons:
        lines += ["", "Bear in mind:", *_items(explanation.reasons)]
    return "\n".join(lines)


def _head(head: Head, explanation: Explanation) -> list[str]:
    """Return the answer: the sentence, and a line each for what else there is to know."""
    lines = [line for said in (head.first, head.worth) for line in _wrapped(said)]
    if head.further and explanation.beside:
        lines += _wrapped(f"{explanation.beside}:")
    lines += _items(head.further)
    for said in (*head.rest, qualification(explanation)):
        lines += _wrapped(said)
    return lines


def _errors(explanation: Explanation) -> list[str]:
    """Return the table of errors: each stage on the data fitted, and on those not seen."""
    unit, rows = error_rows(explanation)
    unseen = explanation.holdout is not None
    title = f"Error, {unit} rms (fit)"
    lines = [f"{title:<28}{'data fitted':>21}" + f"{'not seen':>21}" * unseen]
    for row in rows:
        line = f"  {row.label:<26}{_error(row.rmse, row.fit)}"
        line += _error(row.unseen_rmse, row.unseen_fit) if unseen else ""
        lines.append(line.rstrip())
    holdout = explanation.holdout
    if holdout is not None and explanation.findings:
        said = [f"Removed: {improvement_in_words(holdout)} of the error on {holdout.source}"]
        if holdout.blocks:
            said.append(f"better in {holdout.wins} of {holdout.blocks} blocks")
        said.append(f"placebo {percent(holdout.placebo_percent, 1)}")
        lines += _wrapped("; ".join(said) + ".")
    return lines


def _error(rmse: str, fit: str) -> str:
    known = fit not in ("", NO_NUMBER)
    return f"{rmse:>10}{f'({fit} %)' if known else '':>11}"


def _finding(finding: Finding, explanation: Explanation, head: Head) -> list[str]:
    """Return one finding: a line of the table, how much and where, its numbers, its rivals."""
    first, *others = _wrapped(f"{finding.rank}. {heading(finding_name(finding))}", "", _NAME)
    worth = f"{carried(finding.energy_share):>{_SHARE}}{share(finding.probability):>9}"
    lines = [f"{first:<{_NAME}}{worth}", *(f"   {other}" for other in others)]
    names = (*explanation.recordings, *explanation.held_out)
    said = finding.said
    if not head.says(said.place or said.lead):
        lines += _wrapped(said.place or said.lead, "   ")
    lines += _wrapped(said.caveat, "   ")
    if finding.where:
        places = "; ".join(regions_in_words(finding.where, names))
        lines += _wrapped(f"where: {places}", "   ")
    lines += _numbers(parameter_rows(finding.parameters))
    for other in finding.alternatives:
        lines += _wrapped(
            f"or {effect_name(other.effect)} ({share(other.probability)}); told apart by: "
            f"{after_colon(other.told_apart_by)}",
            "   ",
        )
    return lines


def _numbers(rows: Sequence[ParameterRow]) -> list[str]:
    """Return a finding's numbers, and after them those that are not known, by the reason."""
    lines: list[str] = []
    unknown: dict[str, list[str]] = {}
    for row in rows:
        if not row.identified:
            unknown.setdefault(row.reason, []).append(row.label)
            continue
        value = f"{row.value} {row.unit}".strip()
        beside = row.interval or row.reason
        interval = f" ({beside})" if beside else ""
        lines += textwrap.wrap(
            f"   {row.label:<40} {value}{interval}", WIDTH, subsequent_indent=44 * " "
        )
    for reason, labels in unknown.items():
        lines += _wrapped(f"{'; '.join(labels)}: not identified: {reason}", "   ")
    return lines


def _unexplained(explanation: Explanation) -> list[str]:
    if not explanation.unexplained_where:
        return []
    names = (*explanation.recordings, *explanation.held_out)
    return [
        "",
        f"{unexplained_in_words(explanation)} It lies here:",
        *_items(regions_in_words(explanation.unexplained_where, names)),
    ]


def _next(experiment: NextExperiment, axis: str, file: str) -> list[str]:
    lines = ["Next:", *_wrapped(experiment.sentence)]
    lines += _wrapped(set_up_beside(experiment))
    lasts = motion_needed(experiment)
    needed = f"Motion needed: {lasts}." if lasts else ""
    lines += _wrapped(f"{tells_apart(experiment)} {needed}".strip())
    lines += _wrapped(trajectory_hint(experiment, file))
    command = next_command(experiment, axis, file)
    return lines + [f"  {command}"] * bool(command)


def _wrapped(text: str, indent: str = "  ", width: int = WIDTH) -> list[str]:
    return textwrap.wrap(
        text,
        width,
        initial_indent=indent,
        subsequent_indent=indent,
        break_on_hyphens=False,
    )


def _items(texts: Iterable[str]) -> Sequence[str]:
    return [
        line
        for text in texts
        for line in textwrap.wrap(
            text, WIDTH, initial_indent="  - ", subsequent_indent="    ", break_on_hyphens=False
        )
    ]
