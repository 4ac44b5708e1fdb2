"""Recordings as others make them: several sampling rates, single passes, slow and noisy motion."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from agent.explain.explain import explain
from agent.explain.rows.held import Held, direction_in_passes
from agent.explain.rows.run import Run
from agent.explain.rows.table import Table, tabulate
from agent.explain.study import study
from agent.physics.twin import Twin, parse_twin

STATIC_EXTRA_NM, STRIBECK_VELOCITY_RAD_S = 0.2, 3.0
SPEEDS_RAD_S = (0.5, 1.0, 2.0, 4.0, 7.0, 11.0, 16.0, 22.0)
NOISE_NM = 0.02


def twin() -> Twin:
    return parse_twin(
        'schema = "stribeck.twin/1"\nrobot = "bench"\naxis = 1\ngear_ratio = 1.0\n'
        "[rigid_body]\ninertia_kg_m2 = 0.001\ngravity_sin_nm = 0.0\ngravity_cos_nm = 0.0\n"
        "[friction]\ncoulomb_nm = 0.5\nviscous_nm_s_per_rad = 0.01\n"
    )


def passes(extra_nm: float = STATIC_EXTRA_NM) -> Run:
    """Return single passes of 400 samples, the slower the more slowly sampled, one after another.

    Friction falls with speed; neither a position nor a change of speed was recorded.
    """
    rng = np.random.default_rng(0)
    times, velocities, torques, now = [], [], [], 0.0
    for speed in SPEEDS_RAD_S:
        for sign in (1.0, -1.0):
            time = now + np.arange(400) * (1.0 / min(20.0 * speed, 200.0))
            velocity = sign * speed * np.ones(400)
            boundary = extra_nm * np.exp(-speed / STRIBECK_VELOCITY_RAD_S)
            friction = sign * (0.5 + boundary) + 0.01 * velocity
            times.append(time)
            velocities.append(velocity + 0.01 * rng.standard_normal(400))
            torques.append(friction + NOISE_NM * rng.standard_normal(400))
            now = float(time[-1]) + 30.0
    columns = {
        "time_s": np.concatenate(times),
        "velocity_rad_s": np.concatenate(velocities),
        "torque_nm": np.concatenate(torques),
    }
    return Run.from_columns(columns, 1.0, name="passes")


@pytest.fixture(scope="module")
def table() -> Table:
    return tabulate(twin(), [passes()])


def test_every_stretch_is_compared_in_its_own_band(table: Table) -> None:
    for piece in table.pieces:
        assert piece.cutoff_hz <= 0.1001 / piece.period_s
    assert table.cutoff_hz == max(piece.cutoff_hz for piece in table.pieces)
    assert len({round(piece.cutoff_hz, 3) for piece in table.pieces}) > 3
    # The slowest stretch costs the others nothing.
    assert float(np.mean(table.used)) > 0.85


def test_law_is_recovered_over_all_bands_and_no_unrest_is_named(table: Table) -> None:
    found = study(twin(), table)
    (term,) = found.model.terms
    assert term.scored.form.effect == "stribeck"
    numbers = found.model.parameters[0]
    assert numbers["static_extra_nm"].value == pytest.approx(STATIC_EXTRA_NM, rel=0.15)
    fall = numbers["stribeck_velocity_rad_s"].value
    assert fall == pytest.approx(STRIBECK_VELOCITY_RAD_S, rel=0.25)
    assert not found.model.base["inertia_kg_m2"].identified
    for effect in ("measurement-delay", "presliding-hysteresis"):
        assert "no change of speed was recorded" in found.not_judged[effect]


def test_a_fold_leaves_out_whole_velocity_steps(table: Table) -> None:
    rows = np.flatnonzero(table.used)
    fold = table.step_folds(rows, 8)
    assert fold is not None
    step = table.rows["step"][rows]
    assert all(np.unique(fold[step == one]).size == 1 for one in np.unique(step))
    assert np.unique(fold).size == 8
    assert table.step_folds(rows, 9) is None  # sixteen steps are not two for each


def test_a_log_that_holds_no_speed_is_not_decidable() -> None:
    rng = np.random.default_rng(1)
    columns = {
        "time_s": np.arange(2000.0),
        "velocity_rad_s": np.where(rng.random(2000) < 0.5, 0.0, rng.standard_normal(2000)),
        "torque_nm": rng.standard_normal(2000),
    }
    found = explain(twin(), [Run.from_columns(columns, 1.0, name="log")])
    assert found.findings == ()
    assert found.twin is None
    assert "only speeds that are held can be compared" in found.sentence


@settings(max_examples=30, deadline=None)
@given(st.floats(0.3, 0.8), st.floats(1.0, 6.0), st.sampled_from((-1.0, 1.0)))
def test_a_stutter_does_not_turn_a_pass_round(depth: float, hertz: float, sign: float) -> None:
    """The motor swings back for a moment in every period, but goes on its way in the band."""
    period_s, cutoff_hz = 0.002, 0.5
    time = np.arange(0.0, 20.0, period_s)
    swing = np.maximum(np.sin(2.0 * np.pi * hertz * time), 0.0) ** 8
    velocity = sign * (1.0 + depth - 4.0 * depth * swing)
    held = Held(np.full(time.size, float(velocity.mean())), np.zeros(time.size), one_speed=True)
    direction = direction_in_passes(velocity, held, period_s, cutoff_hz, 0.001)
    assert np.all(direction[500:-500] == sign)


def test_a_reversal_and_a_rest_stay_what_they_are() -> None:
    """What lasts for longer than the band remembers is no stutter, even within a pass."""
    period_s, cutoff_hz = 0.002, 5.0
    time = np.arange(0.0, 6.0, period_s)
    velocity = np.where((time > 2.0) & (time < 3.0), -1.0, np.where(time > 5.0, 0.0, 1.0))
    held = Held(np.ones(time.size), np.zeros(time.size), one_speed=True)
    direction = direction_in_passes(velocity, held, period_s, cutoff_hz, 0.01)
    assert np.all(direction[(time > 2.2) & (time < 2.8)] == -1.0)
    assert np.all(direction[(time > 5.3) & (time < 5.7)] == 0.0)
    assert np.all(direction[(time > 0.3) & (time < 1.7)] == 1.0)
