"""A detector at work, as the thesis draws it in Figures 6.2 and 6.3.

Friction curves, each tested feature's statistic with its threshold, and the states over the cycles.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats
from agent.monitor.detection.series import Judgement, State, Trace
from agent.report.figures.canvas import (
    INK,
    MEASURED,
    PREDICTED,
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

_CURVES: Mapping[State, tuple[str, str]] = {
    State.NO_FAULT: ("#b8ccde", "no fault"),
    State.INCREASED: ("#e69b5e", "H0"),
    State.HIGH: (PREDICTED, "H1"),
}
_TITLES: Mapping[str, str] = {
    "coulomb_nm": "Coulomb friction",
    "viscous_nm_s_per_rad": "viscous friction",
    "integral_w": "integral of the friction curve",
    "low_integral_w": "its low-speed part",
}


@styled
def figure_case_study(
    speed_rad_s: Floats, curves_nm: Floats, judged: Judgement, *, narrow: bool = False
) -> Figure:
    """Draw the curves, the test of each feature and the decision.

    Parameters
    ----------
    speed_rad_s : ndarray, shape (m,)
    curves_nm : ndarray, shape (n, m)
        The friction curve of each cycle, in order of time.
    judged : Judgement
        Of the same n cycles.
    narrow : bool
        Draw for a phone's width.

    Raises
    ------
    ValueError
        If curves and judgement have not as many cycles.
    """
    if len(curves_nm) != len(judged.states):
        raise ValueError(
            f"expected one curve a cycle, got {len(curves_nm)} for {len(judged.states)} cycles"
        )
    shown = [name for name in _TITLES if name in judged.traces]
    heights = [2.3, *[1.25] * len(shown), 0.9]
    panels = stacked(
        [Panel(height, WITH_LABELS_IN) for height in heights], narrow=narrow, header_in=0.2
    )
    _curves(panels[0], speed_rad_s, curves_nm, judged.states)
    for axes, name in zip(panels[1:-1], shown, strict=True):
        _test(axes, _TITLES[name], judged.traces[name])
    _decision(panels[-1], judged)
    return figure_of(panels[0])


def _curves(axes: Axes, speed: Floats, curves: Floats, states: Sequence[State]) -> None:
    """Draw each cycle's curve in the colour of its state, and the first one."""
    said: set[State] = set()
    for curve, state in zip(curves, states, strict=True):
        label = None if state in said else _CURVES[state][1]
        said.add(state)
        axes.plot(speed, curve, color=_CURVES[state][0], lw=0.9, label=label)
    axes.plot(speed, curves[0], color=MEASURED, lw=1.4, label="first cycle")
    axes.set_ylim(bottom=0.0)
    axes.set_xlabel("motor speed, rad/s")
    axes.set_ylabel("friction, N m")
    axes.set_title("friction curves")
    key_in_header(axes, columns=4)


def _test(axes: Axes, title: str, trace: Trace) -> None:
    cycle = np.arange(1, trace.statistic.size + 1)
    axes.plot(cycle, trace.statistic, "-o", ms=2.5, color=MEASURED, label="statistic")
    axes.plot(cycle, trace.threshold, ls="--", color=INK, lw=1.0, label="threshold")
    beyond = trace.statistic > trace.threshold
    label = "beyond it" if beyond.any() else None
    axes.plot(cycle[beyond], trace.statistic[beyond], "o", ms=5, color=PREDICTED, label=label)
    axes.set_xlim(0.5, cycle.size + 0.5)
    axes.set_title(title)
    axes.set_xlabel("cycle")
    key_in_header(axes, columns=3)


def _decision(axes: Axes, judged: Judgement) -> None:
    order = list(State)
    level = np.array([order.index(s) for s in judged.states])
    cycle = np.arange(1, level.size + 1)
    axes.step(cycle, level, where="mid", color=MEASURED, lw=1.0)
    axes.plot(cycle[level > 0], level[level > 0], "o", ms=4, color=PREDICTED)
    axes.set_yticks(range(len(order)), [s.value for s in order])
    axes.set_ylim(-0.4, len(order) - 0.6)
    axes.set_xlim(0.5, cycle.size + 0.5)
    axes.set_title(f"decision: {judged.detector}")
    axes.set_xlabel("cycle")
