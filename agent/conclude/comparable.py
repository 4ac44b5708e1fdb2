"""Whether recordings and a twin can be compared: one axis, one gear, nothing counted twice."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import combinations
from pathlib import Path

import numpy as np

from agent.errors import InputError
from agent.identify.result import Floats
from agent.physics.twin import Twin
from agent.record.recording import Recording

_SIMULATED = "torque_simulated_nm"
_STRETCH = 64  # samples in a row that two recordings do not share by accident
_DISTINCT = 16


def check_recordings(
    twin: Twin, where: Path, recordings: Sequence[Recording], unseen: Sequence[Recording]
) -> None:
    """Refuse what cannot be compared or would prove nothing.

    Parameters
    ----------
    twin : Twin
    where : Path
        The twin's file, for messages.
    recordings, unseen : sequence of Recording
        To learn from, and held out.

    Raises
    ------
    agent.errors.InputError
        Recordings of several axes, of another axis or gear than the twin; a recording that is there
        twice; a hold-out that shares samples with what is learnt from; a recorded simulation that
        only some recordings have.
    """
    everything = (*recordings, *unseen)
    one_axis(everything)
    _twin_of(twin, where, everything[0])
    check_given_once(recordings)
    _none_seen(recordings, unseen)
    _one_simulation(everything)


def one_axis(recordings: Sequence[Recording]) -> None:
    """Refuse recordings of different axes or gears.

    Raises
    ------
    agent.errors.InputError
        Naming two of them.
    """
    first = recordings[0]
    for other in recordings[1:]:
        if _axis_of(first) != _axis_of(other):
            raise InputError(
                f"{first.source} is {_axis_of(first)}, but {other.source} is {_axis_of(other)}.",
                "Take the recordings of one axis at a time.",
            )


def _axis_of(recording: Recording) -> str:
    about = recording.metadata
    return f"{about.robot} axis {about.axis} with gear ratio {about.gear_ratio:g}"


def _twin_of(twin: Twin, where: Path, recording: Recording) -> None:
    about = recording.metadata
    if about.axis != twin.axis or about.robot != twin.robot:
        raise InputError(
            f"{where} is {twin.robot} axis {twin.axis}, but {recording.source} is "
            f"{about.robot} axis {about.axis}.",
            "Take the twin and the recordings of one axis.",
        )
    if not math.isclose(about.gear_ratio, twin.gear_ratio, rel_tol=1e-6):
        raise InputError(
            f"{where} has gear ratio {twin.gear_ratio:g}, but {recording.source} has "
            f"{about.gear_ratio:g}.",
            "Correct the one that is wrong: motor turns per arm turn.",
        )


def check_given_once(recordings: Sequence[Recording]) -> None:
    """Refuse a recording that is given twice, or a part of it: its intervals would shrink.

    Raises
    ------
    agent.errors.InputError
        With both names.
    """
    for first, second in combinations(recordings, 2):
        if _shared(first["torque_nm"], second["torque_nm"]):
            raise InputError(
                f"{second.source} holds samples of {first.source}.",
                "Give every recording once.",
            )


def _none_seen(recordings: Sequence[Recording], unseen: Sequence[Recording]) -> None:
    for held in unseen:
        for known in recordings:
            if _shared(known["torque_nm"], held["torque_nm"]):
                raise InputError(
                    f"{held.source} is held out, but it holds samples of {known.source}, which is "
                    "to be learnt from.",
                    "A proof needs recordings that nothing was learnt from.",
                )


def _shared(known: Floats, other: Floats) -> bool:
    """Tell whether stretches of a recording's torque stand in another one, sample for sample."""
    length = min(_STRETCH, other.shape[0])
    for begin in np.linspace(0, other.shape[0] - length, 5).astype(np.int64):
        stretch = other[begin : begin + length]
        if not np.isfinite(stretch).all() or np.unique(stretch).size < _DISTINCT:
            continue
        for at in np.flatnonzero(known[: max(known.shape[0] - length + 1, 0)] == stretch[0]):
            if np.array_equal(known[at : at + length], stretch):
                return True
    return False


def _one_simulation(recordings: Sequence[Recording]) -> None:
    simulated = [_SIMULATED in recording for recording in recordings]
    if any(simulated) and not all(simulated):
        having, lacking = simulated.index(True), simulated.index(False)
        raise InputError(
            f"{recordings[having].source} has {_SIMULATED}, but {recordings[lacking].source} has "
            "not.",
            "One simulation is questioned at a time: have the column in all recordings or in none.",
        )
