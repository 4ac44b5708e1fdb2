"""A law whose number is not the same everywhere, taken as the same once the joint is known.

A search looks at a gap as the mean of three that differ by a few percent: one path of an arm that
bounces is thrown to one side or the other by next to nothing, above all while weight and friction
are those of a simulation without the gap. The mean is duller than any path, and so is the contact
that makes up for it: its damping is five times too high, its spring a third too stiff. Beside the
joint's own numbers, at last, a path that is followed nearly alone leaves half as much; but only
from near to its place, as the squared error is rough there, and so from many beginnings.
"""

from __future__ import annotations

from dataclasses import replace

from agent.explain.choosing.candidate import Candidate, basis_of, gain_of
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.materiality import noise_energy
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.choosing.valleys import coefficients_beside
from agent.explain.numbers.polish import polished
from agent.explain.numbers.resting import at_own_numbers

_ROUNDS, _EVENER = 3, 2
_FOLLOWED = 8  # points, those that remove most
_MORE_THAN_NOISE = 1.1  # times its square: what leaves less is as good as it gets
_LESS = 0.75  # of what is left above noise: luck among many paths takes away a little


def evened(library: Library, choice: Choice) -> tuple[Library, Choice]:
    """Take a law as even where that leaves clearly less on unseen data, for as long as it does.

    Parameters
    ----------
    library : Library
        At the numbers of the twin beside the choice.
    choice : Choice
        Settled.

    Returns
    -------
    library : Library
        At the numbers beside what is returned with it.
    choice : Choice
        The same effects and rivals; the very same where nothing leaves clearly less.
    """
    for _ in range(_ROUNDS):
        at = next((i for i, c in enumerate(choice.candidates) if c.form.once_known), None)
        term = None if at is None else _evened(library, choice, at)
        if at is None or term is None:
            break
        terms = (*choice.terms[:at], term, *choice.terms[at + 1 :])
        library, choice = at_own_numbers(library, polished(library, replace(choice, terms=terms)))
    return library, choice


def _evened(library: Library, choice: Choice, at: int) -> Term | None:
    """Return a term at its best even point; None where that is no better."""
    term = choice.terms[at]
    form, noise = term.candidate.form, noise_energy(library, choice.candidates)
    left_now = float(library.errors(choice.candidates).sum())
    if form.once_known is None or left_now <= _MORE_THAN_NOISE * noise:
        return None
    others = [c for i, c in enumerate(choice.candidates) if i != at]
    model = library.model(others)
    basis = basis_of(model)
    left = library.target - basis @ (basis.T @ library.target)

    def gain(candidate: Candidate) -> float:
        return gain_of(candidate, basis, left)

    found = term.candidate
    ends: list[tuple[float, Candidate]] = []
    for _ in range(_EVENER):
        near = form.once_known(library.scene, found.point)
        tried = [Candidate.of(form, point, library.columns(form, point)) for point in near]
        starts = sorted(tried, key=gain, reverse=True)[:_FOLLOWED]
        deeper = [library.deeper(start, basis, left) for start in starts]
        ended = [(float(library.errors([*others, end]).sum()), end) for end in deeper]
        ends.append(min(ended, key=lambda pair: pair[0]))
        found = ends[-1][1]
    least, best = min(ends, key=lambda pair: pair[0])
    if least - noise >= _LESS * (left_now - noise):
        return None
    best = library.candidate(form, best.point)
    blocks = library.errors([*others, best])
    own = coefficients_beside(library, model, best)
    scored = replace(term.scored, candidate=best, coefficients=own, blocks=blocks)
    return replace(term, scored=scored)
