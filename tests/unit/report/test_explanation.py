"""What people see of an explanation: every verdict has its page and its text, whole and escaped."""

from __future__ import annotations

import dataclasses
import functools
import math
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.cli.explain.text import WIDTH, explanation_text
from agent.explain.answer.located import Alternative
from agent.explain.answer.names import NAMES, OWN_NUMBER
from agent.explain.answer.result import (
    Cell,
    Explanation,
    Finding,
    Fit,
    Floor,
    NextExperiment,
    Region,
)
from agent.explain.answer.said import Said
from agent.explain.answer.sentences import finding_sentence, spring_sentence
from agent.explain.answer.words import tie_sentence
from agent.identify.result import Parameter
from agent.physics.effects import LIBRARY
from agent.report.explanation import pictures as explanation_pictures
from agent.report.explanation.head import head_of
from agent.report.explanation.page import explanation_page, write_explanation_page
from agent.report.explanation.places import region_in_words, regions_in_words, variable
from agent.report.explanation.quantities import quantity_label, quantity_scale
from agent.report.explanation.rows import finding_row, parameter_rows
from agent.report.explanation.words import (
    briefly,
    decidable,
    motion_needed,
    next_command,
    qualification,
    set_up_beside,
    tells_apart,
    trajectory_hint,
    verdict_words,
)
from tests.unit.report import explanation_examples as examples
from tests.unit.report.test_page import Page

Case = Callable[[], Explanation]
LIMIT_BYTES = 1_500_000
HOSTILE = "<script>alert(1)</script>\"'><img src=x onerror=alert(2)> {{ 7*7 }} $x$"


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
    headline = f"{words.status} {head_of(explanation(case)).first}"
    assert explanation(case).sentence.startswith(head_of(explanation(case)).first)
    assert headline in text
    assert text.index(headline) < 200
    for ident in {"tied", "partly-explained", "no-mismatch", *NAMES} - {"backlash"}:
        if "-" in ident or ident == "tied":
            assert f" {ident} " not in text


def soft_gear_and_delay() -> Explanation:
    """Return a soft gear that makes nearly all of the error, and a delay behind which it hides."""
    made = explanation(examples.explained)
    assert made.holdout is not None
    swings = finding_sentence("joint-flexibility", (), (-1.7, 1.7), 0.95, {})
    late = {"torque_delay_s": Parameter(-0.002, None)}
    delay = finding_sentence("measurement-delay", (), (-0.4, 0.4), 0.0, late, first=False)
    bearing = dataclasses.replace(swings, caveat=spring_sentence(0.54))
    found = (
        Finding("joint-flexibility", 1, 1.0, 0.95, (), bearing, {}, (), 0.4, "one spring"),
        Finding("measurement-delay", 2, 1.0, 0.0, (), delay, late, (), 0.1, "late"),
    )
    proof = dataclasses.replace(made.holdout, extended=Fit(0.0125, 99.0))
    return examples.told(made, findings=found, holdout=proof)


def test_the_head_is_short_and_caveats_places_and_amounts_stand_with_their_finding() -> None:
    """The box had held every sentence whole, and what a soft gear's may be, twice."""
    made = soft_gear_and_delay()
    head = head_of(made)
    assert head.first.endswith(
        "; an arm that swings behind a soft gear explains 95 % of the mismatch."
    )
    late = "One channel that is late against another"
    assert head.further == (f"{late}: without it the error would be 8 times as large.",)
    assert [line.split(" the error")[0] for line in head.rest] == ["On 1 hold-out recording"]
    rows = [finding_row(finding, made, head) for finding in made.told]
    assert rows[0].sentence.replace("\u00a0", " ").endswith("simulation's by up to ±1.7 N m.")
    assert (
        rows[1]
        .sentence.replace("\u00a0", " ")
        .endswith("by up to ±0.40 N m: the motion is reported 2.0 ms later than the torque.")
    )
    swings = "54 % of the joint's inertia swings"
    for text in (explanation_page(made), explanation_text(made)):
        plain = " ".join(text.replace("\u00a0", " ").split())
        assert plain.count(swings.replace("'", "&#39;" if "<html" in text else "'")) == 1
        assert plain.index("What was found") < plain.index("inertia swings")
        assert "has a name, and correcting it" not in plain
    whole = f"{made.findings[0].sentence} Over the whole cycle the torque differs"
    assert made.sentence.startswith(whole)


