"""`stribeck thermal` on several cycles: heating and cooling, joined by when they started."""

from __future__ import annotations

import json
from collections.abc import Sequence
from datetime import UTC, datetime, timedelta
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from agent.cli.identify.thermal import run_thermal, thermal_of
from agent.cli.identify.thermal_history import history_of
from agent.errors import InputError
from agent.identify.thermal.cooling import estimate_cooling
from agent.physics.thermal import THESIS_OILS
from agent.record.reading import read_all
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from fakes.thermal import Gearbox, ThermalParameters

GEAR = 100.0
SPEEDS = (1.0, 2.0, 4.0, 8.0, 15.0, 30.0, 60.0, 120.0, 200.0)
DAY = datetime(2026, 3, 2, 6, 0, tzinfo=UTC)
RATE_HZ, PASS_S = 100.0, 1.5
OIL = "oil 1"


def friction_nm(
    speed: np.ndarray, temperature_degc: np.ndarray | float, oil: str = OIL
) -> np.ndarray:
    """Return a film's friction in proportion to viscosity, over a dry level: no law of ours."""
    viscosity = THESIS_OILS[oil].viscosity_mm2_s(np.asarray(temperature_degc))
    return np.asarray(0.6 + 0.15 * np.exp(-speed / 6.0) + 2.5e-5 * viscosity * speed)


def cycle(
    path: Path, temperature: np.ndarray, started: datetime | None, seed: int = 0, **extra: Any
) -> str:
    """Write one stair, both ways at every speed; the temperature is one number for every second."""
    rng = np.random.default_rng(seed)
    steps = [sign * v for v in SPEEDS for sign in (1.0, -1.0)]
    velocity = np.repeat(steps, int(PASS_S * RATE_HZ))
    time_s = np.arange(velocity.size) / RATE_HZ
    degc = np.interp(time_s, np.arange(temperature.size), temperature)
    torque = np.sign(velocity) * friction_nm(np.abs(velocity), degc)
    seen = degc + 0.05 * rng.standard_normal(velocity.size)
    columns = {
        "time_s": time_s,
        "position_rad": np.cumsum(velocity) / RATE_HZ,
        "velocity_rad_s": velocity + 1e-3 * rng.standard_normal(velocity.size),
        "torque_nm": torque + 0.01 * rng.standard_normal(velocity.size),
        "gearbox_temperature_degc": np.round(seen, 1),
    }
    stamp = "" if started is None else started.isoformat()
    metadata = Metadata("cell7", 1, GEAR, started_at=stamp, extra=extra)
    write(Recording(columns, metadata, str(path)), path)
    return str(path)


def day_of_cycles(folder: Path) -> list[str]:
    """Warm the fake gearbox up for three hours and let it cool for six; a cycle every hour."""
    gearbox = Gearbox(ThermalParameters(ambient_degc=22.0, initial_degc=24.0, sensor_lag_s=20.0))
    names = []
    for hour in range(9):
        watts = 110.0 if hour < 3 else 0.0
        seconds = []
        for _ in range(3600):
            seconds.append(gearbox.sensor_degc)
            gearbox.step(watts, 1.0)
        # Half an hour after the heat was switched the sensor has caught up with it.
        started = DAY + timedelta(hours=hour, minutes=30)
        own = np.array(seconds[1800:1830])
        names.append(cycle(folder / f"{hour:02}.parquet", own, started, seed=hour))
    return names


def at(degc: float) -> np.ndarray:
    return np.full(30, degc)


@pytest.fixture(scope="module")
def recordings(tmp_path_factory: pytest.TempPathFactory) -> list[str]:
    return day_of_cycles(tmp_path_factory.mktemp("day"))


def document(names: Sequence[str], oil: str = "") -> Any:
    return thermal_of(read_all(names), 30.0, oil).to_json()


@pytest.fixture(scope="module")
def whole_day(recordings: list[str]) -> Any:
    return document(recordings, "1")


