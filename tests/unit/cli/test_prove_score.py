"""The score of a proof: every rule on labels and explanations written by hand."""

from __future__ import annotations

import json
from collections import Counter
from typing import Any

import pytest

from agent.cli.prove.misses import is_miss, miss_lines
from agent.cli.prove.numbers import located, measured, overlap
from agent.cli.prove.plan import ALIKE, FULL, NULL, POOR, QUOTA, RICH, plan
from agent.cli.prove.score import Score, score
from agent.cli.prove.share import Share, quantile_text, share_of
from agent.cli.prove.summary import summary_of
from agent.cli.prove.table import table_text
from agent.errors import InputError
from fakes.conceal import EFFECTS, FIRST_SCORED_SEED, LOOK_ALIKES, SNRS

Json = dict[str, Any]


def effect(name: str, **more: Any) -> Json:
    """Return an entry of a label."""
    entry = {
        "effect": name,
        "also": [],
        "form": "sine",
        "basis": "refitted",
        "snr": 1.0,
        "where": [],
        "parameters": {},
        "energy_share": 1.0,
    }
    return entry | more


def label(*effects: Json, nuisances: tuple[Json, ...] = (), verdict: str = "explained") -> Json:
    return {"effects": list(effects), "nuisances": list(nuisances), "expected_verdict": verdict}


def finding(name: str, *alternatives: str, **more: Any) -> Json:
    """Return a finding of an explanation."""
    entry = {
        "effect": name,
        "form": "one order",
        "energy_share": 0.9,
        "where": [],
        "parameters": {},
        "alternatives": [{"effect": other} for other in alternatives],
    }
    return entry | more


def said(*findings: Json, verdict: str = "explained", cells: tuple[str, ...] = ()) -> Json:
    return {
        "verdict": verdict,
        "findings": list(findings),
        "map": [{"axis": axis} for axis in cells],
        "holdout": {"floor_ratio": 1.02},
    }


RIPPLE, OFFSET = effect("torque-ripple"), effect("torque-offset", also=["direction-asymmetry"])
OUTSIDER = effect(
    "outsider:speed-play", where=[{"variable": "after_reversal_s", "from": 0.0, "to": 1.0}]
)


def of(true: Json, explanation: Json, baseline: tuple[str, ...] = ()) -> Score:
    return score(true, explanation, baseline)


def test_the_right_name_alone_is_all_right() -> None:
    found = of(label(RIPPLE), said(finding("torque-ripple")), ("torque-ripple", "stribeck"))
    assert found.first_right
    assert found.exact
    assert found.verdict_right
    assert found.baseline_right
    assert found.floor_ratio == 1.02


def test_another_id_of_the_same_columns_is_as_right() -> None:
    found = of(label(OFFSET), said(finding("direction-asymmetry")), ("direction-asymmetry",))
    assert found.first_right
    assert found.exact
    assert found.baseline_exact


def test_a_wrong_name_is_no_hit_however_many_alternatives_it_has() -> None:
    found = of(label(RIPPLE), said(finding("stribeck", "backlash", "torque-ripple")))
    assert not found.first_right
    assert found.set_right
    assert not found.in_small_set  # three names are no answer
    assert found.covered
    assert not found.exact
    assert found.absent == ("stribeck",)


def test_one_of_two_tied_names_counts() -> None:
    found = of(label(RIPPLE), said(finding("kinematic-error", "torque-ripple"), verdict="tied"))
    assert found.in_small_set
    assert not found.first_right
    assert found.verdict_right


def test_an_additional_name_spoils_the_set_but_not_the_first_name() -> None:
    found = of(label(RIPPLE), said(finding("torque-ripple"), finding("backlash")))
    assert found.first_right
    assert not found.exact
    assert found.absent == ("backlash",)


@pytest.mark.parametrize("counts", [True, False])
def test_a_small_effect_is_true_from_two_percent_on(counts: bool) -> None:
    small = effect("cable-force", counts_as_true=counts)
    truth = label(RIPPLE, nuisances=(small,))
    found = of(truth, said(finding("cable-force"), finding("torque-ripple")))
    assert found.exact is counts
    assert found.first_right is counts  # what is worth naming may stand before the answer
    assert found.absent == ()
    assert found.too_small == (() if counts else ("cable-force",))