def test_two_findings_of_one_name_are_told_apart_and_a_tie_has_the_firsts_probability() -> None:
    """A misread angle of two orders had twice the same line, and the second one's tie above."""
    made = explanation(examples.explained)
    found = []
    for rank, (order, share, probability) in enumerate(((1.0, 0.8, 0.68), (2.0, 0.2, 0.79)), 1):
        where = (Region("order_per_motor_rev", order, order, 0.0, 1.0),)
        said = finding_sentence("resolver-error", where, (-0.03, 0.03), share, {}, first=rank == 1)
        rival = Alternative("kinematic-error", 1.0 - probability, "the arm's own encoder")
        found.append(
            Finding(
                "resolver-error", rank, probability, share, where, said, {}, (rival,), 0.1, "order"
            )
        )
    both = examples.told(made, verdict="tied", findings=tuple(found))
    assert head_of(both).first.startswith("Once per motor turn")
    assert head_of(both).further[0].startswith("2 times per motor turn")
    page = explanation_page(both).replace("\u00a0", " ")
    box = page[page.index('class="rivals"') : page.index("What was found")]
    assert box.index("68 %") < box.index("32 %")
    assert "79 %" not in box


def test_a_small_share_without_which_the_error_is_much_larger_is_not_left_alone() -> None:
    """Less than 1 %, of an effect without which the error was 23 times as large, misleads."""
    made = soft_gear_and_delay()
    weighed = "less than 1 % of the mismatch, but without it the error would be 8 times as large."
    assert weighed in made.sentence
    assert made.to_json()["findings"][1]["sentence"].endswith(weighed)
    assert "8 times as large" not in made.to_json()["findings"][0]["sentence"]
    assert "8 times as large" in " ".join(explanation_text(made).split())

    def told(**changes: Any) -> str:
        return examples.told(
            made, findings=(made.findings[0], dataclasses.replace(made.findings[1], **changes))
        ).sentence

    assert "times as large" not in told(holdout_rmse_without_nm=0.0185)  # 1.48 times
    assert "1.5 times as large" in told(holdout_rmse_without_nm=0.0190)
    assert "times as large" not in told(energy_share=0.12)
    assert "times as large" not in told(form=OWN_NUMBER)


def test_what_was_asked_about_leads_and_the_rest_stands_beside_it() -> None:
    made = dataclasses.replace(soft_gear_and_delay(), beside="Also left out")
    page_text, text = Page(explanation_page(made)).text, explanation_text(made)
    assert page_text.index("What was found") < page_text.rindex("Also left out")
    assert text.count("Also left out:") == 2
    assert "Also left out" not in explanation_page(soft_gear_and_delay())


@pytest.mark.parametrize(("low", "holds"), [(1.0, True), (-0.7, False)])
def test_a_gain_on_unseen_data_is_claimed_only_where_its_interval_shows_one(
    low: float, *, holds: bool
) -> None:
    """A law of a few milliseconds may be there, and make no difference to an error of minutes."""
    found = examples.explained()
    assert found.holdout is not None
    proof = dataclasses.replace(found.holdout, improvement_ci95_percent=(low, 2.0))
    judged = dataclasses.replace(found, holdout=proof)
    assert ("correcting it holds" in verdict_words(judged).meaning) is holds
    assert ("is not shown" in qualification(judged)) is not holds
    assert ("is not shown" in explanation_text(judged).replace("\n  ", " ")) is not holds


def test_what_is_not_proven_is_marked_so_where_it_is_listed_too() -> None:
    """A direct-drive arm had "Several causes fit equally well" above an error of five noises."""
    found = examples.tied()
    assert found.holdout is not None
    far = dataclasses.replace(
        found.holdout, improvement_ci95_percent=(-17.0, 40.0), floor_ratio=4.9
    )
    found = dataclasses.replace(found, holdout=far)
    assert verdict_words(found).status == "Named, but not proven"
    assert "What was found, not proven" in explanation_text(found)
    assert '<h2 id="findings">What was found, not proven</h2>' in explanation_page(found)
    near = dataclasses.replace(found, holdout=dataclasses.replace(far, floor_ratio=1.1))
    assert verdict_words(near).status == verdict_words(examples.tied()).status


