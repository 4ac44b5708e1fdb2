"""What is asked about: the recordings, put right before they are compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from agent.explain.numbers.loads import without_unknown_loads
from agent.explain.rows.cleaner import by_the_quieter
from agent.explain.rows.run import Run, stood_in, without_gearbox_temperature
from agent.explain.rows.stamps import put_right
from agent.physics.twin import Twin


@dataclass(frozen=True)
class Asked:
    """What is asked about, as it can be compared.

    Parameters
    ----------
    runs, holdout : tuple of Run
    by_motor : bool
        Whether the motor's temperature stands in for the gearbox's.
    apart, bettered : tuple of str
        Which hold-outs were left out; which stamps were put right, and whether the motion was taken
        from the position alone.
    """

    runs: tuple[Run, ...]
    holdout: tuple[Run, ...]
    by_motor: bool
    apart: tuple[str, ...]
    bettered: tuple[str, ...]


def as_asked(twin: Twin, runs: Sequence[Run], holdout: Sequence[Run]) -> Asked:
    """Return recordings with stamps put right, the quieter motion, a thermometer and known loads.

    Parameters
    ----------
    twin : Twin
        As given: it may know what payloads add.
    runs, holdout : sequence of Run
        As they were recorded.
    """
    everything, stamped = put_right((*runs, *holdout))
    everything, quieter = by_the_quieter(everything, twin.inertia_kg_m2)
    runs, holdout = everything[: len(runs)], everything[len(runs) :]
    by_motor = without_gearbox_temperature((*runs, *holdout))
    if by_motor:
        runs, holdout = stood_in(runs), stood_in(holdout)
    holdout, apart = without_unknown_loads(twin, runs, holdout)
    return Asked(tuple(runs), tuple(holdout), by_motor, tuple(apart), (*stamped, *quieter))
