"""The whole explanation: from recordings and a twin to a verdict, its reasons and its proof."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agent.explain.answer.result import Explanation
from agent.explain.asked import tabulated
from agent.explain.location.moments import Moments, without
from agent.explain.looked import Known
from agent.explain.once import asked_once
from agent.explain.own_effects.against import told_against
from agent.explain.own_effects.better import SETTLED, is_as_good, is_better, is_noise, is_settled
from agent.explain.own_effects.doubted import doubted_of, says_twice
from agent.explain.read_off import read_off
from agent.explain.recorded import told_both_ways
from agent.explain.rows.creep import without_creep
from agent.explain.rows.run import Run, are_simulated
from agent.physics.twin import Twin
from trajectories import AxisLimits

_HELD_OUT = 2.0  # times the noise
_MOST_ROUNDS = 2  # moments hide behind moments


def explain(
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run] = (),
    limits: AxisLimits | None = None,
) -> Explanation:
    """Locate where a twin and recordings differ, name and model what is missing, and prove it.

    Parameters
    ----------
    twin : Twin
        The simulation as given. Recordings that all carry a `torque_simulated_nm` question that
        simulation instead.
    runs : sequence of Run
        Recordings of one axis to learn from.
    holdout : sequence of Run
        Recordings that nothing is learnt from; without them folds of `runs` stand in.
    limits : AxisLimits, optional
        Of the axis: what it may be asked to drive next. Without them nothing beyond what the
        recordings show.

    Returns
    -------
    Explanation
        With reasons and no numbers where the recordings do not carry an answer.
    """
    if not are_simulated((*runs, *holdout)):
        return _but_for_moments(twin, runs, holdout, limits)
    twin, said = read_off(twin, runs, holdout)
    answer = _but_for_moments(twin, runs, holdout, limits)
    return replace(answer, reasons=(*answer.reasons, *said))


def _but_for_moments(
    twin: Twin, runs: Sequence[Run], holdout: Sequence[Run], limits: AxisLimits | None
) -> Explanation:
    """Return the answer, without a few moments that hide a better one where there are such."""
    answer, moments = _asked(twin, runs, holdout, limits)
    left_out: tuple[str, ...] = ()
    for _ in range(_MOST_ROUNDS):
        if moments is None or (moments.begins and left_out):
            break  # what begins later begins in motion, too
        if moments.comes_back and not holdout:
            break  # there is nothing to hold it against
        runs, left_out = without(runs, moments), (*left_out, moments.said(apart=True))
        again, moments = _asked(twin, runs, holdout, limits)
        if _is_better(again, answer):
            return replace(again, reasons=(*left_out, *again.reasons))
    return answer


def _is_better(answer: Explanation, other: Explanation) -> bool:
    """Return whether an answer without moments settles more than one with them, or leaves half.

    It does not where a hold-out holds far more of it than noise: then they were no accident.
    """
    held = answer.holdout
    if held is not None and answer.held_out and held.floor_ratio > _HELD_OUT:
        return False
    rank = SETTLED[answer.verdict] - SETTLED[other.verdict]
    return rank > 0 or (rank == 0 and answer.extended.rmse_nm < 0.5 * other.extended.rmse_nm)


def _asked(
    twin: Twin, runs: Sequence[Run], holdout: Sequence[Run], limits: AxisLimits | None
) -> tuple[Explanation, Moments | None]:
    """Return an explanation; where the simulation's effects may be wrong, the better of two.

    The other one is of a twin without such effects: what it finds in their place is told as what
    is wrong with them. A recorded simulation is asked the other way round what it has too much.
    """
    answer, moments = asked_once(twin, runs, holdout, limits)
    if answer.twin is None or is_noise(answer):
        return answer, moments
    if are_simulated((*runs, *holdout)):
        return told_both_ways(answer, moments, twin, runs, holdout, limits)
    if not twin.effects:
        return answer, moments
    table = without_creep(tabulated(twin, runs, holdout)[1])
    best = answer, moments
    for doubted in doubted_of(twin, table, answer):
        bare, apart = asked_once(doubted.bare, runs, holdout, limits, Known(doubted=doubted))
        once = says_twice(answer, doubted) and is_as_good(bare, answer)
        told = told_against(doubted, answer, bare, plainer=once)
        if told is not None and (best[0] is answer or is_better(told, best[0])):
            best = told, apart
            if is_settled(told):
                break
    return best
