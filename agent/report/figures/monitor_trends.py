"""A joint over its history: temperature, features at equal temperature, and the detector's sums."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING, Any

import numpy as np

from agent.identify.result import Floats
from agent.monitor.baseline.first_cycles import TRACE
from agent.monitor.detection.series import FEATURES, State
from agent.monitor.verdict.verdict import Finding, Track
from agent.numbers import scale_for
from agent.report.figures.canvas import (
    COMMAND_PALE,
    INK,
    KEY_IN,
    MEASURED,
    MUTED,
    NOISE,
    PREDICTED,
    SHADE,
    TEMPERATURE,
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

_DAY_S = 86_400.0
_HEIGHT_IN, _NARROW_HEIGHT_IN = 1.25, 1.2
_MARKS = {State.INCREASED: COMMAND_PALE, State.HIGH: PREDICTED}
_TITLES = {
    "low_integral_w": "Low-speed integral",
    "integral_w": "Integral of the friction curve",
    "coulomb_nm": "Coulomb friction",
    "viscous_nm_s_per_rad": "Viscous friction",
}
_SUMS = {"low_integral_w": "low speed", "integral_w": "all speeds", TRACE: "since the first cycle"}
_UNITS = {
    "coulomb_nm": "N m",
    "viscous_nm_s_per_rad": "N m s/rad",
    "integral_w": "W",
    "low_integral_w": "W",
}


@styled
def figure_monitor_trends(finding: Finding, *, narrow: bool = False) -> Figure:
    """Draw features, temperature and detector over time.

    Parameters
    ----------
    finding : Finding
        With at least one cycle.
    narrow : bool
        Draw for a phone's width.
    """
    judged = [t for t in finding.tracks if t.judgement is not None]
    warm = bool(np.any(np.isfinite([c.temperature_degc for c in finding.history.cycles])))
    count = len(FEATURES) + warm + bool(judged)
    height = _NARROW_HEIGHT_IN if narrow else _HEIGHT_IN
    panels = [Panel(height, WITHOUT_LABELS_IN)] * (count - 1) + [Panel(height, WITH_LABELS_IN)]
    below_a_key = Panel(height, WITHOUT_LABELS_IN + KEY_IN)
    if narrow and judged:  # the second panel has a key, too
        panels[0] = below_a_key
    if narrow and warm:  # and the last
        panels[-2] = below_a_key
    column = stacked(panels, narrow=narrow, header_in=KEY_IN)
    rest = iter(column)
    if judged:
        _statistic(next(rest), finding, narrow=narrow)
    for name in _TITLES:
        _feature(next(rest), finding, name, narrow=narrow)
    if warm:
        _temperature(next(rest), finding, narrow=narrow)
    for axes in column:
        _events(axes, finding, named=axes is column[0])
        axes.tick_params(labelbottom=axes is column[-1])
    _dates(column, finding)
    return figure_of(column[0])


def trends_in_words(finding: Finding) -> str:
    """Say in words what `figure_monitor_trends` shows, for those who do not see it."""
    cycles = finding.history.cycles
    alarms = sum(
        s is not State.NO_FAULT for t in finding.tracks if t.judgement for s in t.judgement.states
    )
    return (
        f"Features of {len(cycles)} cycles from {cycles[0].started_at[:10]} to "
        f"{cycles[-1].started_at[:10]}, as measured and at equal temperature, with the gearbox "
        f"temperature and the detector's sums; {alarms} cycles are in alarm."
    )


def _days(finding: Finding, track: Track) -> Floats:
    """Return when each cycle started in days since 1970, as the library counts dates."""
    cycles = finding.history.cycles[track.segment.start : track.segment.stop]
    return np.array([c.started_s / _DAY_S for c in cycles])


def _feature(axes: Axes, finding: Finding, name: str, *, narrow: bool) -> None:
    """Draw one feature: as measured, pale; at the reference, with its interval; and the states."""
    raw = [f.values[name] for f in finding.history.features]
    scale = scale_for(_UNITS[name], raw)
    for i, track in enumerate(finding.tracks):
        segment = track.segment
        when, values = _days(finding, track), np.array(raw[segment.start : segment.stop])
        said = i == 0
        style: dict[str, Any] = {"color": NOISE, "ms": 2.4, "lw": 0.7}
        axes.plot(when, scale.factor * values, "o-", label="as measured" if said else None, **style)
        if track.found is None:
            continue
        found = track.found[name]
        middle, reach = scale.factor * found.value, 1.96 * scale.factor * found.deviation
        axes.fill_between(
            when,
            middle - reach,
            middle + reach,
            color=MEASURED,
            alpha=0.15,
            lw=0,
            label="95 %" if said else None,
        )
        axes.plot(
            when,
            middle,
            "-",
            color=MEASURED,
            lw=1.2,
            label="at equal temperature" * said or None,
        )
        _healthy(axes, when, scale.factor * track.baseline.laws[name].level, track.baseline.cycles)
        _states(axes, when, middle, track)
    axes.set_title(_TITLES[name])
    axes.set_ylabel(scale.unit)
    if name == next(iter(_TITLES)):
        key_in_header(axes, columns=3, over_title=narrow)


def _healthy(axes: Axes, when: Floats, level: float, cycles: int) -> None:
    """Shade the baseline and lead its level on."""
    axes.axvspan(when[0], when[cycles - 1], color=SHADE, lw=0, zorder=0)
    axes.plot([when[0], when[-1]], [level, level], color=INK, lw=0.8, ls=(0, (4, 3)))


def _states(axes: Axes, when: Floats, values: Floats, track: Track) -> None:
    """Mark the cycles in alarm."""
    if track.judgement is None:
        return
    states = track.judgement.states
    for state, color in _MARKS.items():
        own = [i for i, s in enumerate(states) if s is state]
        if own:
            axes.plot(when[own], values[own], "o", color=color, ms=4.2)


def _statistic(axes: Axes, finding: Finding, *, narrow: bool) -> None:
    """Draw each feature's sum over its threshold: 1 is the alarm."""
    colors = {"low_integral_w": MEASURED, "integral_w": TEMPERATURE, "coulomb_nm": MUTED}
    seen: set[str] = set()
    for track in finding.tracks:
        if track.judgement is None:
            continue
        when = _days(finding, track)
        for name, trace in track.judgement.traces.items():
            share = trace.statistic / np.where(trace.threshold > 0.0, trace.threshold, np.nan)
            label = None if name in seen else _SUMS.get(name, name)
            seen.add(name)
            axes.plot(when, share, color=colors.get(name, NOISE), lw=1.2, label=label)
        top = np.nanmax(
            [t.statistic / t.threshold for t in track.judgement.traces.values()], axis=0
        )
        _states(axes, when, np.asarray(top), track)
    axes.axhline(1.0, color=PREDICTED, lw=0.9, ls=(0, (4, 3)))
    low, high = axes.get_ylim()
    axes.set_ylim(min(0.0, low), 1.06 * max(high, 1.0))
    axes.set_title(f"Detector ({finding.detector}): 1 is the alarm")
    axes.set_ylabel("of threshold")
    key_in_header(axes, columns=3, over_title=narrow)


