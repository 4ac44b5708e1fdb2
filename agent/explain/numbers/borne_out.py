"""Numbers that what has no name may have bent: none of them is called wrong.

A torque that no law carries pulls the twin's numbers its way when they are refitted: friction that
is higher after every rest, or while a brake drags, asks for a higher Coulomb level on the average.
That is no wrong number. Where more than noise stays, a number is told only as it accounts for ten
times as much as what stays; where far more stays, only as far as its own interval refutes what the
twin says, too. Without a noise floor what stays is at least what goes along an axis, surely.

And an inertia or a friction that comes out surely below zero is none of a joint's, beside laws or
without: a drag that is greatest at some speed takes viscous friction there.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.explain.answer.result import Cell
from agent.explain.choosing.materiality import CLOSE, FAR
from agent.explain.choosing.search import Library
from agent.explain.choosing.shares import unseen_nm2
from agent.explain.numbers.model import Model
from agent.explain.numbers.wrong import WrongNumber, factor_of
from agent.identify.result import Parameter
from agent.physics.twin import Twin

_FAR_MORE = 10.0  # than what stays: drag that has no law here bent viscous friction by 18 %
_FACTOR = "factor"  # of all torque: right at 1; every other number is told as what it has more


def borne_out(
    numbers: Sequence[WrongNumber],
    library: Library,
    model: Model,
    noise_nm: float,
    cells: Sequence[Cell] = (),
) -> tuple[WrongNumber, ...]:
    """Return the numbers that stay refuted beside a mismatch without a name.

    Parameters
    ----------
    numbers : sequence of WrongNumber
    library : Library
    model : Model
        Of the twin's own numbers, without laws.
    noise_nm : float
        Not positive where it could not be measured: then what stays may be noise, but for what
        the map of it shows.
    cells : sequence of Cell
        Of that map.
    """
    left_nm2 = float(np.mean(model.residual_nm**2))
    if not noise_nm > 0.0:
        shown = max((cell.gain for cell in cells if cell.counts), default=0.0)
        noise_nm = math.sqrt(left_nm2 * max(1.0 - shown, 0.0))
    stays_nm2 = left_nm2 - (CLOSE * noise_nm) ** 2
    if stays_nm2 <= 0.0:
        return tuple(numbers)
    given_nm2 = unseen_nm2(library, np.zeros((library.target.shape[0], 0)))
    stays = stays_nm2 / max(given_nm2 - noise_nm**2, left_nm2)
    far = left_nm2 > (FAR * noise_nm) ** 2
    kept = tuple(
        n for n in numbers if n.energy_share > _FAR_MORE * stays and (_refuted(n) or not far)
    )
    # What was told beside a torque constant is another number without it.
    return kept if factor_of(kept) == factor_of(numbers) else ()


def below_zero(
    numbers: Sequence[WrongNumber], twin: Twin, model: Model, noise_nm: float
) -> tuple[WrongNumber, ...]:
    """Return the numbers that no joint can have, which something has bent.

    An inertia and a Coulomb level never are. Friction that hardly grows with speed may end with a
    viscous part below zero, and its level is wrong all the same, where no more than noise stays.

    Parameters
    ----------
    numbers : sequence of WrongNumber
        With their last intervals.
    twin : Twin
        As given.
    model : Model
        Of the choice.
    noise_nm : float
        Not positive where it could not be measured.
    """
    left_nm2 = float(np.mean(model.residual_nm**2))
    stays = 0.0 < (CLOSE * noise_nm) ** 2 < left_nm2
    return tuple(
        number
        for number in numbers
        if any(
            _is_negative(extra, found, twin) and (stays or not extra.startswith("viscous"))
            for extra, found in number.parameters.items()
        )
    )


def _is_negative(extra: str, found: Parameter, twin: Twin) -> bool:
    if "_extra_" not in extra or found.ci95 is None:
        return False
    return float(getattr(twin, extra.replace("_extra_", "_"))) + found.ci95[1] < 0.0


def _refuted(number: WrongNumber) -> bool:
    """Return whether an interval of its own leaves out what the twin says."""
    return any(leaves_out_right(name, p) for name, p in number.parameters.items())


def leaves_out_right(name: str, found: Parameter) -> bool:
    """Return whether a number's interval leaves out what it is where the twin is right."""
    right = 1.0 if name == _FACTOR else 0.0
    return found.ci95 is not None and not found.ci95[0] <= right <= found.ci95[1]