def test_numbers_that_are_not_known_for_one_reason_stand_in_one_line() -> None:
    """A wobble of six numbers had twelve lines of the same words."""
    found = examples.explained()
    reason = "the squared error hardly depends on it"
    unknown = {n: Parameter.not_identified(reason, 1.0) for n in ("cos_nm", "sin_nm", "limit_nm")}
    known = {"half_gap_rad": Parameter(0.01, (0.008, 0.012))}
    finding = dataclasses.replace(found.findings[0], parameters={**unknown, **known})
    text = " ".join(explanation_text(dataclasses.replace(found, findings=(finding,))).split())
    assert text.count("not identified:") == 1
    assert f"Cosine part; Sine part; Torque limit of the drive: not identified: {reason}" in text
    assert text.index("Half of the gap") < text.index("Cosine part")


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
        "Friction that changes with the gearbox temperature",
        "Does it hold on data that it had not seen?",
        "Where in the cycle",
        "night-run.parquet (hold-out: not seen by the fit)",
        "Where in the physics",
        "What it does to the simulation's own numbers",
        "What could not be judged",
        "What it stands on",
    )
    below = text.index("What was found")  # the head names the findings as well
    places = [text.index(heading, below) for heading in order]
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
    assert parsed.row("Extra friction at standstill")[1:3] == ["0.310", "N m"]
    moved = parsed.row("Coulomb friction")
    assert float(moved[2]) == pytest.approx(0.64)
    assert moved[5] == f"{abs(made.moved[2].sigmas):.2g}"


def test_tie_names_both_causes_and_the_command_that_decides() -> None:
    text = said(examples.tied)
    assert (
        "54 % friction that changes with the gearbox temperature 46 % friction that changes" in text
    )
    assert "stribeck run CELL.toml --axis 1 --trajectory next.json" in text
    assert "stribeck explain TWIN.toml" in text
    assert text.index("What to do next") < text.index("What was found")
    assert "Motion needed: about 2.5 min" in text
    assert "cannot tell" not in text  # the causes are listed, each with its probability


@pytest.mark.parametrize(("probability", "equally"), [(0.54, True), (0.95, False)])
def test_causes_of_which_one_is_far_likelier_do_not_fit_equally_well(
    probability: float, equally: bool
) -> None:
    tied = explanation(examples.tied)
    first = dataclasses.replace(tied.findings[0], probability=probability)
    found = dataclasses.replace(tied, findings=(first,))
    assert ("fit equally well" in verdict_words(found).status) is equally
    assert ("cannot tell" in tie_sentence(first)) is equally
    assert ("not ruled out" in tie_sentence(first)) is not equally
    assert not qualification(found)


def test_what_lies_nowhere_is_not_called_located() -> None:
    located = explanation(examples.unexplained)
    nowhere = dataclasses.replace(located, unexplained_where=(), unexplained_varies=None)
    assert verdict_words(located).status == "Located, but not explained"
    assert verdict_words(nowhere).status == "Not explained"
    assert not qualification(nowhere)  # the sentence says it already


def test_unexplained_shows_where_and_in_which_shape_and_invents_no_stage() -> None:
    text, parsed = said(examples.unexplained), page(examples.unexplained)[1]
    assert "97 % of the mismatch has no explanation" in text
    assert "Motor velocity 28 to 48 rad/s" in text
    varies = "how much Coulomb friction would have to differ from what it usually is"
    assert any(varies in image["alt"] for image in parsed.all("img"))
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
    unproved = dataclasses.replace(explanation(examples.no_mismatch), traces=(), cells=())
    assert unproved.holdout is not None
    empty = dataclasses.replace(unproved.holdout, baseline=Fit(), refitted=Fit(), extended=Fit())
    floorless = dataclasses.replace(unproved, holdout=empty, floor=Floor(*[math.nan] * 4))
    assert not Page(explanation_page(floorless)).all("img")
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
                said=Said(HOSTILE, HOSTILE, HOSTILE, HOSTILE),
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


