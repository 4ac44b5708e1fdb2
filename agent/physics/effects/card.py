"""What the library says about an effect: its forms, its look-alikes, and how it refuses numbers."""

from __future__ import annotations

import datetime
import math
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.physics.effects.look_alikes import LookAlike, look_alikes
from agent.physics.effects.motion import Base, Motion
from agent.physics.law import Law

_BELOW_ONE = 0.999

Floats = NDArray[np.float64]
Numbers = Mapping[str, float]
Added = Callable[[Numbers, Motion, Base], Floats]
Corrected = Callable[[Numbers, Motion], Motion]
Reported = Callable[[Numbers, Motion, Floats], Floats]


@dataclass(frozen=True)
class Parameter:
    """One number of an effect, and what physics allows for it.

    Parameters
    ----------
    default : float or None
        None: it must be given.
    lower, upper : float
        Physical bounds; both may be reached unless `above` is set.
    above : bool
        The number must lie above `lower`, not on it.
    linear : bool
        Whether the effect's torque is proportional to it.
    meaning : str
        Where the form's law does not know the parameter.
    instant : bool
        A date and time instead of a number: ISO 8601 with its zone, or TOML's own.
    several : bool
        A list of such; `Form.numbers` gives them as ``name[0]``, ``name[1]`` and so on.
    """

    default: float | None = None
    lower: float = -math.inf
    upper: float = math.inf
    above: bool = False
    linear: bool = False
    meaning: str = ""
    instant: bool = False
    several: bool = False

    def number(self, value: object) -> float:
        """Return a value of the file as a number, or refuse it.

        Raises
        ------
        ValueError
            Saying what was expected and what came.
        """
        if self.instant:
            return unix_s(value)
        if isinstance(value, bool) or not isinstance(value, (int, float)):
            raise ValueError(f"expected a finite number, got {value!r}")
        if not math.isfinite(value):
            raise ValueError(f"expected a finite number, got {value!r}")
        if value < self.lower or (self.above and value <= self.lower):
            limit = f"above {self.lower:g}" if self.above else f"of at least {self.lower:g}"
            raise ValueError(f"expected a number {limit}, got {value!r}")
        if value > self.upper:
            raise ValueError(f"expected a number of at most {self.upper:g}, got {value!r}")
        return float(value)


def free(default: float | None = None, meaning: str = "") -> Parameter:
    """Return a parameter of either sign that the torque is not proportional to."""
    return Parameter(default, meaning=meaning)


def amplitude(default: float | None = None, meaning: str = "") -> Parameter:
    """Return a parameter of either sign that the torque is proportional to."""
    return Parameter(default, linear=True, meaning=meaning)


def positive(default: float | None = None, meaning: str = "") -> Parameter:
    """Return a parameter above zero that the torque is not proportional to."""
    return Parameter(default, lower=0.0, above=True, meaning=meaning)


def share(meaning: str = "") -> Parameter:
    """Return a parameter above zero that stays below one."""
    return Parameter(None, lower=0.0, upper=_BELOW_ONE, above=True, meaning=meaning)


def not_negative(
    default: float | None = None, meaning: str = "", *, linear: bool = False
) -> Parameter:
    """Return a parameter from zero up."""
    return Parameter(default, lower=0.0, linear=linear, meaning=meaning)


