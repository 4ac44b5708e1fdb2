"""A recording of another axis among several: said first, left aside, and the others asked."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.explain import explain
from agent.explain.location.moments import Moments
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.report.explanation.words import verdict_words
from tests.lessons.test_carried import CYCLE, KNOWN, recorded
from tests.science.explain_joint import GEAR_RATIO, TWIN, Conditions, record
from trajectories import SetPoints


def of_another(weight_nm: float, inertia: float, friction: float) -> Run:
    """Return a recording of an axis with so many times the inertia and the dry friction."""

    def missing(points: SetPoints, at: Conditions) -> Floats:
        del at
        arm = points.position_rad / GEAR_RATIO
        faster = (inertia - 1.0) * TWIN.inertia_kg_m2 * points.acceleration_rad_s2
        rubs = (friction - 1.0) * TWIN.coulomb_nm * np.sign(points.velocity_rad_s)
        return np.asarray(weight_nm * np.sin(arm) + faster + rubs)

    return record(CYCLE, missing, Conditions(started_s=900.0), 9, name="odd")


@pytest.mark.parametrize(
    ("odd", "said"),
    [
        (of_another(0.0, 1.0, 0.8), "The recording odd shows none of the weight"),
        (of_another(0.15, 0.4, 0.3), "The recording odd is as if of another axis: there the iner"),
    ],
)
def test_a_recording_of_another_axis_is_left_aside_and_the_others_are_asked(
    odd: Run, said: str
) -> None:
    """Four sentences on faults of a joint stood below it, none of which it had."""
    answer = explain(KNOWN, [*recorded((0, 0, 0), 0.0), odd])
    assert answer.verdict == "no-mismatch"
    assert answer.sentence.startswith(said)
    assert "It was left aside. Simulation and recordings agree" in answer.sentence
    assert answer.recordings == ("run-0", "run-1", "run-2")
    shown = verdict_words(answer)  # not in green, which would be read as of all of them
    assert (shown.status, shown.tone) == ("The other recordings agree", "open")


def test_moments_are_of_all_recordings_again() -> None:
    moments = Moments(((1, "run-2", 3.5),), 0.8)
    assert moments.among([0, 2, 3]) == replace(moments, at=((2, "run-2", 3.5),))
