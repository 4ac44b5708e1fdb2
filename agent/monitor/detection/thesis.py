"""The thesis's detector, to the letter: equations (6.1) to (6.4), Algorithm 7, section 6.2.3.

The averages of (6.2) as printed reach back one sample, theta = lambda y_{t-1} + (1 - lambda) y_t,
and so the residual is (2 lambda - 1)(y_t - y_{t-1}): the CUSUM sums differences, and sees what
rises within a few cycles; wear of less than v / (2 lambda - 1) a cycle it never sees. The recursive
reading, theta_t = lambda theta_{t-1} + (1 - lambda) y_t, is the moving average that the text
speaks of ("the past estimations are more important"). `docs/detection.md` has both measured.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.monitor.detection.decision import DECIDING, decide, held, held_states, whole_cycles
from agent.monitor.detection.series import FeatureSeries, Judgement, Trace


@dataclass(frozen=True)
class Thesis:
    """The detector of chapter 6 with its three numbers and the choices that the text leaves open.

    Parameters
    ----------
    forgetting : float
        lambda_0 of (6.3), above one half; the actual value is averaged with 1 - lambda_0.
    kv : float
        The smallest change to be detected, as a share of the normal value.
    ka : float
        How much of the residual's own scatter so far is added to the drift.
    recursive : bool
        Average over all of the past instead of the last two samples.
    two_sided : bool
        Run a second CUSUM on the negative residual; a fall counts as a crossing too.
    reset : bool
        Set the sum to zero at a crossing, as (6.1) says. T1 then needs two samples that each cross
        the threshold from zero; without the reset a crossing lasts until the sum has drained.
    """

    forgetting: float = 0.8
    kv: float = 0.01
    ka: float = 0.4
    recursive: bool = False
    two_sided: bool = False
    reset: bool = True

    def __post_init__(self) -> None:
        if not 0.5 < self.forgetting < 1.0:
            raise ValueError(f"expected lambda between 0.5 and 1, got {self.forgetting}")
        if self.kv <= 0.0 or self.ka < 0.0:
            raise ValueError(f"expected kv > 0 and ka >= 0, got {self.kv} and {self.ka}")

    @property
    def name(self) -> str:
        """Return the word for it, the choices included where they are not the printed ones."""
        words = ["thesis"]
        words += ["recursive"] if self.recursive else []
        words += ["two-sided"] if self.two_sided else []
        words += [] if self.reset else ["no reset"]
        return words[0] + (f" ({', '.join(words[1:])})" if words[1:] else "")

    def judge(self, series: FeatureSeries) -> Judgement:
        """Return the state at each cycle; one that lacks a deciding feature changes nothing.

        The thesis knows no baseline: the first sample is the first normal value.
        """
        present = whole_cycles(series)
        traces = {
            name: self.trace(series.values[name][present])
            for name in series.values
            if name in DECIDING or bool(np.all(np.isfinite(series.values[name][present])))
        }
        marks = {name: traces[name].statistic > traces[name].threshold for name in DECIDING}
        return Judgement(
            self.name,
            held_states(decide(marks), present),
            {
                name: Trace(held(t.statistic, present), held(t.threshold, present))
                for name, t in traces.items()
            },
        )

    def averages(self, y: Floats) -> tuple[Floats, Floats]:
        """Return theta_0 and theta_t of (6.3), each of shape (n,); the first is the sample."""
        weights = (self.forgetting, 1.0 - self.forgetting)
        if not self.recursive:
            before = np.concatenate((y[:1], y[:-1]))
            normal, actual = (w * before + (1.0 - w) * y for w in weights)
            return normal, actual
        out = np.empty((2, y.size))
        for row, w in zip(out, weights, strict=True):
            mean = float(y[0]) if y.size else 0.0
            for i, value in enumerate(y.tolist()):
                mean = w * mean + (1.0 - w) * value
                row[i] = mean
        return out[0], out[1]

    def trace(self, y: Floats) -> Trace:
        """Return the CUSUM of one feature and its threshold.

        Parameters
        ----------
        y : ndarray, shape (n,)
            The feature at each cycle.

        Returns
        -------
        Trace
            The sum before any reset, g_t = g_{t-1} + eps_t - v_t with
            v_t = kv theta_0 + ka sigma(eps_1..t), and the threshold 3 v_t.
        """
        normal, actual = self.averages(y)
        residual = actual - normal
        drift = self.kv * np.abs(normal) + self.ka * running_deviation(residual)
        rising = self._sum(residual, drift)
        if self.two_sided:
            rising = np.maximum(rising, self._sum(-residual, drift))
        return Trace(rising, 3.0 * drift)

    def _sum(self, residual: Floats, drift: Floats) -> Floats:
        out = np.empty_like(residual)
        g = 0.0
        for i, (eps, v) in enumerate(zip(residual.tolist(), drift.tolist(), strict=True)):
            g = max(0.0, g + eps - v)
            out[i] = g
            if self.reset and g > 3.0 * v:
                g = 0.0
        return out


def running_deviation(residual: Floats) -> Floats:
    """Return sigma(eps_1..t), the standard deviation of the residuals so far, shape (n,)."""
    count = np.arange(1.0, residual.size + 1.0)
    mean = np.cumsum(residual) / count
    spread: Floats = np.sqrt(np.maximum(0.0, np.cumsum(residual**2) / count - mean**2))
    return spread
