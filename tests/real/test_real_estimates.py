"""Recordings that others made: the numbers that their authors, or independent fits, found."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from agent.identify.estimate import estimate, twin_from_estimate
from agent.identify.friction.curve import friction_curve
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.windows import find_windows

pytestmark = pytest.mark.real


def load(folder: Path, name: str) -> Signals:
    table = pq.read_table(folder / f"{name}.parquet")
    metadata = json.loads((table.schema.metadata or {})[b"stribeck"])
    columns = {c: table[c].to_numpy(zero_copy_only=False) for c in table.column_names}
    return Signals.from_columns(columns, float(metadata["gear_ratio"]), name=name)


def test_lead_screw_has_stribeck_friction(real_recordings: Path) -> None:
    result = estimate([load(real_recordings, "epos-screw-drives/drive1-steady")])
    assert result.friction_curve is not None
    assert result.friction_curve.velocity_rad_s.size == 16
    fits = {m.model: m for m in result.friction_models}
    assert result.selected_model is fits["stribeck"]
    assert fits["stribeck"].rmse_nm <= 0.04e-3
    assert fits["stribeck"].fit_percent == pytest.approx(98.9, abs=0.2)
    assert fits["coulomb-viscous"].rmse_nm == pytest.approx(0.127e-3, rel=0.02)
    assert fits["coulomb-viscous"].fit_percent == pytest.approx(95.9, abs=0.2)
    parameters = fits["stribeck"].parameters
    velocity = parameters["stribeck_velocity_rad_s"]
    assert velocity.value == pytest.approx(4.8, rel=0.1)
    assert velocity.ci95 is not None
    assert velocity.ci95[0] < 4.8 < velocity.ci95[1]
    assert parameters["exponent"].value == pytest.approx(1.0, abs=0.15)
    assert "Stribeck" in result.sentence


def test_anti_backlash_lead_screw_has_none(real_recordings: Path) -> None:
    result = estimate([load(real_recordings, "epos-screw-drives/drive2-steady")])
    fit = result.selected_model
    assert fit is not None
    assert fit.model == "coulomb-viscous"
    assert fit.rmse_nm == pytest.approx(0.091e-3, rel=0.02)
    assert fit.fit_percent == pytest.approx(98.2, abs=0.2)


def test_screw_drives_carry_neither_inertia_nor_gravity(real_recordings: Path) -> None:
    body = estimate([load(real_recordings, "epos-screw-drives/drive1-steady")]).rigid_body
    assert body is not None
    for name in ("inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm"):
        assert not body.parameters[name].identified
        assert body.parameters[name].reason
    assert body.parameters["torque_offset_nm"].value == pytest.approx(-0.359e-3, rel=0.02)


def test_benchmark_axis_and_its_validation(real_recordings: Path) -> None:
    result = estimate(
        [load(real_recordings, "emps/estimation")],
        validation=load(real_recordings, "emps/validation-with-pulses"),
    )
    assert result.rigid_body is not None
    parameters = result.rigid_body.parameters
    published = {
        "inertia_kg_m2": 95.11,
        "viscous_nm_s_per_rad": 203.5,
        "coulomb_nm": 20.39,
        "torque_offset_nm": -3.16,
    }
    target = {
        "inertia_kg_m2": 95.0,
        "viscous_nm_s_per_rad": 205.0,
        "coulomb_nm": 20.2,
        "torque_offset_nm": -3.2,
    }
    for name, value in target.items():
        assert parameters[name].value == pytest.approx(value, rel=0.02)
        interval = parameters[name].ci95
        assert interval is not None
        assert interval[0] <= published[name] <= interval[1]
    for name in ("gravity_sin_nm", "gravity_cos_nm"):
        assert not parameters[name].identified
        assert "stroke of 14" in parameters[name].reason
    assert result.validation is not None
    assert result.validation.relative_torque_error_percent <= 4.5
    position = result.validation.position
    assert position is not None
    assert position.closed_loop is not None
    assert position.open_loop is not None
    loop = position.closed_loop
    # The benchmark's own gains: 160.18 1/s of position, 243.45 V s/m of velocity, 35.15 N/V.
    assert loop.stiffness_nm_per_rad / loop.damping_nm_s_per_rad == pytest.approx(160.18, rel=0.01)
    assert loop.damping_nm_s_per_rad == pytest.approx(243.45 * 35.15, rel=0.12)
    assert loop.rmse_rad <= 2.0e-6
    assert loop.largest_rad <= 11.0e-6
    assert loop.relative_percent <= 0.0025
    assert position.open_loop.rmse_rad == pytest.approx(0.35e-3, rel=0.05)
    twin = twin_from_estimate(result, robot="emps", axis=1, gear_ratio=1.0)
    assert twin.inertia_kg_m2 == parameters["inertia_kg_m2"].value


@pytest.mark.parametrize("joint", ["joint1", "joint2"])
def test_production_log_is_not_decidable(real_recordings: Path, joint: str) -> None:
    result = estimate([load(real_recordings, f"ur3-production/{joint}")])
    assert not result.decidable
    assert "too slow" in " ".join(result.reasons)
    assert result.quality.masked == 10


def test_run_in_at_one_speed_is_not_decidable(real_recordings: Path) -> None:
    result = estimate([load(real_recordings, "cycloidal-run-in/baseline")])
    assert not result.decidable
    assert "one steady speed only" in result.reasons[0]


def test_slow_cogging_in_one_direction_is_not_decidable(real_recordings: Path) -> None:
    for path in sorted((real_recordings / "odrive-cogging").glob("*.parquet")):
        result = estimate([load(real_recordings, f"odrive-cogging/{path.stem}")])
        assert not result.decidable
        assert "one direction only" in result.reasons[0]


@pytest.mark.parametrize("drive", [1, 2])
def test_start_stop_moves_agree_with_the_steady_ones(real_recordings: Path, drive: int) -> None:
    moves = load(real_recordings, f"epos-screw-drives/drive{drive}-start-stop")
    steady = estimate([load(real_recordings, f"epos-screw-drives/drive{drive}-steady")])
    motion = read_motion(moves)
    curve = friction_curve([motion], find_windows(motion))
    assert curve is not None
    assert curve.curve.velocity_rad_s.size == 2
    assert steady.friction_curve is not None
    expected = np.interp(
        curve.curve.velocity_rad_s,
        steady.friction_curve.velocity_rad_s,
        steady.friction_curve.friction_nm,
    )
    np.testing.assert_allclose(curve.curve.friction_nm, expected, rtol=0.08)
    # Two speeds carry points of a curve, but no law.
    alone = estimate([moves])
    assert not alone.decidable
    assert "only two steady speeds" in alone.reasons[0]
