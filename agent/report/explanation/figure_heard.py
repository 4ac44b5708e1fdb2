"""What is heard above the compared band: the motor's ringing once the gear's load changed sides."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.explain.answer.result import Ringing
from agent.numbers import scale_for, significant
from agent.report.figures.canvas import (
    INK,
    MEASURED,
    MEASURED_PALE,
    MUTED,
    WITH_LABELS_IN,
    Panel,
    figure_of,
    key_in_header,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_HEIGHT_IN = 2.0

CAPTION = (
    "The motor's velocity above the band that is compared, root mean square over all instants at "
    "which the load on the gear changed sides in motion; pale: 95 %. Teeth with play part there, "
    "and ring when they meet again. In a gear without play nothing begins there."
)


@styled
def figure_ringing(ringing: Ringing, *, narrow: bool = False) -> Figure:
    """Draw how strongly the motor rings before and after the load on the gear changes sides.

    Parameters
    ----------
    ringing : Ringing
    narrow : bool
        Draw for a phone's width.
    """
    (axes,) = stacked([Panel(_HEIGHT_IN, WITH_LABELS_IN)], narrow=narrow)
    scale = scale_for("rad/s", [float(np.max(ringing.rms_rad_s))])
    ms = 1e3 * ringing.at_s
    lower, rms, upper = (
        values * scale.factor
        for values in (ringing.lower_rad_s, ringing.rms_rad_s, ringing.upper_rad_s)
    )
    axes.fill_between(ms, lower, upper, color=MEASURED_PALE, lw=0, zorder=2)
    axes.plot(ms, rms, color=MEASURED, lw=2.0, label=f"mean of {ringing.instants}", zorder=3)
    usual = ringing.usual_rad_s * scale.factor
    axes.axhline(usual, color=INK, lw=0.9, ls=(0, (4, 3)), label="all motion", zorder=1)
    axes.axvline(0.0, color=MUTED, lw=0.9, zorder=1)
    axes.set_xlim(float(ms[0]), float(ms[-1]))
    axes.set_ylim(0.0, 1.08 * float(np.max(upper)))
    axes.set_title("Heard above the band" if narrow else "Heard above the compared band")
    axes.set_xlabel("time since the load on the gear changed sides, ms")
    axes.set_ylabel(f"rms velocity, {scale.unit}")
    key_in_header(axes, columns=2)
    return figure_of(axes)


def ringing_in_words(ringing: Ringing) -> str:
    """Say in words what `figure_ringing` shows, for those who do not see it."""
    before = ringing.rms_rad_s[ringing.at_s < 0.0]
    after = ringing.rms_rad_s[ringing.at_s >= 0.0]
    scale = scale_for("rad/s", [float(after.max())])
    return (
        "Ringing of the motor about the instants at which the load on the gear changes sides: "
        f"{significant(float(before.mean()) * scale.factor, 2)} {scale.unit} rms before, up to "
        f"{significant(float(after.max()) * scale.factor, 2)} {scale.unit} after."
    )
