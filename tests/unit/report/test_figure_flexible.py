"""The picture of a flexible joint: what is measured, what is fitted, where both can be trusted."""

from __future__ import annotations

import dataclasses
import math

import numpy as np
import pytest
from matplotlib.axes import Axes

from agent.identify.flexible.chain import Chain
from agent.identify.flexible.fit import Options, refused
from agent.identify.flexible.result import FlexibleFit
from agent.identify.flexible.simulation import FlexibleJoint
from agent.identify.result import Parameter
from agent.identify.signals.arrays import Signals
from agent.report.figures.flexible import figure_flexible
from agent.report.figures.flexible_view import (
    Response,
    Stretch,
    measured_response,
    model_response,
    telling_stretch,
)
from tests.science.flexible_plant import PLAIN, drive, stair, triangle_wave


def known_fit() -> FlexibleFit:
    """Return a fit that has found the simulated joint exactly."""
    friction = PLAIN.friction.coulomb_nm, PLAIN.friction.viscous_nm_s_per_rad
    chain = Chain(
        (PLAIN.arm_inertia_kg_m2,), (PLAIN.spring_nm_per_rad,), (PLAIN.damper_nm_s_per_rad,)
    )
    names = refused(Options(), ["nothing yet"]).parameters
    return FlexibleFit(
        "two-mass",
        "coulomb-viscous",
        True,
        (),
        {name: Parameter(0.0, (-1e-6, 1e-6)) for name in names},
        cutoff_hz=60.0,
        gear_ratio=PLAIN.gear_ratio,
        joint=FlexibleJoint(PLAIN.motor_inertia_kg_m2, chain, *friction, gear_ratio=224.0),
        rigid=FlexibleJoint(PLAIN.inertia_kg_m2, None, *friction, gear_ratio=224.0),
    )


FIT = known_fit()


@pytest.fixture(scope="module")
def wave() -> Signals:
    return drive(triangle_wave(4), noise_nm=0.005, name="wave")


@pytest.fixture(scope="module")
def response(wave: Signals) -> Response:
    return measured_response(FIT, [wave], math.nan)


@pytest.fixture(scope="module")
def stretch(wave: Signals) -> Stretch:
    return telling_stretch(FIT, wave)


def line(axes: Axes, label: str) -> np.ndarray:
    (found,) = (one for one in axes.get_lines() if one.get_label() == label)
    return np.asarray(found.get_ydata(), dtype=np.float64)


def test_the_model_has_its_dip_and_peak_where_the_joint_swings() -> None:
    assert FIT.joint is not None
    hz = np.geomspace(0.1, 1000.0, 20_001)
    size = np.abs(model_response(FIT.joint, hz))
    assert size[0] == pytest.approx(1.0 / PLAIN.inertia_kg_m2, rel=1e-3)
    assert size[-1] == pytest.approx(1.0 / PLAIN.motor_inertia_kg_m2, rel=1e-3)
    assert hz[size.argmin()] == pytest.approx(PLAIN.locked_frequency_hz, rel=0.01)
    assert hz[size.argmax()] == pytest.approx(PLAIN.resonance_frequency_hz, rel=0.01)


def test_the_measured_response_is_the_joints_own(response: Response) -> None:
    assert FIT.joint is not None
    low, high = response.excited_hz()
    assert low < 2.0
    assert high > 2.0 * PLAIN.resonance_frequency_hz
    model = model_response(FIT.joint, response.frequency_hz)
    # Windowed segments blur the sharp dip and peak; away from them the lines must agree.
    hz = response.frequency_hz
    away = (hz < 6.0) | ((hz > 16.0) & (hz < 40.0))
    kept = response.clear & away
    assert kept.sum() > 20
    ratio = np.abs(response.acceleration_per_nm[kept]) / np.abs(model[kept])
    assert abs(float(np.median(ratio)) - 1.0) < 0.05
    assert np.quantile(np.abs(ratio - 1.0), 0.9) < 0.3


def test_noise_ends_the_band(wave: Signals, response: Response) -> None:
    loud = dataclasses.replace(
        wave,
        torque_nm=wave.torque_nm
        + 2.0 * np.random.default_rng(0).standard_normal(wave.torque_nm.size),
    )
    heard = measured_response(FIT, [loud], math.nan)
    assert heard.clear.sum() < 0.7 * response.clear.sum()
    assert np.median(heard.relative_error) > 5.0 * np.median(response.relative_error)


def test_the_stretch_is_the_one_that_tells(stretch: Stretch) -> None:
    inside = np.isfinite(stretch.measured_nm)
    assert 0.6 < inside.mean() < 1.0, "standstill is left out, and only that"
    flexible = (stretch.measured_nm - stretch.flexible_nm)[inside]
    rigid = (stretch.measured_nm - stretch.rigid_nm)[inside]
    assert np.sqrt(np.mean(flexible**2)) < 0.1 * np.sqrt(np.mean(rigid**2))
    length_s = stretch.time_s[-1] - stretch.time_s[0]
    assert length_s == pytest.approx(14.0 / PLAIN.locked_frequency_hz, rel=0.05)
    steps = drive(stair(), noise_nm=0.0, name="stair")
    assert telling_stretch(FIT, steps, 1.0).time_s[-1] == pytest.approx(1.0, abs=0.02)
    still = dataclasses.replace(
        steps,
        position_rad=np.zeros(steps.time_s.size),
        velocity_rad_s=np.zeros(steps.time_s.size),
    )
    with pytest.raises(ValueError, match="never moving"):
        telling_stretch(FIT, still)


@pytest.mark.parametrize("narrow", [False, True])
def test_every_panel_says_what_it_shows(response: Response, stretch: Stretch, narrow: bool) -> None:
    figure = figure_flexible(FIT, response, stretch, unseen=True, narrow=narrow)
    magnitude, phase, torque, residual = figure.axes
    assert all(axes.get_title(loc="left") for axes in figure.axes)
    assert [a.get_ylabel() for a in figure.axes] == ["rad/s² per N m", "degrees", "N m", "N m"]
    assert phase.get_xlabel() == "frequency, Hz (logarithmic)"
    marks = " ".join(text.get_text() for text in magnitude.texts)
    assert "antiresonance\n8.01 Hz" in marks
    assert "resonance\n11.8 Hz" in marks.replace("antiresonance", "")
    model = line(magnitude, "flexible, fitted")
    assert model.max() > 5.0 * line(magnitude, "rigid").max()
    assert magnitude.get_ylim()[1] > model.max()
    assert line(torque, "flexible").size == stretch.time_s.size
    legend = residual.get_legend()
    assert legend is not None
    said = [text.get_text() for text in legend.get_texts()]
    assert any(s.startswith("rigid: 0.") for s in said)
    assert any(s.startswith("flexible: 0.0") for s in said)
    for axes in figure.axes:
        assert axes.get_xlim()[0] < axes.get_xlim()[1]


def test_nothing_is_drawn_of_nothing(response: Response, stretch: Stretch) -> None:
    nothing = refused(Options(), ["the joint stands still"])
    with pytest.raises(ValueError, match="the joint stands still"):
        figure_flexible(nothing, response, stretch, unseen=False)
