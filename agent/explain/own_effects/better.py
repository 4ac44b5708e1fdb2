"""Which of two answers about one joint is the better one: what it settles, and with how little."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.result import Explanation, Verdict
from agent.explain.choosing.materiality import CLOSE, MATERIAL

_AS_WELL = 0.1  # of the energy: fewer laws that leave no more are the better answer
_HALF = 0.5  # of the energy above the noise
SETTLED: Mapping[Verdict, int] = {
    "unexplained": 0,
    "partly-explained": 1,
    "tied": 2,
    "explained": 2,
    "no-mismatch": 2,
}
"""How much a verdict settles."""


def is_better(bare: Explanation, answer: Explanation, too_much: int = 0) -> bool:
    """Return whether an answer settles more, needs fewer laws, or leaves half of another one's.

    Fewer laws may leave a little more, and more laws must leave more than a little less: so much as
    is worth no name beside them.

    Parameters
    ----------
    bare, answer : Explanation
    too_much : int
        How many laws were taken off a recorded simulation for `bare`, which needs them as well.
    """
    settled = SETTLED[bare.verdict] - SETTLED[answer.verdict]
    if settled:
        return settled > 0
    ours, theirs = (each.extended.rmse_nm**2 for each in (bare, answer))
    little = max(_AS_WELL * theirs, MATERIAL * mismatch_nm2(bare))
    more = _said_of(bare) + too_much - _said_of(answer)
    if more > 0 and theirs - ours <= max(little, MATERIAL * _mismatch_as_judged_nm2(answer)):
        return False
    return settles_more(bare, answer) or (more < 0 and ours - theirs <= little)


def is_as_good(bare: Explanation, answer: Explanation) -> bool:
    """Return whether an answer settles as much with no more laws, and leaves hardly more."""
    ours, theirs = (each.extended.rmse_nm**2 for each in (bare, answer))
    return (
        SETTLED[bare.verdict] >= SETTLED[answer.verdict]
        and _said_of(bare) <= _said_of(answer)
        and ours <= (1.0 + _AS_WELL) * theirs
    )


def _mismatch_as_judged_nm2(answer: Explanation) -> float:
    """Return what small effects were lost in: beside wrong numbers, the simulation's as given."""
    wrong = any(f.form == OWN_NUMBER for f in answer.findings)
    return mismatch_nm2(answer, OWN_NUMBER if wrong else "")


def settles_more(bare: Explanation, answer: Explanation) -> bool:
    """Return whether an answer's verdict is a better one, or as good with half left."""
    settled = SETTLED[bare.verdict] - SETTLED[answer.verdict]
    if settled:
        return settled > 0
    left, before = (each.extended.rmse_nm**2 - floor_nm2(answer) for each in (bare, answer))
    return left < _HALF * before


def on_the_floor_of(answer: Explanation, other: Explanation) -> Explanation:
    """Return an answer with another one's noise floor, where that one leaves less than its own.

    A simulated arm that rings where the joint's does not leaves what looks like noise; that it
    agrees but for noise is not so then.
    """
    ours, theirs = floor_nm2(answer), floor_nm2(other)
    if not (0.0 < theirs < ours and other.extended.rmse_nm**2 < ours):
        return answer
    agrees = answer.extended.rmse_nm**2 <= CLOSE**2 * theirs
    verdict = "unexplained" if answer.verdict == "no-mismatch" and not agrees else answer.verdict
    return replace(answer, floor=other.floor, verdict=verdict)


def is_noise(answer: Explanation) -> bool:
    """Return whether a simulation agrees, and leaves no more than the noise floor.

    What it leaves beyond that may be noise in kind, or the image of an arm that the joint has not.
    """
    left_nm2 = answer.refitted.rmse_nm**2
    return answer.verdict == "no-mismatch" and left_nm2 <= CLOSE**2 * floor_nm2(answer)


def is_settled(answer: Explanation) -> bool:
    """Return whether a verdict cannot be a better one."""
    return SETTLED[answer.verdict] == max(SETTLED.values())


def _said_of(answer: Explanation) -> int:
    """Return how many laws an answer's twin has, and how many of its numbers are said to be wrong.

    Of two simulations of one joint that with less of both is the better one.
    """
    laws = 0 if answer.twin is None else len(answer.twin.effects)
    return laws + sum(f.form == OWN_NUMBER for f in answer.findings)


def floor_nm2(answer: Explanation) -> float:
    """Return the energy of noise, N m squared; 0 where it is not known."""
    floor_nm = answer.floor.value_nm
    return floor_nm**2 if floor_nm > 0.0 else 0.0


def mismatch_nm2(answer: Explanation, own: str = "") -> float:
    """Return what the twin leaves above the noise, N m squared: as given for its own numbers."""
    before = answer.baseline if own == OWN_NUMBER else answer.refitted
    return max(before.rmse_nm**2 - floor_nm2(answer), 0.0)
