"""A finding over the axis on which it lives: the law's line and band over what was measured."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from agent.explain.answer.result import Curve, Region
from agent.identify.result import Floats
from agent.numbers import Scale, scale_for, significant
from agent.report.explanation.places import Variable, variable
from agent.report.figures.canvas import (
    INK,
    MEASURED,
    MEASURED_PALE,
    MUTED,
    SHADE,
    WITH_LABELS_IN,
    Panel,
    figure_of,
    key_in_header,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_HEIGHT_IN, _NARROW_HEIGHT_IN = 2.5, 2.1
_BREAK = 2.5  # times the usual step in time


@styled
def figure_finding(curve: Curve, where: tuple[Region, ...] = (), *, narrow: bool = False) -> Figure:
    """Draw what a law adds to the simulation, over the binned means of what was missing.

    Parameters
    ----------
    curve : Curve
        The law's line with its band, and the bins' means with half of their 95 % interval.
    where : tuple of Region
        Shaded where they lie along the curve's own axis.
    narrow : bool
        Draw for a phone's width.
    """
    height = _NARROW_HEIGHT_IN if narrow else _HEIGHT_IN
    (axes,) = stacked([Panel(height, WITH_LABELS_IN)], narrow=narrow)
    abscissa = abscissa_of(curve)
    scale = scale_for("N m", [_largest_nm(curve)])
    axes.axhline(0.0, color=MUTED, lw=0.7)
    _law(axes, curve, abscissa, scale)
    _means(axes, curve, abscissa, scale)
    _by_frequency(axes, curve)
    _shade(axes, curve, where, abscissa)
    if curve.variable == "recording":
        axes.set_xticks(np.unique(np.round(abscissa.shown(curve.bin_at))))
    axes.set_xlabel(abscissa.title)
    kind = "rms torque" if curve.variable == "frequency_hz" else "torque"
    missing = "that is missing" if curve.given_nm is None else "of the effect"
    axes.set_ylabel(f"{kind} {missing}, {scale.unit}")
    key_in_header(axes, columns=2 if curve.given_nm is None else 3)
    return figure_of(axes)


def finding_in_words(curve: Curve) -> str:
    """Say in words what `figure_finding` shows, for those who do not see it."""
    scale = scale_for("N m", [_largest_nm(curve)])
    abscissa = abscissa_of(curve)
    finite = curve.line_nm[np.isfinite(curve.line_nm)] * scale.factor
    span = abscissa.shown(curve.at[np.isfinite(curve.at)])
    if not finite.size or not span.size:
        return f"Means of the torque that the simulation lacks over {abscissa.title}; no line."
    unit = f" {abscissa.unit}" if abscissa.unit else ""
    what = "that the simulation lacks" if curve.given_nm is None else "of the effect"
    return (
        f"Torque {what} over {abscissa.label}, from "
        f"{significant(float(span.min()), 3)} to {significant(float(span.max()), 3)}{unit}: the "
        f"law's line, between {significant(float(finite.min()), 3)} and "
        f"{significant(float(finite.max()), 3)} {scale.unit}, with its band, over "
        f"{curve.bin_at.size} means of what was measured."
        f"{_given_in_words(curve, scale)}"
    )


def _given_in_words(curve: Curve, scale: Scale) -> str:
    if curve.given_nm is None:
        return ""
    given = curve.given_nm[np.isfinite(curve.given_nm)] * scale.factor
    low, high = (significant(float(end), 3) for end in (given.min(), given.max()))
    return f" The simulation's own line lies between {low} and {high} {scale.unit}."


def abscissa_of(curve: Curve) -> Variable:
    """Return how a curve's axis is written.

    Over the time it is the moment that shows most, over an order one period of its wave.
    """
    if curve.variable == "time_s":
        return Variable("time in the recording that shows it most", "s")
    if curve.variable.startswith("order_per_"):
        return Variable("angle within one period of the wave", "degrees", math.degrees(1.0))
    return variable(curve.variable)


def caption_of(curve: Curve) -> str:
    """Return what the points, the line and the shade of a finding's picture are."""
    if curve.given_nm is not None:
        return (
            "Points: measured torque less that of the simulation without this effect, averaged "
            "over short stretches of this axis, with the rest of the model taken off. Their bars "
            "are 95 % intervals. Line: the law found; pale: its band. Dashed: what the simulation "
            "as given has instead."
        )
    if curve.variable == "frequency_hz":
        return (
            "Points: root mean square of measured less simulated torque by bands of frequency, with"
            " the rest of the model taken off; noise adds to them. Line: what the law found adds to"
            " the simulation. Shaded: where the mismatch was located."
        )
    if curve.variable == "time_s":
        return (
            "The second in which the law found adds most. Points: measured less simulated torque,"
            " with the rest of the model taken off. Line: what the law adds to the simulation;"
            " pale: where the noise would leave 95 % of the points."
        )
    if curve.variable.startswith("order_per_"):
        return (
            "Points: measured less simulated torque, averaged over one period of the wave, with the"
            " rest of the model taken off. Their bars are 95 % intervals. Line: what the law found"
            " adds to the simulation; pale: its band. Both in the band that is compared, above"
            " which fast passes lie: their mean is lower than the wave's amplitude."
        )
    return (
        "Points: measured less simulated torque, averaged over short stretches of this axis, with"
        " the rest of the model taken off. Their bars are 95 % intervals. Line: what the law found"
        " adds to the simulation, whose own numbers move beside it (below), so that they may differ"
        " by less; pale: its band. Shaded: where the mismatch was located."
    )


