"""`stribeck explain` on recordings that others made: what it says of them, and what it declines."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from agent.cli.explain.simulate import read_twin
from agent.cli.identify.estimate import run_twin
from agent.conclude.explanation import explained
from agent.explain.answer.result import Explanation, Finding
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


def explain(twin: Path, *recordings: Path, holdout: Path | None = None) -> Explanation:
    unseen = read_all([str(holdout)]) if holdout is not None else ()
    return explained(read_twin(twin), twin, read_all([str(r) for r in recordings]), unseen)


def by_hand(folder: Path, robot: str, inertia: float, coulomb: float) -> Path:
    path = folder / "twin.toml"
    path.write_text(BY_HAND.format(robot=robot, inertia=inertia, coulomb=coulomb))
    return path


def identified(folder: Path, recording: Path) -> Path:
    run_twin([str(recording)], folder / "twin.toml")
    return folder / "twin.toml"


def by_effect(found: Explanation, effect: str) -> Finding:
    return next(f for f in found.findings if f.effect == effect)


def also(finding: Finding) -> set[str]:
    return {alternative.effect for alternative in finding.alternatives}


def interval(finding: Finding, name: str) -> tuple[float, float]:
    ci95 = finding.parameters[name].ci95
    assert ci95 is not None
    return ci95


def amplitude(finding: Finding, order: float) -> float:
    """Return a ripple's amplitude at one order per motor turn, N m; 0 where it is of another."""
    number = {name: p.value for name, p in finding.parameters.items()}
    for cos, sin, times in (("cos_nm", "sin_nm", 1), ("cos_second_nm", "sin_second_nm", 2)):
        if cos in number and abs(times * number["order_per_motor_rev"] - order) < 0.2:
            return float(np.hypot(number[cos], number[sin]))
    return 0.0


def test_emps_friction_differs_by_direction_and_along_the_position(
    real_recordings: Path, tmp_path: Path
) -> None:
    """Published for this axis: viscous friction 169 forward and 243 backward, 74 ±1 apart."""
    emps = real_recordings / "emps"
    found = explain(
        identified(tmp_path, emps / "estimation.parquet"),
        emps / "estimation.parquet",
        holdout=emps / "validation-with-pulses.parquet",
    )
    asymmetry = by_effect(found, "direction-asymmetry")
    assert asymmetry.rank == 1
    difference = interval(asymmetry, "viscous_difference_nm_s_per_rad")
    assert difference[0] < -73.0
    assert difference[1] > -75.0
    located = {r.variable for f in found.findings for r in f.where}
    located |= {r.variable for r in found.unexplained_where}
    assert located & {"arm_position_rad", "load_torque_nm"}
    assert found.holdout is not None
    assert found.holdout.improvement_ci95_percent is not None
    assert found.holdout.improvement_ci95_percent[0] > 50.0
    assert found.holdout.placebo_percent < 2.0


def test_epos_drive_1_has_a_stribeck_effect(real_recordings: Path, tmp_path: Path) -> None:
    """Passes at 8 to 156 samples a second in one recording; fitted by others: about 4.8 rad/s."""
    recording = real_recordings / "epos-screw-drives" / "drive1-steady.parquet"
    found = explain(identified(tmp_path, recording), recording)
    stribeck = by_effect(found, "stribeck")
    low, high = interval(stribeck, "stribeck_velocity_rad_s")
    assert low < 4.8 < high < 10.0
    assert interval(stribeck, "static_extra_nm")[0] > 0.0
    pair = found.findings[0]
    assert {pair.effect} | also(pair) == {"torque-offset", "direction-asymmetry"}
    assert found.holdout is not None
    assert found.holdout.source == "velocity steps left out in turn"
    assert found.holdout.extended.rmse_nm < 0.7 * found.holdout.refitted.rmse_nm


def test_epos_drive_2_has_no_stribeck_effect(real_recordings: Path, tmp_path: Path) -> None:
    recording = real_recordings / "epos-screw-drives" / "drive2-steady.parquet"
    found = explain(identified(tmp_path, recording), recording)
    named = {f.effect for f in found.findings} | {a for f in found.findings for a in also(f)}
    assert "stribeck" not in named
    assert "the position was not recorded" in found.not_judged["torque-ripple"]
    assert "no change of speed was recorded" in found.not_judged["measurement-delay"]


