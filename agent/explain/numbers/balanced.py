"""A balancer's spring in gravity's place: as it grows stronger with its length it is a sine, too.

What pulls at a spring of levers a and b is ``a b sin p`` times the force over the length. The part
of the force that grows with the length leaves a plain sine of the arm's angle, which gravity's two
numbers take wherever they are refitted; they would be told as wrong. Where the spring with such a
part does as well as the spring beside any weight, the weight is as it was given.
"""

from __future__ import annotations

from collections.abc import Sequence

from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.rivals import DECISIVE, LIKE_A_WEIGHT, log_density_gap
from agent.explain.choosing.search import Library
from agent.explain.forms.balancer import BALANCERS, COIL, FORCE
from agent.explain.forms.form import Form
from agent.explain.rows.evidence import Weighing, effective_size
from agent.explain.rows.scene import Scene

_LESS = 0.9  # of what gravity alone leaves: where no spring is left to see there is none


def spring_does_without(
    scene: Scene, held: Scene, weighing: Weighing, forms: Sequence[Form]
) -> bool | None:
    """Return whether a balancer's spring explains what it and a wrong weight explain.

    Parameters
    ----------
    scene, held : Scene
        With gravity among the numbers that are refitted, and with gravity as given.
    weighing : Weighing
    forms : sequence of Form
        All that these recordings can show.

    Returns
    -------
    bool or None
        None where no such spring stands beside gravity, or a hose leaves as little.
    """
    if FORCE not in forms or not COIL.grid(held):
        return None
    library = Library.of(scene, weighing, (FORCE,))
    beside = _best(library)
    if beside is None or beside.error > _LESS * float(library.errors(()).sum()):
        return None
    left = library.residual([beside.candidate])
    size = effective_size(scene.table, weighing, left)
    # Between its two ends a spring bends as many curves do: what has no levers is likelier.
    hoses = [f for f in forms if f.effect in LIKE_A_WEIGHT and f not in BALANCERS]
    hose = _best(Library.of(scene, weighing, hoses))
    instead = _best(Library.of(held, weighing, BALANCERS))
    if instead is None or (
        hose is not None and log_density_gap(beside.blocks, hose.blocks, size) < DECISIVE
    ):
        return None
    return log_density_gap(beside.blocks, instead.blocks, size) < DECISIVE


def _best(library: Library) -> Scored | None:
    ranked = library.rank(())
    return ranked[0] if ranked else None
