"""Which of the candidates stands: the simplest that unseen data do not speak against."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.rivals import DECISIVE, LIKE_A_WEIGHT, WEIGHT, log_density_gap
from agent.explain.choosing.search import Library
from agent.explain.forms.balancer import BALANCERS
from agent.explain.forms.form import Form
from agent.explain.rows.evidence import effective_size
from agent.explain.rows.table import GRAVITY_AT
from agent.physics.friction import boundary_share

_SAME = 0.1  # of log density: columns that copy each other differ by no more
_ONE_SPOT = ("position-dependent-friction", "tight spot"), ("local-fault", "rubbing")
_AS_WIDE = 0.05  # of its width: a spot that is found as wide under both names, and there
_BEND = "viscous-nonlinear"
_NOT_OVER = 0.1  # of a fall, still there at the fastest speed
_AS_GOOD = 0.05  # of the gain: what a bend may miss of such a fall's, whose form is not the joint's
_AS_MUCH = 0.01  # of the gain: what a special case misses of it is small, however significant
_SHOWS = 0.1  # of what is left: what a weight's look-alike misses, and is none
_AS_LITTLE = 0.03  # of what is left: for less no spring stiffens, and no catch-all stands first


def preferred(library: Library, ranked: Sequence[Scored], without: float) -> Scored | None:
    """Return the simplest candidate that is not clearly worse than the best on unseen data.

    What may stand for anything comes after what leaves hardly more: a motor that turns one way only
    shows a ripple and friction along its turn as the same. A weight comes after what looks like it
    where the twin has none: an axis that stands upright has cables and offsets as any other, and
    neither its arm nor a payload pulls at it.

    Parameters
    ----------
    library : Library
    ranked : sequence of Scored
    without : float
        Squared error on unseen data without any of them.
    """
    if not ranked:
        return None
    best = ranked[0]
    if best.form.only_clearly and any(
        s.form.refined_by(best.form) and s.error <= (1.0 + _AS_LITTLE) * best.error for s in ranked
    ):
        return preferred(library, ranked[1:], without)
    size = effective_size(library.scene.table, library.weighing, library.residual([best.candidate]))
    upright = not np.any(library.scene.as_given[GRAVITY_AT])
    close = []
    for scored in ranked:
        loss = scored.blocks - best.blocks
        error = float(np.std(loss)) * math.sqrt(loss.shape[0])
        behind = log_density_gap(best.blocks, scored.blocks, size)
        missed = float(loss.sum()) / max(without - best.error, 1e-300)
        pulls = upright and best.form.effect == WEIGHT and _is_like_a_weight(scored.form)
        hardly = float(loss.sum()) < _AS_LITTLE * best.error
        small = missed < _AS_MUCH
        if pulls or best.form in BALANCERS:
            # A strong weight's look-alike misses a small share of it, and is plainly none.
            small = small and float(loss.sum()) < _SHOWS * best.error
        special = ((behind < DECISIVE or hardly) and scored.form.refined_by(best.form)) or (
            (pulls or scored.form.effect in best.form.contains) and (behind < DECISIVE or small)
        )
        special = special or (hardly and best.form.catch_all and not scored.form.catch_all)
        if behind < _SAME or special or (float(loss.sum()) <= error and behind < 2.0 * DECISIVE):
            close.append(scored)
    if any(s.form.effect == WEIGHT for s in close):
        # A spring whose shorter lever is nothing is a weight: it stands for one as any law that has
        # one more number would.
        close = [s for s in close if s.form not in BALANCERS]
    # A cubic pull beside a weight that is off copies a hose that pulls evenly: hoses do.
    close = [s for s in close if not any(s.form.less_usual_than(other.form) for other in close)]
    # Of laws as simple, the one whose effect can explain most: by its other forms, too.
    of_effect: dict[str, float] = {}
    for scored in ranked:
        if scored is best or not scored.form.rivals_none:
            of_effect.setdefault(scored.form.effect, scored.error)
    return min(
        close,
        key=lambda s: (
            s.form.catch_all,
            upright and s.form.effect == WEIGHT,
            s.form.size,
            of_effect.get(s.form.effect, s.error),
            s.error,
        ),
        default=best,
    )


def _is_like_a_weight(form: Form) -> bool:
    """Return whether a form is taken for a weight, and is not one with another number."""
    return form.effect in LIKE_A_WEIGHT and form not in BALANCERS


def named_by_width(library: Library, ranked: Sequence[Scored], best: Scored) -> Scored:
    """Return the best, or the other name of one spot that brakes: narrow a fault, wide the path's.

    Between the widest fault and the narrowest tight spot both are the same columns. Which comes
    first is told by which of the two the width is nearer to.

    Parameters
    ----------
    library : Library
    ranked : sequence of Scored
    best : Scored
        One of them.
    """
    names = {(s.form.effect, s.form.name): s for s in ranked}
    own = best.form.effect, best.form.name
    if own not in _ONE_SPOT or not all(name in names for name in _ONE_SPOT):
        return best
    spot, fault = (names[name] for name in _ONE_SPOT)
    (center, width), (other, as_wide) = spot.candidate.point, fault.candidate.point
    if abs(width - as_wide) > _AS_WIDE * width or abs(center - other) > _AS_WIDE * width:
        return best
    ends = [s.form.limits(library.scene)[1] for s in (spot, fault) if s.form.limits is not None]
    narrowest, widest = ends[0][0], ends[1][1]
    return fault if best.candidate.point[1] < math.sqrt(narrowest * widest) else spot


def named_by_reach(
    library: Library, ranked: Sequence[Scored], best: Scored, without: float
) -> Scored:
    """Return the best, or a bend over all speeds in place of a fall that no driven speed ends.

    Friction falls with speed as a film builds up, at a speed that carries. Where a tenth of a
    Stribeck law's fall is still to come at the fastest speed, that was not seen; the law is a curve
    with a free exponent beside Coulomb and viscous friction, and copies any that bends.

    Parameters
    ----------
    library : Library
    ranked : sequence of Scored
    best : Scored
        One of them.
    without : float
        Squared error on unseen data without any of them.
    """
    if best.form.effect != "stribeck":
        return best
    if float(boundary_share(library.scene.fastest, *best.candidate.point)) < _NOT_OVER:
        return best
    bend = next((s for s in ranked if s.form.effect == _BEND), best)
    return bend if bend.error - best.error < _AS_GOOD * (without - best.error) else best
