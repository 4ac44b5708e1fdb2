"""A soft gear that only smooths: a rigid joint, behind a motion that is measured with noise.

The inertia's torque is told by the measured acceleration, noise and all. An arm on a soft and well
damped spring follows that less, and so predicts better, on unseen recordings too, wherever the
motion is noisier than the torque. How much noise alone makes of it can be seen: on a motion that is
noisier once more, how much of what the inertia misses of its own torque would such an arm take?
"""

from __future__ import annotations

import numpy as np

from agent.explain.choosing.candidate import Candidate, basis_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.search import Library
from agent.explain.forms.seen_arm import SEEN
from agent.explain.numbers.noisier import Noisier, inertia_at, noisier
from agent.identify.result import Floats

_FLEXIBLE = "joint-flexibility"
_BY_NOISE = 2.0  # times what noise alone makes of it: true springs gain hundreds of times as much


def only_smooths(library: Library, choice: Choice) -> set[tuple[str, str]]:
    """Return effect and name of all soft gears, where one was chosen that noise alone would show.

    Parameters
    ----------
    library : Library
    choice : Choice
        Settled.
    """
    at = inertia_at(library)
    arms = [term for term in choice.candidates if _is_soft(term)]
    if at < 0 or not arms:
        return set()
    behind = noisier(library)
    for arm in arms:
        others = library.model([term for term in choice.candidates if term is not arm])
        gain = _gain(library.target, others, arm.columns)
        by_noise = [_gain_by_noise(library, others, arm, other, at) for other in behind]
        if gain < _BY_NOISE * float(np.mean(by_noise)):
            alike = (c.form for c in (arm, *library.candidates) if _is_soft(c))
            return {(form.effect, form.name) for form in alike}
    return set()


def _is_soft(candidate: Candidate) -> bool:
    return candidate.form.effect == _FLEXIBLE and candidate.form.name != SEEN


def _gain_by_noise(
    library: Library, others: Floats, arm: Candidate, noisy: Noisier, at: int
) -> float:
    """Return the squared error that an arm takes of a rigid joint's behind a noisier motion."""
    columns = others.copy()
    columns[:, at] += noisy.inertia_noise
    torque = float(library.scene.theta[0]) * others[:, at]
    return _gain(torque, columns, noisy.library.columns(arm.form, arm.point))


def _gain(target: Floats, others: Floats, columns: Floats) -> float:
    """Return how much less squared error some columns leave of a target beside others."""
    basis = basis_of(others)
    left = target - basis @ (basis.T @ target)
    own = basis_of(columns - basis @ (basis.T @ columns), like=columns)
    return float(np.sum((own.T @ left) ** 2))
