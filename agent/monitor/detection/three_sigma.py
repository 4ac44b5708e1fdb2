"""The 3-sigma test of thesis section 6.1.1, in both of its forms.

|s_t| < 3 sigma_t, and with the variance of the fault-free data |s_t| < 3 sqrt(sigma_t^2 +
sigma_o^2), where s_t is the distance from the baseline's mean. It has no memory: a rise below three
sigma is not seen however long it lasts. Only a rise counts here, and the decision is the
thesis's (`decision`): two or three cycles in a row.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from agent.monitor.detection.decision import DECIDING, decide
from agent.monitor.detection.series import FeatureSeries, Judgement, State, Trace
from agent.monitor.detection.standing import standing


@dataclass(frozen=True)
class ThreeSigma:
    """The test with or without the baseline's scatter in its threshold.

    Parameters
    ----------
    with_baseline : bool
        Take the baseline's variance into the threshold, the second and more robust form.
    factor : float
        Three, as the name says.
    """

    with_baseline: bool = True
    factor: float = 3.0

    @property
    def name(self) -> str:
        """Return the word for it."""
        return "3-sigma" if self.with_baseline else "3-sigma (own deviation only)"

    def judge(self, series: FeatureSeries) -> Judgement:
        """Return the state at each cycle; without a baseline to stand on, no fault throughout."""
        traces = {}
        for name in series.values:
            found = standing(series, name)
            if found is not None:
                baseline = found.scatter if self.with_baseline else 0.0
                own = np.hypot(series.deviations[name], baseline)
                traces[name] = Trace(series.values[name] - found.level, self.factor * own)
        if not set(DECIDING) <= traces.keys():
            return Judgement(self.name, (State.NO_FAULT,) * series.time_s.size, traces)
        marks = {name: traces[name].statistic > traces[name].threshold for name in DECIDING}
        return Judgement(self.name, decide(marks), traces)
