"""`stribeck ripple` with anticogging off and on: what it does to torque and to motion."""

from __future__ import annotations

import itertools
import json
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.cli.identify.ripple import multiples, run_ripple
from agent.errors import InputError
from agent.identify.result import Parameter
from agent.identify.ripple.identification import Ripple
from agent.identify.ripple.line import RippleLine
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from agent.report.figures.ripple import figure_ripple

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


@pytest.mark.parametrize(
    ("orders", "family"),
    [
        ((7.0, 28.0, 14.02, 12.0, 36.0, 35.0), ([7.0, 14.02, 28.0, 35.0], 7.0)),
        ((1.0, 2.0, 3.01, 1.4), ([1.0, 2.0, 3.01], 1.0)),
        ((1.0, 28.0, 41.0, 57.0), ([], 0.0)),  # all are multiples of 1, and it says nothing
        ((7.0, 14.0, 30.0), ([], 0.0)),
        ((), ([], 0.0)),
    ],
)
def test_orders_of_one_cause_are_told_as_multiples(
    orders: tuple[float, ...], family: tuple[list[float], float]
) -> None:
    assert multiples([Parameter(o, (o - 0.03, o + 0.03)) for o in orders]) == family


def test_names_of_orders_stand_clear_of_each_other() -> None:
    def line(order: float, size_nm: float) -> RippleLine:
        at, size = Parameter(order, None), Parameter(size_nm, (0.8 * size_nm, 1.2 * size_nm))
        nothing = Parameter.not_identified("no position")
        return RippleLine(at, at, size, nothing, "undecided", "", 0.0, (), ())

    order = np.linspace(1.0, 200.0, 400)
    lines = tuple(line(o, s) for o, s in ((7.0, 6e-3), (14.0, 2e-3), (12.0, 1.7e-3), (14.6, 1e-3)))
    scanned = np.full(order.size, 1e-3)
    found = Ripple(("a",), True, (), lines, order, scanned, scanned, 2)
    for narrow in (False, True):
        figure = figure_ripple(found, narrow=narrow)
        figure.canvas.draw()
        texts = figure.axes[0].texts
        boxes = [text.get_window_extent() for text in texts]
        assert {"7", "14"} <= {text.get_text() for text in texts}
        assert not any(a.overlaps(b) for a, b in itertools.combinations(boxes, 2))
