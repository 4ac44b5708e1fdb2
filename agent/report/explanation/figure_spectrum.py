"""What swings at a frequency of its own: its line in the spectrum, above its neighbourhood."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agent.explain.answer.result import Curve, Region
from agent.numbers import scale_for, significant
from agent.report.explanation.figure_cycle import NOT_EXPLAINED
from agent.report.explanation.places import variable
from agent.report.figures.canvas import (
    INK,
    MUTED,
    NOISE,
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
_THINNEST = 0.004  # of the picture's width: a narrower region is not seen


@styled
def figure_spectrum(curve: Curve, where: Sequence[Region] = (), *, narrow: bool = False) -> Figure:
    """Draw a spectrum of what is left, the frequencies that stand out shaded.

    Parameters
    ----------
    curve : Curve
        `bin_nm` is the root mean square of a sine at each frequency, `upper_nm` what the
        neighbourhood has.
    where : sequence of Region
    narrow : bool
        Draw for a phone's width.
    """
    (axes,) = stacked([Panel(_HEIGHT_IN, WITH_LABELS_IN)], narrow=narrow)
    scale = scale_for("N m", [float(np.max(curve.bin_nm, initial=0.0))])
    low, high = float(curve.bin_at[0]), float(curve.bin_at[-1])
    thin = _THINNEST * (high - low)
    for region in where:
        if region.variable == curve.variable and low < region.upper and region.lower < high:
            ends = max(region.lower - thin, low), min(region.upper + thin, high)
            axes.axvspan(*ends, color=NOT_EXPLAINED, lw=0, zorder=0)
    level = curve.upper_nm * scale.factor
    axes.fill_between(curve.at, 0.0, level, color=NOISE, lw=0, zorder=2, label="neighbourhood")
    axes.plot(curve.bin_at, curve.bin_nm * scale.factor, color=INK, lw=0.9, label="left", zorder=3)
    peak = int(np.argmax(curve.bin_nm))
    axes.annotate(
        f"{significant(float(curve.bin_at[peak]), 3)} Hz",
        (float(curve.bin_at[peak]), float(curve.bin_nm[peak]) * scale.factor),
        xytext=(6.0, -4.0),
        textcoords="offset points",
        va="top",
        color=INK,
    )
    axes.set_xlim(low, high)
    axes.set_ylim(0.0, 1.08 * float(curve.bin_nm[peak]) * scale.factor)
    axes.set_title("What swings of its own" if narrow else "What swings at a frequency of its own")
    axes.set_xlabel(variable(curve.variable).title)
    axes.set_ylabel(f"rms torque, {scale.unit}")
    axes.tick_params(axis="x", colors=MUTED)
    key_in_header(axes, columns=2)
    return figure_of(axes)


def spectrum_in_words(curve: Curve) -> str:
    """Say in words what `figure_spectrum` shows, for those who do not see it."""
    peak = int(np.argmax(curve.bin_nm))
    scale = scale_for("N m", [float(curve.bin_nm[peak])])
    near = float(np.interp(curve.bin_at[peak], curve.at, curve.upper_nm))
    return (
        "Spectrum of the torque that is left without explanation: largest at "
        f"{significant(float(curve.bin_at[peak]), 3)} Hz, where a sine of "
        f"{significant(float(curve.bin_nm[peak]) * scale.factor, 2)} {scale.unit} rms stands over "
        f"{significant(near * scale.factor, 2)} {scale.unit} in its neighbourhood."
    )
