"""Whatever ends a cycle in motion: rest within the stated time, and the recording is kept."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

from tests.safety.aborting import ABORTS, REST_RAD_S, Abort, abort

BRAKES_WITHIN_S = 0.35
"""From 60 rad/s at 500 rad/s2: 0.12 s; then the arm behind its spring swings back once or twice."""

COASTS_WITHIN_S = 2.0
"""Without torque its own friction stops the simulated joint; a real one has brakes for that."""


@pytest.mark.parametrize("condition", ABORTS, ids=[a.name for a in ABORTS])
def test_the_joint_comes_to_rest_and_the_message_says_why(condition: Abort, tmp_path: Path) -> None:
    came = abort(condition, tmp_path)
    assert re.search(condition.says, str(came.error))
    braking_s = COASTS_WITHIN_S if condition.coasts else BRAKES_WITHIN_S
    assert came.rest_s < condition.noticed_s + braking_s
    assert came.speed_rad_s < REST_RAD_S
    assert came.recordings == 1
    notes = " ".join(came.error.__notes__)
    assert "at rest (measured)" in notes or "NOT seen to come to rest" in notes
