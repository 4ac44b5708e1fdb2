"""A torque that is half a sample beside the motion, as it is where it is held over each sample.

A loop that computes a torque at each sample and holds it until the next one acts, on the mean, half
a sample after it; a recording puts it beside the motion of either end. So are most simulators'
recordings and many drives', and it says as little of the joint as a velocity that is late by part
of a sample (decision 0037): it is put right and told, and is no finding.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.rows.run import CORNERS, Run
from agent.identify.result import Floats, Parameter
from agent.numbers import significant

_OFF, _ROUGHLY = 0.06, 0.15
"""Of a sample: how far from a half a delay may be, and its 95 % interval reach, either way."""

_ALIKE = 0.01  # of a period: recordings at one rate

_WITH_THE_MOTION = (
    "velocity_command_rad_s",
    "position_command_rad",
    "position_arm_rad",
    "torque_simulated_nm",
    CORNERS,
)


def half_a_sample_s(delay: Parameter, runs: Sequence[Run]) -> float:
    """Return by how much the torque is late where that is half a sample of all runs; else 0.

    Of a sample that was recorded, or of what is compared of recordings that are thinned.

    Parameters
    ----------
    delay : Parameter
        Of the torque, s, as it was found; below zero where it is early.
    runs : sequence of Run
        All that is compared.
    """
    recorded = [run.sampled_every_s for run in runs]
    compared = [float(np.median(np.diff(run.signals.time_s))) for run in runs]
    return _half_of(delay, recorded) or _half_of(delay, compared)


def _half_of(delay: Parameter, periods_s: Sequence[float]) -> float:
    """Return half of a period by which a torque is late or early; 0 where it is another delay."""
    period_s = periods_s[0]
    if delay.ci95 is None or any(abs(p - period_s) > _ALIKE * period_s for p in periods_s):
        return 0.0
    reach = 0.5 * (delay.ci95[1] - delay.ci95[0])
    if reach > _ROUGHLY * period_s or abs(abs(delay.value) - 0.5 * period_s) > _OFF * period_s:
        return 0.0
    return 0.5 * period_s if delay.value > 0.0 else -0.5 * period_s


def in_step_with(runs: Sequence[Run], late_s: float) -> tuple[Run, ...]:
    """Return runs whose motion is as late as their torque.

    The motion is moved and not the torque, whose noise is judged: a cubic spline takes nothing of
    what the band holds.

    Parameters
    ----------
    runs : sequence of Run
    late_s : float
        By how much the torque is later; below zero where it is earlier.
    """
    return tuple(_moved(run, late_s) for run in runs)


def said_of(late_s: float) -> str:
    """Return what is said of it."""
    word = "later" if late_s > 0.0 else "earlier"
    return (
        f"the torque is half a sample ({significant(1e3 * abs(late_s), 2)} ms) {word} than the "
        "motion, as it is where a torque is held over each sample: the two were put in step"
    )


def _moved(run: Run, late_s: float) -> Run:
    signals = run.signals

    def later(values: Floats | None) -> Floats | None:
        return None if values is None else _later(signals.time_s, values, late_s)

    return replace(
        run,
        signals=replace(
            signals,
            position_rad=later(signals.position_rad),
            velocity_rad_s=later(signals.velocity_rad_s),
            velocity_command_rad_s=later(signals.velocity_command_rad_s),
            position_command_rad=later(signals.position_command_rad),
            position_arm_rad=later(signals.position_arm_rad),
        ),
        columns={
            name: _later(signals.time_s, values, late_s) if name in _WITH_THE_MOTION else values
            for name, values in run.columns.items()
        },
    )


def _later(time_s: Floats, values: Floats, late_s: float) -> Floats:
    """Return values, shape (n,), as they were `late_s` before; NaN stays where it was."""
    from scipy.interpolate import CubicSpline

    there = np.isfinite(time_s) & np.isfinite(values)
    if np.count_nonzero(there) < 2:
        return values
    own = time_s[there]
    out = values.copy()
    out[there] = CubicSpline(own, values[there])(np.clip(own - late_s, own[0], own[-1]))
    return out
