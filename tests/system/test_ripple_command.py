"""`stribeck ripple` with anticogging off and on: what it does to torque and to motion."""

from __future__ import annotations

import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.cli.identify.ripple import run_ripple
from agent.errors import InputError
from agent.record.recording import Metadata, Recording
from agent.record.writing import write

ORDER = 7.0


def turned(path: Path, seed: int, stutter_rad: float, **trajectory: Any) -> str:
    """Write one slow pass of five turns: the same torque, more stutter or less."""
    rng = np.random.default_rng(seed)
    time_s = np.arange(0.0, 16.0, 0.005)
    line = 2.0 * time_s
    angle = line + stutter_rad * np.sin(ORDER * line)
    position = angle + 1e-4 * rng.standard_normal(time_s.size)
    torque = 0.1 + 0.006 * np.cos(ORDER * angle) + 1e-3 * rng.standard_normal(time_s.size)
    columns = {
        "time_s": time_s,
        "position_rad": position,
        "velocity_rad_s": np.full(time_s.size, 2.0),
        "torque_nm": torque,
    }
    write(Recording(columns, Metadata("r", 1, 1.0, trajectory=trajectory), str(path)), path)
    return str(path)


@pytest.fixture
def pair(tmp_path: Path) -> list[str]:
    off = turned(tmp_path / "off.parquet", 1, 0.02, name="slow", anticogging=False)
    on = turned(tmp_path / "on.parquet", 2, 0.002, name="slow", parameters={"anticogging": True})
    return [off, on]


def test_both_are_set_side_by_side(
    pair: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "ripple.svg"
    run_ripple(pair, 40.0, picture, as_json=False)
    text = capsys.readouterr().out
    assert "Anticogging off → on at 2 rad/s (1 and 1 passes)" in text
    assert re.search(r"20(\.\d)? → (2|1\.9\d|2\.0\d) \(10 %\)", text), text
    assert re.search(r"motion's stutter with anticogging on is down to 10 % .* at order 7", text)
    assert "the compensation is part of it" in text
    assert "anticogging off" in picture.read_text()
    run_ripple(pair, 40.0, None, as_json=True)
    document = json.loads(capsys.readouterr().out)
    assert document["recordings"] == ["off.parquet"]
    (order,) = document["anticogging"][0]["orders"]
    assert order["order_per_motor_rev"] == pytest.approx(ORDER, abs=0.05)
    assert order["motion"] == "down"
    assert document["anticogging"][0]["sentence"] in text
    low, high = order["torque_left"]["ci95"]
    assert low < 1.0 < high
    assert order["stutter_left"]["value"] == pytest.approx(0.1, rel=0.05)


def test_one_kind_alone_is_not_compared(
    pair: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    run_ripple(pair[1:], 40.0, None, as_json=False)
    assert "Anticogging" not in capsys.readouterr().out


def test_a_recording_that_does_not_say_is_not_mixed_in(pair: list[str], tmp_path: Path) -> None:
    unsaid = turned(tmp_path / "unsaid.parquet", 3, 0.02, name="slow")
    with pytest.raises(InputError, match="whether anticogging was on"):
        run_ripple([*pair, unsaid], 40.0, None, as_json=False)
