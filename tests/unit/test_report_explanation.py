"""What people see of an explanation: every verdict has its page and its text, whole and escaped."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from agent.cli.explanation_text import WIDTH, explanation_text
from agent.explain.result import Cell, Explanation, Fit, NextExperiment, Region, Trace
from agent.identify.result import Parameter
from agent.report.explanation import RECORDINGS_DRAWN, explanation_page, write_explanation_page
from agent.report.explanation_map import heat_map
from agent.report.explanation_words import (
    EFFECTS,
    decidable,
    next_command,
    region_in_words,
    tells_apart,
    variable,
    verdict_words,
)
from agent.report.figure_explanation_curve import figure_finding
from agent.report.figure_explanation_cycle import (
    figure_residual,
    lines_of,
    located_mask,
    reach_of,
)
from agent.report.figure_explanation_left import left_over
from agent.report.figure_explanation_moved import figure_moved
from agent.report.figure_explanation_proof import (
    error_rows,
    extended_interval,
    figure_errors,
    gain_rows,
)
from tests.unit import explanation_examples as examples
from tests.unit.test_report_page import Page

Case = Callable[[], Explanation]
LIMIT_BYTES = 1_500_000
HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> {{ 7*7 }} $x$"
EFFECT_IDS = {
    "stribeck",
    "viscous-nonlinear",
    "direction-asymmetry",
    "load-dependent-friction",
    "temperature-dependent-friction",
    "position-dependent-friction",
    "presliding-hysteresis",
    "friction-drift",
    "torque-ripple",
    "kinematic-error",
    "torque-constant-error",
    "torque-offset",
    "torque-saturation",
    "measurement-delay",
    "resolver-error",
    "inertia-error",
    "wrong-number",
    "gravity-imbalance",
    "cable-force",
    "joint-flexibility",
    "backlash",
    "local-fault",
}


@functools.cache
def explanation(case: Case) -> Explanation:
    return case()


@functools.cache
def page(case: Case) -> tuple[str, Page]:
    text = explanation_page(
        explanation(case), robot="cell7", axis=1, next_file="next.json", metadata=examples.METADATA
    )
    return text, Page(text)


def said(case: Case) -> str:
    """Return the page's visible text with plain spaces."""
    return page(case)[1].text.replace("\u00a0", " ")


@pytest.mark.parametrize("case", examples.ALL)
def test_every_verdict_has_its_page_accessible_offline_and_small(case: Case) -> None:
    text, parsed = page(case)
    assert len(parsed.all("h1")) == 1
    ids = [attributes["id"] for _, attributes in parsed.elements if "id" in attributes]
    assert len(ids) == len(set(ids))
    for _, attributes in parsed.elements:
        assert attributes.get("aria-labelledby", ids[0]) in ids
    assert all(len(image["alt"]) > 40 for image in parsed.all("img"))
    assert all(image["src"].startswith("data:") for image in parsed.all("img"))
    assert len(parsed.all("table")) == len(parsed.all("caption"))
    assert all("scope" in header for header in parsed.all("th"))
    assert not parsed.all("script")
    assert "default-src 'none'" in text
    for outside in ("http:", "https:", "url(", "@import"):
        assert outside not in text
    assert len(text.encode()) < LIMIT_BYTES


@pytest.mark.parametrize("case", examples.ALL)
def test_sentence_and_verdict_in_words_come_first_and_no_id_is_shown(case: Case) -> None:
    text, words = said(case), verdict_words(explanation(case))
    headline = f"{words.status} {explanation(case).sentence}"
    assert headline in text
    assert text.index(headline) < 200
    for ident in {"tied", "partly-explained", "no-mismatch", *EFFECT_IDS} - {"backlash"}:
        if "-" in ident or ident == "tied":
            assert f" {ident} " not in text


def test_verdicts_differ_in_word_and_in_shape() -> None:
    words = [verdict_words(explanation(case)) for case in examples.ALL]
    assert (
        len({(one.status, one.sign) for one in words}) == len(words) - 1
    )  # wrong number: explained
    signs = {page(case)[0].split('class="sign"')[1].split("</svg>")[0] for case in examples.ALL}
    assert len(signs) == len(words) - 1


