"""What every law says about itself: equation, parameters, source, limits; and how it refuses."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Law:
    """The identity card of one law.

    Parameters
    ----------
    id : str
        Lower case with hyphens.
    equation : str
        In the field's symbols.
    parameters : mapping of str to str
        Parameter name, with its unit, to its symbol and meaning.
    source : str
        Where the equation comes from.
    limits : str
        Where it stops being true.
    """

    id: str
    equation: str
    parameters: Mapping[str, str]
    source: str
    limits: str


def require(law: Law, values: object, *, positive: str = "", not_negative: str = "") -> None:
    """Refuse the parameters of a law that no joint can have.

    Parameters
    ----------
    law : Law
        Its parameters must all be finite attributes of `values`.
    values : object
        The dataclass that carries them.
    positive, not_negative : str
        Names, separated by blanks, that must be above zero, or zero and above.

    Raises
    ------
    ValueError
        Naming law, parameter, what was expected and what came.
    """
    for name in law.parameters:
        value = getattr(values, name)
        if isinstance(value, tuple):
            continue
        if not math.isfinite(value):
            raise ValueError(f"{law.id}: {name}: expected a finite number, got {value}")
        if name in positive.split() and value <= 0.0:
            raise ValueError(f"{law.id}: {name}: expected a number above 0, got {value}")
        if name in not_negative.split() and value < 0.0:
            raise ValueError(f"{law.id}: {name}: expected 0 or more, got {value}")
