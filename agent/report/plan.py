"""A plan as one HTML file that needs neither network nor script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from agent.numbers import units_unbroken
from agent.report.figures.canvas import data_uri
from agent.report.figures.plan import figure_plan, plan_figure_in_words
from agent.report.page import render
from trajectories import Expectation, Trajectory


def plan_html(
    trajectory: Trajectory,
    expectation: Expectation,
    nominal: Mapping[str, float],
    *,
    title: str,
    robot: str,
    axis: int,
    gear_ratio: float,
    in_short: tuple[str, str],
    rows: Sequence[tuple[str, str, str]],
    can_see: Sequence[str],
    cannot_see: Sequence[str],
    basis: str,
) -> str:
    """Return the page as text; the same input gives the same text.

    Parameters
    ----------
    trajectory, expectation, nominal, gear_ratio
        See `figure_plan`.
    title, robot : str
        Untrusted, escaped.
    axis : int
        As the cell numbers it.
    in_short : tuple of str
        What the plan is worth, and how it compares with a plain stair; the second may be empty.
    rows : sequence of (str, str, str)
        Parameter, assumed value, expected half-interval.
    can_see, cannot_see : sequence of str
        Sentences.
    basis : str
        What the numbers stand on.
    """
    drawn = trajectory, expectation, nominal, gear_ratio
    return render(
        "plan.html.j2",
        title=title,
        robot=robot,
        axis=str(axis),
        wide_uri=data_uri(figure_plan(*drawn)),
        narrow_uri=data_uri(figure_plan(*drawn, narrow=True)),
        alt=plan_figure_in_words(trajectory, expectation),
        worth=units_unbroken(in_short[0]),
        beside=units_unbroken(in_short[1]),
        rows=[
            (label, units_unbroken(value), units_unbroken(width)) for label, value, width in rows
        ],
        can_see=[units_unbroken(one) for one in can_see],
        cannot_see=[units_unbroken(one) for one in cannot_see],
        basis=units_unbroken(basis),
    )
