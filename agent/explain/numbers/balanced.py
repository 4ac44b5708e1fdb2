"""A balancer's spring in gravity's place: as it grows stronger with its length it is a sine, too.

What pulls at a spring of levers a and b is ``a b sin p`` times the force over the length. The part
of the force that grows with the length leaves a plain sine of the arm's angle, which gravity's two
numbers take wherever they are refitted; they would be told as wrong. Where the spring with such a
part does as well as the spring beside any weight, the weight is as it was given.
"""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.explain.choosing.search import Library
from agent.explain.forms.balancer import COIL, FORCE
from agent.explain.forms.form import Form
from agent.explain.rows.evidence import Weighing
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats

_SURELY = 3.0  # standard errors: what misses more is none
_SHOWS = 0.02  # of what is left: so much a spring may miss whose shape is not quite the law's
_LESS = 0.9  # of what gravity alone leaves: where no spring is left to see there is none


def spring_does_without(
    scene: Scene, held: Scene, weighing: Weighing, forms: Sequence[Form]
) -> bool:
    """Return whether a balancer's spring explains what it and a wrong weight explain.

    Parameters
    ----------
    scene, held : Scene
        With gravity among the numbers that are refitted, and with gravity as given.
    weighing : Weighing
    forms : sequence of Form
        All that these recordings can show.
    """
    if FORCE not in forms or not COIL.grid(held):
        return False
    beside = _left(scene, weighing, FORCE)
    instead = _left(held, weighing, COIL)
    if beside is None or instead is None:
        return False
    plain = Library.of(scene, weighing, ()).errors(())
    if float(beside.sum()) > _LESS * float(plain.sum()):
        return False
    loss = instead - beside
    chance = _SURELY * float(np.std(loss)) * math.sqrt(loss.shape[0])
    return float(loss.sum()) <= max(chance, _SHOWS * float(beside.sum()))


def _left(scene: Scene, weighing: Weighing, form: Form) -> Floats | None:
    """Return what a form leaves on unseen blocks, shape (b,), or nothing where it helps nowhere."""
    ranked = Library.of(scene, weighing, (form,)).rank(())
    return ranked[0].blocks if ranked else None
