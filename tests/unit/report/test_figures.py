"""The pictures: labelled axes, no peak lost, nothing left behind, the same bytes every time."""

from __future__ import annotations

import base64
import dataclasses
import gc
import re
import subprocess
import sys

import matplotlib as mpl
import numpy as np
import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from agent.identify.result import FrictionCurve
from agent.report.figures import canvas, thinning
from agent.report.figures.curve import figure_friction_curve, slow_limit_rad_s
from agent.report.figures.cycle import figure_cycle
from agent.report.figures.prediction import figure_prediction, medians_by_velocity
from agent.report.views import EstimateViews, RecordingView
from tests.unit.report import estimate_examples as examples

CURVE_FIELDS = tuple(field.name for field in dataclasses.fields(FrictionCurve))


def titles(figure: Figure) -> list[str]:
    return [axes.get_title(loc="left") for axes in figure.axes]


def line(axes: Axes, label: str) -> np.ndarray:
    (found,) = (one for one in axes.get_lines() if one.get_label() == label)
    return np.asarray(found.get_ydata(), dtype=np.float64)


@pytest.mark.parametrize("narrow", [False, True])
def test_every_panel_says_what_it_shows_and_in_which_unit(narrow: bool) -> None:
    view = examples.recording()
    figures = [
        figure_cycle(view, narrow=narrow),
        figure_prediction(view, narrow=narrow),
        figure_friction_curve(examples.friction_curve(), examples.friction_models(), narrow=narrow),
    ]
    for figure in figures:
        assert all(titles(figure))
        assert all(axes.get_ylabel() for axes in figure.axes)
    assert [axes.get_ylabel() for axes in figures[0].axes] == ["rad/s", "N m", "degrees", "°C"]
    assert [[axes.get_xlabel() for axes in figure.axes] for figure in figures] == [
        ["", "", "", "time, s"],
        ["", "time, s", "motor velocity, rad/s"],
        ["motor velocity, rad/s", "motor speed, rad/s (logarithmic)"],
    ]
    assert [axes.get_ylabel() for axes in figures[2].axes] == ["friction torque, N m"] * 2


def test_cycle_shows_what_was_recorded_and_no_empty_panel() -> None:
    whole = figure_cycle(examples.recording())
    assert titles(whole) == [
        "Motor velocity",
        "Motor torque",
        "Arm position",
        "Gearbox temperature",
    ]
    bare = examples.recording(position=False, temperature=False)
    assert titles(figure_cycle(bare)) == ["Motor velocity", "Motor torque"]
    signals = dataclasses.replace(
        examples.recording(temperature=False).signals,
        velocity_rad_s=None,
        velocity_command_rad_s=None,
    )
    assert titles(figure_cycle(RecordingView(signals))) == ["Motor torque", "Arm position"]


def test_cycle_shades_each_steady_window_where_it_is() -> None:
    view = examples.recording()
    torque = figure_cycle(view).axes[1]
    spans = sorted(
        (patch.get_extents().transformed(torque.transData.inverted()).x0)
        for patch in torque.patches
    )
    starts = [view.signals.time_s[window.start] for window in view.windows]
    np.testing.assert_allclose(spans, starts, atol=1e-9)


def test_cycle_keeps_the_torque_peak_of_a_single_sample() -> None:
    view = examples.recording()
    view.signals.torque_nm[12_345] = 99.0
    shown = np.asarray(figure_cycle(view).axes[1].get_lines()[0].get_ydata(), dtype=np.float64)
    assert shown.max() == 99.0
    assert shown.size < 3000


def test_arm_position_is_in_degrees_on_the_arm_side() -> None:
    view = examples.recording()
    assert view.signals.position_rad is not None
    shown = np.asarray(figure_cycle(view).axes[2].get_lines()[0].get_ydata(), dtype=np.float64)
    expected = np.degrees(view.signals.position_rad.max() / examples.GEAR_RATIO)
    assert shown.max() == pytest.approx(expected)


def test_small_torques_are_drawn_in_a_small_unit() -> None:
    view = examples.recording()
    signals = dataclasses.replace(view.signals, torque_nm=view.signals.torque_nm * 1e-3)
    axes = figure_cycle(dataclasses.replace(view, signals=signals)).axes[1]
    assert axes.get_ylabel() == "mN m"
    shown = np.asarray(axes.get_lines()[0].get_ydata(), dtype=np.float64)
    assert shown.max() == pytest.approx(view.signals.torque_nm.max())


def test_residual_counts_only_what_is_compared() -> None:
    view = examples.recording()
    assert view.compared is not None
    spoiled = np.flatnonzero(~view.compared)
    view.signals.torque_nm[spoiled] += 50.0
    low, high = figure_prediction(view).axes[1].get_ylim()
    assert high < 1000.0  # mN m
    assert low > -1000.0


