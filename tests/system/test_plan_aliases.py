"""`stribeck plan --aliases`: what a cycle cannot tell apart, said before it is driven."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from agent.cli.app import app
from agent.errors import InputError
from agent.explain.answer.names import NAMES
from trajectories import Trajectory

PAIR = ["direction-asymmetry", "torque-offset"]


@pytest.fixture
def cell_file(tmp_path: Path) -> Path:
    path = tmp_path / "cell.toml"
    shipped = CliRunner().invoke(app, ["example-cell"])
    path.write_text(shipped.stdout, encoding="utf-8")
    return path


def asked(cell_file: Path, *options: str) -> str:
    result = CliRunner().invoke(app, ["plan", str(cell_file), "--axis", "1", *options])
    assert result.exit_code == 0, result.output
    return result.stdout


def groups(document: dict[str, Any]) -> list[set[str]]:
    return [set(group["effects"]) for group in document["sets"]]


def test_the_cells_own_stair_is_asked_and_nothing_is_written(
    cell_file: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    document = json.loads(asked(cell_file, "--aliases", "--json"))
    assert document["schema"] == "stribeck.aliases/1"
    assert set(PAIR) in groups(document)
    assert "temperature-dependent-friction" in document["not_shown"]
    assert "friction-drift" in document["not_shown"]
    assert Trajectory.from_json(document["trajectory"]).duration_s == pytest.approx(40.0, abs=0.1)
    assert [p.name for p in tmp_path.iterdir()] == [cell_file.name]
    said = asked(cell_file, "--aliases")
    for effect in PAIR:
        assert NAMES[effect] in said
    assert "brake closed" in said
    assert "one gearbox temperature" in said


def test_speeds_tell_ripple_from_a_wobbling_gear_and_one_speed_does_not(cell_file: Path) -> None:
    both = {"torque-ripple", "kinematic-error"}
    many = json.loads(asked(cell_file, "--aliases", "--json"))
    assert not any(both <= group for group in groups(many))
    text = cell_file.read_text(encoding="utf-8")
    for old, new in (
        ("speeds = 11", "speeds = 2"),
        ("motor_velocity_min_rad_s = 2.0", "motor_velocity_min_rad_s = 19.0"),
        ("motor_velocity_max_rad_s = 160.0", "motor_velocity_max_rad_s = 20.0"),
    ):
        assert old in text
        text = text.replace(old, new)
    cell_file.write_text(text, encoding="utf-8")
    one = json.loads(asked(cell_file, "--aliases", "--json"))
    assert any(both <= group for group in groups(one))


def test_a_designed_plan_says_it_beside_the_rest(cell_file: Path, tmp_path: Path) -> None:
    out = tmp_path / "plan"
    options = ("--seconds", "16", "--out", str(out), "--aliases", "--json")
    document = json.loads(asked(cell_file, *options))
    assert document["schema"] == "stribeck.plan/1"
    assert set(PAIR) in groups(document["aliases"])
    assert (out / "plan.json").exists()


def test_a_plan_needs_a_time_or_a_question_and_a_joint(cell_file: Path) -> None:
    bare = CliRunner().invoke(app, ["plan", str(cell_file), "--axis", "1"])
    assert bare.exit_code == 2
    assert "--aliases" in bare.output
    text = cell_file.read_text(encoding="utf-8")
    cell_file.write_text(text.replace("coulomb_nm = 0.7", "coulomb_nm = 0.0"), encoding="utf-8")
    unknown = CliRunner().invoke(app, ["plan", str(cell_file), "--axis", "1", "--aliases"])
    assert isinstance(unknown.exception, InputError)
    assert "rough idea of axis 1" in str(unknown.exception)
