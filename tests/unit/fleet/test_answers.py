"""What a fleet's engineer reads: who is first, what robots agree on, what a file got wrong."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.errors import InputError
from agent.fleet.estimates import estimates_of
from agent.fleet.explanations import agreements, explain_one, in_words, questions
from agent.fleet.lake import Lake
from agent.fleet.roster import Roster, roster_of
from agent.fleet.verdicts import by_risk
from agent.physics.twin import Twin, format_twin
from agent.record.writing import write
from agent.report.figures.fleet import figure_individuals, figure_rises
from agent.report.fleet import FleetPage, fleet_html
from agent.report.fleet_rows import AgreementRow, JointRow
from tests.benchmarks.fleet import AXES, GEAR, ROBOTS, cycles

STATES = ("H1", "H0", "not-decidable", "NF", "")


def verdict(
    key: str, state: str, rise: float | None = None, limit: str | None = None
) -> dict[str, Any]:
    return {
        "key": key,
        "state": state,
        "failure": "" if state else "its worker ended",
        "low_rise_to_percent": rise,
        "limit_earliest": limit,
    }


@given(st.permutations(range(7)))
def test_the_most_urgent_joint_is_first_whatever_the_order(order: list[int]) -> None:
    rows = [
        verdict("a", "H1", 60.0, "2026-12-24T00:00:00+00:00"),
        verdict("b", "H1", 90.0),
        verdict("c", "H0", 12.0),
        verdict("d", "H0", 8.0),
        verdict("e", ""),
        verdict("f", "not-decidable"),
        verdict("g", "NF", 3.0),
    ]
    assert [r["key"] for r in by_risk([rows[i] for i in order])] == list("abcdefg")


def test_robots_of_a_model_agree_or_do_not() -> None:
    def said(key: str, effects: str, failure: str = "") -> dict[str, Any]:
        verdict = "explained" if effects else "no-mismatch"
        return {"key": key, "model": "M", "axis": 2, "effects": effects, "failure": failure} | {
            "verdict": verdict
        }

    rows = [
        said("1", "wrong-number load-dependent-friction stribeck"),
        said("2", "load-dependent-friction wrong-number"),
        said("4", "wrong-number"),
        said("3", ""),
        said("5", "", failure="mixed axes"),
    ]
    (found,) = agreements(rows)
    assert (found.asked, found.without_mismatch) == (4, 1)
    assert in_words(found) == (
        "2 of 4 M axis 2 show friction that grows with the load on the gear "
        "(load-dependent-friction), which the twin lacks; 1 agrees with the twin."
    )
    assert found.effects[-1] == ("wrong-number", 3)  # more often, but nothing the twin lacks
    (calm,) = agreements([said("3", "")])
    assert in_words(calm) == "1 of 1 M axis 2 agree with their twin."


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("schema = 3", "expected schema"),
        ("schema =", "is no TOML"),
        ('schema = "stribeck.fleet/1"\n[[model]]\nname = "M"', "robots as a list"),
        (
            'schema = "stribeck.fleet/1"\n[[model]]\nname = "M"\nrobots = ["*"]\ntwin = 1',
            "does not know twin",
        ),
        (
            'schema = "stribeck.fleet/1"\n[[model]]\nname = "M"\nrobots = ["*"]\n'
            'twins = { a = "b" }',
            "twins = { AXIS",
        ),
    ],
)
def test_a_wrong_roster_is_one_sentence(tmp_path: Path, text: str, said: str) -> None:
    (tmp_path / "fleet.toml").write_text(text)
    with pytest.raises(InputError, match=said):
        roster_of(Lake(str(tmp_path)))


def test_a_robot_is_of_the_first_model_that_has_its_name(tmp_path: Path) -> None:
    (tmp_path / "fleet.toml").write_text(
        'schema = "stribeck.fleet/1"\n'
        '[[model]]\nname = "big"\nrobots = ["*66?0"]\ntwins = { 2 = "t.toml" }\n'
        '[[model]]\nname = "any"\nrobots = ["*"]\n'
    )
    roster = roster_of(Lake(str(tmp_path)))
    assert [roster.name_of(r) for r in ("c-6650", "c-4600")] == ["big", "any"]
    assert roster.name_of("c-6650", "recorded otherwise") == "big"
    nobody = Roster()
    assert nobody.name_of("c-6650", "IRB 6650") == "IRB 6650"
    assert nobody.name_of("c-6650") == "model not recorded"
    assert roster.models[0].twins == {2: "t.toml"}


def test_the_page_escapes_what_robots_are_called_and_says_what_is_first() -> None:
    evil = "<script>alert(1)</script>"
    rises = {"H1": (40.0, 35.0, 45.0), "NF": (0.5, -1.0, 2.0)}
    joints = [
        JointRow("s", f"{evil}{s}", 1, "M", s, f"why {evil}", "", rises.get(s), 0.6, 0.01)
        for s in STATES
    ]
    agreed = [AgreementRow("2 of 3 agree.", 3, (("stribeck", 2), ("backlash", 1)))]
    page = fleet_html(FleetPage("lake", joints, agreed, (f"x: {evil}",), 12))
    assert evil not in page
    assert "2 show increased friction; see to" in page
    assert "backlash (1)" in page
    assert page.count("data:image/svg+xml") == 4
    calm, silent = (
        fleet_html(FleetPage("lake", [j for j in joints if j.state in states], [], (), 1))
        for states in (("NF", ""), ("", "not-decidable"))
    )
    assert "none shows increased friction; 1 cannot be decided yet" in calm
    assert "Nothing to do" in calm
    assert "none can be decided yet" in silent
    assert "Nothing to do" not in silent
    nothing = fleet_html(FleetPage("lake", [], [], (), 0))
    assert "No joint has been judged by this version yet" in nothing


def test_robots_of_no_recorded_model_are_nobody_s_peers() -> None:
    """Two of unlike makes had been a model of their own, with a median and a spread."""
    known = [JointRow("s", f"r{k}", 1, "M", "NF", "", "", None, 0.6 + k, 0.01) for k in (0, 1)]
    strangers = [
        replace(j, robot=f"x{k}", model="", coulomb_nm=77.5 + k) for k, j in enumerate(known)
    ]
    page = fleet_html(FleetPage("lake", [*known, *strangers], [], (), 4))
    assert "0.6 to 1.6" in page
    assert "2 joints are compared with no other: the robot&#39;s model is not recorded." in page
    assert "Coulomb friction of 2 joints, by model and axis." in page
    assert page.count(">not recorded</td>") == 2
    assert "77.5" not in page
    assert "compared with no other" not in fleet_html(FleetPage("lake", known, [], (), 2))
    alone = fleet_html(FleetPage("lake", strangers[:1], [], (), 1))
    assert "1 joint is compared with no other" in alone
    assert "by model and axis" not in alone
    assert "77.5" not in alone


def test_a_phone_tells_the_axes_of_one_robot_apart() -> None:
    robot = "cell7-irb6650-line-3"
    joints = [
        JointRow("s", robot, axis, "M", "NF", "", rise_percent=(1.0, 0.0, 2.0)) for axis in (1, 2)
    ]
    (axes,) = figure_rises(joints, narrow=True).axes
    assert [t.get_text()[-8:] for t in axes.get_yticklabels()] == [", axis 1", ", axis 2"]


@pytest.mark.parametrize("narrow", [False, True])
def test_each_joint_s_dot_is_within_the_picture_of_individuals(*, narrow: bool) -> None:
    """Of joints that are nearly alike the largest stood on the picture's edge, and was cut."""
    levels = (0.64, 0.641, 0.65)
    joints = [
        JointRow("s", f"r{k}", 1, "M", "NF", "", coulomb_nm=level) for k, level in enumerate(levels)
    ]
    (axes,) = figure_individuals(joints, narrow=narrow).axes
    width_px = axes.get_window_extent().width
    assert axes.get_xlim()[0] == 0.0
    assert width_px * (1.0 - max(levels) / axes.get_xlim()[1]) > 8.0
    assert len(axes.get_lines()) == 1  # the median
    (alone,) = figure_individuals(joints[:1], narrow=narrow).axes
    assert not alone.get_lines()
    page = fleet_html(FleetPage("lake", joints[:1], [], (), 1))
    assert "0.64 to" not in page  # of one joint there is no spread
    assert ">0.64<" in page


