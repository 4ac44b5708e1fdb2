"""A hold-out with another load, of another day or in another unit is told as that."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.proof import Compared
from agent.explain.rows.run import Run
from agent.explain.rows.table import BASE
from agent.explain.unlike import held_out_apart
from agent.identify.result import Floats
from tests.science.explain_joint import Conditions, record, stair
from trajectories import SetPoints

NOISE_NM = 0.01


def _no_effect(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.zeros_like(points.position_rad)


@pytest.fixture(scope="module")
def run() -> Run:
    return record(stair((6.0, 20.0, 50.0)), _no_effect, Conditions(), 0)


def _said(run: Run, numbers: dict[str, float], held_out: Run | None = None) -> str:
    rng = np.random.default_rng(5)
    base = rng.standard_normal((3000, len(BASE)))
    left = NOISE_NM * rng.standard_normal(3000)
    left += sum(base[:, BASE.index(name)] * value for name, value in numbers.items())
    compared = Compared(left, left, left, left, np.arange(3000) // 100, base)
    return held_out_apart(compared, 1.2 * NOISE_NM, NOISE_NM, [run], [held_out or run])


@pytest.mark.parametrize(
    ("numbers", "says"),
    [
        ({}, ""),
        ({"gravity_cos_nm": 0.01}, ""),  # hardly more than the noise
        ({"gravity_cos_nm": 0.02}, "explain it among them"),  # of which kind, it does not prove
        ({"gravity_cos_nm": 0.2, "inertia_kg_m2": 0.1}, "another inertia and gravity"),
        ({"coulomb_nm": 0.1, "viscous_nm_s_per_rad": 0.1}, "another friction"),
        ({"coulomb_nm": 0.1, "gravity_cos_nm": 0.1}, "explain it among them"),
    ],
)
def test_what_only_the_hold_out_has_more_of_is_told(
    run: Run, numbers: dict[str, float], says: str
) -> None:
    """621 times the noise on unseen data of 6 kg more had stood there without a word."""
    assert says in _said(run, numbers)
    assert bool(_said(run, numbers)) is bool(says)


def test_a_hold_out_in_degrees_is_told_as_that(run: Run) -> None:
    signals = run.signals
    assert signals.position_rad is not None
    assert signals.velocity_rad_s is not None
    degrees = replace(
        signals,
        name="held.csv",
        position_rad=np.degrees(signals.position_rad),
        velocity_rad_s=np.degrees(signals.velocity_rad_s),
    )
    said = _said(run, {"inertia_kg_m2": 0.1}, replace(run, signals=degrees))
    assert said == "held.csv is as the others if its motion is in degrees: convert it first"
