"""The interval decides the digits, the size decides the unit, and no number is invented."""

from __future__ import annotations

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from agent.identify.result import Parameter
from agent.numbers import (
    NO_NUMBER,
    dates_unbroken,
    decimals_for,
    fixed,
    parameter_label,
    parameter_unit,
    scale_for,
    scales_for,
    significant,
    units_unbroken,
    written,
)


@pytest.mark.parametrize(
    ("value", "interval", "factor", "expected"),
    [
        (0.6042, (0.5193, 0.6891), 1.0, ("0.604", "0.519 to 0.689", "0.085")),
        (0.0184, (0.0182, 0.0186), 1e4, ("184.0", "182.0 to 186.0", "2.0")),
        (-3.163, (-3.381, -2.945), 1.0, ("−3.16", "−3.38 to −2.94", "0.22")),
        (95.11, (94.21, 96.01), 1.0, ("95.11", "94.21 to 96.01", "0.90")),
        (12345.0, (12115.0, 12575.0), 1.0, ("12340", "12120 to 12580", "230")),
        (0.00001, (-0.0049, 0.0049), 1.0, ("0.0000", "−0.0049 to 0.0049", "0.0049")),
        (-0.00001, (-0.0049, 0.0049), 1.0, ("0.0000", "−0.0049 to 0.0049", "0.0049")),
    ],
)
def test_value_ends_where_two_digits_of_the_half_width_end(
    value: float, interval: tuple[float, float], factor: float, expected: tuple[str, str, str]
) -> None:
    assert written(Parameter(value, interval), factor) == expected


def test_number_without_interval_has_four_significant_digits() -> None:
    assert written(Parameter(0.123456, None)) == ("0.1235", "", "")
    assert written(Parameter(0.5, (0.5, 0.5))) == ("0.5000", "0.5000 to 0.5000", "")


@given(st.floats(1e-9, 1e9))
def test_half_width_has_two_significant_digits_whatever_its_size(half_width: float) -> None:
    written_width = round(half_width, decimals_for(half_width))
    mantissa = written_width / 10.0 ** (-decimals_for(half_width))
    assert 10 <= round(mantissa) <= 99
    assert written_width == pytest.approx(half_width, rel=0.051)


@given(st.floats(-1e6, 1e6), st.floats(1e-6, 1e3))
def test_written_value_is_the_value_to_within_the_interval_s_last_digit(
    value: float, half_width: float
) -> None:
    text, _, _ = written(Parameter(value, (value - half_width, value + half_width)))
    assert abs(float(text.replace("−", "-")) - value) <= 0.06 * half_width + 1e-9 * abs(value)


@pytest.mark.parametrize("half_width", [0.0, -1.0, math.nan, math.inf])
def test_half_width_that_decides_nothing_is_refused(half_width: float) -> None:
    with pytest.raises(ValueError, match="positive, finite"):
        decimals_for(half_width)


@pytest.mark.parametrize(
    ("unit", "value", "expected"),
    [
        ("N m", 0.604, "N m"),
        ("N m", -0.0107, "mN m"),
        ("N m", 0.000035, "µN m"),
        ("kg m²", 0.0184, "kg cm²"),
        ("kg m²", 95.0, "kg m²"),
        ("kg m²", 2e-6, "g cm²"),
        ("s", 0.00004, "µs"),
        ("rad/s", 0.001, "rad/s"),
        ("N m", 0.0, "N m"),
        ("N m", math.nan, "N m"),
    ],
)
def test_unit_suits_the_size(unit: str, value: float, expected: str) -> None:
    assert scale_for(unit, [value]).unit == expected


def test_numbers_of_one_kind_share_the_unit_of_the_largest() -> None:
    scales = scales_for(
        [
            ("coulomb_nm", Parameter(0.6, (0.5, 0.7))),
            ("torque_offset_nm", Parameter(0.002, (0.0, 0.004))),
            ("gravity_sin_nm", Parameter.not_identified("no position", 4e9)),
        ]
    )
    assert {unit: scale.unit for unit, scale in scales.items()} == {"N m": "N m"}


@pytest.mark.parametrize(
    ("name", "unit", "label"),
    [
        ("viscous_nm_s_per_rad", "N m s/rad", "Viscous friction"),
        ("beta_s_per_rad", "s/rad", "Beta"),
        ("stribeck_velocity_rad_s", "rad/s", "Stribeck velocity"),
        ("exponent", "", "Stribeck exponent"),
        ("spring_stiffness_nm_per_rad", "N m/rad", "Spring stiffness"),
    ],
)
def test_name_carries_unit_and_words(name: str, unit: str, label: str) -> None:
    assert (parameter_unit(name), parameter_label(name)) == (unit, label)


def test_what_is_not_a_number_is_not_written_as_one() -> None:
    assert fixed(math.nan, 2) == NO_NUMBER
    assert significant(math.inf) == NO_NUMBER
    assert significant(0.0) == "0"


def test_number_and_unit_stay_on_one_line() -> None:
    sentence = units_unbroken(
        "friction is 0.604 ± 0.005 N m and 10.7 mN m s/rad at 14 rad/s, 2.0 ms late"
    )
    assert sentence.split(" ") == [
        "friction",
        "is",
        "0.604\u00a0±\u00a00.005\u00a0N\u00a0m",
        "and",
        "10.7\u00a0mN\u00a0m\u00a0s/rad",
        "at",
        "14\u00a0rad/s,",
        "2.0\u00a0ms",
        "late",
    ]


def test_minutes_and_hours_stay_with_their_numbers() -> None:
    told = units_unbroken("in 10 min, or 2.5 h; 3 minutes and 4 hours are words")
    assert told == "in 10\u00a0min, or 2.5\u00a0h; 3 minutes and 4 hours are words"


def test_a_date_in_a_pages_text_stays_on_one_line_and_is_copied_as_it_is() -> None:
    page = (
        "<title>2026-03-01</title><style>/* 2026-03-01 */</style>"
        '<p aria-label="of 2026-03-01">2026-03-01 02:03, and 2026-03-02.</p>'
        '<td>stair-2026-03-01.parquet</td><svg><text>2026-03-01</text></svg><option value="1">'
        "2026-03-01</option>"
    )
    wrapped = [f'<span class="date">2026-03-0{day}</span>' for day in (1, 2)]
    expected = page.replace(
        "2026-03-01 02:03, and 2026-03-02", f"{wrapped[0]} 02:03, and {wrapped[1]}"
    )
    assert dates_unbroken(page) == expected
