"""How the rate of experiments shows in friction over a year, and what each rate costs and sees."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats
from agent.monitor.schedule.rate import YEAR_DAYS, Rate, RatePlan
from agent.report.figures.canvas import (
    INK,
    MEASURED,
    MUTED,
    PREDICTED,
    TEMPERATURE,
    WITH_LABELS_IN,
    WITHOUT_LABELS_IN,
    Panel,
    figure_of,
    key_in_header,
    plain_ticks,
    stacked,
    styled,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_FRACTIONS = 100.0  # a share in per cent


@styled
def figure_rate(plan: RatePlan, *, narrow: bool = False) -> Figure:
    """Draw a year at a higher and a lower rate, after the thesis's Figure A.4, and the trade.

    Above: the gearbox's temperature, the friction integral that follows it, uncompensated, and
    its change from one experiment to the next. Below: how far wear has grown when each rate finds
    it, over the minutes that the rate costs.

    Parameters
    ----------
    plan : RatePlan
    narrow : bool
        Draw for a phone's width.
    """
    often = plan.advised or plan.rates[0]
    rarely = plan.rates[-1] if plan.rates[-1] is not often else plan.rates[0]
    often, rarely = sorted((often, rarely), key=lambda r: r.interval_days)
    panels = stacked(
        [
            Panel(1.1, WITHOUT_LABELS_IN),
            Panel(1.3, WITHOUT_LABELS_IN),
            Panel(1.3, WITH_LABELS_IN),
            Panel(2.0, WITH_LABELS_IN),
        ],
        narrow=narrow,
        header_in=0.2,
    )
    _year(panels[:3], plan, (often, rarely))
    _trade(panels[3], plan)
    return figure_of(panels[0])


def _year(panels: list[Axes], plan: RatePlan, rates: tuple[Rate, Rate]) -> None:
    """Draw a year of the swing at two rates."""
    site = plan.site
    day = np.arange(0.0, YEAR_DAYS, 0.25)
    panels[0].plot(day, site.temperature_degc(day), color=TEMPERATURE, lw=1.0)
    panels[0].set_title("Gearbox temperature, from its mean")
    panels[0].set_ylabel("°C")
    for rate, color, size in zip(rates, (MEASURED, PREDICTED), (3.0, 5.0), strict=True):
        at = np.arange(0.0, YEAR_DAYS, rate.interval_days)
        friction = _friction(plan, at)
        label = f"every {rate.interval_days:g} days"
        panels[1].plot(at, friction, "o-", ms=size, lw=0.6, color=color, label=label)
        panels[2].plot(at[1:], np.diff(friction), "o-", ms=size, lw=0.6, color=color)
    panels[1].set_title("Friction, not compensated")
    panels[1].set_ylabel("% of its mean")
    key_in_header(panels[1], columns=2)
    panels[2].set_title("Change from one experiment to the next")
    panels[2].set_ylabel("%")
    panels[2].set_xlabel("day of the swing")
    for axes in panels:
        axes.set_xlim(0.0, YEAR_DAYS)
        axes.axhline(0.0, color=MUTED, lw=0.6)
    for axes in panels[:2]:
        axes.tick_params(labelbottom=False)


def _friction(plan: RatePlan, day: Floats) -> Floats:
    """Return the friction that the swing and the weather make on each day, per cent of its mean."""
    rng = np.random.default_rng(1)
    every = np.arange(0.0, YEAR_DAYS + 1.0, 0.25)
    weather = plan.site.weather_degc * rng.standard_normal(every.size)
    swing = plan.site.temperature_degc(day) + np.interp(day, every, weather)
    return np.asarray(_FRACTIONS * plan.site.slope_per_k * swing)


def _trade(axes: Axes, plan: RatePlan) -> None:
    """Draw how far wear has grown when it is found, over the downtime."""
    minutes = [r.minutes_per_year for r in plan.rates]
    axes.plot(
        minutes,
        [_FRACTIONS * r.risen_95 for r in plan.rates],
        "o--",
        ms=4,
        color=PREDICTED,
        label="95 % is found below",
    )
    axes.plot(
        minutes,
        [_FRACTIONS * r.risen for r in plan.rates],
        "o-",
        ms=4,
        color=MEASURED,
        label="on average",
    )
    limit = _FRACTIONS * plan.wish.limit
    axes.axhline(limit, color=INK, lw=0.8, ls=":", label=f"wanted: {limit:g} %")
    axes.set_xscale("log")
    axes.set_ylim(bottom=0.0)
    axes.set_xlim(0.7 * min(minutes), 1.6 * max(minutes))
    plain_ticks(axes)
    for rate in plan.rates:
        axes.annotate(
            f"{rate.interval_days:g} d",
            (rate.minutes_per_year, _FRACTIONS * rate.risen),
            xytext=(0, -11),
            textcoords="offset points",
            ha="center",
            fontsize=7.5,
            color=MUTED,
        )
    if plan.advised is not None:
        axes.plot(
            [plan.advised.minutes_per_year],
            [_FRACTIONS * plan.advised.risen_95],
            "o",
            ms=9,
            mfc="none",
            color=INK,
        )
    axes.set_title(f"Wear of {_FRACTIONS * plan.wish.wear_per_month:g} % a month: rise when found")
    axes.set_xlabel("downtime, minutes a year")
    axes.set_ylabel("rise, %")
    key_in_header(axes, columns=3)
