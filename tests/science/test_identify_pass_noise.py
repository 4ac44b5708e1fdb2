"""Intervals of pass means under noise that remembers for longer than a pass lasts."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest

from agent.identify.friction.pass_blocks import TimedPass
from agent.identify.friction.pass_noise import PassNoise, noise_of
from agent.identify.friction.passes import Pass
from agent.identify.uncertainty import student_975
from tests.science.identify_plant import Floats, coloured

RATE_HZ = 60.0
PASS_S, RAMP_S = 2.0, 0.25
SPEEDS = (2.0, 4.0, 7.0, 12.0, 20.0, 32.0, 48.0, 70.0)


def stair_of_noise(
    rng: np.random.Generator,
    memory_s: float,
    *,
    speeds: Sequence[float] = SPEEDS,
    repeats: int = 1,
    louder: float = 1.0,
) -> tuple[list[TimedPass], Floats]:
    """Return passes of one stair whose friction is zero, and half the difference of directions.

    The noise runs on through the ramps; gravity and an offset lie under it. The third speed is
    `louder` than the others.
    """
    order = [(k, way) for k in range(len(speeds)) for way in (1.0, -1.0)] * repeats
    samples = int(PASS_S * RATE_HZ)
    step = samples + int(RAMP_S * RATE_HZ)
    noise = coloured(rng, step * len(order), 0.02, float(np.exp(-1.0 / (RATE_HZ * memory_s))))
    passes = []
    sums = np.zeros((len(speeds), 2))
    for i, (group, way) in enumerate(order):
        own = noise[i * step : i * step + samples] * (louder if group == 2 else 1.0)
        sums[group, int(way < 0.0)] += own.mean() / repeats
        reach = speeds[group] * (np.arange(samples) / RATE_HZ - 0.5 * PASS_S)
        position = 40.0 + way * reach
        torque = own + 0.3 * np.sin(position / 100.0) + 0.1
        zero = np.zeros(samples)
        velocity = way * speeds[group]
        taken = Pass(velocity, 0.0, torque, position, zero, 100.0, 1.0 / RATE_HZ)
        passes.append(TimedPass(taken, 0, i * step / RATE_HZ, group))
    return passes, np.asarray((sums[:, 0] - sums[:, 1]) / 2.0, dtype=np.float64)


def errors_of(noise: PassNoise | None) -> list[float]:
    assert noise is not None
    return [s.standard_error_nm for s in noise.spreads]


@pytest.mark.parametrize("memory_s", [0.02, 0.2, 1.0])
@pytest.mark.parametrize("case", [{}, {"speeds": (5.0, 20.0, 60.0)}, {"repeats": 2}], ids=str)
def test_intervals_cover_whatever_the_memory(memory_s: float, case: dict[str, int]) -> None:
    rng = np.random.default_rng(5)
    inside = []
    for _ in range(25):
        passes, error = stair_of_noise(rng, memory_s, **case)  # type: ignore[arg-type]  # keywords by parametrisation
        found = noise_of(passes)
        assert found is not None
        reach = np.array([student_975(s.dof) * s.standard_error_nm for s in found.spreads])
        inside.append(np.abs(error) <= reach)
    # Points of one stair lean together: a run's share scatters by 2 points, of 3 speeds by 4.
    assert np.mean(inside) >= (0.88 if len(inside[0]) > 3 else 0.83)


def test_a_loud_speed_is_wide_and_does_not_widen_the_others() -> None:
    widths = []
    for louder in (1.0, 6.0):
        rng = np.random.default_rng(6)
        found = [noise_of(stair_of_noise(rng, 0.05, louder=louder)[0]) for _ in range(10)]
        widths.append(np.mean([errors_of(f) for f in found], axis=0))
    ratio = widths[1] / widths[0]
    assert ratio[2] == pytest.approx(6.0, rel=0.35)
    assert np.all(np.delete(ratio, 2) < 1.4)


def test_more_passes_narrow_the_interval_by_their_root() -> None:
    rng = np.random.default_rng(7)
    once = [noise_of(stair_of_noise(rng, 0.05)[0]) for _ in range(8)]
    fourfold = [noise_of(stair_of_noise(rng, 0.05, repeats=4)[0]) for _ in range(8)]
    narrow, wide = (np.mean([errors_of(f) for f in many]) for many in (fourfold, once))
    assert narrow == pytest.approx(0.5 * wide, rel=0.15)


def test_a_single_block_tells_nothing() -> None:
    rng = np.random.default_rng(8)
    passes, _ = stair_of_noise(rng, 0.1, speeds=(5.0,))
    short = [
        TimedPass(p.samples.within(40.0, 40.4), p.recording, p.start_s, p.group) for p in passes
    ]
    assert noise_of(short) is None


@pytest.mark.parametrize("memory_s", [0.02, 0.2])
def test_a_true_law_is_refuted_no_more_often_than_it_says(memory_s: float) -> None:
    rng = np.random.default_rng(9)
    speeds = np.array(SPEEDS[:5])
    columns = np.column_stack((np.ones(5), speeds))
    chances = []
    for _ in range(40):
        passes, friction = stair_of_noise(rng, memory_s, speeds=speeds.tolist())
        found = noise_of(passes)
        assert found is not None
        chances.append(found.chance(columns, friction + columns @ (0.6, 0.01)))
    # One side of Kolmogorov's distance: of 40 even chances, beyond 0.24 in one case of 100.
    ranks = np.arange(1, 41) / 40.0
    assert np.max(ranks - np.sort(chances)) < 0.24


def test_a_fall_beyond_the_noise_has_no_chance_and_a_common_level_every_chance() -> None:
    rng = np.random.default_rng(10)
    speeds = np.array(SPEEDS[:5])
    columns = np.column_stack((np.ones(5), speeds))
    passes, friction = stair_of_noise(rng, 0.05, speeds=speeds.tolist())
    found = noise_of(passes)
    assert found is not None
    assert found.chance(columns, friction + 0.1 * np.exp(-speeds / 5.0)) < 1e-4
    level = found.chance(columns, friction + 1.0)
    assert level == pytest.approx(found.chance(columns, friction))
    assert found.chance(np.eye(5), friction) == 1.0