def test_many_recordings_are_folded_counted_and_not_all_drawn(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(explanation_pictures, "RECORDINGS_DRAWN", 4)
    made = explanation(examples.tied)
    many = tuple(
        dataclasses.replace(made.traces[0], recording=f"run-{k}.parquet") for k in range(6)
    )
    bare = dataclasses.replace(made, traces=many, findings=(), moved=(), cells=())
    text = explanation_page(dataclasses.replace(bare, verdict="no-mismatch"))
    assert "1 more recording<" in text
    assert "2 more recordings were used and are not drawn" in text
    assert text.count("<img ") == 4 + 1


def test_every_effect_of_the_library_and_each_of_its_numbers_is_called_something() -> None:
    assert set(NAMES) == set(LIBRARY)
    assert len(set(NAMES.values())) == len(NAMES)
    names = {n for card in LIBRARY.values() for form in card.forms for n in form.parameters}
    for name in names:
        label = quantity_label(name)
        assert not {"nm", "rad", "per"} & set(label.lower().split()) - {"per"}, name
        assert not label.lower().endswith((" k", " h", " per rad")), name
    without_unit = {name for name in names if not quantity_scale(name, [1.0]).unit}
    assert without_unit == {
        "changed_at",
        "damping_ratio",
        "exponent",
        "shape_exponent",
        "factor",
        "half_gap_spread",
        "parting_damping_share",
        "lever_ratio",
        "yielding_share",
        "load_coefficient",
        "load_boundary_coefficient",
        "load_power",
        "driving_excess",
        "cos_share",
        "sin_share",
        "order_per_arm_rev",
        "order_per_motor_rev",
        "recorded_from",
        "reference_run",
        "reference_started_at",
    }


@pytest.mark.parametrize(
    ("name", "value", "written"),
    [
        ("coulomb_nm_per_k", 0.0021, "2.100 mN m/K"),
        ("viscous_nm_s_per_rad_per_h", 0.000052, "52.00 µN m s/rad/h"),
        ("coulomb_nm_per_run", 0.2, "0.2000 N m per run"),
        ("coulomb_nm_per_1000_turns", 0.002, "2.000 mN m per 1000 turns"),
        ("inertia_kg_m2_per_kg", 0.0001, "1.000 kg cm²/kg"),
        ("stiffness_nm_per_arm_rad", 4.0, "4.000 N m/rad"),
        ("center_arm_rad", math.pi / 4.0, "45.00 degrees"),
        ("factor_per_k", -0.001, "−0.001000 1/K"),
        ("torque_delay_s", 0.004, "4.000 ms"),
        ("decay_k", 20.7, "20.70 K"),
    ],
)
def test_numbers_of_an_effect_are_written_in_a_unit_that_fits(
    name: str, value: float, written: str
) -> None:
    (row,) = parameter_rows({name: Parameter(value, None)})
    assert f"{row.value} {row.unit}" == written


def test_a_size_that_a_law_lacks_by_its_form_is_not_among_its_numbers() -> None:
    only_stiffens = {
        "stiffness_nm_per_arm_rad": Parameter(0.0, None),
        "cubic_stiffness_nm_per_arm_rad3": Parameter(2.2, (2.1, 2.3)),
        "neutral_arm_rad": Parameter(0.0, None),
    }
    stiffening, neutral = parameter_rows(only_stiffens)
    assert (stiffening.value, neutral.value) == ("2.20", "0")


@pytest.mark.parametrize("case", examples.ALL)
def test_text_fits_a_terminal_and_begins_with_the_answer(case: Case) -> None:
    text = explanation_text(explanation(case), axis=1, next_file="next.json")
    lines = text.splitlines()
    assert lines[0] == f"{verdict_words(explanation(case)).status}."
    assert " ".join(text.split()).startswith(f"{lines[0]} {head_of(explanation(case)).first}")
    assert max(map(len, lines)) <= WIDTH
    assert "nan" not in text.split()


def test_physics_has_its_share_of_what_right_numbers_leave() -> None:
    """Beside 94 % that a wrong number explains, 100 % of the mismatch had been a soft gear's."""
    made = explanation(examples.wrong_number)
    number = dataclasses.replace(made.findings[0], form=OWN_NUMBER)
    soft = dataclasses.replace(number, effect="joint-flexibility", form="one spring", rank=2)
    both = dataclasses.replace(made, findings=(number, soft))
    rows = [finding_row(finding, both, head_of(both)) for finding in both.findings]
    assert [row.shared for row in rows] == [
        "the difference to the simulation as given",
        "what the right numbers leave",
    ]
    alone = dataclasses.replace(made, findings=(soft,))
    assert finding_row(soft, alone, head_of(alone)).shared == "the mismatch"
    said = finding_sentence("joint-flexibility", (), (-0.02, 0.02), 1.0, {}, beside_numbers=True)
    assert said.lead.endswith("explains 100 % of what the right numbers leave.")


def test_text_says_what_the_page_says() -> None:
    text = " ".join(explanation_text(explanation(examples.tied), axis=3).split())
    assert "friction that changes with time or use (46 %); told apart by: the same speeds" in text
    assert "stribeck run CELL.toml --axis 3 --trajectory next.json" in text
    text = " ".join(explanation_text(explanation(examples.partly)).split())
    assert "38 % of the mismatch has no explanation. It lies here:" in text
    assert "Exponent: not identified: no speed below 2 rad/s" in text
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
        (Region("time_s", 2.0, 4.0, 2.0, 0.254), "time 2 to 4 s (2 s, 25 % of it lies there)"),
        (Region("order_per_motor_rev 12", 0.0, 6.0), "order 12 per motor turn 0 to 6"),
        (Region("oil_age_s", 1.0, 2.0), "oil age 1 to 2 s"),
    ],
)
def test_region_in_words(region: Region, words: str) -> None:
    assert region_in_words(region, ("a.parquet", "b.parquet")) == words


