"""A number that varies along an axis, where no law of the library carries a mismatch."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.explain.answer.as_if import as_if
from agent.explain.answer.located import Region, Varying
from agent.explain.location.varying import Bins, varying
from agent.identify.result import Floats

FLOOR_NM = 0.02
ROW_S = 0.01
TIME_S: Floats = np.arange(4000, dtype=np.float64) * ROW_S
SIGN: Floats = np.sign(np.sin(2.0 * np.pi * TIME_S / 3.7))


def left_of(more: Floats, seed: int) -> Floats:
    """Return what refitted friction leaves where it differs by `more`, with noise."""
    noise = FLOOR_NM * np.random.default_rng(seed).standard_normal(TIME_S.size)
    left = SIGN * more + noise
    return np.asarray(left - SIGN * float(SIGN @ left) / TIME_S.size)


def along_time(left: Floats) -> Varying | None:
    bins = Bins.of("time_s", TIME_S)
    assert bins is not None
    return varying(bins, "coulomb_nm", SIGN, left, FLOOR_NM, 1.0, ROW_S)


@settings(max_examples=40, deadline=None)
@given(
    st.floats(0.0, 30.0),
    st.floats(6.0, 15.0),
    st.floats(0.08, 1.0),
    st.booleans(),
    st.integers(0, 9999),
)
def test_a_drag_for_less_than_half_of_the_time_is_where_it_is_and_as_large(
    begins_s: float, lasts_s: float, size_nm: float, less: bool, seed: int
) -> None:
    """Refitted, friction is too small in it and too large beside it: neither is the place alone."""
    ends_s = min(begins_s + lasts_s, 40.0)
    inside = np.clip(TIME_S, begins_s, ends_s) == TIME_S
    size_nm *= -1.0 if less else 1.0
    found = along_time(left_of(np.where(inside, size_nm, 0.0), seed))
    assert found is not None
    bin_s = 40.0 / 30.0
    assert found.regions[0].lower == pytest.approx(begins_s, abs=1.1 * bin_s)
    assert found.regions[0].upper == pytest.approx(ends_s, abs=1.1 * bin_s)
    assert found.amounts[0] == pytest.approx(size_nm, rel=0.3)  # bins at its ends are half of it
    assert found.share > 0.7


@pytest.mark.parametrize("seed", range(20))
def test_noise_varies_with_nothing(seed: int) -> None:
    assert along_time(left_of(np.zeros(TIME_S.size), seed)) is None


def test_what_would_vary_is_told_with_its_place_its_unit_and_what_it_carries() -> None:
    slow, late = Region("velocity_rad_s", 7.0, 18.0), Region("time_s", 0.4, 9.4)
    none = np.zeros(0)

    def said(number: str, *places: tuple[Region, float]) -> str:
        regions, amounts = tuple(r for r, _ in places), tuple(a for _, a in places)
        return as_if(Varying(number, "time_s", 0.94, none, none, none, regions, amounts))

    assert said("coulomb_nm", (late, 0.11)) == (
        "It is as if Coulomb friction were 0.11 N m more at times from 0.4 to 9.4 s than "
        "usual: varying so it would carry 94 % of it."
    )
    assert "viscous friction were 1.2 mN m s/rad less at motor speeds from 7 to 18 rad/s" in said(
        "viscous_nm_s_per_rad", (slow, -0.0012), (late, 0.0008)
    )
    assert "all of the torque were 12 % less at times" in said("scale", (late, -0.12))
    assert said("offset", (late, -0.11)).startswith(
        "It is as if there were another −0.11 N m of torque at times from 0.4 to 9.4 s: varying so"
    )


def test_an_inertia_is_usual_where_it_makes_a_torque() -> None:
    """It had been usual at steady speeds, where noise says what it is, and tenfold elsewhere."""
    random = np.random.default_rng(4)
    swing = np.where(random.random(TIME_S.size) < 0.3, 300.0, 4.0)
    acceleration = swing * np.sin(2.0 * np.pi * TIME_S / 3.7)
    left = -2e-4 * acceleration + FLOOR_NM * random.standard_normal(TIME_S.size)
    steady = np.abs(acceleration) < 4.0
    left[steady] += 5e-3 * acceleration[steady]  # the torque's own hysteresis, say
    bins = Bins.of("acceleration_rad_s2", acceleration)
    assert bins is not None
    found = varying(bins, "inertia_kg_m2", acceleration, left, FLOOR_NM, 1.0, ROW_S)
    assert found is not None
    assert all(-10.0 < region.lower < region.upper < 10.0 for region in found.regions)
