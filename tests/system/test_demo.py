"""`stribeck demo`, on a shorter stair: the whole story, told by its files and its last lines."""

from __future__ import annotations

import json
import tomllib
from pathlib import Path
from typing import Any

import pytest
import tomli_w
from typer.testing import CliRunner

from agent.cli.app import app
from agent.cli.demo import demo
from agent.cli.demo.concealed import Secret, opened, secrets_of, simulation_of
from agent.cli.devices.fake_cell import fake_cell_text
from agent.physics.twin import parse_twin
from fakes.specification import FakeSpecification


def quick_cell_text(*arguments: Any, **keywords: Any) -> str:
    """Return the demo's cell with a shorter stair, sampled half as often."""
    cell = tomllib.loads(fake_cell_text(*arguments, **keywords))
    cell["axis"][0]["stair"] |= {"duration_s": 28.0, "speeds": 8}
    cell["recording"]["sample_rate_hz"] = 250.0
    return tomli_w.dumps(cell)


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Return what the demo prints, and the folder that it fills."""
    out = tmp_path_factory.mktemp("demo") / "out"
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(demo, "fake_cell_text", quick_cell_text)
        result = CliRunner().invoke(app, ["demo", "--out", str(out)], catch_exceptions=False)
    assert result.exit_code == 0, result.stderr
    return result.stdout, out


def test_the_demo_ends_by_naming_files_that_are_there(told: tuple[str, Path]) -> None:
    text, out = told
    listed = [line.split()[-1] for line in text.split("Open these files:\n")[1].splitlines()]
    assert {Path(path) for path in listed} == {
        *out.glob("*.parquet"),
        out / "demo.estimate.json",
        out / "demo.report.html",
        out / "simulation.toml",
        out / "explanation" / "report.html",
        out / "explanation" / "twin.toml",
    }
    assert all(Path(path).stat().st_size > 0 for path in listed)


def test_what_is_concealed_in_the_demo_is_found(told: tuple[str, Path]) -> None:
    text, out = told
    document = json.loads((out / "explanation" / "explanation.json").read_text(encoding="utf-8"))
    named = [finding["effect"] for finding in document["findings"]]
    assert named[0] == "joint-flexibility"
    assert "stribeck" in named
    rivals = {each["effect"] for f in document["findings"] for each in f["alternatives"]}
    assert "friction-drift" not in rivals  # a single cycle has no use that its order is not
    assert document["held_out"]
    unseen = document["holdout"]
    assert unseen["extended"]["rmse_nm"] < 0.1 * unseen["baseline"]["rmse_nm"]
    joint, (spring, *_) = FakeSpecification().joint, document["findings"]
    found = {name: number["value"] for name, number in spring["parameters"].items()}
    assert found["stiffness_nm_per_rad"] == pytest.approx(joint.spring_nm_per_rad, rel=0.03)
    assert found["arm_inertia_kg_m2"] == pytest.approx(joint.arm_inertia_kg_m2, rel=0.03)
    assert parse_twin((out / "simulation.toml").read_text(encoding="utf-8")).is_plain
    assert not parse_twin((out / "explanation" / "twin.toml").read_text(encoding="utf-8")).is_plain
    concealed = text.split("Concealed", 1)[1]
    assert "25.3 N m/rad" in concealed
    assert "not named" not in concealed.splitlines()[1]


def test_the_simulation_of_the_demo_is_right_in_what_it_knows() -> None:
    twin = simulation_of(FakeSpecification(), robot="r", axis=1)
    assert twin.is_plain
    assert twin.inertia_kg_m2 == pytest.approx(0.0184)
    assert twin.coulomb_nm == pytest.approx(0.6042)
    assert twin.viscous_nm_s_per_rad == pytest.approx(0.0107)


def test_the_table_of_secrets_claims_nothing_that_was_not_found(tmp_path: Path) -> None:
    path = tmp_path / "explanation.json"
    number = {"value": 0.1478, "identified": True, "ci95": [0.138, 0.158]}
    content = {"stribeck": {"static_extra_nm": number}, "joint-flexibility": {}}
    findings = [{"effect": effect, "parameters": p} for effect, p in content.items()]
    path.write_text(json.dumps({"findings": findings}), encoding="utf-8")
    secrets = (*secrets_of(FakeSpecification()), Secret("mass", "inertia-error", "a_kg_m2", 0.1))
    head, *rows = opened(secrets, path).splitlines()
    assert head.split() == ["Concealed", "true", "found", "(95", "%", "interval)"]
    assert rows[0].endswith("25.3 N m/rad   named, its size not identified")
    assert rows[2].endswith("0.150 N m   0.148 (0.138 to 0.158)")
    assert rows[3].endswith("named, its size not identified")
    assert rows[5].endswith("0.100 kg m²   not named")
    assert max(map(len, (head, *rows))) <= 80