def test_a_mixture_needs_all_of_its_names() -> None:
    truth = label(RIPPLE, effect("backlash"))
    half = of(truth, said(finding("torque-ripple", "backlash")), ("torque-ripple", "stribeck"))
    assert half.first_right
    assert not half.exact
    assert half.covered
    assert half.baseline_right
    assert not half.baseline_exact
    both = of(truth, said(finding("backlash"), finding("torque-ripple")), ("backlash",))
    assert both.exact
    third = of(truth, said(finding("backlash")), ("stribeck", "torque-ripple", "backlash"))
    assert not third.baseline_exact  # it is told that there are two


def test_nothing_said_of_something_is_a_miss() -> None:
    found = of(label(RIPPLE), said(verdict="no-mismatch"))
    assert not found.first_right
    assert not found.exact
    assert not found.verdict_right


def test_a_null_is_right_only_without_a_name() -> None:
    truth = label(verdict="no-mismatch")
    assert of(truth, said(verdict="no-mismatch")).exact
    named = of(truth, said(finding("stribeck")))
    assert named.absent == ("stribeck",)
    assert not named.exact


@pytest.mark.parametrize("verdict", ["unexplained", "partly-explained", "explained", "no-mismatch"])
def test_an_outsider_must_be_said_to_be_unknown(verdict: str) -> None:
    truth = label(OUTSIDER, verdict="unexplained")
    found = of(truth, said(verdict=verdict, cells=("velocity_rad_s", "after_reversal_rad")))
    assert found.not_misnamed is (verdict in ("unexplained", "partly-explained"))
    assert found.cell_right
    named = of(truth, said(finding("backlash"), verdict=verdict))
    assert not named.not_misnamed


def test_only_the_first_three_cells_count() -> None:
    late = ("velocity_rad_s", "direction", "time_s", "after_reversal_rad")
    assert of(label(OUTSIDER), said(cells=late)).cell_right is False
    order = effect("torque-ripple", where=[{"variable": "order_per_motor_rev", "from": 5, "to": 7}])
    assert of(label(order), said(cells=("order_per_motor_rev 6.01",))).cell_right


def test_what_a_refit_takes_in_has_no_cell() -> None:
    wrong = effect("wrong-number", basis="as-given", where=OUTSIDER["where"])
    assert of(label(wrong), said(cells=("velocity_rad_s",))).cell_right is None


def test_a_tool_that_crashed_has_missed() -> None:
    found = of(label(RIPPLE), {"verdict": "crashed", "reasons": ["ValueError: x"]})
    assert not found.first_right
    assert not found.exact
    assert found.floor_ratio is None


def test_overlap_is_intersection_over_union() -> None:
    assert overlap([(0.0, 2.0)], [(1.0, 3.0)]) == pytest.approx(1.0 / 3.0)
    assert overlap([(-3.0, -1.0), (1.0, 3.0)], [(-3.0, 3.0)]) == pytest.approx(4.0 / 6.0)
    assert overlap([(0.0, 1.0)], [(2.0, 3.0)]) == 0.0
    assert overlap([(0.0, 1.0)], [(0.0, 0.5), (0.5, 1.0)]) == pytest.approx(1.0)
    assert overlap([(1.0, 1.0)], [(1.0, 1.0)]) == 0.0  # no width, nothing to share


def test_no_share_is_compared_where_the_measured_motion_hides_the_effect() -> None:
    clipped = effect("torque-saturation", basis="commanded")
    (place,) = of(label(clipped), said(finding("torque-saturation"))).located
    assert place.share_error is None


def test_a_share_is_compared_in_the_band_that_the_tool_compares_in() -> None:
    told = [{"up_to_hz": hz, "energy_share": x} for hz, x in ((5.0, 0.1), (10.0, 0.2), (40.0, 0.6))]
    true = effect("backlash", energy_share=0.5, energy_share_by_band=told)
    found = finding("backlash", energy_share=0.3)
    errors = {
        hz: located(true, found, hz).share_error for hz in (None, 2.0, 10.0, 20.0, 40.0, 60.0)
    }
    assert errors == pytest.approx(
        {None: -0.2, 2.0: 0.2, 10.0: 0.1, 20.0: -0.1, 40.0: -0.3, 60.0: -0.3}
    )
    assert located(effect("backlash"), found, 10.0).share_error == pytest.approx(-0.7)


def test_a_place_is_compared_along_the_same_variable_only() -> None:
    true = effect("stribeck", where=[{"variable": "velocity_rad_s", "from": -4.0, "to": 4.0}])
    same = finding("stribeck", where=[{"variable": "velocity_rad_s", "from": -4.0, "to": 0.0}])
    place = located(true, same)
    assert place.overlap == pytest.approx(0.5)
    assert place.share_error == pytest.approx(-0.1)
    other = finding("stribeck", where=[{"variable": "time_s", "from": 0.0, "to": 9.0}])
    assert located(true, other).overlap is None