def _temperature(axes: Axes, finding: Finding, *, narrow: bool) -> None:
    said = False
    for track in finding.tracks:
        cycles = finding.history.cycles[track.segment.start : track.segment.stop]
        values = np.array([c.temperature_degc for c in cycles])
        when = _days(finding, track)
        axes.plot(when, values, "o-", color=TEMPERATURE, ms=2.4, lw=0.9)
        if track.found is None:
            continue
        beyond = np.flatnonzero(next(iter(track.found.values())).extrapolated)
        if beyond.size:
            axes.plot(
                when[beyond],
                values[beyond],
                "o",
                color=INK,
                mfc="white",
                ms=3.4,
                label=None if said else "not seen by the baseline",
            )
            said = True
        axes.axvspan(
            when[0],
            when[track.baseline.cycles - 1],
            color=SHADE,
            lw=0,
            zorder=0,
        )
    axes.set_title("Gearbox temperature")
    axes.set_ylabel("°C")
    if said:
        key_in_header(axes, columns=1, over_title=narrow)


def _events(axes: Axes, finding: Finding, *, named: bool) -> None:
    """Draw a line where a new baseline begins, and say why at the top."""
    for track in finding.tracks:
        if not track.segment.events:
            continue
        when = _days(finding, track)[0]
        axes.axvline(when, color=INK, lw=0.9)
        if named:
            axes.annotate(
                track.segment.events[0].label,
                (when, 1.0),
                xycoords=("data", "axes fraction"),
                xytext=(3, -9),
                textcoords="offset points",
                color=INK,
                fontsize=8.0,
                bbox={"facecolor": "white", "edgecolor": "none", "pad": 0.8},  # over lines
            )


def _dates(column: Iterable[Axes], finding: Finding) -> None:
    """Give all panels the same days, in the shortest form that is clear."""
    from matplotlib import dates

    locate: Any = dates.AutoDateLocator  # they have no types of their own
    write: Any = dates.ConciseDateFormatter
    cycles = finding.history.cycles
    first, last = cycles[0].started_s, cycles[-1].started_s
    margin = max(0.015 * (last - first), 0.2 * _DAY_S)
    for axes in column:
        axes.set_xlim((first - margin) / _DAY_S, (last + margin) / _DAY_S)
        locator = locate(minticks=3, maxticks=8)
        axes.xaxis.set_major_locator(locator)
        axes.xaxis.set_major_formatter(write(locator))
