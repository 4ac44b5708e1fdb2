"""The pictures of an explanation, and its map: what is drawn is what was found."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable

import numpy as np
import pytest

from agent.explain.answer.result import Cell, Explanation, Fit, Region
from agent.identify.result import Parameter
from agent.report.explanation.figure_curve import figure_finding
from agent.report.explanation.figure_cycle import (
    figure_residual,
    lines_of,
    located_mask,
    reach_of,
)
from agent.report.explanation.figure_left import left_over
from agent.report.explanation.figure_moved import figure_moved
from agent.report.explanation.figure_proof import (
    error_rows,
    extended_interval,
    figure_errors,
    gain_rows,
)
from agent.report.explanation.map import heat_map
from agent.report.explanation.pictures import RECORDINGS_DRAWN
from agent.report.figures.canvas import data_uri
from tests.unit.report import explanation_examples as examples


@functools.cache
def explanation(case: Callable[[], Explanation]) -> Explanation:
    return case()


def test_located_samples_are_the_ones_inside_the_regions() -> None:
    one = examples.trace_of([1.0, 5.0, -5.0, -1.0, 3.0], [[0.0] * 5] * 3)
    fast = Region("velocity_rad_s", 4.0, 9.0)
    assert located_mask(one, [fast]).tolist() == [False, True, False, False, False]
    soon = Region("after_reversal_s", 0.0, 0.5)
    assert located_mask(one, [soon]).tolist() == [False, False, True, False, True]
    assert located_mask(one, [fast, soon]).sum() == 3
    near = Region("after_reversal_rad", 0.0, 0.5)
    assert located_mask(one, [near]).tolist() == [False, False, True, False, True]
    assert located_mask(one, [Region("after_reversal_rad", 0.5, 1.5)]).tolist()[3]
    assert located_mask(one, [Region("recording", 2.0, 2.0)], index=2).all()
    assert not located_mask(one, [Region("gearbox_temperature_degc", 0.0, 99.0)]).any()


def test_residuals_that_are_one_line_are_drawn_once_and_far_ones_do_not_flatten() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.01, 400)
    same = examples.trace_of([1.0] * 400, [list(noise + 9.0), list(noise), list(noise)])
    assert [line.label for line in lines_of(same)] == ["as given", "refitted = extended"]
    assert 0.01 < reach_of(same) < 0.1
    lines = figure_residual(same, ()).axes[1].get_lines()
    assert any("beyond the axis" in str(one.get_label()) for one in lines)
    nothing = examples.trace_of([1.0] * 400, [[math.nan] * 400] * 3)
    assert lines_of(nothing) == []
    assert "nothing was compared" in figure_residual(nothing, ()).axes[1].texts[0].get_text()


def test_long_noisy_recording_stays_small_enough_to_draw_ten_of_them() -> None:
    rng = np.random.default_rng(2)
    residuals = [list(0.1 * (3 - k) * rng.standard_normal(15_000)) for k in range(3)]
    long = examples.trace_of(list(60.0 * np.sin(np.arange(15_000) / 40.0)), residuals)
    sizes = [len(data_uri(figure_residual(long, (), narrow=narrow))) for narrow in (False, True)]
    assert RECORDINGS_DRAWN * sum(sizes) < 1_300_000


def test_left_over_is_the_mean_of_the_last_stage_that_is_there() -> None:
    velocity = np.repeat(np.linspace(-10.0, 10.0, 41), 20)
    bump = np.where(velocity > 5.0, 0.3, 0.0)
    one = examples.trace_of(
        velocity.tolist(), [list(bump + 9.0), list(bump), [math.nan] * bump.size]
    )
    left = left_over([one], "velocity_rad_s")
    assert left is not None
    assert left.mean_nm[left.at > 5.6] == pytest.approx(0.3)
    assert left.mean_nm[left.at < 4.4] == pytest.approx(0.0)
    assert left_over([one], "gearbox_temperature_degc") is None
    assert left_over([], "velocity_rad_s") is None


def test_law_is_broken_at_the_reversal_where_friction_jumps() -> None:
    curve = explanation(examples.explained).findings[0].curve
    assert curve is not None
    (law,) = (
        one for one in figure_finding(curve).axes[0].get_lines() if one.get_label() == "law found"
    )
    at, line = (np.asarray(values, dtype=np.float64) for values in law.get_data())
    assert np.isnan(line[np.flatnonzero(np.isnan(at))]).all()
    jumps = np.abs(np.diff(line))
    assert np.nanmax(jumps) < 0.1  # from -0.3 to 0.3 N m it would be 0.6


def test_proof_has_every_stage_the_floor_and_an_interval_that_follows_from_the_gain() -> None:
    made = explanation(examples.explained)
    holdout = made.holdout
    assert holdout is not None
    labels = [row.label for row in error_rows(made)]
    assert labels[0] == "simulation as given"
    assert labels[-2:] == ["extended by the findings", "noise floor"]
    assert sum(label.startswith("without ") for label in labels) == 2
    interval = extended_interval(holdout)
    assert interval is not None
    assert holdout.improvement_ci95_percent is not None
    low, high = holdout.improvement_ci95_percent
    gains = [100.0 * (1.0 - end / holdout.refitted.rmse_nm) for end in interval]
    assert gains == pytest.approx([high, low])
    elsewhere = dataclasses.replace(holdout, improvement_percent=holdout.improvement_percent - 9.0)
    assert extended_interval(elsewhere) is None
    assert [row.label for row in gain_rows(made)] == ["findings", "placebo"]
    assert gain_rows(explanation(examples.unexplained)) == []


def test_errors_far_apart_are_drawn_on_a_logarithmic_axis() -> None:
    made = explanation(examples.explained)
    assert figure_errors(made).axes[0].get_xscale() == "linear"
    holdout = made.holdout
    assert holdout is not None
    far = dataclasses.replace(holdout, baseline=Fit(5.0, 1.0))
    wild = figure_errors(dataclasses.replace(made, holdout=far), narrow=True).axes[0]
    assert wild.get_xscale() == "log"
    left, right = wild.get_xlim()
    assert left < 0.0117 < 5.0 < right
    with pytest.raises(ValueError, match="got none"):
        figure_errors(explanation(examples.undecided))


def test_map_prints_gains_outlines_what_counts_and_keeps_the_best_of_a_place() -> None:
    cells = (
        Cell("coulomb_nm", "velocity_rad_s", 0.62, 0.002, counts=True),
        Cell("viscous_nm_s_per_rad", "velocity_rad_s", -0.01, 0.7, counts=False),
        Cell("scale", "order_per_motor_rev", 0.01, 0.3, counts=False),
        Cell("scale", "order_per_motor_rev", 0.12, 0.004, counts=True),
    )
    shown = heat_map(cells)
    assert shown is not None
    assert shown.columns == ("Coulomb", "Viscous", "Scale")
    assert [row.label for row in shown.rows] == ["Motor speed", "Order per motor turn"]
    first, second = (row.cells for row in shown.rows)
    assert [cell.text for cell in first] == ["62", "–", ""]
    assert [cell.counts for cell in first] == [True, False, False]
    assert second[2].text == "12"
    assert first[0].level > second[2].level > first[1].level
    assert len(shown.ranked) == 4
    assert shown.ranked[0].reads_as == "Friction falls or bends with speed"
    assert [cell.reads_as for cell in shown.ranked if not cell.counts] == ["", ""]
    assert "Coulomb friction along motor speed (62 %)" in shown.sentence
    assert heat_map(()) is None


def test_moves_are_written_and_what_is_not_identified_has_no_dot() -> None:
    made = explanation(examples.explained).moved[2]
    unknown = dataclasses.replace(
        made, extended=Parameter.not_identified("one speed only"), sigmas=math.nan
    )
    first, second = figure_moved([made, unknown]).axes
    assert "moved by" in first.get_title(loc="right")
    assert second.get_title(loc="right") == ""
    assert "not identified" in [text.get_text() for text in second.texts]
    with pytest.raises(ValueError, match="got none"):
        figure_moved([])


@pytest.mark.parametrize("narrow", [False, True])
@pytest.mark.parametrize("apart", [1.5, 60.0], ids=["linear", "logarithmic"])
def test_numbers_beside_the_dots_are_within_the_picture(apart: float, *, narrow: bool) -> None:
    """On a phone the last letter of the largest error was cut off."""
    found = explanation(examples.explained)
    assert found.holdout is not None
    least = found.holdout.extended.rmse_nm
    findings = [
        dataclasses.replace(f, holdout_rmse_without_nm=apart * least) for f in found.findings
    ]
    one, *others = findings
    more = dataclasses.replace(found, findings=(one, dataclasses.replace(one, rank=2), *others))
    figure = figure_errors(more, narrow=narrow)
    figure.draw_without_rendering()
    texts = [text for axes in figure.axes for text in (*axes.texts, *axes.get_yticklabels())]
    assert len(texts) > 6
    for text in texts:
        box = text.get_window_extent()
        assert 0.0 < box.x0 < box.x1 < figure.bbox.x1, text.get_text()
