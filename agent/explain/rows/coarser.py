"""Recordings that were sampled more often than the comparison needs, thinned to what it does.

The widest band that is compared is 40 Hz. Every law is computed at full rate, and searches try
hundreds: at 1 kHz each costs twice what it does at 500 Hz, and no band shows the difference. All
columns become weighted means of neighbours, so that none is later than another.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.rows.full_rate import filled
from agent.explain.rows.run import Run
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.sampling import find_stretches

OFTEN_ENOUGH_HZ = 500.0
"""A recording is thinned to this rate, or by a whole number to less than twice of it."""

_ROUND = 1e-3  # of a rate: 999.9 Hz is 1 kHz
_SHORTEST = 8  # samples that must be left of a stretch


def coarsened(runs: Sequence[Run]) -> tuple[Run, ...]:
    """Return the runs, those of 1 kHz and more as means of their neighbours, on an even grid."""
    return tuple(_coarsened(run) for run in runs)


def _coarsened(run: Run) -> Run:
    """Return a run thinned, stretch by stretch; itself where it is sampled no more often."""
    signals = run.signals
    parts = [
        (stretch, max(1, int((1.0 + _ROUND) / (OFTEN_ENOUGH_HZ * stretch.period_s))))
        for stretch in find_stretches(signals).stretches
    ]
    parts = [(s, every) for s, every in parts if s.time_s.shape[0] >= (_SHORTEST + 4) * every]
    if all(every == 1 for _, every in parts):
        return run

    def thinned(values: Floats) -> Floats:
        return np.concatenate([_thinned(s.on_grid(signals, values), n) for s, n in parts])

    def kept(values: Floats | None) -> Floats | None:
        return None if values is None else thinned(values)

    time_s = np.concatenate([_thinned(stretch.time_s, every) for stretch, every in parts])
    sparser = Signals(
        time_s=time_s,
        torque_nm=thinned(signals.torque_nm),
        position_rad=kept(signals.position_rad),
        velocity_rad_s=kept(signals.velocity_rad_s),
        valid=np.ones(time_s.shape, dtype=np.bool_),
        gear_ratio=signals.gear_ratio,
        name=signals.name,
        samples_lost=signals.samples_lost,
        acquisition=signals.acquisition,
        left_out=signals.left_out,
        gearbox_temperature_degc=kept(signals.gearbox_temperature_degc),
        velocity_command_rad_s=kept(signals.velocity_command_rad_s),
        position_command_rad=kept(signals.position_command_rad),
        position_arm_rad=kept(signals.position_arm_rad),
    )
    lost = np.concatenate([_lost(s.on_grid(signals, signals.torque_nm), n) for s, n in parts])
    return replace(
        run,
        signals=sparser,
        recorded_every_s=float(np.median([stretch.period_s for stretch, _ in parts])),
        columns={name: thinned(values) for name, values in run.columns.items()},
        thinned_away_nm2=max(float(np.mean(lost)), 0.0),
    )


def _thinned(values: Floats, every: int) -> Floats:
    """Return the means around every so many-th value, from the first whole one on."""
    return _means(values, every)[::every]


def _lost(values: Floats, every: int) -> Floats:
    """Return by how much the square of each value is more than that of the mean around it."""
    end = 2 * every - 1 if every > 1 else 0
    level = float(np.mean(values))
    inside = values[end : values.shape[0] - end] - level
    return np.asarray(inside**2 - (_means(values, every) - level) ** 2)


def _means(values: Floats, every: int) -> Floats:
    """Return the mean around every value that has all of its neighbours; inner gaps are filled.

    Weighted by Lagrange's cubic: to the fourth order in frequency flat at rest, and zero where it
    folds.
    """
    if every == 1:
        return values
    x = np.abs(np.arange(1 - 2 * every, 2 * every)) / every
    near, far = (1.0 - x * x) * (2.0 - x) / 2.0, (1.0 - x) * (2.0 - x) * (3.0 - x) / 6.0
    weights = np.where(x < 1.0, near, far)
    return np.convolve(filled(values), weights / weights.sum(), mode="valid")
