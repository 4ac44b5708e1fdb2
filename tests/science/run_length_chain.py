"""How long a CUSUM runs before it crosses its threshold, by the chain of Brook and Evans.

Brook and Evans (Biometrika 59, 1972) cut [0, threshold] into states and solve (I - Q) L = 1; it is
exact as the states grow fine, and holds for any law of the steps. It judges the law that tuning
uses (`agent.monitor.detection.run_length`) and gives a benchmark its optimum.
"""

from __future__ import annotations

import numpy as np
from scipy.stats import norm


def brook_evans(drift: float, threshold: float, *, states: int = 120) -> float:
    """Return the average run length of a CUSUM from zero; infinite beyond some 1e14 steps.

    Parameters
    ----------
    drift, threshold : float
        As for `agent.monitor.detection.run_length.siegmund`.
    states : int
        Cells that [0, threshold] is cut into.
    """
    width = 2.0 * threshold / (2.0 * states - 1.0)
    centre = width * np.arange(states)
    # From cell i to cell j: the step falls within half a width of their difference.
    edge = centre[None, :] - centre[:, None] + 0.5 * width
    moves = np.diff(norm.cdf(edge - drift), axis=1, prepend=0.0)
    lengths = np.linalg.solve(np.eye(states) - moves, np.ones(states))
    # Runs longer than the arithmetic's digits bear leave nothing of 1 - Q.
    return float(lengths[0]) if lengths[0] >= 1.0 else np.inf
