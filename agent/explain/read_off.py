"""The plain numbers of a recorded simulation, read off its torque where twin.toml's are others.

A recorded simulation stands in the twin's place, but what is possible for the joint, how heavy an
arm can be and what its friction yields to, is held against the twin's numbers. Those of another
joint, or of a file that only says which gear there is, would refuse what is right.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from agent.explain.answer.names import NUMBERS
from agent.explain.answer.number_sentences import change_said
from agent.explain.asked import tabulated
from agent.explain.numbers.model import predicted, with_numbers
from agent.explain.plausible import contradiction
from agent.explain.rows.creep import without_creep
from agent.explain.rows.run import Run
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats
from agent.numbers import parameter_unit
from agent.physics.twin import Twin, TwinError

_ANOTHER = 0.1  # of the recorded simulation's torque: what other plain numbers must bring
_SLIGHT = 0.02  # of it: what they must where they are most of the difference
_MOST = 0.4  # of the difference: what they leave at most then
_PLAIN = 0.5  # of what the given numbers leave of it: more is an effect, which no number makes up
_NOTHING = 2e-3  # of the measured torque: what a number that is none makes of it
_MOVED = 0.1  # of the torque of what moves most: less is not told


def read_off(
    twin: Twin, runs: Sequence[Run], holdout: Sequence[Run]
) -> tuple[Twin, tuple[str, ...]]:
    """Return the twin that a recorded simulation's torque is of, and what is said of that.

    Parameters
    ----------
    twin : Twin
        As given.
    runs, holdout : sequence of Run
        All with a recorded simulation.

    Returns
    -------
    twin : Twin
        That given, with other plain numbers where its own do not predict the simulation, and
        without effects that these recordings cannot drive.
    said : tuple of str
        What was changed; nothing where all of it stays.
    """
    if not runs or contradiction((*runs, *holdout)):
        return twin, ()
    try:
        table = without_creep(tabulated(twin, runs, holdout)[1])
    except ValueError:
        return twin, ()  # they cannot be compared, as is said where they are asked about
    twin, left_out = _predictable(table, twin)
    moved = _moved(table, twin)
    if moved is None:
        return twin, left_out
    numbers = {name: getattr(twin, name) + d for name, d in zip(BASE, moved, strict=True)}
    least_nm = _NOTHING * _rms(table.measured_nm[table.sliding])
    for name, torque_nm in _torques_nm(table, numbers).items():
        if torque_nm < least_nm:
            numbers[name] = 0.0
    found = with_numbers(twin, numbers)
    return found, (*left_out, _said(table, twin, found))


def _predictable(table: Table, twin: Twin) -> tuple[Twin, tuple[str, ...]]:
    """Return the twin without effects where these recordings lack what they need, and that said.

    The recorded simulation has them or not; beside it they are asked for nothing.
    """
    try:
        predicted(table, twin)
    except TwinError as error:
        why = str(error).rstrip(".")
        said = f"the effects of twin.toml are left out beside the recorded simulation ({why})"
        return replace(twin, effects=()), (said,)
    return twin, ()


def _moved(table: Table, twin: Twin) -> Floats | None:
    """Return by how much the numbers differ from the simulation's, (5,); None where they do not."""
    rows, carried = table.sliding & np.isfinite(table.given_nm), table.carried
    if not rows.any() or not carried.any():
        return None
    columns = table.base[np.ix_(rows, carried)]
    simulated_nm, left_nm = table.given_nm[rows], (table.given_nm - predicted(table, twin))[rows]
    size = np.sqrt(np.mean(columns**2, axis=0))
    weights = np.linalg.lstsq(columns / size, left_nm, rcond=1e-9)[0] / size
    plain_nm = columns @ weights
    rest_nm, difference_nm = _rms(left_nm - plain_nm), _rms(left_nm)
    least = _SLIGHT if rest_nm <= _MOST * difference_nm else _ANOTHER
    if rest_nm > _PLAIN * difference_nm or _rms(plain_nm) < least * _rms(simulated_nm):
        return None
    moved = np.zeros(len(BASE))
    moved[carried] = weights
    return moved


def _torques_nm(table: Table, numbers: Mapping[str, float]) -> dict[str, float]:
    """Return how much torque each number makes of the motion, rms, N m."""
    columns = zip(BASE, table.base[table.sliding].T, strict=True)
    return {name: abs(numbers[name]) * _rms(column) for name, column in columns}


def _said(table: Table, twin: Twin, found: Twin) -> str:
    """Return which numbers stand in the place of twin.toml's."""
    numbers = {name: float(getattr(found, name)) for name in BASE}
    moved_nm = _torques_nm(
        table, {name: number - float(getattr(twin, name)) for name, number in numbers.items()}
    )
    least_nm = _MOVED * max(moved_nm.values())
    told = [
        change_said(NUMBERS[name], float(getattr(twin, name)), number, parameter_unit(name))
        for name, number in numbers.items()
        if moved_nm[name] >= least_nm
    ]
    return (
        "the recorded simulation is not that of twin.toml, whose numbers do not predict it; those "
        f"that do were read off it and stand in their place: {'; '.join(told)}"
    )


def _rms(torque_nm: Floats) -> float:
    return float(np.sqrt(np.mean(torque_nm**2)))
