"""A prescribed motion with corners, where torque jumps between two samples: that is no finding."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.rows.corners import with_corners
from agent.explain.rows.run import CORNERS, Run
from agent.identify.result import Floats
from agent.physics.derivative import slope
from tests.science.textbook_joint import TWIN, Driven, Extra, nothing, recorded, stair, steps

SPEEDS_RAD_S = (4.0, 8.0, 15.0, 28.0, 50.0)


def runs(extra: Extra, noise_nm: float = 0.02, rate_hz: float = 500.0) -> list[Run]:
    return [
        recorded(
            stair([(1.0 + 0.07 * seed) * v for v in SPEEDS_RAD_S], rate_hz=rate_hz),
            extra,
            noise_nm,
            seed,
        )
        for seed in range(4)
    ]


@pytest.mark.parametrize("rate_hz", [500.0, 1000.0])
@pytest.mark.parametrize("noise_nm", [0.02, 0.004, 0.0])
def test_a_joint_that_lacks_nothing_lacks_nothing(rate_hz: float, noise_nm: float) -> None:
    *fit, held_out = runs(nothing, noise_nm, rate_hz)
    answer = explain(TWIN, fit, [held_out])
    assert answer.verdict == "no-mismatch", answer.sentence


def bump(driven: Driven) -> Floats:
    """Return a bump of five times the noise at one place of the arm."""
    away = driven.position_rad / 50.0 - 0.1
    return 0.1 * np.exp(-0.5 * (away / 0.02) ** 2)


def test_a_bump_beside_them_has_its_name() -> None:
    *fit, held_out = runs(bump)
    answer = explain(TWIN, fit, [held_out])
    (finding,) = answer.findings
    assert (answer.verdict, finding.effect) == ("explained", "local-fault")
    assert finding.parameters["height_nm"].value == pytest.approx(0.1, rel=0.06)


def stepped(extra: Extra, rate_hz: float, late_s: float) -> list[Run]:
    """Return stairs through close speeds; the drive's own low-pass makes its velocity late."""
    out = []
    for seed in range(4):
        order = np.random.default_rng(seed).permutation(
            [-22.0, -9.0, -5.0, -2.0, 2.0, 5.0, 9.0, 22.0]
        )
        driven = steps(
            [(1.0 + 0.07 * seed) * speed for speed in order],
            acceleration_rad_s2=300.0,
            rate_hz=rate_hz,
        )
        run = recorded(driven, extra, 0.008, seed)
        velocity = np.interp(driven.time_s - late_s, driven.time_s, driven.velocity_rad_s)
        signals = replace(run.signals, velocity_rad_s=velocity)
        out.append(replace(run, signals=signals))
    return out


@pytest.mark.parametrize(("rate_hz", "late_s"), [(250.0, 0.0), (250.0, 0.0008), (500.0, 0.0004)])
def test_ramps_of_few_samples_and_a_late_velocity_hide_nothing(
    rate_hz: float, late_s: float
) -> None:
    """Joints that lack nothing were unexplained, and a fall of seven times the noise as well."""
    *fit, held_out = stepped(nothing, rate_hz, late_s)
    answer = explain(TWIN, fit, [held_out])
    assert answer.verdict in ("no-mismatch", "explained"), answer.sentence
    assert not [f for f in answer.findings if f.effect != "measurement-delay"]
    *fit, held_out = stepped(falling, rate_hz, late_s)
    answer = explain(TWIN, fit, [held_out])
    assert answer.findings[0].effect == "stribeck", answer.sentence
    assert answer.findings[0].parameters["static_extra_nm"].value == pytest.approx(0.06, rel=0.3)


def falling(driven: Driven) -> Floats:
    """Return friction that falls with speed."""
    speed = np.abs(driven.velocity_rad_s)
    return 0.06 * np.sign(driven.velocity_rad_s) * np.exp(-speed / 6.0)


def delayed_by(samples: int) -> Callable[[Run], Run]:
    return lambda run: Run.from_columns(
        {
            "time_s": run.signals.time_s,
            "position_rad": np.asarray(run.signals.position_rad),
            "velocity_rad_s": np.asarray(run.signals.velocity_rad_s),
            "torque_nm": np.roll(run.signals.torque_nm, samples),
        },
        run.signals.gear_ratio,
        name=run.name,
    )


def test_a_torque_that_is_late_is_late_all_the_same() -> None:
    late = delayed_by(3)
    *fit, held_out = [late(run) for run in runs(nothing)]
    answer = explain(TWIN, fit, [held_out])
    (finding,) = answer.findings
    assert finding.effect == "measurement-delay"
    assert finding.parameters["torque_delay_s"].value == pytest.approx(0.006, abs=0.0002)


def acceleration(run: Run) -> Floats:
    (known,) = with_corners([run])
    assert known.signals.velocity_rad_s is not None
    plain = slope(known.signals.velocity_rad_s, 0.002)
    return np.asarray(plain + known.columns.get(CORNERS, 0.0))


def test_the_acceleration_is_the_sampled_one() -> None:
    driven = stair(SPEEDS_RAD_S)
    run = recorded(driven, nothing, 0.002, 0)
    inside = driven.velocity_rad_s != 0.0  # a start has friction's jump beside its own
    error = (acceleration(run) - driven.acceleration_rad_s2)[inside]
    assert np.max(np.abs(error)) < 0.02 * 400.0  # the torque's noise is a hundredth of its jumps


def test_a_filtered_torque_and_a_noisy_speed_leave_it_as_it_was() -> None:
    run = recorded(stair(SPEEDS_RAD_S), nothing, 0.002, 0)
    signals = run.signals
    columns = {
        "time_s": signals.time_s,
        "position_rad": np.asarray(signals.position_rad),
        "velocity_rad_s": np.asarray(signals.velocity_rad_s),
        "torque_nm": signals.torque_nm,
    }
    smooth = np.convolve(signals.torque_nm, np.full(5, 0.2), mode="same")
    noise = np.random.default_rng(0).standard_normal(smooth.shape[0])
    for other in (
        {"torque_nm": smooth},
        {"velocity_rad_s": columns["velocity_rad_s"] + 0.3 * noise},
    ):
        (known,) = with_corners([Run.from_columns({**columns, **other}, 50.0, name="other")])
        assert CORNERS not in known.columns


def test_lost_rows_leave_the_corners_that_are_not_beside_them_as_they_were() -> None:
    """Fifteen of eight thousand made a joint that lacks nothing unexplained."""
    run = runs(nothing, rate_hz=250.0)[0]
    count = run.signals.time_s.shape[0]
    lost = np.random.default_rng(1).choice(np.arange(20, count - 20), 15, replace=False)
    kept = np.setdiff1d(np.arange(count), lost)
    thinner = Run.from_columns(
        {
            name: np.asarray(getattr(run.signals, name))[kept]
            for name in ("time_s", "position_rad", "velocity_rad_s", "torque_nm")
        },
        run.signals.gear_ratio,
        name=run.name,
    )
    (whole,), (holed,) = with_corners([run]), with_corners([thinner])
    away = np.min(np.abs(kept[:, np.newaxis] - lost), axis=1) > 8
    there = whole.columns[CORNERS][kept][away]
    same = np.isclose(holed.columns[CORNERS][away], there, atol=1e-6)
    assert np.count_nonzero(there) > 80
    assert np.mean(same[there != 0.0]) > 0.85
