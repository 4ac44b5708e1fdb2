"""Reversals of an independent simulator, whose truth is known."""

from __future__ import annotations

import numpy as np
import pytest

from agent.identify.result import Floats
from agent.identify.reversals import find_reversals, identify_reversals
from agent.identify.signals import Signals

GEAR = 100.0
LEVEL, STIFFNESS, INERTIA = 0.6, 12.0, 0.002


def joint(seed: int, *, gap_rad: float = 0.0, periods: float = 4.0) -> tuple[Signals, Floats]:
    """Swing a Dahl joint to and fro (explicit Euler in ten small steps) behind a clearance."""
    rng = np.random.default_rng(seed)
    dt, inner = 0.004, 10
    time_s = np.arange(0.0, periods * 4.0, dt)
    rate = 2.0 * np.pi / 4.0
    velocity = 0.8 * np.cos(rate * time_s)
    position = 0.8 / rate * np.sin(rate * time_s)
    friction, torque, arm = LEVEL, [], []
    motor = carried = 0.0
    for t, v, q in zip(time_s, velocity, position, strict=True):
        torque.append(friction - INERTIA * 0.8 * rate * np.sin(rate * t))
        for _ in range(inner):
            friction += dt / inner * v * STIFFNESS * (1.0 - friction / LEVEL * np.sign(v))
        motor = q
        carried = min(max(carried, motor - gap_rad / 2.0), motor + gap_rad / 2.0)
        arm.append(carried / GEAR)
    columns = {
        "time_s": time_s,
        "position_rad": position,
        "velocity_rad_s": velocity,
        "torque_nm": np.array(torque) + rng.normal(0.0, 0.005, time_s.size),
    }
    noisy = np.array(arm) + rng.normal(0.0, 1e-5, time_s.size)
    return Signals.from_columns(columns, GEAR), noisy


def test_reversals_are_found() -> None:
    signals, _ = joint(1)
    assert len(find_reversals(signals)) == 8


def test_dahl_and_clearance_are_recovered() -> None:
    signals, arm = joint(2, gap_rad=0.05)
    found = identify_reversals([signals], [arm])
    dahl = found.presliding[0]
    assert dahl.law == "dahl"
    assert dahl.parameters["coulomb_nm"].value == pytest.approx(LEVEL, rel=0.03)
    assert dahl.parameters["stiffness_nm_per_rad"].value == pytest.approx(STIFFNESS, rel=0.06)
    assert dahl.heldout_rmse_nm == pytest.approx(0.005, rel=0.3)
    gap = found.backlash_rad
    assert gap.value == pytest.approx(0.05, rel=0.05)
    assert "elasticity" in gap.reason


def test_motor_side_alone_gives_no_clearance() -> None:
    signals, _ = joint(3, gap_rad=0.05)
    gap = identify_reversals([signals]).backlash_rad
    assert not gap.identified
    assert "position_arm_rad" in gap.reason


def test_no_reversal_no_number() -> None:
    signals, _ = joint(4, periods=0.2)
    found = identify_reversals([signals])
    assert found.reversals == 0
    assert not found.presliding
    assert found.reason.startswith("not identified")