def test_cooling_cycles_are_one_curve(recordings: list[str]) -> None:
    history = history_of(read_all(recordings[3:]))
    cooling = estimate_cooling(history.time_s, history.temperature_degc).to_json()
    assert cooling["identified"], cooling["reason"]
    low, high = cooling["parameters"]["rate_per_s"]["ci95"]
    assert low <= 6.2e-5 <= high
    assert high < 1.2 * low
    low, high = cooling["parameters"]["settled_degc"]["ci95"]
    assert low <= 22.0 <= high


def test_heating_and_cooling_are_no_single_law_but_carry_the_surface(whole_day: Any) -> None:
    found = whole_day
    assert not found["cooling"]["identified"]
    assert "take the hours of rest by themselves" in found["cooling"]["reason"]
    assert found["friction_surface"]["identified"]
    assert "temperature-dependent" in found["friction_surface"]["law"]
    # The same temperature comes by while heating and while cooling: no tie is left.
    assert found["temperature_or_time"]["verdict"] == "temperature"


def test_other_oils_are_predicted_by_viscosity(whole_day: Any) -> None:
    oils = whole_day["oils"]
    assert "viscosity alone" in oils["assumption"]
    speed = np.array(oils["speed_rad_s"])
    shown = {o["name"]: o for o in oils["oils"] if not o["reason"]}
    assert set(shown) == set(THESIS_OILS)
    assert [name for name, o in shown.items() if o["in_use"]] == [OIL]
    for name, curve in shown.items():
        truth = friction_nm(speed, oils["temperature_degc"], name)
        np.testing.assert_allclose(curve["friction_nm"], truth, rtol=0.02)
    fastest = [shown[name]["friction_nm"][-1] for name in sorted(shown)]
    assert fastest == sorted(fastest)


def test_the_command_prints_the_same_document(
    recordings: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    run_thermal(recordings[3:4], 30.0, "", None, as_json=True)
    assert json.loads(capsys.readouterr().out) == document(recordings[3:4])


def test_text_and_picture_show_every_oil(
    recordings: list[str], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    picture = tmp_path / "oils.svg"
    run_thermal(recordings, 30.0, "mine=150/18", picture, as_json=False)
    text = capsys.readouterr().out
    assert "mine (in use)" in text
    assert "oil 3" in text
    drawn = picture.read_text()
    for label in ("mine (in use)", "oil 2", "oil 3", "measured, "):
        assert label in drawn


def test_an_oil_without_viscosities_is_asked_for_them(
    recordings: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    run_thermal(recordings[:1], 30.0, "gear grease", None, as_json=False)
    assert "--oil NAME=V40/V100" in capsys.readouterr().out
    with pytest.raises(InputError, match="NAME=V40/V100"):
        run_thermal(recordings[:1], 30.0, "mine=18/150", None, as_json=False)


def test_recordings_of_different_oils_are_refused(tmp_path: Path) -> None:
    names = [
        cycle(tmp_path / f"{oil}.parquet", at(30.0), DAY + timedelta(hours=i), oil=oil)
        for i, oil in enumerate(("oil 1", "oil 2"))
    ]
    with pytest.raises(InputError, match="different oils: oil 1, oil 2"):
        run_thermal(names, 30.0, "", None, as_json=False)


def test_overlapping_recordings_are_refused(tmp_path: Path) -> None:
    names = [
        cycle(tmp_path / f"{i}.parquet", at(30.0), DAY + timedelta(seconds=10 * i))
        for i in range(2)
    ]
    with pytest.raises(InputError, match=r"0\.parquet and 1\.parquet overlap in time by 17 s"):
        run_thermal(names, 30.0, "", None, as_json=False)


@pytest.mark.parametrize("started", [None, datetime(1970, 1, 1, tzinfo=UTC)])
def test_recordings_without_a_clock_carry_the_surface_and_no_curve(
    tmp_path: Path, started: datetime | None
) -> None:
    names = [
        cycle(tmp_path / f"{i}.parquet", at(25.0 + 5.0 * i), started, seed=i) for i in range(5)
    ]
    found = document(names)
    assert "5 (0.parquet, 1.parquet and 3 more) of 5 recordings" in found["cooling"]["reason"]
    assert found["reaches"]["at_s"]["value"] is None
    assert found["friction_surface"]["identified"]
