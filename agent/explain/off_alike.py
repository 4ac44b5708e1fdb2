"""Numbers that all come out off by one factor beside a law, and are too little to be told wrong.

Inertia and friction have nothing in common but the torque in which they are told, and that they all
moved alike is no uncertainty of theirs: a torque constant, which is told as a wrong number from
twice the noise's energy on. Where holding them costs less than that they are said to be alike.
"""

from __future__ import annotations

from agent.explain.answer.amounts import factor, percent
from agent.explain.numbers.alike import off_alike
from agent.explain.rows.table import BASE
from agent.explain.study import Study


def off_alike_said(found: Study) -> str:
    """Return that the twin's numbers all moved by one factor; nothing where they did not.

    Parameters
    ----------
    found : Study
    """
    alike = None if found.numbers else off_alike(found.twin, found.model, BASE)
    if alike is None or alike.but or not found.choice.terms:
        return ""
    off = 1.0 / alike.factor.value - 1.0
    way = "larger" if off > 0.0 else "smaller"
    return (
        "beside what was found the simulation's inertia, Coulomb and viscous friction all come out "
        f"{percent(abs(off))} {way}, as where the real torque is the reported one times "
        f"{factor(alike.factor.value)}: too little of this mismatch to be told as a wrong number, "
        "and gravity, where it is held as given, is off by as much"
    )
