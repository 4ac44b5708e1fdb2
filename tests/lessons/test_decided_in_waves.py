"""A sum of sines holds no speed, and has no noise floor: what is left may be noise all the same."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.answer.result import Explanation
from agent.explain.explain import explain
from agent.identify.result import Floats
from tests.science.textbook_joint import TWIN, Driven, Extra, recorded, waves


def under_load(driven: Driven) -> Floats:
    """Return friction that grows with the weight on the gear."""
    angle = driven.position_rad / TWIN.gear_ratio
    weight = TWIN.gravity_sin_nm * np.sin(angle) + TWIN.gravity_cos_nm * np.cos(angle)
    return np.asarray(0.08 * np.abs(weight) * np.sign(driven.velocity_rad_s))


def falling_beside_cogging(driven: Driven) -> Floats:
    speed = driven.velocity_rad_s
    falls = 0.12 * np.exp(-np.abs(speed) / 6.0) * np.sign(speed)
    return np.asarray(falls + 0.04 * np.cos(7.0 * driven.position_rad + 0.3))


def bending(driven: Driven) -> Floats:
    """Return friction whose fall is a rational function, as no law of the library is."""
    speed = driven.velocity_rad_s
    return np.asarray(0.15 * np.sign(speed) / (1.0 + (speed / 5.0) ** 2))


def explained(extra: Extra) -> Explanation:
    *fit, held_out = (recorded(waves(seed), extra, 0.004, seed) for seed in range(4))
    return explain(TWIN, fit, [held_out])


@pytest.mark.parametrize(
    ("extra", "names"),
    [
        (under_load, ["load-dependent-friction"]),
        (falling_beside_cogging, ["torque-ripple", "stribeck"]),
    ],
)
def test_what_leaves_noise_is_told_from_what_leaves_more(extra: Extra, names: list[str]) -> None:
    answer = explained(extra)
    assert answer.verdict == "explained", answer.sentence
    assert [finding.effect for finding in answer.findings] == names
    assert not any(finding.alternatives for finding in answer.findings)


def test_a_law_of_another_form_stays_tied() -> None:
    """What a law's own form leaves is no noise, and says nothing against its rival."""
    answer = explained(bending)
    assert answer.verdict == "tied", answer.sentence
