"""`stribeck simulate`: the column it adds, and what it refuses in one sentence."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from agent.cli.explain.simulate import run_simulate, simulated
from agent.errors import InputError
from agent.physics.twin import Effect, Twin, format_twin
from agent.record.metadata import Metadata
from agent.record.reading import read
from agent.record.recording import Recording
from agent.record.writing import write

TWIN = Twin(
    "r", 2, 100.0, 0.02, 0.6, 0.01, 0.2, -0.1, (Effect("torque-offset", {"torque_offset_nm": 0.3}),)
)


def recorded(folder: Path) -> Path:
    time = np.arange(0.0, 8.0, 0.002)
    position, velocity = 60.0 * np.sin(time), 60.0 * np.cos(time)
    torque = TWIN.predict_torque(position, velocity, -60.0 * np.sin(time))
    columns = {
        "time_s": time,
        "position_rad": position,
        "velocity_rad_s": velocity,
        "torque_nm": torque,
        "mood": np.array(["calm"] * len(time)),
    }
    about = Metadata("r", 2, 100.0, "2026-01-01T00:00:00Z", {"name": "sine", "parameters": {}})
    return write(Recording(columns, about), folder / "run.parquet")


def written(folder: Path, twin: Twin) -> Path:
    path = folder / "twin.toml"
    path.write_text(format_twin(twin), encoding="utf-8")
    return path


def test_a_twin_predicts_its_own_recording(tmp_path: Path) -> None:
    source, out = recorded(tmp_path), tmp_path / "out.parquet"
    run_simulate(written(tmp_path, TWIN), str(source), out)
    before, after = read(source), read(out)
    error = after["torque_simulated_nm"] - after["torque_nm"]
    # Friction turns over at the samples where the recording's own sign does, give or take one.
    moving = np.abs(after["velocity_rad_s"]) > 1.0
    assert np.nanmax(np.abs(error[moving])) < 0.005
    # Where the motion beyond an end would matter nothing is said, and that is a matter of moments.
    unknown = np.flatnonzero(np.isnan(error))
    assert unknown.size < 0.01 * error.size
    assert np.all((unknown < 50) | (unknown > error.size - 50))
    assert after.metadata == before.metadata
    assert set(after.columns) == {*before.columns, "torque_simulated_nm"}
    assert after["mood"].tolist() == before["mood"].tolist()


ARM = {"arm_inertia_kg_m2": 0.012, "stiffness_nm_per_rad": 40.0, "damping_nm_s_per_rad": 0.02}
SOFT = Twin("r", 2, 100.0, 0.018, 0.4, 0.005, effects=(Effect("joint-flexibility", ARM),))


def ringing(noise_rad_s: float) -> dict[str, Any]:
    """Return columns of a soft joint under a speed controller, with a noisy velocity."""

    def reference(t: Any) -> Any:
        knots = [0.0, 0.5, 0.6, 2.0, 2.1, 3.5, 3.7, 5.0, 5.1]
        return np.interp(t, knots, [5.0, 5.0, 20.0, 20.0, 45.0, 45.0, -20.0, -20.0, -45.0])

    def derivative(t: float, state: Any) -> list[float]:
        motor, speed, arm, arm_speed, integral = state
        error = reference(t) - speed
        shaft = 40.0 * (motor - arm) + 0.02 * (speed - arm_speed)
        friction = 0.4 * np.tanh(speed / 0.02) + 0.005 * speed
        acceleration = (0.5 * error + 6.0 * integral - friction - shaft) / 0.006
        return [speed, acceleration, arm_speed, shaft / 0.012, error]

    time = np.arange(0.0, 6.0, 0.002)
    start = [0.0, 5.0, 0.0, 5.0, (0.4 + 0.025) / 6.0]
    position, velocity, _, _, integral = solve_ivp(
        derivative, (0.0, 6.0), start, "LSODA", time, rtol=1e-6, max_step=2e-3
    ).y
    return {
        "time_s": time,
        "position_rad": position,
        "velocity_rad_s": velocity + noise_rad_s * np.random.default_rng(3).normal(size=time.shape),
        "torque_nm": 0.5 * (reference(time) - velocity) + 6.0 * integral,
    }


@pytest.mark.parametrize(("noise_rad_s", "rms_nm"), [(0.0, 0.01), (0.02, 0.03), (0.1, 0.06)])
def test_a_soft_arm_that_rings_is_followed_as_far_as_noise_lets_see(
    noise_rad_s: float, rms_nm: float
) -> None:
    columns = ringing(noise_rad_s)
    about = Metadata("r", 2, 100.0, "2026-01-01T00:00:00Z", {"name": "steps"})
    after = simulated(SOFT, Recording(columns, about), "twin")
    error = np.asarray(after["torque_simulated_nm"] - columns["torque_nm"])
    moving = (np.abs(columns["velocity_rad_s"]) > 2.0) & np.isfinite(error)
    assert np.mean(moving) > 0.9
    assert np.std(columns["torque_nm"]) > 1.0
    assert np.sqrt(np.mean(error[moving] ** 2)) < rms_nm


def test_a_gap_in_the_recording_is_a_gap_in_the_prediction() -> None:
    columns = ringing(0.02)
    columns["velocity_rad_s"][1200:1230] = np.nan
    about = Metadata("r", 2, 100.0, "2026-01-01T00:00:00Z", {"name": "steps"})
    torque = simulated(SOFT, Recording(columns, about), "twin")["torque_simulated_nm"]
    unknown = np.flatnonzero(np.isnan(torque))
    assert set(range(1200, 1230)) <= set(unknown.tolist())
    assert unknown.size < 150


def test_it_says_where_a_twins_laws_are_carried_beyond_what_they_were_learnt_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    source = recorded(tmp_path)
    for reach, said in ((1e-3, True), (1e3, False)):
        known = replace(TWIN, extra={"learnt_over": {"velocity_rad_s": [0.0, reach]}})
        run_simulate(written(tmp_path, known), str(source), tmp_path / f"{said}.parquet")
        assert ("was learnt over: motor speeds" in capsys.readouterr().err) is said


def test_a_drift_needs_to_know_when_the_recording_began(tmp_path: Path) -> None:
    numbers = {"coulomb_nm_per_h": 0.01, "reference_started_at": "2025-12-31T14:00:00Z"}
    drift = Effect("friction-drift", numbers)
    aged = Twin("r", 2, 100.0, 0.02, 0.6, 0.01, 0.2, -0.1, (*TWIN.effects, drift))
    recording = read(recorded(tmp_path))
    older = simulated(aged, recording, "twin")["torque_simulated_nm"]
    grown = older - simulated(TWIN, recording, "twin")["torque_simulated_nm"]
    assert np.nanmax(grown) == pytest.approx(0.1, abs=1e-4)
    undated = recording.with_metadata(replace(recording.metadata, started_at=""))
    with pytest.raises(InputError, match="instant at which the recording started"):
        simulated(aged, undated, "twin")


@pytest.mark.parametrize(
    ("twin", "named"),
    [
        (Twin("r", 1, 100.0, 0.02, 0.6, 0.01), "axis 1"),
        (Twin("r", 2, 90.0, 0.02, 0.6, 0.01), "gear ratio 90"),
        (Twin("r", 2, 100.0, 0.02, 0.6, 0.01, effects=(Effect("magic", {}),)), "magic"),
    ],
)
def test_another_axis_gear_or_physics_is_refused(tmp_path: Path, twin: Twin, named: str) -> None:
    source, out = recorded(tmp_path), tmp_path / "out.parquet"
    with pytest.raises(InputError, match=named):
        run_simulate(written(tmp_path, twin), str(source), out)
    assert not out.exists()


def test_a_twin_that_is_none_and_another_suffix_are_refused(tmp_path: Path) -> None:
    source = recorded(tmp_path)
    with pytest.raises(InputError, match="cannot be read"):
        run_simulate(tmp_path / "none.toml", str(source), tmp_path / "out.parquet")
    with pytest.raises(InputError, match=r"\.parquet or \.csv"):
        run_simulate(written(tmp_path, TWIN), str(source), tmp_path / "out.txt")