@dataclass(frozen=True)
class Form:
    """One way in which an effect can be written; one of the three callables is there.

    What corrects the motion may add a torque, too: of the motion as it was measured.

    Parameters
    ----------
    name : str
        In plain words, for reports.
    law : Law
        Its home: equation, source, limits.
    parameters : mapping of str to Parameter
        Names as in a twin's file.
    added_nm : callable, optional
        ``added_nm(numbers, motion, base)``, shape (n,): the torque that it adds.
    corrected : callable, optional
        ``corrected(numbers, motion)``: the true motion for a measured one.
    reported_nm : callable, optional
        ``reported_nm(numbers, motion, torque)``, shape (n,): what the drive reports for a torque.
    equation : str
        In place of the law's own, where only a part of it is the effect.
    """

    name: str
    law: Law
    parameters: Mapping[str, Parameter]
    added_nm: Added | None = None
    corrected: Corrected | None = None
    reported_nm: Reported | None = None
    equation: str = ""

    @property
    def formula(self) -> str:
        """Return the equation that is the effect's own."""
        return self.equation or self.law.equation

    @property
    def required(self) -> tuple[str, ...]:
        """Return the parameters without a default."""
        return tuple(name for name, p in self.parameters.items() if p.default is None)

    def meaning(self, name: str) -> str:
        """Return what a parameter means: symbol first, then words."""
        return self.parameters[name].meaning or self.law.parameters[name]

    def accepts(self, given: Mapping[str, Any]) -> bool:
        """Tell whether these are this form's numbers: none unknown, none missing."""
        return set(self.required) <= set(given) <= set(self.parameters)

    def numbers(self, given: Mapping[str, Any]) -> dict[str, float]:
        """Return the numbers, defaults filled in.

        Raises
        ------
        ValueError
            Naming the parameter.
        """
        unknown = sorted(set(given) - set(self.parameters))
        if unknown:
            raise ValueError(f"expected {', '.join(self.parameters)}; got also {unknown}")
        out = {}
        for name, parameter in self.parameters.items():
            if name not in given and parameter.default is not None:
                out[name] = parameter.default
                continue
            for own, value in _entries(name, parameter, given.get(name)):
                try:
                    out[own] = parameter.number(value)
                except ValueError as error:
                    raise ValueError(f"{own}: {error}") from error
        return out


def _entries(name: str, parameter: Parameter, value: object) -> Iterator[tuple[str, object]]:
    """Yield a parameter's value under its name, or those of a list, numbered."""
    if not parameter.several:
        yield name, value
    elif isinstance(value, (list, tuple)) and value:
        yield from ((f"{name}[{index}]", entry) for index, entry in enumerate(value))
    else:
        raise ValueError(f"{name}: expected a list, got {value!r}")


@dataclass(frozen=True)
class EffectCard:
    """One id of contract section 4.

    Parameters
    ----------
    id : str
        Lower case with hyphens.
    summary : str
        What it is, for a technician; one sentence.
    forms : tuple of Form
        The one that accepts a twin's numbers is taken; the first is the plainest.
    axes : tuple of str
        Variables along which it shows, plainest first: columns of a recording, or the derived
        ones of contract section 6.
    needs : tuple of str
        Columns without which it cannot be judged, beyond time, torque and velocity.
    """

    id: str
    summary: str
    forms: tuple[Form, ...]
    axes: tuple[str, ...]
    needs: tuple[str, ...] = ()

    @property
    def look_alikes(self) -> tuple[LookAlike, ...]:
        """Return what it can be mistaken for, the likeliest first."""
        return look_alikes(self.id)

    def form_of(self, given: Mapping[str, Any]) -> Form:
        """Return the form whose numbers these are; else the nearest, which will name the fault."""
        for form in self.forms:
            if form.accepts(given):
                return form
        return max(
            self.forms,
            key=lambda form: (
                len(set(given) & set(form.parameters)) - len(set(given) - set(form.parameters))
            ),
        )


def unix_s(value: object) -> float:
    """Return an instant as seconds since 1970-01-01 UTC.

    Parameters
    ----------
    value : str or datetime.datetime
        ISO 8601 with a time zone, as in a recording's `started_at`.

    Raises
    ------
    ValueError
        It is none, or has no time zone.
    """
    expected = f"expected a date and time with its zone (2026-01-31T06:00:00Z), got {value!r}"
    if isinstance(value, str):
        try:
            value = datetime.datetime.fromisoformat(value)
        except ValueError as error:
            raise ValueError(expected) from error
    if not isinstance(value, datetime.datetime) or value.tzinfo is None:
        raise ValueError(expected)
    return value.timestamp()
