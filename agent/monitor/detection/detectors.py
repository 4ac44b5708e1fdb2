"""Every detector by its word, and the one that is taken when none is asked for."""

from __future__ import annotations

from collections.abc import Callable, Mapping

from agent.monitor.detection.cusum import Cusum
from agent.monitor.detection.likelihood_ratio import LikelihoodRatio
from agent.monitor.detection.multi_model import MultiModel
from agent.monitor.detection.series import Detector
from agent.monitor.detection.thesis import Thesis
from agent.monitor.detection.three_sigma import ThreeSigma

DEFAULT = "cusum"

DETECTORS: Mapping[str, Callable[[], Detector]] = {
    "cusum": Cusum,
    "thesis": Thesis,
    "thesis-recursive": lambda: Thesis(recursive=True, reset=False),
    "3-sigma": ThreeSigma,
    "likelihood-ratio": LikelihoodRatio,
    "multi-model": MultiModel,
}


def detector(word: str = DEFAULT) -> Detector:
    """Return the detector of a word.

    Raises
    ------
    ValueError
        If there is none of that word; the message names those that there are.
    """
    if word not in DETECTORS:
        raise ValueError(f"expected a detector ({', '.join(DETECTORS)}), got {word!r}")
    return DETECTORS[word]()