@pytest.mark.parametrize(("low", "right"), [(5.98, True), (6.98, False)])
def test_an_order_is_right_inside_the_labels_band(low: float, right: bool) -> None:
    variable = "order_per_motor_rev"
    true = effect("torque-ripple", where=[{"variable": variable, "from": 5.5, "to": 6.5}])
    found = finding("torque-ripple", where=[{"variable": variable, "from": low, "to": low + 0.04}])
    place = located(true, found)
    assert place.order_right is right
    assert place.overlap is None


def number(value: float, low: float, high: float) -> Json:
    return {"value": value, "identified": True, "ci95": [low, high]}


def test_cosine_and_sine_are_judged_as_one_vector() -> None:
    true = effect("torque-ripple", parameters={"cos_nm": 0.3, "sin_nm": 0.4})
    numbers = {"cos_nm": number(0.3, 0.29, 0.31), "sin_nm": number(0.45, 0.42, 0.48)}
    found = measured(true, finding("torque-ripple", parameters=numbers))
    assert [m.error for m in found] == pytest.approx([0.1, 0.1])
    assert [m.covered for m in found] == [True, False]


def test_numbers_of_another_form_are_not_compared() -> None:
    true = effect("stribeck", form="rational", parameters={"static_extra_nm": 0.2})
    numbers = {"static_extra_nm": number(0.2, 0.1, 0.3)}
    form = "exponential fall"
    assert measured(true, finding("stribeck", form=form, parameters=numbers)) == []
    same = measured(
        true | {"form": "exponential"}, finding("stribeck", form=form, parameters=numbers)
    )
    assert [m.parameter for m in same] == ["static_extra_nm"]


def test_a_slope_is_compared_about_the_temperature_that_the_finding_names() -> None:
    truth = {"factor": 1.0, "factor_per_k": -0.004, "reference_degc": 25.0}
    true = effect("torque-constant-error", form="falls with winding temperature", parameters=truth)
    # 0.9 at 50 degC: what falls by 0.004 of the cold value falls by 0.004/0.9 of the warm one.
    numbers = {
        "factor_per_k": number(-0.004 / 0.9, -0.0046, -0.0042),
        "reference_degc": {"value": 50},
    }
    named = finding("torque-constant-error", form="with motor temperature", parameters=numbers)
    (found,) = measured(true, named)
    assert found.error == pytest.approx(0.0, abs=1e-12)
    assert found.covered


def test_a_number_without_interval_has_no_coverage() -> None:
    true = effect("torque-offset", form="constant", parameters={"torque_offset_nm": 0.2})
    numbers = {"torque_offset_nm": {"value": 0.21, "identified": False}}
    (found,) = measured(true, finding("torque-offset", form="constant", parameters=numbers))
    assert found.covered is None
    assert found.error == pytest.approx(0.05)


def test_an_error_is_no_share_of_nothing() -> None:
    true = effect("torque-offset", form="constant", parameters={"torque_offset_nm": 0.0})
    numbers = {"torque_offset_nm": number(0.01, -0.01, 0.03)}
    assert measured(true, finding("torque-offset", form="constant", parameters=numbers)) == []


def test_shares_say_what_their_number_is_worth() -> None:
    share = share_of([True, True, True, False], bool)
    assert share == Share(3, 4)
    assert share.interval == pytest.approx((0.301, 0.954), abs=1e-3)  # Wilson, by hand
    assert Share(0, 0).text() == "-"
    assert Share(0, 10).interval[1] == pytest.approx(0.278, abs=1e-3)
    assert Share.of(share.to_json()) == share
    assert quantile_text([], (0.5,), "{:.1f}") == "-"
    assert quantile_text([1.0, 2.0, 3.0], (0.5,), "median {:.1f}") == "median 2.0 (n 3)"


