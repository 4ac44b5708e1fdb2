"""What the observer saw on ordinary work: friction's rise in its healthy band, and whiteness."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agent.monitor.observer.band import HealthyBand, Watch
from agent.report.figures.canvas import (
    INK,
    MEASURED,
    MUTED,
    PREDICTED,
    SHADE,
    WITH_LABELS_IN,
    WITHOUT_LABELS_IN,
    Panel,
    figure_of,
    key_in_header,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


@styled
def figure_watch(band: HealthyBand, found: Sequence[Watch], *, narrow: bool = False) -> Figure:
    """Draw every recording's rise of friction in its band, and its whiteness statistic.

    Parameters
    ----------
    band : HealthyBand
        Its recordings are drawn first, in grey.
    found : sequence of Watch
        In order of time; those that are not decidable are left out.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        No recording is decidable.
    """
    count = len(band.seen)
    shown = [(count + k, w) for k, w in enumerate(found) if w.seen is not None and w.bands_nm]
    if not shown:
        raise ValueError("expected a recording that is decidable, got none")
    speeds = len(band.shares)
    heights = [Panel(1.5, WITHOUT_LABELS_IN)] * speeds + [Panel(1.3, WITH_LABELS_IN)]
    panels = stacked(heights, narrow=narrow, header_in=0.2)
    for which, axes in enumerate(panels[:-1]):
        _rise(axes, band, shown, which)
    _whiteness(panels[-1], band, shown)
    for axes in panels:
        axes.set_xlim(-0.5, count + len(found) - 0.5)
    for axes in panels[:-1]:
        axes.tick_params(labelbottom=False)
    key_in_header(panels[0], columns=4)
    return figure_of(panels[0])


def _rise(axes: Axes, band: HealthyBand, shown: Sequence[tuple[int, Watch]], which: int) -> None:
    """Draw the rise at one of the band's speeds."""
    at = np.array([k for k, _ in shown])
    ends = np.array([w.bands_nm[which] for _, w in shown])
    rise = np.array([w.seen.rises_nm[which] for _, w in shown if w.seen is not None])
    outside = (rise < ends[:, 0]) | (rise > ends[:, 1])
    healthy = [s.rises_nm[which] for s in band.seen]
    axes.fill_between(at, ends[:, 0], ends[:, 1], color=SHADE, step="mid", label="healthy band")
    axes.plot(range(len(healthy)), healthy, "o", ms=3, color=MUTED, label="learned from")
    axes.plot(at[~outside], rise[~outside], "o", ms=3, color=MEASURED, label="inside")
    axes.plot(at[outside], rise[outside], "D", ms=4, color=PREDICTED, label="outside: asks")
    axes.axhline(0.0, color=MUTED, lw=0.6)
    speed = band.shares[which] * band.model.top_rad_s
    axes.set_title(f"friction over the healthy curve at {speed:.3g} rad/s")
    axes.set_ylabel("N m")


def _whiteness(axes: Axes, band: HealthyBand, shown: Sequence[tuple[int, Watch]]) -> None:
    """Draw the whiteness statistics and what they may reach."""
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    at = np.array([k for k, _ in shown])
    found = np.array([w.seen.whiteness.statistic for _, w in shown if w.seen is not None])
    limit = shown[0][1].whiteness_threshold
    over = found > limit
    axes.plot(
        range(len(band.seen)), [s.whiteness.statistic for s in band.seen], "o", ms=3, color=MUTED
    )
    axes.plot(at[~over], found[~over], "o", ms=3, color=MEASURED)
    axes.plot(at[over], found[over], "D", ms=4, color=PREDICTED)
    axes.axhline(limit, color=INK, lw=0.8, ls=":")
    axes.set_yscale("log")
    axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
    axes.yaxis.set_major_formatter(FuncFormatter(lambda y, _: f"{y:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_title("whiteness of the innovations (Ljung-Box), and what is healthy at most")
    axes.set_xlabel("recording of ordinary work")