def test_prediction_needs_a_prediction() -> None:
    view = dataclasses.replace(examples.recording(), torque_predicted_nm=None)
    with pytest.raises(ValueError, match="expected a predicted torque"):
        figure_prediction(view)


def test_prediction_shows_the_friction_that_the_rigid_body_lacks() -> None:
    axes = figure_prediction(examples.recording()).axes[2]
    forward, slowest = line(axes, "_median"), 0
    assert forward[slowest] > 50.0  # mN m: the Stribeck rise of the synthetic joint
    assert forward[-1] < 0.0


def test_medians_hold_equally_many_samples_and_follow_velocity() -> None:
    velocity = np.repeat([5.0, 1.0, 3.0], 40)
    middle, median = medians_by_velocity(velocity, 10.0 * velocity)
    assert np.all(np.diff(middle) >= 0.0)
    np.testing.assert_allclose(median, 10.0 * middle)
    assert medians_by_velocity(velocity[:5], velocity[:5])[0].size == 0


def test_selected_law_is_bold_and_named_and_every_law_is_drawn() -> None:
    figure = figure_friction_curve(examples.friction_curve(), examples.friction_models())
    widths = {
        one.get_label(): one.get_linewidth()
        for one in figure.axes[0].get_lines()
        if not str(one.get_label()).startswith("_")
    }
    assert set(widths) == {"Stribeck (selected)", "Coulomb + viscous", "Feeny–Moon"}
    assert widths["Stribeck (selected)"] == max(widths.values())
    key = [text.get_text() for text in figure.legends[0].get_texts()]
    assert key[:2] == ["measured, 95 % interval", "Stribeck (selected)"]


def test_law_that_cannot_be_evaluated_is_left_out_of_the_picture() -> None:
    models = examples.friction_models()
    no_numbers = {
        name: dataclasses.replace(p, value=np.nan) for name, p in models[1].parameters.items()
    }
    unknown = dataclasses.replace(models[2], model="from-a-later-version")
    broken = (models[0], dataclasses.replace(models[1], parameters=no_numbers), unknown)
    figure = figure_friction_curve(examples.friction_curve(), broken)
    key = [text.get_text() for text in figure.legends[0].get_texts()]
    assert key == ["measured, 95 % interval", "Coulomb + viscous"]


def test_low_speeds_are_logarithmic_and_zoomed() -> None:
    figure = figure_friction_curve(examples.friction_curve(), examples.friction_models())
    whole, low = figure.axes
    assert low.get_xscale() == "log"
    assert low.get_xlim()[1] < 0.4 * whole.get_xlim()[1]
    assert slow_limit_rad_s(np.array([1.0, 2.0, 3.0, 4.0, 100.0])) == 25.0
    assert slow_limit_rad_s(np.array([50.0, 60.0, 70.0, 80.0, 100.0])) == 80.0
    assert slow_limit_rad_s(np.array([7.0])) == 7.0


@pytest.mark.parametrize("points", [1, 2, 10])
def test_few_points_still_make_a_picture(points: int) -> None:
    whole = examples.friction_curve()
    curve = FrictionCurve(*(getattr(whole, name)[:points] for name in CURVE_FIELDS))
    assert canvas.data_uri(figure_friction_curve(curve)).startswith("data:image/svg+xml;base64,")
    both = examples.both_directions(curve)
    assert len(figure_friction_curve(both).axes) == 2


def test_curve_without_points_is_refused() -> None:
    empty = np.empty(0)
    curve = FrictionCurve(empty, empty, np.empty((0, 2)), empty, np.empty(0, dtype=np.int64))
    with pytest.raises(ValueError, match="got none"):
        figure_friction_curve(curve)


def test_thinning_keeps_extremes_ends_and_gaps() -> None:
    values = np.sin(np.linspace(0.0, 40.0, 40_000))
    values[7_777], values[20_001] = 5.0, -5.0
    values[30_000:32_000] = np.nan
    kept = thinning.extremes(values, 500)
    assert kept.size <= 1002
    assert np.all(np.diff(kept) > 0)
    assert (kept[0], kept[-1]) == (0, 39_999)
    assert {7_777, 20_001} <= set(kept.tolist())
    assert np.isnan(values[kept]).sum() >= 20
    np.testing.assert_array_equal(thinning.extremes(values[:100], 500), np.arange(100))


def test_envelope_encloses_the_line_and_keeps_gaps() -> None:
    time_s = np.arange(10_000) / 1000.0
    values = np.random.default_rng(5).standard_normal(10_000)
    values[5_000:6_000] = np.nan
    centre_s, low, mean, high = thinning.envelope(time_s, values, 100)
    assert np.nanmin(low) == np.nanmin(values)
    assert np.nanmax(high) == np.nanmax(values)
    assert np.isnan(mean).sum() == 10
    np.testing.assert_allclose(centre_s[np.isnan(mean)], np.arange(5.05, 6.0, 0.1), atol=1e-3)
    there = ~np.isnan(mean)
    assert np.all((low[there] <= mean[there]) & (mean[there] <= high[there]))


