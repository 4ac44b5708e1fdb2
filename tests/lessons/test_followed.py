"""A wave that passes faster than half the sampling rate is in no torque that samples show."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.physics.periodic import followed, wave
from agent.physics.twin import Effect, Twin
from tests.science.explain_plant import GEAR, Joint, record

EVERY = 5  # recorded with 100 Hz: nine waves a turn are followed up to 35 of 80 rad/s
ORDER, WAVE_NM = 9.0, 0.15
TWIN = Twin("plant", 1, GEAR, 0.006, 0.5, 0.004, 0.5, 0.2)


def test_friction_along_the_turn_is_named_where_fast_motion_only_shows_its_image() -> None:
    joint = Joint(rubbing_wave=WAVE_NM, rubbing_order=ORDER)
    runs = [record(joint, seed, every=EVERY) for seed in range(1, 6)]
    answer = explain(TWIN, runs[:4], runs[4:])
    (found,) = answer.findings
    assert (answer.verdict, found.effect) == ("explained", "position-dependent-friction")
    assert found.parameters["cos_nm"].value == pytest.approx(WAVE_NM, rel=0.02)
    assert found.parameters["order_per_arm_rev"].value == pytest.approx(ORDER * GEAR, rel=1e-4)
    assert answer.twin is not None
    assert explain(answer.twin, runs[:4], runs[4:]).verdict == "no-mismatch"


def test_samples_of_a_waves_slow_image_are_left_out_where_the_loop_holds_a_part_of_it() -> None:
    joint = Joint(rubbing_wave=0.25, rubbing_order=ORDER)
    runs = [record(joint, seed, every=EVERY) for seed in range(1, 6)]
    answer = explain(TWIN, runs[:4], runs[4:])
    assert answer.verdict == "explained"
    assert [found.effect for found in answer.findings] == ["position-dependent-friction"]
    assert answer.extended.rmse_nm < 1.2 * answer.floor.value_nm  # with its image 3.7 times
    assert any("slow image" in reason for reason in answer.reasons)
    assert answer.twin is not None
    assert explain(answer.twin, runs[:4], runs[4:]).verdict == "no-mismatch"


def test_an_image_is_left_out_before_what_is_left_may_pass_for_louder_noise(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr("agent.explain.left.is_noise_in_kind", lambda *_: True)
    joint = Joint(rubbing_wave=0.2, rubbing_order=ORDER)  # with its image 1.2 times the noise
    runs = [record(joint, seed, every=EVERY) for seed in range(1, 6)]
    answer = explain(TWIN, runs[:4], runs[4:])
    assert [found.effect for found in answer.findings] == ["position-dependent-friction"]
    assert answer.extended.rmse_nm < 1.1 * answer.floor.value_nm
    assert any("slow image" in reason for reason in answer.reasons)


@pytest.mark.parametrize(
    ("effect", "numbers"),
    [
        ("torque-ripple", {"cos_nm": 0.1, "sin_nm": 0.0}),
        ("position-dependent-friction", {"cos_nm": 0.1, "sin_nm": 0.0}),
        ("kinematic-error", {"cos_rad": 0.01, "sin_rad": 0.0, "arm_inertia_kg_m2": 0.003}),
        ("resolver-error", {"cos_rad": 0.01, "sin_rad": 0.0}),
    ],
)
def test_a_twin_adds_nothing_where_its_samples_cannot_follow(
    effect: str, numbers: dict[str, float]
) -> None:
    period_s = 0.01
    time = period_s * np.arange(2000)
    velocity = 80.0 * np.sin(0.9 * time)
    motion = {
        "velocity_rad_s": velocity,
        "acceleration_rad_s2": 72.0 * np.cos(0.9 * time),
        "position_rad": 80.0 / 0.9 * (1.0 - np.cos(0.9 * time)),
        "time_s": time,
    }
    entry = Effect(effect, {"order_per_motor_rev": ORDER, **numbers})
    added = replace(TWIN, effects=(entry,)).predict_torque(**motion) - TWIN.predict_torque(**motion)
    slow = followed(ORDER, velocity, period_s) > 0.0
    assert 0.2 < slow.mean() < 0.8
    np.testing.assert_allclose(added[~slow], 0.0, atol=1e-12)
    assert np.std(added[slow]) > 1e-3
    if effect == "torque-ripple":
        expected = wave(0.1, 0.0, ORDER, motion["position_rad"])
        np.testing.assert_allclose(added[slow], expected[slow], atol=1e-12)