@pytest.mark.parametrize("inertia_kg_m2", [0.0, 1e-5], ids=["no inertia", "a rotor's"])
def test_odrive_motor_has_cogging(
    real_recordings: Path, tmp_path: Path, inertia_kg_m2: float
) -> None:
    """A slow motor that stutters, and a twin that hardly knows it; the static map's 7 per turn.

    One way, over one turn: friction along the position is the ripple's equal.
    """
    recording = real_recordings / "odrive-cogging" / "slow2-slower-nocomp-0.parquet"
    found = explain(by_hand(tmp_path, "odrive-bldc", inertia_kg_m2, 1e-3), recording)
    assert {f.effect for f in found.findings} == {"torque-ripple"}
    first = found.findings[0]
    assert also(first) == {"position-dependent-friction"}
    assert amplitude(first, 7.0) == pytest.approx(0.86 * 7.5e-3, rel=0.1)
    assert max(amplitude(f, 28.0) for f in found.findings) == pytest.approx(3.5e-3, rel=0.15)
    assert "no change of speed was recorded" in found.not_judged["backlash"]
    assert "only one speed was driven" in found.not_judged["stribeck"]
    assert found.next_experiment is not None


@pytest.mark.parametrize("compensated", ["nocomp", "comp"])
def test_odrive_anticogging_leaves_the_torques_ripple(
    real_recordings: Path, tmp_path: Path, compensated: str
) -> None:
    """The compensation is itself a part of the current; three runs predict one another."""
    folder = real_recordings / "odrive-cogging"
    found = explain(
        by_hand(tmp_path, "odrive-bldc", 1e-5, 1e-3),
        *(folder / f"slow2-{compensated}-{i}.parquet" for i in range(3)),
    )
    first = found.findings[0]
    assert first.effect == "torque-ripple"
    assert amplitude(first, 7.0) == pytest.approx(6.2e-3, rel=0.1)
    assert found.holdout is not None
    assert found.holdout.source == "recordings left out in turn"
    assert found.holdout.improvement_percent > 75.0


def test_ten_seconds_of_a_noisy_slow_motor_are_too_short(
    real_recordings: Path, tmp_path: Path
) -> None:
    recording = real_recordings / "odrive-cogging" / "slow2-nocomp-0.parquet"
    found = explain(by_hand(tmp_path, "odrive-bldc", 1e-5, 1e-3), recording)
    assert found.findings == ()
    assert "record 24 s or more" in found.sentence


def test_cycloidal_run_in_is_a_tie_of_temperature_and_time(
    real_recordings: Path, tmp_path: Path
) -> None:
    """One sample a second: steady passes are compared, and no change of speed is."""
    recording = real_recordings / "cycloidal-run-in" / "baseline.parquet"
    found = explain(by_hand(tmp_path, "cycloidal-baseline", 1e-3, 3.0), recording)
    assert found.verdict == "tied"
    warming = found.findings[0]
    assert {warming.effect} | also(warming) == {"temperature-dependent-friction", "friction-drift"}
    assert found.next_experiment is not None
    assert "while heating and while cooling" in found.next_experiment.sentence
    assert "sampled too slowly" in found.not_judged["presliding-hysteresis"]
    assert any("the motor's stands in for it" in reason for reason in found.reasons)


@pytest.mark.parametrize("file", ["joint1", "joint2"])
def test_a_production_log_is_not_decidable(
    real_recordings: Path, tmp_path: Path, file: str
) -> None:
    recording = real_recordings / "ur3-production" / f"{file}.parquet"
    axis = read_all([str(recording)])[0].metadata.axis
    twin = by_hand(tmp_path, "ur3", 1e-3, 3.0)
    twin.write_text(twin.read_text().replace("axis = 1", f"axis = {axis}"))
    found = explain(twin, recording)
    assert found.findings == ()
    assert "at 1 samples a second only speeds that are held can be compared" in found.sentence
    assert found.twin is None