def test_large_drawing_becomes_png() -> None:
    figure = figure_cycle(examples.recording(), narrow=True)
    assert canvas.data_uri(figure).startswith("data:image/svg+xml;base64,")
    uri = canvas.data_uri(figure, svg_limit_bytes=1000)
    prefix, _, content = uri.partition(",")
    assert prefix == "data:image/png;base64"
    assert base64.b64decode(content).startswith(b"\x89PNG")


def test_drawing_leaves_the_caller_s_style_and_no_figure_behind() -> None:
    before = dict(mpl.rcParams)
    figure_cycle(examples.recording())
    assert dict(mpl.rcParams) == before
    gc.collect()
    alive = {id(one) for one in gc.get_objects() if issubclass(type(one), Figure)}
    canvas.data_uri(figure_prediction(examples.recording(), narrow=True))
    gc.collect()
    left = {id(one) for one in gc.get_objects() if issubclass(type(one), Figure)} - alive
    assert not left


def test_report_imports_plots_late_and_pyplot_never() -> None:
    script = (
        "import sys, agent.report\n"
        "assert 'matplotlib' not in sys.modules and 'jinja2' not in sys.modules\n"
        "from tests.unit.report import estimate_examples as e\n"
        "agent.report.estimate_html(*e.undecided())\n"
        "assert 'matplotlib' in sys.modules and 'matplotlib.pyplot' not in sys.modules\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", script], capture_output=True, text=True, check=False, timeout=600
    )
    assert done.returncode == 0, done.stderr


def test_views_refuse_what_does_not_fit_the_recording() -> None:
    view = examples.recording()
    with pytest.raises(ValueError, match=r"velocity_rad_s of shape \(40000,\), got \(3,\)"):
        dataclasses.replace(view, velocity_rad_s=np.zeros(3))
    late = dataclasses.replace(view.windows[0], stop=40_001)
    with pytest.raises(ValueError, match="inside 0 to 40000"):
        dataclasses.replace(view, windows=(late,))
    assert EstimateViews((view,)).recordings[0].residual_nm is not None


def test_line_is_broken_where_samples_are_missing() -> None:
    time_s = np.concatenate((np.arange(100) / 100.0, 5.0 + np.arange(100) / 100.0))
    for bins in (10, 1000):
        drawn_s, values = thinning.polyline(time_s, np.arange(200.0), bins)
        (gap,) = np.flatnonzero(np.isnan(drawn_s))
        assert np.isnan(values[gap])
        assert drawn_s[gap - 1] < 1.0
        assert drawn_s[gap + 1] >= 5.0


def test_prediction_is_held_against_the_torque_that_was_compared() -> None:
    view = examples.recording()
    assert view.torque_predicted_nm is not None
    assert view.compared is not None
    view.compared[10_000:15_000] = False
    smooth = dataclasses.replace(view, torque_nm=view.torque_predicted_nm + 0.01)
    assert smooth.residual_nm is not None
    np.testing.assert_allclose(smooth.residual_nm[view.compared], 0.01)
    assert np.isnan(smooth.residual_nm[~view.compared]).all()
    predicted = line(figure_prediction(smooth).axes[0], "predicted")
    assert np.isnan(predicted).any()


def test_few_speeds_are_not_called_enlarged() -> None:
    whole = examples.friction_curve()
    few = FrictionCurve(*(getattr(whole, name)[:3] for name in CURVE_FIELDS))
    assert titles(figure_friction_curve(few))[1] == "The same by speed"
    assert not figure_friction_curve(few).axes[0].patches
    assert titles(figure_friction_curve(whole))[1] == "Low speeds, enlarged"
    assert len(figure_friction_curve(whole).axes[0].patches) == 1


def test_slower_sampling_is_no_gap() -> None:
    time_s = np.concatenate((np.arange(500) / 1000.0, 0.5 + np.arange(1, 20) * 0.1))
    assert not thinning.gaps(time_s).any()
    assert thinning.gaps(np.array([0.0, 0.1, 0.2, 5.0, 5.1, 5.2])).tolist() == [
        False,
        False,
        True,
        False,
        False,
    ]


def test_one_peak_does_not_flatten_the_residual_and_is_said() -> None:
    view = examples.recording()
    assert view.torque_predicted_nm is not None
    assert not figure_prediction(view).axes[1].texts
    view.torque_predicted_nm[20_500:20_510] -= 9.0
    axes = figure_prediction(view).axes[1]
    assert axes.get_ylabel() == "N m"
    assert axes.get_ylim()[1] < 2.0
    said = re.fullmatch(r"beyond the axis: ([0-9.]+) N m at 20\.5 s", axes.texts[0].get_text())
    assert said
    assert float(said[1]) == pytest.approx(9.0, abs=0.2)
