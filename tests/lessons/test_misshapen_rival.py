"""A rival that misses little of a large gain is out where the chosen law leaves only noise."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.choosing.candidate import Scored
from agent.explain.choosing.materiality import noise_energy
from agent.explain.choosing.rivals import with_rivals
from tests.lessons.test_warmth_or_time import warms_up


@pytest.mark.parametrize(
    ("left", "missed", "stands"), [(0.0, 0.4, False), (0.0, 0.1, True), (0.4, 0.4, True)]
)
def test_what_a_rival_may_miss_is_what_the_laws_own_form_leaves(
    left: float, missed: float, stands: bool
) -> None:
    """`left` and `missed` are times the noise: what the law leaves above it, and a rival more.

    All of it is less than a twentieth of what the law explains.
    """
    library = warms_up()
    best = next(s for s in library.rank([]) if s.form.effect == "temperature-dependent-friction")
    other = next(s for s in library.rank([]) if s.form.effect == "friction-drift")
    noise = noise_energy(library, [best.candidate])
    assert 0.8 * noise < 0.05 * (library.errors([]).sum() - best.error)

    def leaves(scored: Scored, above: float) -> Scored:
        count = best.blocks.size
        even = (1.0 + above) * noise / count * (1.0 + 1e-3 * np.cos(np.arange(count)))
        return replace(scored, blocks=np.asarray(even))

    own = leaves(best, left)
    form = replace(other.candidate.form, effect="local-fault")
    rival = leaves(replace(other, candidate=replace(other.candidate, form=form)), left + missed)
    term = with_rivals(library, [], [own, rival], own, 0.0, {})
    assert bool(term.rivals) == stands
