"""`stribeck ripple` and `stribeck thermal`: data on stdout, sentences for what is not there."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from agent.cli.identify.ripple import run_ripple
from agent.cli.identify.thermal import run_thermal
from agent.errors import InputError
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from tests.science.test_ripple_recovery import GEAR, passes
from tests.science.test_thermal_recovery import cooled


def saved(path: Path, columns: dict[str, np.ndarray]) -> str:
    write(Recording(columns, Metadata(robot="r", axis=1, gear_ratio=GEAR), str(path)), path)
    return str(path)


def rippled(path: Path) -> str:
    signals = passes(1, {6.0: 0.05}, velocities=(4.0, -4.0), seconds=4.0)
    assert signals.position_rad is not None
    return saved(
        path,
        {
            "time_s": signals.time_s,
            "position_rad": signals.position_rad,
            "torque_nm": signals.torque_nm,
        },
    )


def test_ripple_prints_text_json_and_picture(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    name = rippled(tmp_path / "run.parquet")
    picture = tmp_path / "ripple.svg"
    run_ripple([name], 60.0, picture, as_json=False)
    text = capsys.readouterr().out
    assert "per arm turn: " in text
    assert "torque-ripple" in text
    assert picture.read_bytes().startswith(b"<?xml")
    run_ripple([name], 60.0, None, as_json=True)
    document = json.loads(capsys.readouterr().out)
    assert document["schema"] == "stribeck.ripple/1"
    assert document["lines"][0]["kind"] == "torque-ripple"
    with pytest.raises(InputError, match="above 0"):
        run_ripple([name], -1.0, None, as_json=False)


def test_thermal_prints_the_cooling_and_says_what_is_missing(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    time_s, temperature = cooled(1)
    still = np.zeros_like(time_s)
    columns = {"time_s": time_s, "velocity_rad_s": still, "torque_nm": still}
    name = saved(tmp_path / "a.parquet", {**columns, "gearbox_temperature_degc": temperature})
    picture = tmp_path / "thermal.png"
    run_thermal([name], 30.0, "", picture, as_json=False)
    text = capsys.readouterr().out
    assert "at 30 °C" in text
    assert "not identified: none of the recordings carries a friction curve" in text
    assert picture.read_bytes().startswith(b"\x89PNG")
    run_thermal([name], 30.0, "", None, as_json=True)
    document = json.loads(capsys.readouterr().out)
    assert document["cooling"]["identified"]
    assert document["reaches"]["at_s"]["ci95"][0] < document["reaches"]["at_s"]["value"]
    assert not document["friction_surface"]["identified"]
    plain = saved(tmp_path / "b.parquet", columns)
    with pytest.raises(InputError, match="has a temperature"):
        run_thermal([plain], 30.0, "", None, as_json=False)
