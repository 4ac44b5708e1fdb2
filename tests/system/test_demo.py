"""`stribeck demo`: the whole story, told by its files, its last lines and README's figures."""

from __future__ import annotations

import json
import re
from pathlib import Path

import pytest
from typer.testing import CliRunner

from agent.cli.app import app
from agent.cli.demo.concealed import Secret, opened, secrets_of, simulation_of
from agent.physics.twin import parse_twin
from fakes.specification import FakeSpecification

README = Path(__file__).parents[2] / "README.md"
_NUMBER = r"(-?\d+(?:\.\d+)?)"
_INTERVAL = re.compile(rf"{_NUMBER}[^\d(|]*\({_NUMBER} to {_NUMBER}")


@pytest.fixture(scope="module")
def told(tmp_path_factory: pytest.TempPathFactory) -> tuple[str, Path]:
    """Return what the demo prints, and the folder that it fills."""
    out = tmp_path_factory.mktemp("demo") / "out"
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
    assert not parse_twin((out / "simulation.toml").read_text(encoding="utf-8")).effects
    assert parse_twin((out / "explanation" / "twin.toml").read_text(encoding="utf-8")).effects
    concealed = text.split("Concealed", 1)[1]
    assert "25.3 N m/rad" in concealed
    assert "not named" not in concealed
    assert document["verdict"] == "explained"


def test_the_figures_of_readme_are_those_of_its_first_command(told: tuple[str, Path]) -> None:
    """To a fifth of what an interval is wide: another processor may change the last digit."""
    told_numbers = intervals_in(told[0])
    section = README.read_text(encoding="utf-8").split("## What it finds", 1)[1]
    rows = section.split("On joints whose physics", 1)[0].splitlines()
    claimed = [triple for row in rows if row.startswith("|") for triple in intervals_in(row)]
    assert len(claimed) == 11
    for claim in claimed:
        slack = 0.2 * (claim[2] - claim[1])
        near = [t for t in told_numbers if max(map(abs, map(float.__sub__, claim, t))) <= slack]
        assert near, f"README says {claim}"


def intervals_in(text: str) -> list[tuple[float, float, float]]:
    """Return every value that stands before its interval."""
    found = _INTERVAL.findall(text.replace("\u2212", "-"))
    return [(float(value), float(low), float(high)) for value, low, high in found]


def test_the_simulation_of_the_demo_is_right_in_what_it_knows() -> None:
    twin = simulation_of(FakeSpecification(), robot="r", axis=1)
    assert twin.effects == ()
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
