"""Ripple amplitudes and orders over many seeds: coverage, and error against the bound.

A pass of n samples in noise of power density S at an order's frequency (that of white noise: its
variance) tells an amplitude to ``2 S/n``; amplitudes that are the same in all passes add their
information. The order's own bound is ``24 S/(n A^2 L^2)`` over the angle L.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from scipy.signal import lfilter

from agent.identify.result import Parameter
from agent.identify.ripple.identification import find_ripple
from agent.identify.signals.arrays import Signals
from tests.science.information import Score
from tests.science.thermal_campaign import score

STEP_S, NOISE_NM, HIGHEST = 0.004, 0.02, 40.0
TRUTH: Mapping[float, float] = {6.0: 0.02, 7.37: 0.01, 12.0: 0.01}


@dataclass(frozen=True)
class Passes:
    """Passes at constant velocity, in white or exponentially correlated noise."""

    name: str
    velocity_rad_s: tuple[float, ...] = (3.0, -3.0, 4.5, -4.5)
    seconds: float = 8.0
    memory: float = 0.0

    def record(self, seed: int, ripple: Mapping[float, float] = TRUTH) -> Signals:
        rng = np.random.default_rng(seed)
        n = int(self.seconds / STEP_S)
        velocity = np.concatenate(
            [np.concatenate((np.full(n, v), np.zeros(250))) for v in self.velocity_rad_s]
        )
        angle = np.cumsum(velocity) * STEP_S
        white = NOISE_NM * rng.standard_normal(velocity.size)
        noise = lfilter([np.sqrt(1.0 - self.memory**2)], [1.0, -self.memory], white)
        torque = 0.4 * np.sign(velocity) + 0.01 * velocity + noise
        for order, size in ripple.items():
            torque = torque + size * np.cos(order * angle + 0.7 * order)
        columns = {
            "time_s": np.arange(velocity.size) * STEP_S,
            "torque_nm": torque,
            "velocity_rad_s": velocity,
            "position_rad": angle,
        }
        return Signals.from_columns(columns, 50.0, name=self.name)

    def bounds(self, order: float) -> tuple[float, float]:
        """Return the smallest deviation of the amplitude and of the order."""
        amplitude = at_order = 0.0
        n = self.seconds / STEP_S
        for v in self.velocity_rad_s:
            turn = np.exp(-1j * order * abs(v) * STEP_S)
            density = NOISE_NM**2 * (1.0 - self.memory**2) / abs(1.0 - self.memory * turn) ** 2
            amplitude += n / (2.0 * density)
            length = abs(v) * self.seconds
            at_order += n * TRUTH[order] ** 2 * length**2 / (24.0 * density)
        return float(amplitude**-0.5), float(at_order**-0.5)


CASES = (
    Passes("white"),
    Passes("coloured", memory=0.9),
    Passes("coloured, two passes", (4.0, -4.0), memory=0.9),
    Passes("white, one way", (4.0,)),
)


def ripple_campaign(seeds: Iterable[int], case: Passes) -> tuple[list[Score], int]:
    """Search once for every seed; return the scores and how many false orders were named."""
    amplitude: dict[float, list[Parameter]] = {order: [] for order in TRUTH}
    at: dict[float, list[Parameter]] = {order: [] for order in TRUTH}
    false = 0
    for seed in seeds:
        found = find_ripple([case.record(seed)], highest_order=HIGHEST)
        false += len(found.lines)
        for order in TRUTH:
            line = found.at(order)
            if line is not None:
                amplitude[order].append(line.amplitude_nm)
                at[order].append(line.order_per_motor_rev)
                false -= 1
    scores = []
    for order, size in TRUTH.items():
        bound, order_bound = case.bounds(order)
        label = f"{order:g}: amplitude, N m"
        scores.append(score(case.name, label, size, amplitude[order], bound))
        scores.append(score(case.name, f"{order:g}: order", order, at[order], order_bound))
    return scores, false


def false_orders(seeds: Iterable[int], case: Passes) -> int:
    """Return in how many recordings without ripple an order is named."""
    return sum(bool(find_ripple([case.record(s, {})], highest_order=HIGHEST).lines) for s in seeds)
