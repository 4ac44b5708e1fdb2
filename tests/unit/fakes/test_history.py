"""The simulated months: the same for the same seed, and with the physics that their plan says."""

from __future__ import annotations

import datetime
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.identify.estimate import estimate
from agent.identify.signals.arrays import Signals
from agent.record.reading import read_all
from fakes.history import Climate, HistoryPlan, OilChange, Swap, Wear, cycles, ordinary_runs


def test_the_same_seed_gives_the_same_history_and_another_seed_another() -> None:
    one, same = (list(cycles(HistoryPlan(cycles=3, seed=4))) for _ in range(2))
    other = list(cycles(HistoryPlan(cycles=3, seed=5)))
    for a, b, c in zip(one, same, other, strict=True):
        assert a.metadata == b.metadata
        assert all(np.array_equal(a.columns[k], b.columns[k]) for k in a.columns)
        assert not np.array_equal(a.columns["torque_nm"], c.columns["torque_nm"])


def test_wear_raises_the_curve_at_low_speed_and_leaves_it_at_high_speed() -> None:
    plan = HistoryPlan(cycles=1, repeatability=0.0)
    worn = HistoryPlan(
        cycles=1, repeatability=0.0, events=(Wear(-60.0, days=60.0, low_speed_nm=0.3),)
    )
    curves = []
    for p in (plan, worn):
        run = next(cycles(p))
        found = estimate([Signals.from_columns(run.columns, p.joint.gear_ratio)])
        assert found.friction_curve is not None
        curves.append(found.friction_curve)
    speed, rise = curves[0].velocity_rad_s, curves[1].friction_nm - curves[0].friction_nm
    truth = 0.3 * np.exp(-((speed / 60.0) ** 2))
    assert np.all(np.abs(rise - truth) < 0.01)
    assert run.label["low_speed_rise_nm"] == pytest.approx(0.3)


@settings(max_examples=20, deadline=None)
@given(st.floats(0.0, 200.0), st.floats(0.0, 500.0), st.floats(1.0, 3.0))
def test_wear_never_shrinks_with_age_nor_grows_with_speed(
    day: float, speed: float, power: float
) -> None:
    wear = Wear(30.0, power=power, everywhere_nm=0.05)
    at = np.array([speed, speed + 10.0])
    now, later = wear.rise_nm(day, at), wear.rise_nm(day + 5.0, at)
    assert np.all(later >= now)
    assert now[1] <= now[0]
    assert day > 30.0 or not np.any(now)


def test_the_gearbox_follows_the_season_and_is_never_colder_than_its_hall() -> None:
    climate = Climate(season_degc=8.0, weather_degc=0.0, rest_spread_h=0.0)
    rng = np.random.default_rng(1)
    hall = climate.ambient_degc(np.array([20.0, 203.0]), rng)
    assert hall[1] - hall[0] == pytest.approx(16.0, abs=0.1)
    warmth = climate.gearbox_degc(hall, rng) - hall
    assert warmth == pytest.approx(12.0 * np.exp(-6.2e-5 * 4.0 * 3600.0))


def test_a_swap_and_an_oil_change_are_in_the_metadata_and_end_the_wear() -> None:
    plan = HistoryPlan(
        cycles=4,
        first=datetime.date(2024, 7, 1),
        events=(OilChange(1.0), Swap(2.0), Wear(0.0, days=1.0)),
    )
    runs = list(cycles(plan))
    assert [r.metadata["oil"] for r in runs] == ["oil-1", "oil-2", "oil-2", "oil-2"]
    assert [r.metadata["gearbox_serial"] for r in runs] == ["G-0001"] * 2 + ["G-0002"] * 2
    assert [r.label["low_speed_rise_nm"] > 0 for r in runs] == [False, True, False, False]
    assert runs[0].metadata["started_at"].startswith("2024-07-01T02:00:00")


def test_ordinary_work_is_of_the_same_nights() -> None:
    plan = HistoryPlan(cycles=2, seed=3)
    nights = [r.label["gearbox_degc"] for r in cycles(plan)]
    work = list(ordinary_runs(plan))
    assert [r.label["gearbox_degc"] for r in work] == nights
    assert np.ptp(work[0].columns["position_rad"]) > 100.0


def test_the_command_writes_recordings_that_the_reader_takes(tmp_path: Path) -> None:
    from typer.testing import CliRunner

    from agent.cli.app import app

    out = tmp_path / "history"
    done = CliRunner().invoke(app, ["fake-history", str(out), "--cycles", "2", "--work"])
    assert done.exit_code == 0, done.output
    read = read_all([str(out), str(out / "work")])
    assert [r.metadata.trajectory["name"] for r in read] == ["stair-between"] * 2 + ["work"] * 2
    again = CliRunner().invoke(app, ["fake-history", str(out), "--cycles", "2"])
    assert again.exit_code != 0
