"""One sentence says what findings are worth on data that was not seen, whichever way it went."""

from __future__ import annotations

import pytest

from agent.explain.answer.fits import Fit, Holdout
from agent.explain.answer.words import proof_sentence


def _holdout(before_nm: float, after_nm: float) -> Holdout:
    before, after = Fit(before_nm, 90.0), Fit(after_nm, 90.0)
    return Holdout("recordings unseen", before, before, after, 0.0, None, 1.0, 1, 2, 0.0, True)


@pytest.mark.parametrize(
    ("before_nm", "after_nm", "said"),
    [
        (0.0105, 0.00625, "the error falls from 10 to 6.2 mN m; noise is 6.1 mN m."),
        (0.00625, 0.00621, "the error stays at 6.2 mN m; noise is 6.1 mN m."),
        (
            0.0062,
            0.0105,
            "the error does not fall: it goes from 6.2 to 10 mN m; noise is 6.1 mN m. "
            "What was found does not hold there.",
        ),
    ],
)
def test_sentence_is_the_way_the_error_went(before_nm: float, after_nm: float, said: str) -> None:
    sentence = proof_sentence(_holdout(before_nm, after_nm), 0.0061)
    assert sentence == f"On recordings unseen {said}"
