"""Which of the fitted laws the curve carries.

The simplest, Coulomb + viscous, stays unless a richer law beats it beyond its noise in three ways
at once: in the error at speeds that it has not seen (leave one speed out, by more than one standard
error), in the Bayesian information criterion (by more than 10: very strong evidence, Kass and
Raftery, JASA 90 (1995) 773), and with parameters that physics allows.

Where a richer law has hardly fewer parameters than there are speeds, it cannot predict one that is
left out: four of five speeds fix Stribeck's law, and the slowest lies far outside of them. There
the passes' own noise takes the place of unseen speeds: the simple law must leave more of the curve
than noise does in one stair of twenty.

Between Stribeck and Feeny-Moon, which draw nearly the same fall, Stribeck is reported unless
Feeny-Moon beats it in the same way: Stribeck's parameters are the twin's.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.identify.friction.intervals import ENOUGH_FREEDOM
from agent.identify.friction.law_fit import LawFit
from agent.identify.result import FrictionModelFit

_STRONG_BIC = 10.0
_PLAIN = "Coulomb + viscous"
_BY_CHANCE = 0.05  # by which a simple law is refuted where unseen speeds cannot be predicted


def select(fits: Sequence[LawFit]) -> tuple[FrictionModelFit, ...]:
    """Mark the law that is selected, and say of each why or why not."""
    if not fits:
        return ()
    simple = fits[0]
    chosen = simple
    reasons = {simple.fit.model: "the simplest law; no richer one beats it beyond its noise"}
    for rich in fits[1:]:
        refusal = rich.allowed or _not_better(simple, rich)
        if refusal:
            reasons[rich.fit.model] = refusal
            continue
        reasons[simple.fit.model], ours = _better(simple, rich)
        if chosen is simple:
            chosen = rich
            reasons[rich.fit.model] = ours
        elif not _not_better(chosen, rich):
            reasons[chosen.fit.model] = f"{rich.fit.model} predicts unseen speeds better"
            chosen = rich
            reasons[rich.fit.model] = "predicts unseen speeds best"
        else:
            reasons[rich.fit.model] = f"no better at unseen speeds than {chosen.fit.model}"
    return tuple(replace(f.fit, selected=f is chosen, reason=reasons[f.fit.model]) for f in fits)


def _by_noise(simple: LawFit, rich: LawFit) -> bool:
    """Return whether the passes' noise decides: there are too few speeds to leave one out."""
    return rich.freedom < ENOUGH_FREEDOM and simple.chance is not None


def _better(simple: LawFit, rich: LawFit) -> tuple[str, str]:
    """Return why the simple law is dropped, and why the richer one replaces it."""
    if not _by_noise(simple, rich):
        return (
            "a richer law predicts unseen speeds better",
            f"predicts unseen speeds better than {_PLAIN}",
        )
    percent = f"chance {100.0 * (simple.chance or 0.0):.2g} %"
    return (
        f"it leaves more of the curve than the passes' noise does ({percent})",
        f"follows the curve where {_PLAIN} leaves more than the passes' noise does ({percent})",
    )


def _not_better(simple: LawFit, rich: LawFit) -> str:
    """Return why the richer law does not replace the simple one; empty where it does."""
    if simple.fit.bic - rich.fit.bic <= _STRONG_BIC:
        return (
            f"its gain does not pay for its parameters (BIC {rich.fit.bic - simple.fit.bic:+.1f} "
            f"against {simple.fit.model})"
        )
    if _by_noise(simple, rich):
        if (simple.chance or 0.0) > _BY_CHANCE:
            return (
                f"the passes' noise may leave what {simple.fit.model} leaves (chance "
                f"{100.0 * (simple.chance or 0.0):.2g} %)"
            )
    elif _gain(simple, rich) <= 0.0:
        return "it does not predict unseen speeds better beyond one standard error"
    return ""


def _gain(worse: LawFit, better: LawFit) -> float:
    """Return the mean fall in squared unseen-speed error, less one standard error.

    Points count as they do for the better law, which is nearer to the points' own errors.
    """
    fall = better.weight**2 * (worse.unseen_nm**2 - better.unseen_nm**2)
    error = float(np.std(fall, ddof=1)) / np.sqrt(fall.shape[0])
    return float(np.mean(fall) - error)
