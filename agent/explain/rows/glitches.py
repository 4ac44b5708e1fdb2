"""Recordings without single rows that no drive can have meant; see `identify.signals.glitches`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agent.explain.rows.run import Run
from agent.identify.signals import glitches


def without_glitches(runs: Sequence[Run]) -> tuple[tuple[Run, ...], tuple[str, ...]]:
    """Return recordings without single rows that stand alone, and what is to be said of them.

    Parameters
    ----------
    runs : sequence of Run
    """
    told = [(run, *glitches.without_glitches(run.signals)) for run in runs]
    kept = tuple(replace(run, signals=signals) if said else run for run, signals, said in told)
    return kept, tuple(said for _, _, said in told if said)