def broken_at_reversal(variable_name: str, at: Floats) -> NDArray[np.intp]:
    """Return where a line must be broken, as indices for `numpy.insert`.

    A recording has gaps, and a friction law jumps at zero velocity: a line through the jump would
    be a slope that no joint has.
    """
    if variable_name == "time_s" and at.size > 2:
        # What was not compared, around a reversal, is not bridged.
        return np.flatnonzero(np.diff(at) > _BREAK * np.median(np.diff(at))) + 1
    if variable_name != "velocity_rad_s":
        return np.empty(0, dtype=np.intp)
    return np.flatnonzero(np.sign(at[:-1]) * np.sign(at[1:]) < 0.0) + 1


def _law(axes: Axes, curve: Curve, abscissa: Variable, scale: Scale) -> None:
    breaks = broken_at_reversal(curve.variable, curve.at)
    at = np.insert(abscissa.shown(curve.at), breaks, np.nan)
    line, lower, upper = (
        np.insert(values * scale.factor, breaks, np.nan)
        for values in (curve.line_nm, curve.lower_nm, curve.upper_nm)
    )
    axes.fill_between(at, lower, upper, color=MEASURED_PALE, lw=0, zorder=2)
    if curve.given_nm is not None:
        given = np.insert(curve.given_nm * scale.factor, breaks, np.nan)
        axes.plot(at, given, color=MUTED, lw=1.4, ls="--", label="simulation has", zorder=2.5)
    axes.plot(at, line, color=MEASURED, lw=2.2, label="law found", zorder=3)


def _means(axes: Axes, curve: Curve, abscissa: Variable, scale: Scale) -> None:
    reach = np.where(np.isfinite(curve.bin_ci_nm), np.abs(curve.bin_ci_nm), 0.0)
    axes.errorbar(
        abscissa.shown(curve.bin_at),
        curve.bin_nm * scale.factor,
        yerr=reach * scale.factor,
        fmt="o",
        ms=3.6,
        mew=0.0,
        color=INK,
        ecolor=INK,
        elinewidth=0.9,
        capsize=0.0,
        zorder=4,
        label="measured less simulated" if curve.given_nm is None else "measured",
    )


def _by_frequency(axes: Axes, curve: Curve) -> None:
    """Lay out a spectrum: from zero up, frequencies by their logarithm, without a grid of tens."""
    if curve.variable != "frequency_hz":
        return
    low, high = float(curve.at.min()), float(curve.at.max())
    axes.set_xscale("log")
    marks = [f for f in (0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100) if low <= f <= high]
    axes.set_xticks(marks, [f"{mark:g}" for mark in marks])
    axes.minorticks_off()
    axes.set_xlim(low, high)
    axes.set_ylim(bottom=0.0)


def _shade(axes: Axes, curve: Curve, where: tuple[Region, ...], abscissa: Variable) -> None:
    """Shade the located regions without moving the axis: a region may be wider than the data."""
    left, right = axes.get_xlim()
    for region in where:
        if region.variable == curve.variable and not curve.variable.startswith("order_per_"):
            low, high = abscissa.shown(np.array([region.lower, region.upper]))
            axes.axvspan(max(low, left), min(high, right), color=SHADE, lw=0, zorder=0)
    axes.set_xlim(left, right)


def _largest_nm(curve: Curve) -> float:
    given = np.empty(0) if curve.given_nm is None else curve.given_nm
    values = np.concatenate((curve.line_nm, curve.bin_nm, given))
    return float(np.max(np.abs(values), initial=0.0, where=np.isfinite(values)))
