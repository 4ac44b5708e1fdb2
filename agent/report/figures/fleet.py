"""A fleet in two pictures: who has risen by how much, and how different individuals are."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agent.report.figures.canvas import (
    INK,
    MEASURED,
    MUTED,
    POSITION,
    PREDICTED,
    WITH_LABELS_IN,
    Panel,
    dots,
    figure_of,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

    from agent.report.fleet_rows import JointRow

_ROW_IN = 0.21
_MARKS = {"H1": ("^", PREDICTED), "H0": ("D", PREDICTED), "NF": ("o", POSITION)}
_WORDS = {"H1": "high", "H0": "increased", "NF": "healthy"}


@styled
def figure_rises(joints: Sequence[JointRow], *, narrow: bool = False) -> Figure:
    """Draw each joint's rise of low-speed friction with its interval, the most urgent on top."""
    (axes,) = stacked(
        [Panel(max(_ROW_IN * len(joints), 0.6), WITH_LABELS_IN)], narrow=narrow, header_in=0.1
    )
    for row, joint in enumerate(joints):
        assert joint.rise_percent is not None
        value, low, high = joint.rise_percent
        mark, color = _MARKS.get(joint.state, ("s", MUTED))
        axes.plot([low, high], [row, row], color=color, lw=2.0, alpha=0.45, solid_capstyle="round")
        axes.plot([value], [row], marker=mark, ms=5.0, color=color, ls="none")
    axes.axvline(0.0, color=MUTED, lw=0.8)
    axes.set_ylim(len(joints) - 0.4, -0.6)
    _name_rows(axes, [j.label for j in joints], narrow=narrow)
    what = "rise" if narrow else "rise of low-speed friction at equal temperature"
    axes.set_xlabel(f"{what}, % (95 % interval)")
    used = [s for s in ("H1", "H0", "NF") if any(j.state == s for j in joints)]
    for state in used:
        mark, color = _MARKS[state]
        axes.plot([], [], marker=mark, color=color, ls="none", label=_WORDS[state])
    axes.legend(loc="lower right", bbox_to_anchor=(1.0, 1.0), ncols=3)
    return figure_of(axes)


@styled
def figure_individuals(joints: Sequence[JointRow], *, narrow: bool = False) -> Figure:
    """Draw each joint's Coulomb friction as a dot, a row for each model and axis (chapter 5)."""
    kinds = sorted({(j.model, j.axis) for j in joints})
    (axes,) = stacked([Panel(max(0.34 * len(kinds), 0.6), WITH_LABELS_IN)], narrow=narrow)
    for row, kind in enumerate(kinds):
        own = [j for j in joints if (j.model, j.axis) == kind and j.coulomb_nm is not None]
        levels = np.sort(np.array([j.coulomb_nm for j in own], dtype=np.float64))
        aside = np.array([0.22 * (i % 3 - 1) for i in range(levels.size)])  # none hides another
        dots(axes, levels, row + aside, color=MEASURED, size_pt=4.0, alpha=0.55)
        if levels.size > 1:  # the one dot would be hidden by its own median
            middle = float(np.median(levels))
            axes.plot([middle, middle], [row - 0.38, row + 0.38], color=INK, lw=1.4)
    axes.set_ylim(len(kinds) - 0.5, -0.5)
    most = max((j.coulomb_nm for j in joints if j.coulomb_nm is not None), default=0.0)
    axes.set_xlim(0.0, 1.05 * most if most > 0.0 else 1.0)  # from zero on, and no dot at the edge
    _name_rows(axes, [f"{model}, axis {axis}" for model, axis in kinds], narrow=narrow)
    when = "" if narrow else " of the last cycle"
    axes.set_xlabel(f"Coulomb friction{when}, N m; line: median")
    return figure_of(axes)


def _name_rows(axes: Axes, names: Sequence[str], *, narrow: bool) -> None:
    """Write a name beside each row, and make room for it."""
    figure = figure_of(axes)
    width = figure.get_figwidth()
    written = [_short(name, 18 if narrow else 34) for name in names]
    left = 0.1 + 0.075 * max(map(len, written))
    box = axes.get_position()
    axes.set_position((left / width, box.y0, box.x1 - left / width, box.height))
    axes.set_yticks(range(len(names)), written)
    axes.grid(visible=False, axis="y")


def _short(name: str, longest: int) -> str:
    """Return a name that fits: "robot, axis N" keeps its axis, or a robot's joints were one."""
    whose, comma, axis = name.rpartition(", axis ")
    room = longest - len(comma) - len(axis)
    return name if len(whose) <= room else f"{whose[: room - 1]}…{comma}{axis}"
