"""The picture of a detector at work."""

from __future__ import annotations

import numpy as np
import pytest
from matplotlib.axes import Axes

from agent.monitor.detection.thesis import Thesis
from tests.benchmarks.monitor_case_figure import figure_case_study
from tests.benchmarks.monitor_case_study import COURSES, CYCLES, curves, history
from tests.science.monitor_joint import SPEEDS


def test_what_crosses_is_marked_and_the_states_are_those_of_the_judgement() -> None:
    seen = curves(1000, COURSES[0])
    judged = Thesis(recursive=True, reset=False).judge(history(1000, COURSES[0]))
    panels = figure_case_study(SPEEDS, seen, judged).axes
    titles = [axes.get_title(loc="left") for axes in panels]
    assert titles[0] == "friction curves"
    assert titles[-1] == "decision: thesis (recursive, no reset)"
    low = panels[titles.index("its low-speed part")]
    trace = judged.traces["low_integral_w"]
    beyond = _line(low, "beyond it")
    assert np.array_equal(beyond[0] - 1, np.flatnonzero(trace.statistic > trace.threshold))
    states = [text.get_text() for text in panels[-1].get_yticklabels()]
    drawn = np.asarray(panels[-1].get_lines()[0].get_ydata())
    assert [states[int(level)] for level in drawn] == [s.value for s in judged.states]
    assert len(panels[0].get_lines()) == CYCLES + 1


def test_curves_and_judgement_of_different_length_are_refused() -> None:
    judged = Thesis().judge(history(0))
    with pytest.raises(ValueError, match="one curve a cycle"):
        figure_case_study(SPEEDS, curves(0)[:-1], judged)


def _line(axes: Axes, label: str) -> tuple[np.ndarray, np.ndarray]:
    line = next(line for line in axes.get_lines() if line.get_label() == label)
    return np.asarray(line.get_xdata()), np.asarray(line.get_ydata())
