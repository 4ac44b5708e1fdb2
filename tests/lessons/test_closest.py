"""What comes closest to the little that is left is said, and what it would take; and no more."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.closest import closest_said
from agent.explain.rows.table import tabulate
from agent.explain.study import study
from agent.identify.result import Floats
from tests.science.explain_joint import NOISE_NM, TWIN, Conditions, record, stair
from trajectories import SetPoints

SPEEDS = (4.0, 8.0, 16.0, 30.0)
RATE_HZ = 500.0


def wandering(count: int, size_nm: float) -> Floats:
    """Return torque that wanders in time, and follows nothing of the motion."""
    rng = np.random.default_rng(6)
    time = np.arange(count) / RATE_HZ
    hertz, phase = rng.uniform(0.15, 0.5, 6), rng.uniform(0.0, 6.28, 6)
    waves = np.sin(2.0 * np.pi * np.outer(hertz, time) + phase[:, np.newaxis])
    return np.asarray(size_nm * np.sum(waves, axis=0) / np.sqrt(3.0))


@pytest.mark.parametrize(("ripple", "said"), [(0.172, True), (0.6, False)])
def test_a_ripple_too_small_for_a_name_beside_what_wanders_is_what_comes_closest(
    ripple: float, said: bool
) -> None:
    def missing(points: SetPoints, _at: Conditions) -> Floats:
        wave = ripple * NOISE_NM * np.cos(points.position_rad)
        return np.asarray(wave + wandering(wave.shape[0], 0.52 * NOISE_NM))

    found = study(TWIN, tabulate(TWIN, [record(stair(SPEEDS), missing, Conditions(), 3)]))
    assert bool(found.choice.terms) != said  # what is large enough has a name
    assert ("torque ripple" in closest_said(found)) == said
