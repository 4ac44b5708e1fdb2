"""`stribeck explain` on recordings that others made: what it says of them, and what it declines."""

from __future__ import annotations

from pathlib import Path

import pytest

from agent.cli.estimate import run_twin
from agent.cli.explain import explained
from agent.cli.simulate import read_twin
from agent.explain.result import Explanation
from agent.record.reading import read_all

pytestmark = pytest.mark.real

BY_HAND = """schema = "stribeck.twin/1"
robot = "{robot}"
axis = 1
gear_ratio = 1.0

[rigid_body]
inertia_kg_m2 = {inertia}
gravity_sin_nm = 0.0
gravity_cos_nm = 0.0

[friction]
coulomb_nm = {coulomb}
viscous_nm_s_per_rad = 0.0
"""


def explain(twin: Path, recording: Path, holdout: Path | None = None) -> Explanation:
    unseen = read_all([str(holdout)]) if holdout is not None else ()
    return explained(read_twin(twin), twin, read_all([str(recording)]), unseen)


def by_hand(folder: Path, robot: str, inertia: float, coulomb: float) -> Path:
    path = folder / "twin.toml"
    path.write_text(BY_HAND.format(robot=robot, inertia=inertia, coulomb=coulomb))
    return path


def identified(folder: Path, recording: Path) -> Path:
    run_twin([str(recording)], folder / "twin.toml")
    return folder / "twin.toml"


def test_emps_friction_differs_by_direction_and_along_the_position(
    real_recordings: Path, tmp_path: Path
) -> None:
    """Published for this axis: viscous friction 169 forward and 243 backward, 74 apart."""
    emps = real_recordings / "emps"
    found = explain(
        identified(tmp_path, emps / "estimation.parquet"),
        emps / "estimation.parquet",
        emps / "validation-with-pulses.parquet",
    )
    by_effect = {finding.effect: finding for finding in found.findings}
    asymmetry = by_effect["direction-asymmetry"]
    assert asymmetry.rank == 1
    difference = asymmetry.parameters["viscous_difference_nm_s_per_rad"].ci95
    assert difference is not None
    assert difference[0] < -74.0 < difference[1]
    located = {r.variable for f in found.findings for r in f.where}
    located |= {r.variable for r in found.unexplained_where}
    assert located & {"arm_position_rad", "load_torque_nm"}
    assert found.holdout is not None
    assert found.holdout.improvement_ci95_percent is not None
    assert found.holdout.improvement_ci95_percent[0] > 50.0
    assert found.holdout.placebo_percent < 2.0


def test_epos_drive_2_has_no_stribeck_effect(real_recordings: Path, tmp_path: Path) -> None:
    recording = real_recordings / "epos-screw-drives" / "drive2-steady.parquet"
    found = explain(identified(tmp_path, recording), recording)
    assert "stribeck" not in [f.effect for f in found.findings]
    assert "the position was not recorded" in found.not_judged["torque-ripple"]


def test_epos_drive_1_passes_are_too_short_for_its_slowest_rate(
    real_recordings: Path, tmp_path: Path
) -> None:
    """Passes of 3 s beside passes sampled at 8 Hz; `estimate`, of means, names Stribeck."""
    recording = real_recordings / "epos-screw-drives" / "drive1-steady.parquet"
    found = explain(identified(tmp_path, recording), recording)
    assert found.findings == ()
    assert "recorded can be compared, in the band of 0.78 Hz" in found.sentence


def test_odrive_motor_stutters_too_close_to_standstill(
    real_recordings: Path, tmp_path: Path
) -> None:
    recording = real_recordings / "odrive-cogging" / "slow2-slower-nocomp-0.parquet"
    found = explain(by_hand(tmp_path, "odrive-bldc", 1e-5, 1e-3), recording)
    assert found.findings == ()
    assert "can be compared" in found.sentence


@pytest.mark.parametrize(
    ("file", "robot"),
    [
        ("ur3-production/joint1.parquet", "ur3"),
        ("cycloidal-run-in/baseline.parquet", "cycloidal-baseline"),
    ],
)
def test_one_sample_a_second_is_not_decidable(
    real_recordings: Path, tmp_path: Path, file: str, robot: str
) -> None:
    found = explain(by_hand(tmp_path, robot, 1e-3, 3.0), real_recordings / file)
    assert found.findings == ()
    assert "samples a second" in found.sentence
    assert found.twin is None
