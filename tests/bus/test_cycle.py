"""The product on a real CAN bus: a short stair at 500 Hz, every SYNC answered, friction found."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

from agent.record.reading import read
from fakes.specification import FakeSpecification
from tests.bus.vcan import Vcan
from tests.conftest import REPOSITORY

pytestmark = [pytest.mark.bus, pytest.mark.real_time]

RATE_HZ = 500.0


def test_a_cycle_on_vcan_loses_nothing_and_finds_the_friction(vcan: Vcan, tmp_path: Path) -> None:
    command = [sys.executable, "-m", "tests.bus.cycle", "--channel", vcan.channel]
    done = vcan.run([*command, "--out", str(tmp_path)], 120.0, cwd=REPOSITORY)
    assert done.returncode == 0, done.stderr

    (path,) = tmp_path.glob("*.parquet")
    recording = read(path)
    assert recording.metadata.samples_lost == 0
    account = recording.metadata.extra["acquisition"]
    assert (account["reader"], account["stamps"]) == ("process", "kernel")
    assert account["received"] == account["expected"] > 0.95 * 12.0 * RATE_HZ
    assert account["dropped_by_kernel"] == 0
    steps = np.diff(recording.columns["time_s"])
    assert np.median(steps) == pytest.approx(1.0 / RATE_HZ, rel=0.02)
    assert recording.columns["time_s"].size > 0.95 * 12.0 * RATE_HZ

    estimate = json.loads(done.stdout)
    assert estimate["decidable"], estimate["reasons"]
    assert estimate["quality"]["samples_lost"] == 0
    temperature = recording.columns["gearbox_temperature_degc"]
    truth = FakeSpecification().joint.friction.truth(float(np.median(temperature)))
    # The curve, not a law: five speeds of a short stair do not always tell one law from another.
    curve = estimate["friction_curve"]
    speed = np.array(curve["velocity_rad_s"])
    extra = np.exp(-((speed / truth.stribeck_velocity_rad_s) ** truth.exponent))
    expected = truth.coulomb_nm + truth.viscous_nm_s_per_rad * speed + truth.static_extra_nm * extra
    assert speed.size == 5
    np.testing.assert_allclose(curve["friction_nm"], expected, rtol=0.02)
