"""What is left where no speed is held, and nobody knows how loud noise is."""

from __future__ import annotations

from functools import partial

import numpy as np
import pytest
from scipy.signal import lfilter

from agent.explain.answer.result import Verdict
from agent.explain.explain import explain
from agent.identify.result import Floats
from tests.science.textbook_joint import TWIN, Driven, recorded, waves

REMEMBERS_S, NOISE_NM = 0.1, 0.004


def beside(noise_nm: Floats, driven: Driven) -> Floats:
    """Return a torque that follows nothing of the motion."""
    del driven
    return noise_nm


@pytest.mark.parametrize(
    ("slow_nm", "verdict"), [(0.05, "unexplained"), (0.01, "no-mismatch")], ids=["10 %", "2 %"]
)
def test_a_tenth_of_the_torque_that_remembers_itself_is_no_agreement(
    slow_nm: float, verdict: Verdict
) -> None:
    """A simulation "agreed" whose arm rings with 10 % of the torque, and the joint's does not."""

    def slow(seed: int) -> Floats:
        kept = np.exp(-0.002 / REMEMBERS_S)
        drawn = np.random.default_rng(seed).standard_normal(waves(0).time_s.size)
        return np.asarray(slow_nm * lfilter([np.sqrt(1.0 - kept**2)], [1.0, -kept], drawn))

    runs = [recorded(waves(k), partial(beside, slow(k)), NOISE_NM, k) for k in range(3)]
    answer = explain(TWIN, runs[:2], runs[2:])
    assert not answer.floor.value_nm > 0.0
    assert (answer.verdict, answer.findings) == (verdict, ())
