"""Which law the reversals ask for: the simplest that no richer one beats beyond its noise.

A richer law replaces the chosen one where it predicts reversals that it has not seen better by
more than one standard error over the reversals, where the Bayesian information criterion, with
samples counted by their correlation time, falls by more than 10, and where physics allows its
numbers: the same rule that chooses between friction curves.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence

import numpy as np

from agent.identify.reversals.data import Data
from agent.identify.reversals.laws import Range
from agent.identify.reversals.parameters import unresolved
from agent.identify.reversals.search import Solution
from agent.identify.uncertainty import correlation_time

_STRONG_BIC = 10.0
_SLIPS = ("coulomb_nm", "fast_nm", "slow_nm", "motor_coulomb_nm", "arm_coulomb_nm")


def select(
    solutions: Sequence[Solution], data: Data, range_: Range
) -> tuple[Solution, Mapping[str, str]]:
    """Return the law that is chosen, and of every law why it was or was not.

    Parameters
    ----------
    solutions : sequence of Solution
        Simplest first.
    data : Data
        What they were fitted to.
    range_ : Range
        What the recordings can tell apart.
    """
    chosen = solutions[0]
    reasons = {chosen.law.name: "the simplest law; no richer one beats it beyond its noise"}
    for rich in solutions[1:]:
        refusal = objection(rich, range_) or not_better(chosen, rich, data)
        if refusal:
            reasons[rich.law.name] = refusal
            continue
        reasons[chosen.law.name] = f"{rich.law.name} predicts unseen reversals better"
        reasons[rich.law.name] = f"predicts unseen reversals better than {chosen.law.name}"
        chosen = rich
    return chosen, reasons


def objection(found: Solution, range_: Range) -> str:
    """Return why physics or the encoder does not allow these numbers; empty where they do."""
    reason = unresolved(found, range_)
    if reason:
        return reason
    for name in _SLIPS:
        if name in found.law.levels and found.value(name) <= 0.0:
            return f"{name} comes out negative, which friction cannot be"
    arm = "arm_inertia_kg_m2"
    if arm in found.law.levels and found.upper(arm) < 0.0:
        return f"{arm} comes out negative, which no mass has"
    if found.law.name == "bliman-sorine" and found.value("slow_nm") >= found.value("fast_nm"):
        return "the slow element comes out stronger than the fast one: friction would drive"
    return ""


def not_better(simple: Solution, rich: Solution, data: Data) -> str:
    """Return why the richer law does not replace the simple one; empty where it does."""
    # What the richer law leaves is closer to the noise: its colour counts the samples of both.
    ends = np.flatnonzero(np.diff(data.turn)) + 1
    count = rich.residual_nm.size / correlation_time(np.split(rich.residual_nm, ends))
    gain = _information(simple, count) - _information(rich, count)
    if gain <= 0.0:
        return f"it fits no better than {simple.law.name} (BIC {-gain:+.1f})"
    if gain <= _STRONG_BIC:
        return (
            f"its gain does not pay for its parameters (BIC {-gain:+.1f} against {simple.law.name})"
        )
    fall = simple.unseen_nm2 - rich.unseen_nm2
    error = float(np.std(fall, ddof=1)) / math.sqrt(fall.size)
    if float(np.mean(fall)) <= error:
        return "it does not predict unseen reversals better beyond one standard error"
    return ""


def _information(found: Solution, count: float) -> float:
    """Return the Bayesian information criterion over so many independent samples."""
    squares = max(float(np.mean(found.residual_nm**2)), 1e-300)
    free = found.x.size + found.weights.size
    return count * math.log(squares) + free * math.log(max(count, 2.0))
