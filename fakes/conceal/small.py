"""The little of everything that a real joint has, sized to stay below what is worth naming."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from fakes.conceal.concealment import BASES, Basis, Concealment
from fakes.conceal.library import NUISANCES, maker
from fakes.conceal.refit import Refit
from fakes.conceal.rehearsal import Rehearsal
from fakes.conceal.truth import Truth

LEAST_SHARE, MOST_SHARE = 0.002, 0.03
"""Of the noise's energy, for each nuisance."""

_SAME_COLUMNS = {"direction-asymmetry", "torque-offset"}


@dataclass(frozen=True)
class Put:
    """An effect at the amplitude that was found, and the SNR that it has by itself."""

    concealment: Concealment
    amplitude: float
    snr: float
    moved_nm: Mapping[Basis, float] = field(default_factory=dict)  # of the residual, by basis

    def into(self, truth: Truth) -> Truth:
        """Return the truth with the effect in it."""
        return self.concealment.put(truth, self.amplitude)


def all_in(truth: Truth, puts: Sequence[Put]) -> Truth:
    """Return the truth with all of them in it."""
    for put in puts:
        truth = put.into(truth)
    return truth


def small_effects(
    rng: np.random.Generator, rehearsal: Rehearsal, large: Sequence[str]
) -> list[Put]:
    """Return two or three nuisances, none of them among the large effects or their twins.

    Each moves the twin's residual by 0.2 to 3 percent of the noise's energy, and the refitted one's
    by that or less. All of them add torque in proportion to their amplitude, so one rehearsal says
    how large that must be.
    """
    taken = set(large)
    if taken & _SAME_COLUMNS:
        taken |= _SAME_COLUMNS
    free = [name for name in NUISANCES if name not in taken]
    if not taken & _SAME_COLUMNS:
        free.remove(str(rng.choice(sorted(_SAME_COLUMNS))))
    names = rng.choice(free, size=int(rng.integers(2, 4)), replace=False)
    plain = rehearsal.see(rehearsal.robot.truth)
    out = []
    for name in names:
        concealment = maker(str(name))(rng, rehearsal.robot)
        share = float(np.exp(rng.uniform(np.log(LEAST_SHARE), np.log(MOST_SHARE))))
        tried = concealment.put(rehearsal.robot.truth, concealment.first)
        seen = rehearsal.see(tried)
        moved = {
            basis: difference_nm(rehearsal, rehearsal.fit(seen, basis), rehearsal.fit(plain, basis))
            for basis in BASES
        }
        # Neither a refit nor the twin as given may find it large.
        times = float(np.sqrt(share)) * rehearsal.floor_nm / max(moved.values())
        if times * concealment.first <= concealment.most:
            grown = {basis: times * value for basis, value in moved.items()}
            snr = grown["refitted"] / rehearsal.floor_nm
            out.append(Put(concealment, times * concealment.first, snr, grown))
    return out


def difference_nm(rehearsal: Rehearsal, one: Refit, other: Refit) -> float:
    """Return the root mean square of what two residuals differ by, over samples that count."""
    pairs = zip(one.residual_nm, other.residual_nm, rehearsal.counted, strict=True)
    differences = [(a - b)[m] for a, b, m in pairs]
    return float(np.sqrt(np.mean(np.concatenate(differences) ** 2)))
