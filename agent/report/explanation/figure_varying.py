"""What would have to vary: a number of the simulation along an axis, where no law carries it."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.explain.answer.as_if import called, scale_of
from agent.explain.answer.result import Varying
from agent.numbers import Scale, significant
from agent.report.explanation.figure_left import shade
from agent.report.explanation.places import variable
from agent.report.figures.canvas import (
    INK,
    MUTED,
    WITH_LABELS_IN,
    Panel,
    figure_of,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEIGHT_IN = 2.0


@styled
def figure_varying(varies: Varying, *, narrow: bool = False) -> Figure:
    """Draw by how much a number would differ along its axis, with the places where it does."""
    (axes,) = stacked([Panel(_HEIGHT_IN, WITH_LABELS_IN)], narrow=narrow)
    abscissa, scale = variable(varies.variable), _scale(varies)
    axes.axhline(0.0, color=MUTED, lw=0.7)
    axes.errorbar(
        abscissa.shown(varies.at),
        varies.more * scale.factor,
        varies.half * scale.factor,
        ls="none",
        marker="o",
        ms=3.6,
        color=INK,
        elinewidth=0.9,
    )
    shade(axes, varies.regions, varies.variable)
    if varies.variable == "recording":
        axes.set_xticks(abscissa.shown(varies.at))
    axes.set_title(f"By how much {called(varies.number)} would differ")
    axes.set_xlabel(abscissa.title)
    axes.set_ylabel(f"more than usual, {scale.unit}")
    return figure_of(axes)


def varying_in_words(varies: Varying) -> str:
    """Say in words what `figure_varying` shows, for those who do not see it."""
    scale, at = _scale(varies), variable(varies.variable)
    peak = int(np.argmax(np.abs(varies.more)))
    place = float(at.shown(varies.at[peak : peak + 1])[0])
    return (
        f"By how much {called(varies.number)} would have to differ from what it usually is, over "
        f"{at.label}: most at {significant(place, 3)} {at.unit}, by "
        f"{significant(float(varies.more[peak]) * scale.factor, 3)} {scale.unit}."
    )


def _scale(varies: Varying) -> Scale:
    return scale_of(varies.number, float(np.max(np.abs(varies.more), initial=0.0)))
