"""Why a table of recordings does not carry an explanation: too little, or not a joint's."""

from __future__ import annotations

import math

import numpy as np

from agent.explain.answer.amounts import torque
from agent.explain.location.regions import row_seconds
from agent.explain.plausible import in_degrees, of_two_units, runs_backwards
from agent.explain.rows.refit import refit
from agent.explain.rows.table import Table
from agent.physics.twin import Twin
from trajectories import lasting

_LEAST_ROWS = 120
_FEWEST_BLOCKS = 12  # of two seconds: folds and the jackknife leave them out in turn
_HELD_SAMPLES = 60  # of one pass: what the filter leaves of them carries a mean
_SLIDES = 0.1  # of the time: with less the joint stands
_GAP_S = 1.0
_LOST = 0.5  # of what the refitted twin leaves: less gravity is lost in it


def undecidable(table: Table, twin: Twin) -> str:
    """Return why a table cannot be explained, or nothing.

    Parameters
    ----------
    table : Table
        Without what creeps.
    twin : Twin
        As given.
    """
    return _too_little(table) or _impossible(table, twin) or _nowhere(table, twin)


def _too_little(table: Table) -> str:
    """Return why a table does not carry an explanation, or nothing."""
    count = int(np.count_nonzero(table.sliding))
    blocks = np.unique(table.block[table.used]).shape[0]
    if count >= _LEAST_ROWS and blocks >= _FEWEST_BLOCKS:
        return ""
    if all(piece.slow for piece in table.pieces):
        rate_hz = max(1.0 / piece.period_s for piece in table.pieces)
        return (
            f"not decidable: at {rate_hz:.2g} samples a second only speeds that are held can be "
            f"compared, and {_seconds(count, table)} of these recordings hold one for long enough; "
            f"hold every speed for {_HELD_SAMPLES / rate_hz:.0f} s, or record at 250 Hz or faster"
        )
    if count >= _LEAST_ROWS:
        return (
            f"not decidable: the joint slides for only about {_seconds(count, table)} in these "
            f"recordings, and parts of them must be left out to judge by; record "
            f"{2 * _FEWEST_BLOCKS} s or more"
        )
    if float(np.mean(table.full["direction"] != 0.0)) < _SLIDES:
        return (
            "not decidable: the joint hardly slides in these recordings; record a stair of speeds "
            "in both directions"
        )
    return _out_of_band(table, count)


def _impossible(table: Table, twin: Twin) -> str:
    """Return that a torque drives where it should brake, or what is in another unit; or nothing."""
    mixed = of_two_units(table) or in_degrees(table, twin)
    if mixed:
        return f"not decidable: {mixed}"
    if not runs_backwards(table):
        return ""
    return (
        "not decidable: inertia and friction come out negative: torque and velocity have opposite "
        "signs; turn the sign of torque_nm, or of position and velocity"
    )


def _nowhere(table: Table, twin: Twin) -> str:
    """Return that the twin's gravity has no angle to act at, where that matters; or nothing.

    Left out of the prediction in silence it would be missing physics: a cable, an offset.
    """
    gravity_nm = math.hypot(twin.gravity_sin_nm, twin.gravity_cos_nm)
    if table.simulated or not np.isnan(table.full["position_rad"]).any():
        return ""
    left = refit(table)[1][table.used]
    if gravity_nm <= _LOST * float(np.sqrt(np.mean(left**2))):
        return ""
    return (
        f"not decidable: the simulation's gravity, up to {torque(gravity_nm)}, depends on the "
        "arm's angle, and position_rad was not recorded throughout: record it"
    )


def _seconds(rows: int, table: Table) -> str:
    return lasting(rows * row_seconds(table.pieces))


def _out_of_band(table: Table, count: int) -> str:
    """Return that too little of what was recorded can be compared in its band."""
    recorded_s = sum(
        float(np.minimum(np.diff(run.signals.time_s), _GAP_S).sum()) for run in table.runs
    )
    periods = _LEAST_ROWS * row_seconds(table.pieces)
    return (
        f"not decidable: {_seconds(count, table)} of {lasting(recorded_s)} recorded can be "
        f"compared, in the band of {table.cutoff_hz:.2g} Hz that the sampling rate and the noise "
        f"of the velocity allow, and {lasting(periods)} are needed; the rest is near standstill, "
        "or in stretches that are too short; record longer, at 250 Hz or faster, and hold every "
        "speed for 2 s"
    )
