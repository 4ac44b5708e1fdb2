"""What a short warm-up does not tell stands where it usually is, and predicts a warmer day."""

from __future__ import annotations

import math

import numpy as np
import pytest

from agent.explain.numbers.model import predicted
from agent.explain.rows.run import Run
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import NOISE_NM, TWIN, Conditions, record, stair
from trajectories import SetPoints

DECAY_K = 18.0


def thins(points: SetPoints, at: Conditions) -> Floats:
    """Return viscous friction of oil that is thinner by e every 18 K."""
    share = math.exp(-(at.gearbox_degc - 30.0) / DECAY_K) - 1.0
    return np.asarray(0.004 * share * points.velocity_rad_s)


def recorded(*temperatures_degc: float) -> list[Run]:
    cycle = stair((5, 20, 60), 100.0, 12.0)
    return [
        record(cycle, thins, Conditions(degc, 3600.0 * degc**1.7 % 20000.0), k, name=f"run {k}")
        for k, degc in enumerate(temperatures_degc)
    ]


@pytest.mark.parametrize(
    ("temperatures", "identified"), [((28, 29, 30, 31, 32), False), ((20, 32, 44, 56), True)]
)
def test_a_decay_is_the_recordings_or_the_usual_one(
    temperatures: tuple[float, ...], identified: bool
) -> None:
    found = study(TWIN, tabulate(TWIN, recorded(*temperatures)), {"temperature-dependent-friction"})
    (term,) = found.choice.terms
    (numbers,) = found.model.parameters
    assert numbers["decay_k"].identified is identified
    assert term.scored.values()["decay_k"] == pytest.approx(
        DECAY_K if identified else 25.0, rel=0.15
    )
    warm = tabulate(TWIN, recorded(45.0))
    left = warm.target_nm + predicted(warm, TWIN) - predicted(warm, found.extended)
    assert float(np.std(left[warm.used])) < 1.2 * NOISE_NM
