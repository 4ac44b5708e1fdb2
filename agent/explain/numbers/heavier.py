"""Arms that would be heavier than the joint that they are a part of."""

from __future__ import annotations

from agent.explain.choosing.search import Library
from agent.explain.numbers.model import Model

_PART = 1.1  # of the joint's inertia: noise may make an arm that is nearly all of it a little more
_FLEXIBLE = "joint-flexibility"
_ARM, _JOINT = "arm_inertia_kg_m2", "inertia_kg_m2"


def heavier_than_the_joint(library: Library, model: Model) -> set[tuple[str, str]]:
    """Return effect and form of springs where one carries more than the joint's whole inertia.

    Such a spring takes the place of something else that grows with frequency, as a wobble's own
    spring does; the motor would be left with less than none. All forms of a spring would.

    Parameters
    ----------
    library : Library
    model : Model
        Fitted.
    """
    joint = model.base[_JOINT]
    if not joint.identified:
        return set()
    forms = {c.form for c in library.candidates if c.form.effect == _FLEXIBLE}
    for term, numbers in zip(model.terms, model.parameters, strict=True):
        if term.scored.form.effect != _FLEXIBLE or _ARM not in numbers:
            continue
        if numbers[_ARM].value > _PART * joint.value:
            return {(form.effect, form.name) for form in (term.scored.form, *forms)}
    return set()
