"""What a dry run says of the preconditions: what would refuse first, then who judges the rest."""

from __future__ import annotations

from collections.abc import Sequence

from agent.cell.cell import Axis, Cell
from agent.cycle.preconditions import Judged, Precondition, preconditions
from agent.cycle.preflight import Condition

_NAME_WIDTH = 26
_RELEASE_SAYS = ": the release says so"


def judged_in_words(cell: Cell, axis: Axis, judged: Sequence[Condition]) -> list[str]:
    """Return every precondition, a line each: refused, held, and by whom the others are judged.

    Parameters
    ----------
    cell, axis : Cell, Axis
        The description.
    judged : sequence of Condition
        What could be judged so far.
    """
    known = {condition.name: condition for condition in judged}
    out = refused_in_words([c.reason for c in judged if not c.holds])
    if holding := [condition.name for condition in judged if condition.holds]:
        out += ["", "Holds now:", f"  {', '.join(holding)}"]
    later: dict[str, list[str]] = {}
    for precondition in preconditions(cell, axis):
        if precondition.name not in known:
            asks = precondition.asks.removesuffix(_RELEASE_SAYS if cell.release is None else "")
            line = f"  {precondition.name:<{_NAME_WIDTH}}{asks}"
            later.setdefault(_heading(cell, precondition), []).append(line)
    for heading, lines in later.items():
        out += ["", f"{heading}:", *lines]
    return out


def refused_in_words(reasons: Sequence[str]) -> list[str]:
    """Return what a cycle would be refused for, as far as it is known now."""
    if not reasons:
        return ["Nothing that is known now would be refused; what is judged later stands below."]
    if len(reasons) == 1:
        return [f"Would be refused now: {reasons[0]}."]
    return ["Would be refused now:", *(f"  - {reason}" for reason in reasons)]


def _heading(cell: Cell, precondition: Precondition) -> str:
    """Say who judges a precondition and when, or that a person has to answer for it."""
    if precondition.judged is Judged.BY_CELL and cell.release is None:
        return "NOT JUDGED, you must guarantee it (the cell has no [release])"
    return f"Judged {precondition.judged.value}"
