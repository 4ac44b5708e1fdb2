"""A motion that is late, or its velocity alone: the position may be in step with the torque."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from agent.explain.choosing.materiality import CLOSE
from agent.explain.left import Left
from agent.explain.rows.lag import is_part_of_sample
from agent.explain.rows.table import Table
from agent.identify.result import Parameter

_DELAY = "torque_delay_s"
_SAME = 0.25  # of the lag: a filter's is not the same at all frequencies
_AT_MOST = 1.5  # times the lag
_COUNTS = 0.1  # of a delay without an interval: a velocity's lag that changes what is told


def is_velocitys(parameters: Mapping[str, Parameter], table: Table) -> bool:
    """Return whether a torque's lead is by how much the velocity comes later than the position."""
    delay, late_s = parameters.get(_DELAY), table.velocity_late_s
    if delay is None or not late_s:
        return False
    return abs(delay.value + late_s) < _SAME * abs(late_s)


def as_velocitys(parameters: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """Return a torque's delay as the velocity's, beside the other numbers."""
    delay = parameters[_DELAY]
    ends = None if delay.ci95 is None else (-delay.ci95[1], -delay.ci95[0])
    others = {name: each for name, each in parameters.items() if name != _DELAY}
    return {"velocity_delay_s": replace(delay, value=-delay.value, ci95=ends), **others}


class ToldAgainstItError(Exception):
    """The first choice has a delay that is told against a late velocity: the rest can wait.

    Whatever else were looked for beside it, everything would be asked again in step.
    """


def hides_in(delay: Parameter, table: Table) -> bool:
    """Return whether a delay is told against a velocity that is late itself, and need not be.

    Whether the torque is in step with position or velocity does not show beside a torque that is
    late, or teeth that meet; that there is a step between the two does. A velocity that alone is
    late by more than is usual between samples is what is told, and stays.

    Parameters
    ----------
    delay : Parameter
        Of the torque, in seconds.
    table : Table
        Of the recordings.
    """
    late_s = abs(table.velocity_late_s)
    usual = all(is_part_of_sample(late_s, piece.period_s) for piece in table.pieces)
    told = usual or delay.value > 0.0
    counts_s = _COUNTS * abs(delay.value)
    if delay.ci95 is not None:
        counts_s = min(counts_s, 0.5 * (delay.ci95[1] - delay.ci95[0]))
    return told and not table.aligned and late_s > counts_s


def surely_hides_in(delay_s: float, table: Table) -> bool:
    """Return whether a first choice's delay is such a one, however narrow its interval will be.

    Parameters
    ----------
    delay_s : float
        Of the torque.
    table : Table
        Of the recordings.
    """
    return table.in_step_for_a_delay and hides_in(Parameter(delay_s, None), table)


def may_be_velocitys(delay: Parameter, table: Table) -> bool:
    """Return whether a torque's lead may be what a velocity that is late looks like.

    Beside a law that is made of a late motion it is seldom the whole of the velocity's lag.

    Parameters
    ----------
    delay : Parameter
        Of the torque, in seconds.
    table : Table
        Of the recordings.
    """
    return 0.0 < -delay.value / table.velocity_late_s < _AT_MOST if table.velocity_late_s else False


def later_than_usual(table: Table) -> bool:
    """Return whether the velocity is not in step, and later than any usually is between samples."""
    late_s = table.velocity_late_s
    usual = any(is_part_of_sample(late_s, piece.period_s) for piece in table.pieces)
    return bool(late_s) and not usual and not table.aligned


def is_much(left: Left) -> bool:
    """Return whether more than noise is left by all that was found.

    A velocity that alone is late has a delay's name. Beside something far greater it has none, and
    bends its numbers; that it is late shows in the motion, whatever the torque says.
    """
    return left.over_floor > CLOSE or left.without_measure
