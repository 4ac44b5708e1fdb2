"""A law that no simulation bears out is not said to explain."""

from __future__ import annotations

import pytest

from agent.explain.answer.sentences import finding_sentence


@pytest.mark.parametrize("in_twin", [True, False])
def test_a_law_that_no_twin_holds_has_a_shape_and_explains_nothing(in_twin: bool) -> None:
    """Backlash "explains 100 %" stood beside an error that stays."""
    told = finding_sentence("backlash", (), (-0.1, 0.1), 1.0, {}, in_twin=in_twin).whole
    assert ("backlash in the gear explains 100 % of the mismatch" in told) is in_twin
    assert ("twin.toml does not hold it" in told) is not in_twin
