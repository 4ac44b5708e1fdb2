"""Features: linear in the curve, the same for every cycle, with the right spread."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.identify.result import Estimate, Quality
from agent.monitor.detection.series import FEATURES
from agent.monitor.history.cycle import Cycle, CycleCurve, cycle_of
from agent.monitor.history.features import SpeedGrid, features_of, grid_of
from tests.unit.monitor.joint import SPEEDS, months
from tests.unit.report.estimate_examples import METADATA, friction_curve


def line(coulomb: float, viscous: float, speed: np.ndarray = SPEEDS) -> CycleCurve:
    return CycleCurve(speed, coulomb + viscous * speed, np.full(speed.size, 0.002))


@given(
    coulomb=st.floats(0.05, 5.0),
    viscous=st.floats(1e-4, 0.1),
    shift=st.floats(0.98, 1.02),
    low=st.floats(5.0, 120.0),
)
def test_a_straight_curve_has_the_features_of_the_line(
    coulomb: float, viscous: float, shift: float, low: float
) -> None:
    grid = grid_of([line(coulomb, viscous)], low)
    # A cycle whose speeds fall elsewhere tells the same of the same line.
    found = features_of(line(coulomb, viscous, SPEEDS * shift), grid).values

    def integral(upto: float) -> float:
        return coulomb * (upto - 2.0) + 0.5 * viscous * (upto**2 - 4.0)

    expected = (coulomb, viscous, integral(140.0), integral(low))
    assert np.allclose([found[name] for name in FEATURES], expected, rtol=1e-9)


def test_deviations_are_those_of_repeated_measurements() -> None:
    rng = np.random.default_rng(1)
    size = np.linspace(0.002, 0.01, SPEEDS.size)
    middle = 0.6 + 0.1 * np.exp(-SPEEDS / 8.0) + 0.01 * SPEEDS
    grid = grid_of([CycleCurve(SPEEDS, middle, size)])
    seen = [
        features_of(CycleCurve(SPEEDS * 1.01, middle + size * e, size), grid)
        for e in rng.standard_normal((600, SPEEDS.size))
    ]
    for name in FEATURES:
        scatter = np.std([f.values[name] for f in seen])
        assert scatter == pytest.approx(seen[0].deviations[name], rel=0.12)
    inside = [
        f.ci95("integral_w")[0] < np.mean([g.values["integral_w"] for g in seen]) for f in seen
    ]
    assert np.mean(inside) == pytest.approx(0.975, abs=0.02)


def test_one_poor_cycle_does_not_narrow_the_common_speeds() -> None:
    whole = [line(0.6, 0.01)] * 5
    poor = CycleCurve(SPEEDS[3:7], np.full(4, 0.7), np.full(4, 0.002))
    grid = grid_of([poor, *whole])
    assert (grid.speed_rad_s[0], grid.speed_rad_s[-1]) == (2.0, 140.0)
    assert not grid.covered_by(poor)
    with pytest.raises(ValueError, match="reaches from 12 to 48 rad/s"):
        features_of(poor, grid)


def test_the_low_speed_part_must_end_inside_the_curve() -> None:
    with pytest.raises(ValueError, match="between 2 and 140 rad/s, got 200"):
        SpeedGrid(SPEEDS, 200.0)


def test_what_is_not_decidable_has_its_reason_and_no_curve() -> None:
    quality = Quality(100, 0, 0, 500.0, 0.0, None)
    estimate = Estimate(("a",), False, ("one direction only",), quality)
    cycle = cycle_of(
        estimate, METADATA, name="a", duration_s=1.0, temperature_degc=20.0, fingerprint="f"
    )
    assert (cycle.curve, cycle.reasons) == (None, ("one direction only",))


def test_metadata_travel_along_and_come_back_from_the_cache() -> None:
    estimate = Estimate(
        ("a",), True, (), Quality(100, 0, 0, 500.0, 0.0, None), friction_curve(gravity_nm=-0.4)
    )
    metadata = {**METADATA, "gearbox_serial": "G-7", "oil": "VG150", "payload_kg": 12}
    cycle = cycle_of(
        estimate, metadata, name="a", duration_s=40.0, temperature_degc=24.0, fingerprint="f"
    )
    assert cycle.parts == {"drive": "123456", "gearbox": "G-7"}
    assert (cycle.oil, cycle.payload_kg) == ("VG150", 12.0)
    assert cycle.load_nm == pytest.approx(0.4)
    assert cycle.started_at == "2026-03-01T02:03:04+00:00"
    for one in (cycle, months(0, 3)[2]):
        assert Cycle.from_json(one.to_json()).to_json() == one.to_json()
