"""A soft gear behind a motion that is measured with noise: its numbers are not bent by that."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.choice import choose
from agent.explain.choosing.search import Library
from agent.explain.forms import arm
from agent.explain.numbers.intervals import with_intervals
from agent.explain.numbers.model import fit_model
from agent.explain.numbers.unshaken import unshaken
from agent.explain.rows.evidence import weigh
from agent.explain.rows.motion_noise import drawn_noise_rad_s
from agent.explain.rows.refit import refit
from agent.explain.rows.run import Run
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, Table, tabulate
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Twin
from tests.science.explain_plant import GEAR, RATE_HZ, Joint, record

TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)
SOFT = Joint(stiffness=40.0, damping=0.04)
NOISE_RAD_S = 0.01  # beside as much that it has
SWING_HZ = float(np.sqrt(SOFT.stiffness / SOFT.arm_inertia)) / (2.0 * np.pi)

Numbers = Mapping[str, Parameter]


def with_noise(run: Run, velocity_rad_s: Floats) -> Run:
    """Return a run whose velocity has so much noise beside what it had."""
    own = run.signals.velocity_rad_s
    assert own is not None
    return replace(run, signals=replace(run.signals, velocity_rad_s=own + velocity_rad_s))


def table_of(*, fine: bool) -> Table:
    """Return recordings whose velocity is noisy; or finely measured, by the position alone."""
    rng = np.random.default_rng(5)
    runs = [record(SOFT, seed, noise_nm=0.01) for seed in (3, 4)]
    if fine:
        return tabulate(
            TWIN, [replace(r, signals=replace(r.signals, velocity_rad_s=None)) for r in runs]
        )
    noise = [np.asarray(NOISE_RAD_S * rng.standard_normal(r.signals.time_s.shape[0])) for r in runs]
    return tabulate(TWIN, [with_noise(r, own) for r, own in zip(runs, noise, strict=True)])


def numbers(*, fine: bool) -> tuple[Numbers, Numbers]:
    """Return what least squares say of the arm, and what is left of that without the noise."""
    table = table_of(fine=fine)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    scene = Scene(table, theta, np.where(table.used, left, 0.0), given=theta - delta)
    springs = list(arm.FORMS)
    library = Library.of(scene, weigh(table, left), springs)
    choice = choose(library)
    model = with_intervals(library, fit_model(library, TWIN, choice.terms))
    return model.parameters[0], unshaken(library, model).get(0, {})


def stiffness(found: Numbers) -> float:
    swing = 2.0 * np.pi * found["antiresonance_hz"].value
    return float(found["arm_inertia_kg_m2"].value * swing**2)


def off(found: Numbers) -> float:
    return abs(stiffness(found) / SOFT.stiffness - 1.0)


def test_a_spring_that_noise_has_softened_is_as_stiff_as_it_is() -> None:
    bent, freed = numbers(fine=False)
    assert stiffness(bent) < 0.75 * SOFT.stiffness
    assert off(freed) < 0.1
    for name, true in (("arm_inertia_kg_m2", SOFT.arm_inertia), ("antiresonance_hz", SWING_HZ)):
        ci = freed[name].ci95
        assert ci is not None
        assert ci[0] < true < ci[1]


def test_behind_a_fine_encoder_its_numbers_hardly_move() -> None:
    bent, freed = numbers(fine=True)
    assert off(bent) < 0.15
    assert stiffness(freed or bent) == pytest.approx(stiffness(bent), rel=0.1)


@pytest.mark.parametrize("differenced", [False, True])
def test_noise_is_drawn_as_the_velocity_has_it(differenced: bool) -> None:
    rng = np.random.default_rng(1)
    runs = [record(Joint(), 1, noise_nm=0.02)]
    white = 0.05 * rng.standard_normal(runs[0].signals.time_s.shape[0] + 1)
    noise = np.diff(white) if differenced else white[1:]
    drawn = drawn_noise_rad_s(tabulate(TWIN, [with_noise(runs[0], noise)]), rng)
    for low_hz, high_hz in ((5.0, 40.0), (60.0, 0.48 * RATE_HZ)):
        assert power(drawn, low_hz, high_hz) == pytest.approx(
            power(noise, low_hz, high_hz), rel=0.35
        )


def power(signal: Floats, low_hz: float, high_hz: float) -> float:
    """Return the mean square in a band of frequencies."""
    hertz = np.fft.rfftfreq(signal.shape[0], 1.0 / RATE_HZ)
    inside = (hertz >= low_hz) & (hertz <= high_hz)
    return float(np.mean(np.abs(np.fft.rfft(signal)[inside]) ** 2) / signal.shape[0])