def test_explained_shows_findings_proof_place_map_and_moves() -> None:
    text, _ = said(examples.explained), page(examples.explained)[1]
    order = (
        "What was found",
        "Friction that falls with speed (Stribeck)",
        "Friction that changes with temperature",
        "Does it hold on data that it had not seen?",
        "Where in the cycle",
        "night-run.parquet (hold-out: not seen by the fit)",
        "Where in the physics",
        "What it does to the simulation's own numbers",
        "What could not be judged",
        "What it stands on",
    )
    places = [text.index(heading) for heading in order]
    assert places == sorted(places)
    assert "the motor temperature was not recorded" in text
    assert "no speed below 2 rad/s was driven" in text
    assert "What to do next" not in text


def test_numbers_on_the_page_are_the_explanation_s() -> None:
    made, (_, parsed) = explanation(examples.explained), page(examples.explained)
    holdout = made.holdout
    assert holdout is not None
    row = parsed.row("Extended by the findings")
    assert float(row[1]) == pytest.approx(made.extended.rmse_nm, rel=0.005)
    assert float(row[3]) == pytest.approx(holdout.extended.rmse_nm, rel=0.005)
    assert float(row[4]) == pytest.approx(holdout.extended.fit_percent, abs=0.05)
    assert f"{holdout.improvement_percent:.1f} %" in said(examples.explained)
    assert parsed.row("Extra friction at standstill (Stribeck)")[1:3] == ["0.310", "N m"]
    moved = parsed.row("Coulomb friction")
    assert float(moved[2]) == pytest.approx(0.64)
    assert moved[5] == f"{abs(made.moved[2].sigmas):.2g}"


def test_tie_names_both_causes_and_the_command_that_decides() -> None:
    text = said(examples.tied)
    assert "54 % friction that changes with temperature 46 % friction that drifts" in text
    assert "stribeck run CELL.toml --axis 1 --trajectory next.json" in text
    assert "stribeck explain TWIN.toml" in text
    assert text.index("What to do next") < text.index("What was found")
    assert "Motion needed: about 2 min" in text


def test_unexplained_shows_where_and_in_which_shape_and_invents_no_stage() -> None:
    text, parsed = said(examples.unexplained), page(examples.unexplained)[1]
    assert "97 % of the mismatch has no explanation" in text
    assert "Motor velocity 28 to 48 rad/s" in text
    assert any("without explanation" in image["alt"] for image in parsed.all("img"))
    assert "What was found" not in text
    assert not any("extended" in image["alt"].lower() for image in parsed.all("img"))


def test_no_mismatch_is_calm() -> None:
    text = said(examples.no_mismatch)
    assert "No cell counts" in text
    for alarm in ("What was found", "What to do next", "no explanation", "Placebo"):
        assert alarm not in text


def test_not_decidable_shows_reasons_and_steps_and_no_numbers() -> None:
    made, (_, parsed) = explanation(examples.undecided), page(examples.undecided)
    assert not decidable(made)
    assert all(reason in said(examples.undecided) for reason in made.reasons)
    assert "Record faster" in parsed.text
    assert "estimate again" not in parsed.text
    assert not parsed.all("img")
    assert "N m" not in parsed.text
    reckless = dataclasses.replace(explanation(examples.explained), baseline=Fit())
    assert not Page(explanation_page(reckless)).all("img")


