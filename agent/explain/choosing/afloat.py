"""Laws of motion that remove noise: what they are worth while speeds are held is no physics.

The measured velocity's noise, differentiated and multiplied by the inertia, is in what the twin
predicts. A gap whose arm floats while nothing accelerates takes the arm's part of it out again. So
does a soft gear far below the joint's own, damped until it is a low-pass: the less of the inertia
follows fast motion, the less of the noise is in the prediction. So does a delay, which turns the
noise's phase. A joint without any of them is predicted better for it, on unseen data, too. What is
there shows where the speed changes: play where the load on the gear changes sides.

An arm that rattles in play while a speed is held is no noise: sometimes it asks for its torque.
Noise is best left out altogether, and inertia that is not there at held speeds removes more of it
than any arm that floats at times.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.heard import BACKLASH, heard
from agent.explain.choosing.materiality import least_gain, noise_energy
from agent.explain.choosing.search import Library
from agent.explain.forms.seen_arm import SEEN
from agent.explain.rows.strata import STEADY
from agent.identify.result import Floats

_MOSTLY = 0.5  # of what it removes; of play that is there it is a tenth at most
_AS_NOISE = 0.5  # of that: as much goes with the motion's noise
_LOW_PASSES = frozenset({"joint-flexibility", "measurement-delay"})


def afloat(library: Library, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and form of laws that remove next to nothing where the speed changes.

    Of gaps, where motion that asks for no torque at held speeds would do half of it; and of soft
    gears, with a gap or without, and delays whose rest is not worth a name, and that remove no more
    than there is noise: a wave may shake an arm behind a spring at any
    speed, and a gear that rings on while a speed is held shows how late the torque is. Of these all
    forms, as each would remove as much.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    """
    held = library.scene.table.stratum[library.weighing.rows] == STEADY
    terms = choice.candidates
    out = set()
    for term in terms:
        effect = term.form.effect
        is_gap = effect == BACKLASH and not heard(library.scene, term.form)
        if term.form.name == SEEN:
            continue  # that arm is measured, and may rattle at any speed
        rings = effect in _LOW_PASSES or (is_gap and _is_soft(term, library))
        if not is_gap and not rings:
            continue
        without = library.residual([other for other in terms if other is not term])
        removed = without**2 - library.residual(terms) ** 2
        if not float(np.sum(removed[held])) > _MOSTLY * float(np.sum(removed)) > 0.0:
            continue
        if not rings:
            if _noise_of_motion(library, without, held) > _AS_NOISE * float(np.sum(removed[held])):
                out.add((effect, term.form.name))
            continue
        whole, changing = float(np.sum(removed)), float(np.sum(removed[~held]))
        takes_noise = whole < noise_energy(library, terms)
        if takes_noise and changing < least_gain(library, choice.plain, terms):
            forms = (candidate.form for candidate in library.candidates)
            out |= {(form.effect, form.name) for form in forms if form.effect == effect}
    return out


def _noise_of_motion(library: Library, left: Floats, held: NDArray[np.bool_]) -> float:
    """Return what goes of what is left where inertia asks for less, or nothing, at held speeds."""
    scene, weighing = library.scene, library.weighing
    column = np.where(held, scene.table.base[weighing.rows, 0] * weighing.weight, 0.0)
    basis = basis_of(library.base)
    column = column - basis @ (basis.T @ column)
    size = float(column @ column)
    along = column * (float(column @ left) / size) if size > 0.0 else column
    return float(np.sum((left**2 - (left - along) ** 2)[held]))


def _is_soft(gap: Candidate, library: Library) -> bool:
    """Return whether the teeth of a gap meet so softly that the arm rings within the band."""
    at = gap.form.nonlinear.index("contact_hz")
    return gap.point[at] < library.scene.table.cutoff_hz