def test_a_models_twin_is_put_to_each_of_its_robots_and_again_when_it_changes(
    tmp_path: Path,
) -> None:
    lake = Lake(str(tmp_path / "lake"))
    known = estimates_of(lake)
    for number, recording in enumerate(cycles(ROBOTS * AXES * 3 + 2)):
        if number % (ROBOTS * AXES) < 2:  # axes 1 and 2 of the first robot, four nights
            path = write(recording, tmp_path / "cycle.parquet", overwrite=True)
            entry, _ = lake.push(path, "plant")
            known.add(entry.month, {"key": entry.path, "failure": "", "decidable": True})
    known.flush()
    (tmp_path / "lake" / "fleet.toml").write_text(
        'schema = "stribeck.fleet/1"\n'
        '[[model]]\nname = "M"\nrobots = ["robot-*"]\ntwins = { 1 = "m1.toml" }\n'
    )
    twin = Twin("M", 1, GEAR, 0.0184, coulomb_nm=0.55, viscous_nm_s_per_rad=0.0105)
    lake.put("m1.toml", format_twin(twin).encode())
    (asked,) = questions(lake, roster_of(lake))
    assert [e.axis for e in asked.entries] == [1, 1, 1, 1]
    found = explain_one(asked)
    assert found["failure"] == ""
    assert found["verdict"] in ("explained", "partly-explained")  # at 100 Hz steep ramps alias
    assert found["effects"] == "wrong-number"

    lake.put("m1.toml", format_twin(replace(twin, gear_ratio=100.0)).encode())
    (again,) = questions(lake, roster_of(lake))
    assert again.key != asked.key
    assert "gear" in explain_one(again)["failure"]