def test_names_from_outside_are_text_and_nothing_else() -> None:
    made = explanation(examples.tied)
    (finding,) = made.findings
    (other,) = finding.alternatives
    assert made.next_experiment is not None
    hostile = dataclasses.replace(
        made,
        sentence=HOSTILE,
        reasons=(HOSTILE,),
        recordings=(HOSTILE,),
        not_judged={HOSTILE: HOSTILE},
        aliases=((HOSTILE, HOSTILE),),
        traces=(dataclasses.replace(made.traces[0], recording=HOSTILE),),
        cells=(Cell(HOSTILE, HOSTILE, 0.5, 0.01, counts=True),),
        moved=(dataclasses.replace(made.moved[0], parameter=HOSTILE),),
        unexplained_where=(Region(HOSTILE, 0.0, 1.0),),
        next_experiment=dataclasses.replace(
            made.next_experiment, sentence=HOSTILE, set_up=HOSTILE, tells_apart=(HOSTILE, HOSTILE)
        ),
        findings=(
            dataclasses.replace(
                finding,
                effect=HOSTILE,
                sentence=HOSTILE,
                form=HOSTILE,
                parameters={HOSTILE: Parameter.not_identified(HOSTILE)},
                alternatives=(dataclasses.replace(other, effect=HOSTILE, told_apart_by=HOSTILE),),
                where=(Region(HOSTILE, 0.0, 1.0),),
                curve=dataclasses.replace(finding.curve, variable=HOSTILE)
                if finding.curve
                else None,
            ),
        ),
    )
    parsed = Page(
        explanation_page(
            hostile,
            title=HOSTILE,
            robot=HOSTILE,
            axis=HOSTILE,
            next_file=HOSTILE,
            metadata={HOSTILE: HOSTILE},
        )
    )
    assert not parsed.all("script")
    assert not any("onerror" in attributes for _, attributes in parsed.elements)
    assert all(image["src"].startswith("data:") for image in parsed.all("img"))
    assert "".join(parsed.words).count("<script>alert(1)</script>") > 15
    assert "49" not in "".join(parsed.words)


def test_page_is_written_whole_and_the_same_every_time(tmp_path: Path) -> None:
    path = write_explanation_page(tmp_path / "report.html", explanation(examples.undecided))
    assert path.read_text(encoding="utf-8") == explanation_page(explanation(examples.undecided))
    once, again = (explanation_page(explanation(examples.no_mismatch)) for _ in range(2))
    assert once == again


def test_many_recordings_are_folded_counted_and_stay_small() -> None:
    made = explanation(examples.tied)
    many = tuple(
        dataclasses.replace(made.traces[0], recording=f"run-{k}.parquet")
        for k in range(RECORDINGS_DRAWN + 2)
    )
    bare = dataclasses.replace(made, traces=many, findings=(), moved=(), cells=())
    text = explanation_page(dataclasses.replace(bare, verdict="no-mismatch"))
    assert "7 more recordings" in text
    assert "2 more recordings were used and are not drawn" in text
    assert len(text.encode()) < LIMIT_BYTES


def test_every_effect_of_the_contract_is_called_something() -> None:
    assert set(EFFECTS) == EFFECT_IDS
    assert len(set(EFFECTS.values())) == len(EFFECTS)


@pytest.mark.parametrize("case", examples.ALL)
def test_text_fits_a_terminal_and_begins_with_the_answer(case: Case) -> None:
    text = explanation_text(explanation(case), axis=1, next_file="next.json")
    lines = text.splitlines()
    assert lines[0] == f"{verdict_words(explanation(case)).status}."
    assert " ".join(text.split()).startswith(f"{lines[0]} {explanation(case).sentence}")
    assert max(map(len, lines)) <= WIDTH
    assert "nan" not in text.split()


def test_text_says_what_the_page_says() -> None:
    text = " ".join(explanation_text(explanation(examples.tied), axis=3).split())
    assert "friction that drifts from run to run (46 %); told apart by: The same speeds" in text
    assert "stribeck run CELL.toml --axis 3 --trajectory next.json" in text
    text = " ".join(explanation_text(explanation(examples.partly)).split())
    assert "Without explanation: 38 % of the mismatch" in text
    assert "Stribeck exponent: not identified: no speed below 2 rad/s" in text
    assert "Looks" not in explanation_text(explanation(examples.undecided))


