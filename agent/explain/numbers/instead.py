"""A law that does by itself what refitted numbers do, where none of these is known by itself.

Coulomb and viscous friction, freed together, take up most of a fall with speed; and where that is
weak, what they leave of it is hardly more than noise. Their intervals reach over what the twin says
then, as the law could stand for either. If the law alone, beside the numbers as they are given,
leaves no more on unseen blocks, then that is as likely to be what differs.

And behind a gear of one to one a weight pulls once a turn of the motor, as a ripple of order one
does: a screw or a direct drive does not tell the two apart, however well their size is known.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

from agent.explain.choosing.rivals import DECISIVE, log_density_gap
from agent.explain.choosing.search import Library
from agent.explain.numbers.borne_out import leaves_out_right
from agent.explain.numbers.wrong import WrongNumber
from agent.explain.rows.evidence import effective_size
from agent.physics.twin import Twin

_WEIGHT, _RIPPLE = "gravity-imbalance", "torque-ripple"


def with_laws_instead(numbers: Sequence[WrongNumber], library: Library) -> tuple[WrongNumber, ...]:
    """Return the one wrong number that is told, tied with the laws that do as well alone.

    Parameters
    ----------
    numbers : sequence of WrongNumber
        All that is told, with its last intervals.
    library : Library
    """
    if len(numbers) != 1 or any(leaves_out_right(*each) for each in numbers[0].parameters.items()):
        return tuple(numbers)
    (wrong,) = numbers
    own = library.errors_with(library.base)
    size = effective_size(library.scene.table, library.weighing, library.residual([]))
    behind: dict[str, float] = {}
    for candidate in library.candidates:
        gap = log_density_gap(own, library.errors_with(candidate.columns), size)
        effect = candidate.form.effect
        behind[effect] = min(gap, behind.get(effect, math.inf))
    # The numbers are told first, however much better a law is: as likely as the best of them.
    best = min([0.0, *behind.values()])
    likely = {e: math.exp(best - gap) for e, gap in behind.items() if gap - best < DECISIVE}
    whole = 1.0 + math.fsum(likely.values())
    others = {effect: weight / whole for effect, weight in likely.items()}
    return (replace(wrong, alternatives={**wrong.alternatives, **others}),)


def with_a_ripple_instead(numbers: Sequence[WrongNumber], twin: Twin) -> tuple[WrongNumber, ...]:
    """Return numbers with what has the same column as gravity where motor and arm turn alike.

    But for a twin whose arm weighs something: more of that is far likelier than a motor that pulls
    once a turn.

    Parameters
    ----------
    numbers : sequence of WrongNumber
    twin : Twin
        As given.
    """
    if twin.gear_ratio != 1.0 or twin.gravity_sin_nm or twin.gravity_cos_nm:
        return tuple(numbers)
    return tuple(
        replace(number, alternatives=_as_likely((*number.alternatives, _RIPPLE)))
        if number.effect == _WEIGHT
        else number
        for number in numbers
    )


def _as_likely(others: Sequence[str]) -> dict[str, float]:
    return dict.fromkeys(others, 1.0 / (1.0 + len(others)))
