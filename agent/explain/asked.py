"""What is asked about: the recordings, put right before they are compared."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from agent.explain.numbers.loads import without_unknown_loads
from agent.explain.rows.cleaner import by_the_quieter
from agent.explain.rows.coarser import coarsened
from agent.explain.rows.corners import with_corners
from agent.explain.rows.full_rate import choose_band
from agent.explain.rows.glitches import without_glitches
from agent.explain.rows.half_sample import in_step_with, said_of
from agent.explain.rows.refit import refit
from agent.explain.rows.repeats import with_turns_counted, without_repeats
from agent.explain.rows.run import Run, stood_in, without_gearbox_temperature
from agent.explain.rows.stamps import put_right
from agent.explain.rows.table import BASE, Table, tabulate
from agent.explain.rows.use import used_elsewhere
from agent.identify.signals.preprocess import read_motion
from agent.identify.slips import slips_said
from agent.physics.effects.motion import Recorded
from agent.physics.twin import Twin

_FAR = 5.0  # times the simulation's inertia, or a part of it: a unit, or another joint
_MOST = 0.5  # of what the simulation as given leaves


@dataclass(frozen=True)
class Asked:
    """What is asked about, as it can be compared.

    Parameters
    ----------
    runs, holdout : tuple of Run
    by_motor : bool
        Whether the motor's temperature stands in for the gearbox's.
    apart, bettered : tuple of str
        Which hold-outs were left out; where a position jumps, which rows were told twice or stood
        alone, which stamps were put right, whether the motion was taken from the position alone,
        and whether it was half a sample off.
    """

    runs: tuple[Run, ...]
    holdout: tuple[Run, ...]
    by_motor: bool
    apart: tuple[str, ...]
    bettered: tuple[str, ...]

    @property
    def elsewhere(self) -> tuple[Recorded, ...]:
        """Return what the hold-outs add to the joint's use."""
        return used_elsewhere(self.holdout, self.runs)


def tabulated(
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run],
    late_s: float = 0.0,
    band_hz: float | None = None,
    *,
    align_velocity: bool | None = None,
) -> tuple[Asked, Table]:
    """Return what is asked about, and the table of the recordings to learn from, creep and all.

    The band follows from what the inertia makes of the motion's noise. A simulation's, off by a
    unit or of another joint, would leave a band in which nothing is seen: then it is the inertia
    that the recordings show.

    Parameters
    ----------
    twin : Twin
        As given.
    runs, holdout : sequence of Run
        As they were recorded.
    late_s : float
        By what half a sample the torque is known to be later than the motion.
    band_hz : float, optional
        The band, where it and the motion to take are known.
    align_velocity : bool, optional
        Whether the velocity is brought in step with the position; chosen where not given.

    Raises
    ------
    ValueError
        The recordings cannot be compared.
    """
    known = band_hz is not None
    asked = as_asked(twin, runs, holdout, twin.inertia_kg_m2, late_s, quieter=not known)
    step = {"align_velocity": align_velocity}
    table = tabulate(twin, asked.runs, band_hz, **step, elsewhere=asked.elsewhere)
    shown = _shown_inertia_kg_m2(table, twin)
    if known or 1.0 / _FAR < twin.inertia_kg_m2 / shown < _FAR:
        return asked, table
    asked = as_asked(twin, runs, holdout, shown, late_s)
    band_hz = choose_band([read_motion(run.signals) for run in asked.runs], shown)
    return asked, tabulate(twin, asked.runs, band_hz, **step, elsewhere=asked.elsewhere)


def _shown_inertia_kg_m2(table: Table, twin: Twin) -> float:
    """Return the inertia that recordings show where that is most of a mismatch; else the twin's."""
    rows = table.sliding
    if not rows.any():
        return max(twin.inertia_kg_m2, 1e-300)
    moved, left = refit(table)
    given, refitted = table.target_nm[rows], left[rows]
    shown = twin.inertia_kg_m2 + float(moved[BASE.index("inertia_kg_m2")])
    clear = float(refitted @ refitted) < _MOST * float(given @ given) and shown > 0.0
    return shown if clear else max(twin.inertia_kg_m2, 1e-300)


def as_asked(
    twin: Twin,
    runs: Sequence[Run],
    holdout: Sequence[Run],
    inertia_kg_m2: float,
    late_s: float = 0.0,
    *,
    quieter: bool = True,
) -> Asked:
    """Return recordings put right: no row twice, no glitches, right stamps, known loads.

    Parameters
    ----------
    twin : Twin
        As given: it may know what payloads add.
    runs, holdout : sequence of Run
        As they were recorded.
    inertia_kg_m2 : float
        By which the motion's noise is judged.
    late_s : float
        By what half a sample the torque is known to be later than the motion.
    quieter : bool
        Whether the motion is taken from position or velocity, whichever has less noise.
    """
    everything, wrapped = with_turns_counted((*runs, *holdout))
    jumped = slips_said([run.signals for run in everything])
    everything, repeated = without_repeats(everything)
    everything, glitched = without_glitches(everything)
    everything, stamped = put_right(everything)
    better: tuple[str, ...] = ()
    if quieter:
        everything, better = by_the_quieter(everything, inertia_kg_m2, stamped=bool(stamped))
    everything = with_corners(everything)
    stepped = (said_of(late_s),) if late_s else ()
    if late_s:
        everything = in_step_with(everything, late_s)
    everything = coarsened(everything)
    runs, holdout = everything[: len(runs)], everything[len(runs) :]
    by_motor = without_gearbox_temperature((*runs, *holdout))
    if by_motor:
        runs, holdout = stood_in(runs), stood_in(holdout)
    holdout, apart = without_unknown_loads(twin, runs, holdout)
    return Asked(
        tuple(runs),
        tuple(holdout),
        by_motor,
        tuple(apart),
        (*wrapped, *jumped, *repeated, *glitched, *stamped, *better, *stepped),
    )
