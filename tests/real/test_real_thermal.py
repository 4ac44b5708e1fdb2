"""Temperature in recordings that others made: what they carry, and what they do not."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pyarrow.parquet as pq
import pytest

from agent.cli.identify.thermal import thermal_of
from agent.errors import InputError
from agent.identify.thermal.trend import TIE, temperature_or_time
from agent.record.reading import read_all
from tests.real.test_real_estimates import load

pytestmark = pytest.mark.real


def test_run_in_is_a_tie_of_temperature_and_time(real_recordings: Path) -> None:
    signals = load(real_recordings, "cycloidal-run-in/baseline")
    table = pq.read_table(real_recordings / "cycloidal-run-in" / "baseline.parquet")
    temperature = table["motor_temperature_degc"].to_numpy()
    found = temperature_or_time([signals], [np.asarray(temperature, dtype=np.float64)])
    assert found.verdict == TIE
    assert "equal temperatures while heating and while cooling" in found.sentence
    assert found.r2_temperature == pytest.approx(0.88, abs=0.06)
    assert found.r2_time == pytest.approx(0.89, abs=0.06)


def test_warm_up_under_load_carries_no_cooling_law_and_no_surface(real_recordings: Path) -> None:
    """One recording, one speed, the motor's temperature: every law is refused with a reason."""
    found = thermal_of(read_all([str(real_recordings / "cycloidal-run-in")]), 30.0)
    assert found.sensor == "motor_temperature_degc"
    assert not found.cooling.identified
    assert found.cooling.reason.startswith("not identified")
    assert not found.reaches.identified
    assert not found.surface.identified
    assert found.surface.reason.startswith("not identified")


def test_recordings_without_a_temperature_are_refused(real_recordings: Path) -> None:
    with pytest.raises(InputError, match="None of the recordings has a temperature"):
        thermal_of(read_all([str(real_recordings / "emps" / "estimation.parquet")]), 30.0)