def test_many_places_are_the_four_with_most_and_how_many_others() -> None:
    regions = [Region("time_s", float(k), k + 0.5) for k in range(6)]
    assert regions_in_words(regions[:4]) == tuple(map(region_in_words, regions[:4]))
    assert regions_in_words(regions[:5])[3:] == ("time 3 to 3.5 s", "and in 1 smaller place")
    assert regions_in_words(regions)[-1] == "and in 2 smaller places"


def test_command_names_no_file_that_is_not_there() -> None:
    following = explanation(examples.tied).next_experiment
    assert following is not None
    assert trajectory_hint(following, "") in explanation_text(explanation(examples.tied))
    assert trajectory_hint(following, "next.json") == ""
    assert "Save next_experiment.trajectory" not in said(examples.tied)


def test_change_of_the_set_up_has_no_command() -> None:
    change = NextExperiment(
        "Add a payload.", ("a-b", "c", "d"), math.nan, 0.1, set_up="Mount 5 kg."
    )
    assert next_command(change, "1", "next.json") == ""
    assert tells_apart(change) == "It tells apart: a b; c; d."
    assert set_up_beside(change) == "Mount 5 kg."
    told = dataclasses.replace(
        change,
        sentence="While the joint slides, no motion tells a b from c. What does: Mount 5 kg.",
    )
    assert (set_up_beside(told), tells_apart(told)) == ("", "")  # said once, and not both ways
    assert variable("recording").shown(np.array([0.0])).tolist() == [1.0]


def test_an_experiment_says_once_what_it_tells_apart_and_how_long_it_takes() -> None:
    pair = ("stribeck", "load-dependent-friction")
    names = f"{NAMES[pair[0]]} from {NAMES[pair[1]]}"
    stair = NextExperiment(f"Drive a stair: 26 s of driving should tell {names}.", pair, 25.4, 0.1)
    assert (tells_apart(stair), motion_needed(stair)) == ("", "")
    assert briefly(stair) == "Drive a stair: 26 s of driving."
    untold = dataclasses.replace(stair, sentence="Drive a stair.")
    assert (tells_apart(untold), motion_needed(untold)) == (f"It tells {names}.", "about 25.4 s")


def test_a_table_says_what_was_identified_only_where_something_was_not() -> None:
    made = explanation(examples.explained)
    assert explanation_page(made).count(">Identified</th>") == 1
    known = dataclasses.replace(made, findings=made.findings[1:])
    assert "Identified" not in explanation_page(known)
    assert quantity_label("decay_k") == "Warming by which it falls to 37 %"
