"""Pictures of what swings: a resonance at its frequency, a moment where it shows most."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.answer.result import Curve, Region
from agent.explain.forms.downhill import downhill
from agent.explain.location.dynamic_curves import excerpt, over_frequency, spectrum_around
from agent.explain.rows.lines import lines_of
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats
from agent.report.explanation.figure_curve import abscissa_of, caption_of
from agent.report.explanation.figure_spectrum import figure_spectrum, spectrum_in_words
from tests.science.explain_joint import TWIN, Conditions, record, stair
from trajectories import SetPoints

HERTZ, SIZE_NM = 8.0, 0.1


def scene_with(missing_from_s: float) -> Scene:
    """Return one recording with a second of swinging, from an instant on."""

    def swing(points: SetPoints, at: Conditions) -> Floats:
        del at
        time = np.arange(points.velocity_rad_s.shape[0]) / 250.0
        there = (time >= missing_from_s) & (time < missing_from_s + 1.0)
        return np.asarray(SIZE_NM * there * np.sin(2.0 * np.pi * HERTZ * time))

    table = tabulate(TWIN, [record(stair([5.0, 20.0, 60.0]), swing, Conditions(), 3)])
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    return Scene(table, theta, np.where(table.used, left, 0.0))


def swing_at(scene: Scene, rows: np.ndarray, start_s: float) -> Floats:
    time = scene.table.rows["time_s"][rows]
    there = (time >= start_s) & (time < start_s + 1.0)
    return np.asarray(SIZE_NM * there * np.sin(2.0 * np.pi * HERTZ * time))


def test_a_swing_is_drawn_at_its_frequency_and_in_its_moment() -> None:
    scene = scene_with(9.0)
    rows = np.flatnonzero(scene.table.used)
    added = swing_at(scene, rows, 9.0)
    left = scene.residual_nm[rows] - added
    by_frequency = over_frequency(scene, rows, added, left)
    moment = excerpt(scene, rows, added, left)
    assert by_frequency is not None
    assert moment is not None
    peak = int(np.argmax(by_frequency.line_nm))
    assert by_frequency.at[peak] == pytest.approx(HERTZ, rel=0.15)
    # All of the law's energy is in the bands.
    assert np.sum(by_frequency.line_nm**2) == pytest.approx(np.mean(added**2), rel=0.1)
    assert moment.at[0] >= 8.9
    assert moment.at[-1] <= 10.1
    assert np.max(moment.line_nm) == pytest.approx(SIZE_NM, rel=0.1)
    assert abscissa_of(moment).unit == "s"
    assert len({caption_of(by_frequency), caption_of(moment)}) == 2


def test_a_pattern_search_finds_the_bottom_of_a_narrow_valley() -> None:
    """Two numbers that hang together, and a coarse grid that misses both."""
    scene = scene_with(9.0)

    def burst(scene: Scene, point: tuple[float, ...]) -> Floats:
        time = scene.full("time_s")
        bell = np.exp(-0.5 * ((time - 9.5) / point[1]) ** 2)
        return np.asarray(bell * np.sin(2.0 * np.pi * point[0] * time))[:, np.newaxis]

    coarse = [(7.0, 0.1), (7.9, 0.1), (9.0, 0.1)]
    (hertz, width), *_ = downhill(scene, burst, coarse, ((1.0, 20.0), (0.01, 2.0)), 60)
    assert hertz == pytest.approx(HERTZ, rel=0.02)
    # The bell that resembles a box of one second most.
    assert width == pytest.approx(0.36, rel=0.3)


def test_the_line_of_a_hum_is_drawn_and_told() -> None:
    def hum(points: SetPoints, at: Conditions) -> Floats:
        time = np.arange(points.velocity_rad_s.shape[0]) / 250.0
        return np.asarray(0.03 * np.sin(2.0 * np.pi * 60.0 * time + at.started_s))

    runs = [
        record(stair([5.0 * k, 20.0 * k, 60.0 * k]), hum, Conditions(), k, name=f"{k}")
        for k in (1, 2)
    ]
    table = tabulate(TWIN, runs)
    (line,) = lines_of(table, refit(table)[1])
    curve = spectrum_around(line)
    assert isinstance(curve, Curve)
    assert curve.bin_at[int(np.argmax(curve.bin_nm))] == pytest.approx(60.0, abs=0.05)
    assert "60" in spectrum_in_words(curve)
    where = (Region("frequency_hz", 59.9, 60.1),)
    axes = figure_spectrum(curve, where).axes[0]
    assert axes.get_xlim()[0] < 60.0 < axes.get_xlim()[1]
    assert len(axes.patches) == 1