@pytest.mark.parametrize(
    ("region", "words"),
    [
        (Region("velocity_rad_s", -14.0, 14.0), "motor velocity within ±14 rad/s"),
        (Region("velocity_rad_s", 0.5, 14.25), "motor velocity 0.5 to 14.2 rad/s"),
        (Region("velocity_rad_s", -math.inf, 14.0), "motor velocity below 14 rad/s"),
        (Region("load_torque_nm", 3.0, math.inf), "load torque above 3 N m"),
        (Region("order_per_motor_rev", 2.0, 2.0), "order per motor turn 2"),
        (Region("arm_position_rad", 0.0, math.pi / 2), "arm position 0 to 90 degrees"),
        (Region("recording", 1.0, 1.0), "in b.parquet"),
        (Region("recording", 0.0, 1.0), "from a.parquet to b.parquet"),
        (Region("recording", 7.0, 7.0), "in recording 8"),
        (Region("time_s", 2.0, 4.0, 2.0, 0.254), "time 2 to 4 s (2 s, 25 % of the mismatch)"),
        (Region("oil_age_s", 1.0, 2.0), "oil age 1 to 2 s"),
    ],
)
def test_region_in_words(region: Region, words: str) -> None:
    assert region_in_words(region, ("a.parquet", "b.parquet")) == words


def test_change_of_the_set_up_has_no_command() -> None:
    change = NextExperiment(
        "Add a payload.", ("a-b", "c", "d"), math.nan, 0.1, set_up="Mount 5 kg."
    )
    assert next_command(change, "1", "next.json") == ""
    assert tells_apart(change) == "It tells apart: a b; c; d."
    assert variable("recording").shown(np.array([0.0])).tolist() == [1.0]


def trace(velocity: list[float], residual: list[list[float]]) -> Trace:
    given, refitted, extended = (np.array(values) for values in residual)
    return Trace(
        "a.parquet",
        held_out=False,
        time_s=np.arange(float(len(velocity))),
        velocity_rad_s=np.array(velocity),
        measured_nm=np.ones(len(velocity)),
        given_nm=given,
        refitted_nm=refitted,
        extended_nm=extended,
    )


def test_located_samples_are_the_ones_inside_the_regions() -> None:
    one = trace([1.0, 5.0, -5.0, -1.0, 3.0], [[0.0] * 5] * 3)
    fast = Region("velocity_rad_s", 4.0, 9.0)
    assert located_mask(one, [fast]).tolist() == [False, True, False, False, False]
    soon = Region("after_reversal_s", 0.0, 0.5)
    assert located_mask(one, [soon]).tolist() == [False, False, True, False, True]
    assert located_mask(one, [fast, soon]).sum() == 3
    assert located_mask(one, [Region("recording", 2.0, 2.0)], index=2).all()
    assert not located_mask(one, [Region("gearbox_temperature_degc", 0.0, 99.0)]).any()


def test_residuals_that_are_one_line_are_drawn_once_and_far_ones_do_not_flatten() -> None:
    noise = np.random.default_rng(1).normal(0.0, 0.01, 400)
    same = trace([1.0] * 400, [list(noise + 9.0), list(noise), list(noise)])
    assert [line.label for line in lines_of(same)] == ["as given", "refitted = extended"]
    assert 0.01 < reach_of(same) < 0.1
    lines = figure_residual(same, ()).axes[1].get_lines()
    assert any("beyond the axis" in str(one.get_label()) for one in lines)
    nothing = trace([1.0] * 400, [[math.nan] * 400] * 3)
    assert lines_of(nothing) == []
    assert "nothing was compared" in figure_residual(nothing, ()).axes[1].texts[0].get_text()


def test_left_over_is_the_mean_of_the_last_stage_that_is_there() -> None:
    velocity = np.repeat(np.linspace(-10.0, 10.0, 41), 20)
    bump = np.where(velocity > 5.0, 0.3, 0.0)
    one = trace(velocity.tolist(), [list(bump + 9.0), list(bump), [math.nan] * bump.size])
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
    assert [row.label for row in shown.rows] == ["Motor velocity", "Order per motor turn"]
    first, second = (row.cells for row in shown.rows)
    assert [cell.text for cell in first] == ["62", "–", ""]
    assert [cell.counts for cell in first] == [True, False, False]
    assert second[2].text == "12"
    assert first[0].level > second[2].level > first[1].level
    assert len(shown.ranked) == 4
    assert "Coulomb friction along motor velocity (62 %)" in shown.sentence
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
