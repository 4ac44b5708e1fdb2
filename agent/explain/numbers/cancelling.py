"""What two laws make together is known, and neither by itself: they cancel, or share a constant."""

from __future__ import annotations

from collections.abc import Mapping
from itertools import combinations

from agent.explain.choosing.candidate import basis_of
from agent.explain.choosing.same_spring import is_one_arm
from agent.explain.choosing.search import Library
from agent.explain.numbers.model import Model
from agent.identify.result import Parameter

_PINNED = "spring"  # the cable that hangs free in the middle of the stroke, as no other says where
_CONSTANTS = frozenset({"torque_offset_nm", "coulomb_difference_nm"})
_ONE_CONSTANT = (
    "an offset, Coulomb friction that differs between the directions, and the angle at which a "
    "cable hangs free are one constant torque: what they make together is known"
)
_LEFT = 0.5  # of the smaller one's energy, or less


def cancelled_by(library: Library, model: Model) -> Mapping[int, int]:
    """Return which terms are nearly cancelled, by index, and by which other one.

    A hose's pull and a weight that is too small both follow the arm. On a short stroke any share of
    the one may be made up for by the other, and a form that is not quite the joint's decides how
    much. What the twin's own numbers take up counts for neither. A wave and the soft gear that it
    shakes are known where both say the same spring.

    Parameters
    ----------
    library : Library
    model : Model
    """
    basis = basis_of(library.base)
    torques = []
    for term, where in zip(model.terms, model.slices(), strict=True):
        weighted = term.candidate.columns @ model.coefficients[where]
        torques.append(weighted - basis @ (basis.T @ weighted))
    out: dict[int, int] = {}
    for i, j in combinations(range(len(torques)), 2):
        if is_one_arm(model.terms[i].candidate, model.terms[j].candidate):
            continue
        both = torques[i] + torques[j]
        smaller = min(float(torques[i] @ torques[i]), float(torques[j] @ torques[j]))
        if float(both @ both) < _LEFT * smaller:
            out.setdefault(i, j)
            out.setdefault(j, i)
    return out


def without_one_constant(model: Model, numbers: Mapping[str, Parameter]) -> dict[str, Parameter]:
    """Return a law's numbers, none of which is one of several that are the same constant torque.

    Beside a constant a cable is told about the middle of the stroke, wherever it hangs free; its
    stiffness is known.

    Parameters
    ----------
    model : Model
    numbers : mapping of str to Parameter
        Of one of its terms, as a twin names them.
    """
    forms = [term.scored.form for term in model.terms]
    pinned = any(form.effect == "cable-force" and form.name == _PINNED for form in forms)
    if not pinned or not any(_CONSTANTS & set(form.linear) for form in forms):
        return dict(numbers)
    shared = _CONSTANTS | {"neutral_arm_rad"}
    return {
        name: Parameter.not_identified(_ONE_CONSTANT, p.value) if name in shared else p
        for name, p in numbers.items()
    }
