"""`stribeck reversals`: data on stdout, a sentence first, and reasons where there is no number."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from typer.testing import CliRunner

from agent.cli.app import app
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from tests.science.reversal_plant import GEAR, bristled, sampled

Columns = dict[str, NDArray[np.float64]]


def saved(path: Path, columns: Columns) -> str:
    write(Recording(columns, Metadata(robot="r", axis=1, gear_ratio=GEAR), str(path)), path)
    return str(path)


def swung(path: Path, seed: int = 1) -> str:
    signals = sampled(bristled("dahl"), seed)
    assert signals.position_rad is not None
    return saved(
        path,
        {
            "time_s": signals.time_s,
            "position_rad": signals.position_rad,
            "torque_nm": signals.torque_nm,
        },
    )


def asked(*arguments: str) -> str:
    result = CliRunner().invoke(app, ["reversals", *arguments])
    assert result.exit_code == 0, result.output
    return result.stdout


def test_text_json_and_picture_say_the_same(tmp_path: Path) -> None:
    name = swung(tmp_path / "run.parquet")
    picture = tmp_path / "reversals.png"
    text = asked(name, "--picture", str(picture))
    assert text.startswith("Around a reversal the joint gives like a spring for ")
    assert "* dahl" in text
    assert picture.read_bytes().startswith(b"\x89PNG")
    document = json.loads(asked(name, "--json"))
    assert document["schema"] == "stribeck.reversals/1"
    assert document["sentence"] == text.splitlines()[0]
    [selected] = [law for law in document["laws"] if law["selected"]]
    assert selected["law"] == "dahl"
    low, high = selected["parameters"]["space_constant_rad"]["ci95"]
    assert low < 0.04 < high
    assert document["clearance"]["backlash_rad"]["value"] is None
    assert "position_arm_rad" in document["clearance"]["backlash_rad"]["reason"]


def motion(kind: str) -> Columns:
    """Return a recording that carries no reversal to learn from."""
    time_s = np.arange(0.0, 20.0, 0.01)
    swing = np.sin(2.0 * np.pi * 0.25 * time_s)
    noise = np.random.default_rng(3).normal(0.0, 1e-4, time_s.size)
    if kind == "slow sampling":
        time_s = np.arange(0.0, 300.0, 1.0)
        swing = np.sin(2.0 * np.pi * 0.25 * (time_s + 0.3))
        noise = np.random.default_rng(3).normal(0.0, 1e-4, time_s.size)
    position = {
        "no motion": noise,
        "one direction": 2.0 * time_s + noise,
        "one reversal": -np.hypot(time_s - 10.0, 1.0) + noise,
        "slow sampling": 3.0 * swing + noise,
    }[kind]
    return {"time_s": time_s, "position_rad": position, "torque_nm": 0.5 * np.sign(swing) + noise}


@pytest.mark.parametrize(
    ("kind", "says"),
    [
        ("no motion", "does not move"),
        ("one direction", "turned forwards only"),
        ("one reversal", "1 reversal; record at least 4"),
        ("slow sampling", "at 1 Hz"),
    ],
)
def test_what_cannot_be_told_is_said_without_a_number(tmp_path: Path, kind: str, says: str) -> None:
    name = saved(tmp_path / "run.parquet", motion(kind))
    picture = tmp_path / "reversals.svg"
    text = asked(name, "--picture", str(picture))
    assert "not identified" in text
    assert says in text
    assert not picture.exists()
    document = json.loads(asked(name, "--json"))
    assert not document["decidable"]
    assert not document["laws"]
    assert says in document["reasons"][0]
    assert document["clearance"]["backlash_rad"] == {
        "value": None,
        "identified": False,
        "reason": document["reasons"][0],
    }


def test_reversals_that_no_law_explains_get_no_number_of_one(tmp_path: Path) -> None:
    signals = sampled(bristled("dahl"), 1)
    assert signals.position_rad is not None
    # A swing beside the joint, as strong as its friction and forty times the noise.
    shaken = signals.torque_nm + 0.6 * np.sin(2.0 * np.pi * 1.3 * signals.time_s)
    columns = {
        "time_s": signals.time_s,
        "position_rad": signals.position_rad,
        "torque_nm": shaken,
    }
    name, picture = saved(tmp_path / "run.parquet", columns), tmp_path / "reversals.svg"
    text = asked(name, "--picture", str(picture))
    assert text.startswith("These reversals do not tell how friction turns: ")
    assert "times the torque's noise" in text
    assert "stribeck explain" in text
    assert len(text.splitlines()) == 1
    assert picture.exists()
    document = json.loads(asked(name, "--json"))
    assert not document["decidable"]
    assert "no law explains these reversals" in document["reasons"][0]
    numbers = [p for law in document["laws"] for p in law["parameters"].values()]
    assert numbers
    assert all(p["value"] is None and not p["identified"] and p["reason"] for p in numbers)
    assert document["clearance"]["backlash_rad"]["value"] is None
