"""`stribeck simulate`: the column it adds, and what it refuses in one sentence."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from agent.cli.simulate import run_simulate
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
    # At the ends the low-pass sees its own extension of the velocity, which is no motion.
    error = (after["torque_simulated_nm"] - after["torque_nm"])[500:-500]
    assert np.sqrt(np.mean(error**2)) < 0.012
    assert np.max(np.abs(error)) < 0.05
    assert after.metadata == before.metadata
    assert set(after.columns) == {*before.columns, "torque_simulated_nm"}
    assert after["mood"].tolist() == before["mood"].tolist()


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
