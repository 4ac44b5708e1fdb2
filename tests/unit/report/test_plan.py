"""The plan's picture and page: labelled, escaped, the same every time, nothing left behind."""

from __future__ import annotations

from typing import Any

import matplotlib as mpl
import numpy as np
import pytest

from agent.report.figures.plan import figure_plan, plan_figure_in_words
from agent.report.plan import plan_html
from trajectories import Expectation, stair_paired

NOMINAL = {
    "coulomb_nm": 0.6,
    "viscous_nm_s_per_rad": 0.01,
    "static_extra_nm": 0.15,
    "stribeck_velocity_rad_s": 6.0,
    "exponent": 1.3,
}
STAIR = stair_paired(
    -60.0,
    60.0,
    speeds_rad_s=(2.0, 8.0, 30.0),
    duration_s=12.0,
    acceleration_rad_s2=300.0,
    jerk_rad_s3=10_000.0,
)
SEEN = Expectation(np.array([2.0, 8.0, 30.0]), np.array([0.004, 0.005, 0.006]), {})


@pytest.mark.parametrize("narrow", [False, True])
def test_the_picture_shows_the_stair_and_the_points_to_come(narrow: bool) -> None:
    before = dict(mpl.rcParams)
    figure = figure_plan(STAIR, SEEN, NOMINAL, 100.0, narrow=narrow)
    assert dict(mpl.rcParams) == before
    velocity, position, curve = figure.axes
    assert (velocity.get_ylabel(), position.get_ylabel()) == ("rad/s", "degrees")
    assert position.get_xlabel() == "time, s"
    assert curve.get_xlabel() == "motor speed, rad/s"
    assert curve.get_xscale() == "log"
    drawn = np.asarray(velocity.get_lines()[0].get_ydata(), dtype=np.float64)
    assert drawn.max() == pytest.approx(30.0)
    assert drawn.min() == pytest.approx(-30.0)
    shaded = velocity.patches
    assert len(shaded) == len(STAIR.steady_windows())
    points = next(line for line in curve.get_lines() if line.get_marker() == "o")
    torque = np.asarray(points.get_ydata(), dtype=np.float64)
    expected = 0.6 + 0.15 * np.exp(-((SEEN.speed_rad_s / 6.0) ** 1.3))
    np.testing.assert_allclose(torque, expected)
    held = [text.get_text() for text in curve.texts]
    windows = [w for w in STAIR.steady_windows() if abs(w.velocity_rad_s) == 2.0]
    assert held[0] == f"{sum(w.end_s - w.start_s for w in windows):.1f} s"


def page(**changes: Any) -> str:
    arguments: dict[str, Any] = {
        "title": "Plan of 12.0 s",
        "robot": "cell7",
        "axis": 1,
        "gear_ratio": 100.0,
        "in_short": ("12 s, within all limits.", ""),
        "rows": [("Coulomb friction", "0.6 N m", "± 0.01 N m")],
        "can_see": ["much"],
        "cannot_see": ["little"],
        "basis": "Reckoned.",
    }
    return plan_html(STAIR, SEEN, NOMINAL, **(arguments | changes))


def test_the_page_escapes_names_and_is_the_same_every_time() -> None:
    hostile = page(robot="<script>alert(1)</script>")
    assert "<script>" not in hostile
    assert "&lt;script&gt;" in hostile
    again = page(robot="<script>alert(1)</script>")
    assert again == hostile
    assert '<h1 id="worth">12\u00a0s, within all limits.</h1>' in again
    for part in ("much", "little", "±\u00a00.01\u00a0N\u00a0m", plan_figure_in_words(STAIR, SEEN)):
        assert part in again
