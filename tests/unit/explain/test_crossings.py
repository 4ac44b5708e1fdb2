"""A gap's likeness is that of the point alone, whatever else is tried beside it."""

from __future__ import annotations

import numpy as np

from agent.explain.forms.crossings_kernel import likeness_of
from agent.identify.result import Floats


def test_points_of_one_arm_share_what_pulls_its_teeth_apart_and_nothing_else() -> None:
    rng = np.random.default_rng(5)
    time = 0.01 * np.arange(3000)
    velocity = 30.0 * np.sin(0.7 * time) + 10.0 * np.sin(2.3 * time)
    begins = np.zeros(3000, dtype=np.bool_)
    begins[[0, 1100, 1101]] = True
    hard, dry, weight = np.gradient(velocity, 0.01), 80.0 * np.sign(velocity), 60.0 * np.sin(time)
    oil, period_s = 0.5 * velocity, np.full(3000, 0.01)
    residual = np.where(np.diff(velocity, prepend=0.0) > 0.0, -1.0, 1.0) + rng.normal(size=3000)
    arms = np.array([[0.3, 0.2, 0.0, 0.2], [0.3, 0.2, 40.0, 0.0], [0.8, 0.9, 0.0, 0.0]])
    points = np.array([(gap, *arm) for arm in arms for gap in (0.003, 0.01, 0.03)])

    def likeness(of: Floats) -> list[float]:
        out = likeness_of(hard, dry, weight, oil, residual, begins, period_s, of)
        return [float(x) for x in out]

    alone = [likeness(points[k : k + 1])[0] for k in range(points.shape[0])]
    assert likeness(points) == alone
    other_arms_first = np.roll(np.arange(points.shape[0]), 3)
    assert likeness(points[other_arms_first]) == [alone[k] for k in other_arms_first]
    assert len(set(alone)) > 3
