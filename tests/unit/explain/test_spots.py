"""A bell is looked for along the stroke, and may be wider than the stroke itself."""

from __future__ import annotations

import numpy as np
import pytest

from agent.explain.forms.spots import _resemblance


@pytest.mark.parametrize("width", [17.0, 75.0, 96.0])
def test_every_bin_has_its_score_and_the_bell_the_best(width: float) -> None:
    """From 0.13 of the stroke on the window is longer than the stroke: it had 769 scores."""
    bins, center = np.arange(600), 300
    moment = np.exp(-0.5 * ((bins - center) / width) ** 2)
    score = _resemblance(moment, np.ones(600), width)
    assert score.shape == (600,)
    assert abs(int(np.argmax(score)) - center) <= 0.1 * width
