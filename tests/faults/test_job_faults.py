"""A job whose line goes wrong in motion, over TCP and RTU: at rest in time, and said why.

`tests.benchmarks.faults --lines` draws hundreds, at other speeds and moments.
"""

from __future__ import annotations

import pytest

from tests.faults.lines import KINDS, struck


@pytest.mark.parametrize(("kind", "line"), KINDS)
def test_a_line_that_goes_wrong_in_motion_ends_at_rest(kind: str, line: str) -> None:
    run = struck(kind, line, seed=1)
    assert not run.objections(), run
