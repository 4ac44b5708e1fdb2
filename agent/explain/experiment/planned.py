"""A cycle that is only planned, as the candidates that its motion can tell apart, or cannot."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.explain.choosing.aliases import usual_points
from agent.explain.choosing.search import Library
from agent.explain.experiment.motion import simulated_run
from agent.explain.forms.form import Form, Point
from agent.explain.forms.library import CLOCKS, judgeable
from agent.explain.rows.evidence import weigh
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.physics.twin import Twin
from trajectories import Trajectory

_WIDEST_SHARE, _WIDEST_HZ = 0.1, 40.0  # of the sampling rate; no table's band is wider


def planned_library(
    trajectory: Trajectory, twin: Twin, sample_rate_hz: float
) -> tuple[Library, tuple[str, ...]]:
    """Return the candidates on a planned cycle, driven once at one temperature.

    Parameters
    ----------
    trajectory : Trajectory
        What would be driven; the joint is taken to follow it exactly.
    twin : Twin
        What the joint is believed to be; without effects.
    sample_rate_hz : float

    Returns
    -------
    library : Library
        For `aliases`; there is no mismatch in it.
    not_shown : tuple of str
        Effects that need more than one run, or a column that a plan does not have.

    Raises
    ------
    TooShortError
        The trajectory is too short to be filtered.
    """
    theta = np.array([getattr(twin, name) for name in BASE])
    run = simulated_run(trajectory, theta, twin.gear_ratio, 1.0 / sample_rate_hz, lambda _: {})
    cutoff_hz = min(_WIDEST_SHARE * sample_rate_hz, _WIDEST_HZ)
    table = tabulate(twin, [run], cutoff_hz, align_velocity=False)
    scene = Scene(table, theta, np.zeros(table.used.shape[0]))
    forms, not_judged = judgeable(table)
    weighing = weigh(table, np.ones(table.used.shape[0]))
    lasting = [form for form in forms if CLOCKS.isdisjoint(form.needs)]
    library = Library.of(scene, weighing, [_with_usual_points(form) for form in lasting])
    too_short = {form.effect for form in forms} - {form.effect for form in lasting}
    return library, tuple(sorted({*not_judged, *too_short}))


def _with_usual_points(form: Form) -> Form:
    """Return a form that has points where there is no residual to take them from."""

    def grid(scene: Scene) -> Sequence[Point]:
        return usual_points(scene, form)

    return replace(form, grid=grid)
