"""Which law comes closest to the little that is left, though too small to be worth a name."""

from __future__ import annotations

from agent.explain.answer.names import effect_name
from agent.explain.choosing.materiality import (
    CLOSE,
    FAR,
    least_gain,
    noise_energy,
    scatter_of,
)
from agent.explain.study import Study

_A_GOOD_PART = 0.2  # of what stands above the noise: less is as likely the law of something else
_NO_CHANCE = 4.0  # standard errors over the blocks


def closest_said(found: Study) -> str:
    """Return which law would take a good part of what is left, and why it has no name; or nothing.

    Asked where a little more than noise is left. What far more than noise hides has no law in the
    library, and what comes closest to that is the law of something else.

    Parameters
    ----------
    found : Study
        As it is told.
    """
    if not found.floor.value_nm > 0.0 or not CLOSE < found.left.over_floor <= FAR:
        return ""
    library, terms = found.library, [term.candidate for term in found.choice.terms]
    current = library.errors(terms)
    above = float(current.sum()) - noise_energy(library, terms)
    there = {term.form.effect for term in terms} | {number.effect for number in found.numbers}
    for scored in library.rank(terms):
        if scored.form.effect in there or scored.form.catch_all:
            continue
        gain = current - scored.blocks
        if not float(gain.sum()) >= max(_A_GOOD_PART * above, _NO_CHANCE * scatter_of(gain)) > 0.0:
            continue
        if float(gain.sum()) >= least_gain(library, found.choice.plain, [*terms, scored.candidate]):
            continue  # another reason than its size kept it out
        return (
            f"what comes closest to what is left is {effect_name(scored.form.effect)}: it would "
            f"take {100.0 * float(gain.sum()) / above:.0f} % of what stands above the noise, which "
            "is too little of all that was recorded to be worth a name"
        )
    return ""
