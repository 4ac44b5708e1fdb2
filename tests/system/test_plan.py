"""`stribeck plan`, and `stribeck run --trajectory`: designed, written, driven, refused."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import pytest
from typer.testing import CliRunner

from agent.cell.cell import read_cell
from agent.cli.app import app
from agent.cli.cycle.plan import run_plan
from agent.cli.cycle.plan_outlook import Outlook, outlook_of
from agent.cli.cycle.plan_words import in_short
from agent.cli.cycle.run import dry_run_axis, read_trajectory
from agent.cli.terminal.exits import sentence
from agent.conclude.outcome import conclude
from agent.errors import InputError, RefusedError
from agent.record.reading import read
from agent.wire.wire import CycleRequest, drive_cycle
from fakes.specification import FakeSpecification
from tests.system.rig import Rig, rig
from trajectories import Trajectory, TrajectoryError, point_to_point

SECONDS = 16.0


@pytest.fixture
def cell_file(tmp_path: Path) -> Path:
    path = tmp_path / "cell.toml"
    shipped = CliRunner().invoke(app, ["example-cell"])
    path.write_text(shipped.stdout, encoding="utf-8")
    return path


def drive(bench: Rig, trajectory: Trajectory, *, reverse: bool = False) -> Path:
    axis = bench.cell.axis[0]
    request = CycleRequest(bench.cell, axis, bench.folder, reverse, trajectory)
    return drive_cycle(request, bench.clock).recording


def test_a_plan_is_written_and_driven_and_finds_the_joint(cell_file: Path, tmp_path: Path) -> None:
    run_plan(cell_file, 1, SECONDS, tmp_path / "plan", noise_nm=0.02, dwell_s=0.5, as_json=True)
    plan = read_trajectory(tmp_path / "plan" / "plan.json")
    assert plan is not None
    page = (tmp_path / "plan" / "plan.html").read_text(encoding="utf-8")
    assert "data:image/svg+xml" in page
    assert "http" not in page.replace("http-equiv", "").replace("http://www.w3.org", "")
    with rig(tmp_path) as bench:
        recording = read(drive(bench, plan))
    assert recording.metadata.trajectory is not None
    assert recording.metadata.trajectory["name"] == "stair-designed"
    estimate = conclude([recording]).estimate
    assert estimate.decidable
    assert estimate.friction_curve is not None
    # Which slow speeds meet at which place hangs on the last digits of a search: one that has no
    # point of the curve is named.
    pointless = [note for note in estimate.notes if "the friction curve has no point" in note]
    named = re.findall(r"[\d.]+(?=,| rad/s)", pointless[0].split(" the ")[0]) if pointless else []
    points = estimate.friction_curve.velocity_rad_s.size
    assert points + len(named) == len(plan.steady_windows()) // 2
    assert points >= 6
    law = next(m for m in estimate.friction_models if m.model == "stribeck")
    truth = FakeSpecification().joint.friction
    assert law.parameters["coulomb_nm"].value == pytest.approx(truth.coulomb_nm, rel=0.05)
    viscous = law.parameters["viscous_nm_s_per_rad"].value
    assert viscous == pytest.approx(truth.viscous_nm_s_per_rad, rel=0.05)


def test_a_trajectory_of_ones_own_passes_the_same_checks(cell_file: Path, tmp_path: Path) -> None:
    far = point_to_point(
        0.0, 400.0, velocity_rad_s=50.0, acceleration_rad_s2=300.0, jerk_rad_s3=1e4
    )
    with rig(tmp_path / "out") as bench:
        with pytest.raises(RefusedError, match="position would reach"):
            drive(bench, far)
        assert bench.drive.motor_velocity_rad_s == 0.0
    path = tmp_path / "far.json"
    path.write_text(json.dumps(far.to_json()), encoding="utf-8")
    with pytest.raises(RefusedError, match="does not fit"):
        dry_run_axis(cell_file, 1, reverse=False, trajectory_path=path)


def test_the_reversed_plan_is_driven_backward(tmp_path: Path) -> None:
    out = point_to_point(5.0, 25.0, velocity_rad_s=30.0, acceleration_rad_s2=300.0, jerk_rad_s3=1e4)
    with rig(tmp_path) as bench:
        path = drive(bench, out, reverse=True)
    assert path.stem.endswith("-reversed")
    columns = read(path).columns
    steady = columns["velocity_command_rad_s"][columns["phase"] == "steady"]
    assert steady.size
    assert (steady < 0.0).all()


def test_the_plan_says_what_it_can_and_cannot_see(
    cell_file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    run_plan(cell_file, 1, SECONDS, tmp_path, noise_nm=0.02, dwell_s=0.5, as_json=False)
    said = capsys.readouterr().out
    verdict = said.splitlines()[1]
    assert verdict.startswith("16 s, within all limits: shows a friction rise of ")
    for part in ("± ", "starts and ends at −", "This plan can see:", "A rise of friction of"):
        assert part in said
    run_plan(cell_file, 1, SECONDS, tmp_path, noise_nm=0.2, dwell_s=0.5, as_json=True)
    loud: dict[str, Any] = json.loads(capsys.readouterr().out)
    assert loud["schema"] == "stribeck.plan/1"
    assert not loud["expected"]["exponent"]["seen"]
    assert any("exponent" in one for one in loud["cannot_see"])
    assert loud["stribeck_range_rad_s"] is None
    Trajectory.from_json(loud["trajectory"])


def test_a_plan_s_worth_beside_a_plain_stair_is_never_overstated(
    cell_file: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    cell = read_cell(cell_file)
    outlook = outlook_of(cell, cell.axis[0], SECONDS, noise_nm=0.02, dwell_s=0.5)
    for ratios, said in (
        ({"coulomb_nm": 1.0, "exponent": 0.5}, " s in every number, 2.0 times as precise in "),
        ({"coulomb_nm": 1.0, "exponent": 0.99}, " s in every number."),
        ({"coulomb_nm": 1.25, "exponent": 0.5}, "Stribeck exponent, 0.80 times in Coulomb"),
        ({"coulomb_nm": 1.25, "exponent": 0.001}, ": more than 10 times as precise in Stribeck"),
    ):
        monkeypatch.setattr(Outlook, "beside_plain", ratios)
        assert said in in_short(outlook, fits=True)[1]
    monkeypatch.setattr(Outlook, "beside_plain", {})
    first, second = in_short(outlook, fits=False)
    assert first.startswith("16 s, NOT within the axis's limits: ")
    assert second == ""


@pytest.mark.parametrize(
    ("seconds", "edit", "error", "says"),
    [
        (2.0, ("", ""), TrajectoryError, r"needs at least \d"),
        (float("nan"), ("", ""), TrajectoryError, "duration_s must be finite"),
        (20.0, ("[axis.expected]", "[axis.nothing]"), InputError, "unknown key"),
        (20.0, ("coulomb_nm = 0.7", "coulomb_nm = 0.0"), InputError, "rough idea of axis 1"),
        (20.0, ("arm_to_deg = 50.0", "arm_to_deg = -49.99"), TrajectoryError, "needs a stroke"),
        (20.0, ("torque_max_nm = 9.8", "torque_max_nm = 2.0"), TrajectoryError, "lower top speed"),
    ],
)
def test_what_cannot_be_planned_writes_nothing(
    seconds: float,
    edit: tuple[str, str],
    error: type[Exception],
    says: str,
    cell_file: Path,
    tmp_path: Path,
) -> None:
    cell_file.write_text(cell_file.read_text(encoding="utf-8").replace(*edit), encoding="utf-8")
    with pytest.raises(error, match=says) as why:
        run_plan(
            cell_file, 1, seconds, tmp_path / "plan", noise_nm=0.02, dwell_s=0.5, as_json=False
        )
    assert not (tmp_path / "plan").exists()
    told = sentence(why.value)
    if error is TrajectoryError:  # a file's mistakes are a list
        assert told[0] == told[0].upper()
        assert told.endswith(".")


@pytest.mark.parametrize(
    ("content", "says"),
    [
        (None, "cannot be read"),
        ("{", "is not JSON"),
        ("[]", "is not a trajectory"),
        ('{"schema": "stribeck.plan/1"}', "expected schema"),
        ("[" * 100_000, "is not JSON"),
    ],
)
def test_what_is_no_trajectory_is_refused(content: str | None, says: str, tmp_path: Path) -> None:
    path = tmp_path / "plan.json"
    if content is not None:
        path.write_text(content, encoding="utf-8")
    with pytest.raises(InputError, match=says):
        read_trajectory(path)
