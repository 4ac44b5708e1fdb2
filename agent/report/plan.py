"""A plan as one HTML file that needs neither network nor script."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

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
        rows=rows,
        can_see=can_see,
        cannot_see=cannot_see,
        basis=basis,
    )
