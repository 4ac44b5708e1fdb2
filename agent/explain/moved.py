"""Numbers that come out far from the simulation's beside what was found, and are no finding.

A number that most fits without the findings leave alone is bent, not wrong (decision 0035): the
simulation had it right for its own structure. Beside laws that brake in no one way, as a wave along
the path does, it may be wrong all the same, and hidden by what they took from the fit.
"""

from __future__ import annotations

from agent.explain.answer.names import NUMBERS
from agent.explain.answer.number_sentences import change_said
from agent.explain.choosing.materiality import CLOSE
from agent.explain.study import Study
from agent.numbers import parameter_unit

_FAR = 0.08  # of the number
_WIDTHS = 3.0  # half intervals from the number that was found
_FRICTION = ("coulomb_nm", "viscous_nm_s_per_rad")
_BRAKE_IN_NO_ONE_WAY = frozenset(
    {
        "torque-ripple",
        "position-dependent-friction",
        "local-fault",
        "cable-force",
        "torque-offset",
        "resolver-error",
        "measurement-delay",
    }
)


def moved_said(found: Study) -> str:
    """Return which friction comes out otherwise beside what was found; empty where none does."""
    effects = {term.scored.form.effect for term in found.choice.terms}
    if not effects or effects - _BRAKE_IN_NO_ONE_WAY or found.table.simulated or found.numbers:
        return ""
    if found.left.ratio > CLOSE:
        return ""
    said = []
    for name in _FRICTION:
        given, number = float(getattr(found.twin, name)), found.model.base[name]
        if number.ci95 is None or not abs(number.value - given) > _FAR * abs(given):
            continue
        low, high = number.ci95
        if abs(number.value - given) > _WIDTHS * 0.5 * (high - low):
            said.append(change_said(NUMBERS[name], given, number.value, parameter_unit(name)))
    if not said:
        return ""
    return (
        f"beside what was found {' and '.join(said)}, and twin.toml has that; without what was "
        "found recordings do not show it, so that it is told as no wrong number of the simulation"
    )