def test_the_whole_sequence_has_every_effect_and_level_as_often() -> None:
    asked = plan(FULL, FIRST_SCORED_SEED)
    assert Counter(a.group for a in asked) == QUOTA
    assert [a.order.seed for a in asked] == list(range(FIRST_SCORED_SEED, FIRST_SCORED_SEED + FULL))
    rich = [a.order for a in asked if a.group == RICH]
    assert set(Counter(o.effects for o in rich).values()) == {2}
    assert len({(o.effects, o.snr) for o in rich}) == len(rich)
    assert Counter(o.snr for o in rich) == dict.fromkeys(SNRS, len(rich) // len(SNRS))
    poor = [a.order for a in asked if a.group == POOR]
    assert {o.effects[0] for o in poor} == set(EFFECTS)
    assert {o.design for o in poor} == {"poor"}
    alike = [a.order for a in asked if a.group == ALIKE]
    both_ways = {*LOOK_ALIKES, *(pair[::-1] for pair in LOOK_ALIKES)}
    assert all((o.effects[0], o.rival) in both_ways for o in alike)


def test_a_short_proof_is_the_beginning_of_the_whole() -> None:
    assert plan(12, 10_000) == plan(FULL, 10_000)[:12]
    assert {a.group for a in plan(12, 10_000)} == set(QUOTA)


def test_after_the_whole_sequence_levels_change() -> None:
    rich = [a.order for a in plan(2 * FULL, 10_000) if a.group == RICH]
    assert len({(o.effects, o.snr) for o in rich}) == len(rich)


@pytest.mark.parametrize(("count", "seed"), [(0, 10_000), (-1, 10_000), (3, -1)])
def test_impossible_numbers_are_refused(count: int, seed: int) -> None:
    with pytest.raises(InputError, match="expected"):
        plan(count, seed)


def case(group: str, true: Json, explanation: Json, **more: Any) -> Json:
    """Return a case of a proof document, through JSON as a reader sees it."""
    document = {
        "seed": 1,
        "design": "rich",
        "snr": 1.0,
        "rival": None,
        "group": group,
        "explanation": explanation,
        "seconds": 9.0,
        "processor_seconds": 2.0,
        "score": of(true, explanation, ("torque-ripple",)).to_json(),
    }
    return dict(json.loads(json.dumps(document | more)))


def test_the_table_counts_groups_and_prints_every_miss() -> None:
    null = label(verdict="no-mismatch")
    cases = [
        case(RICH, label(RIPPLE), said(finding("torque-ripple"))),
        case(RICH, label(RIPPLE), said(finding("stribeck")), seed=77, snr=0.25),
        case(ALIKE, label(RIPPLE), said(finding("inertia-error")), rival="inertia-error", seed=78),
        case(NULL, null, said(verdict="no-mismatch")),
        case(NULL, null, said(finding("backlash")), seed=79),
        case(POOR, label(RIPPLE), {"verdict": "crashed", "reasons": ["ValueError: x"]}, seed=80),
    ]
    summary = summary_of(cases)
    assert summary["names"]["one effect, SNR 0.5 and up"]["first_right"]["hits"] == 1
    assert summary["names"]["one effect, SNR 0.5 and up"]["cases"] == 1
    assert summary["names"]["one effect, SNR 0.25"]["first_right"]["hits"] == 0
    assert summary["names"]["look-alikes"]["rival_named"]["hits"] == 1
    assert summary["names"]["look-alikes"]["baseline_first_right"]["hits"] == 1
    assert summary["false_names"]["nulls_with_false_name"]["hits"] == 1
    assert summary["false_names"]["nulls_without_mismatch"]["hits"] == 1
    assert [is_miss(c) for c in cases] == [False, True, True, False, True, True]
    document = {
        "first_seed": 1,
        "counts_as_score": False,
        "made": 6,
        "dropped": [],
        "cases": cases,
        "summary": summary,
    }
    text = table_text(document)
    assert "no score" in text
    assert "77 rich 0.25: torque-ripple -> stribeck [explained]" in text
    assert "79 rich 1: nothing -> backlash [explained]" in text
    assert "80 rich 1: torque-ripple -> no name (ValueError: x) [crashed]" in text
    assert max(len(line) for line in text.splitlines()) <= 100


def test_a_miss_without_a_name_tells_why_nothing_was_judged_and_no_caveat() -> None:
    def line(verdict: str) -> str:
        answer = said(verdict=verdict) | {"reasons": ["the joint never moved"]}
        return miss_lines([case(RICH, label(RIPPLE), answer)])[-1]

    assert line("not-decidable").endswith("no name (the joint never moved) [not-decidable]")
    assert line("unexplained").endswith("no name [unexplained]")


def test_no_case_makes_an_empty_table() -> None:
    summary = summary_of([])
    assert summary["names"] == {}
    assert miss_lines([]) == ["not fully right: none"]
