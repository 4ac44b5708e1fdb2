"""A plan: the stair over time, where the arm goes, and where the friction curve is measured."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats
from agent.numbers import scale_for
from agent.physics.friction import STRIBECK
from agent.report.figures.canvas import (
    COMMAND_PALE,
    MEASURED,
    MUTED,
    POSITION,
    SHADE,
    WITH_LABELS_IN,
    WITHOUT_LABELS_IN,
    Panel,
    figure_of,
    stacked,
    styled,
)
from trajectories import Expectation, Trajectory, lasting
from trajectories.design_information import NORMAL_975

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_POINTS = 1500


@styled
def figure_plan(
    trajectory: Trajectory,
    expectation: Expectation,
    nominal: Mapping[str, float],
    gear_ratio: float,
    *,
    narrow: bool = False,
) -> Figure:
    """Draw motor velocity and arm position over time, and the friction curve's points to come.

    Parameters
    ----------
    trajectory : Trajectory
        What would be driven; steady windows are shaded.
    expectation : Expectation
        The points and their standard errors.
    nominal : mapping of str to float
        The Stribeck law's parameters that were assumed.
    gear_ratio : float
        Motor turns per arm turn.
    narrow : bool
        Draw for a phone's width.
    """
    panels = [
        Panel(1.5, WITHOUT_LABELS_IN),
        Panel(0.85, WITH_LABELS_IN),
        Panel(1.8, WITH_LABELS_IN),
    ]
    velocity, position, curve = stacked(panels, narrow=narrow)
    time_s = np.linspace(0.0, trajectory.duration_s, _POINTS)
    motion = trajectory.sample(time_s)
    for axes in (velocity, position):
        for window in trajectory.steady_windows():
            axes.axvspan(window.start_s, window.end_s, color=SHADE, lw=0, zorder=0)
        axes.set_xlim(0.0, 1.005 * trajectory.duration_s)  # room for the last number
    velocity.set_title("Motor velocity")
    velocity.plot(time_s, motion.velocity_rad_s, color=MEASURED)
    velocity.set_ylabel("rad/s")
    velocity.tick_params(labelbottom=False)
    position.set_title("Arm position")
    position.plot(time_s, np.degrees(motion.position_rad / gear_ratio), color=POSITION)
    position.set_ylabel("degrees")
    position.set_xlabel("time, s")
    _curve(curve, expectation, nominal, trajectory)
    return figure_of(velocity)


def plan_figure_in_words(trajectory: Trajectory, expectation: Expectation) -> str:
    """Say in words what `figure_plan` shows, for those who do not see it."""
    speeds = expectation.speed_rad_s
    held = ", ".join(f"{v:.3g}" for v in speeds)
    return (
        f"Motor velocity and arm position over {lasting(trajectory.duration_s)} with "
        f"{len(trajectory.steady_windows())} steady windows shaded; and the friction curve that "
        f"was assumed, with the expected intervals at {held} rad/s."
    )


def _curve(
    axes: Axes, expectation: Expectation, nominal: Mapping[str, float], trajectory: Trajectory
) -> None:
    """Draw the assumed law over the logarithm of speed, with an interval at every point.

    Its viscous part is left out: beside it, neither the fall of friction nor an interval shows.
    """
    dry = {**nominal, "viscous_nm_s_per_rad": 0.0}
    speeds = expectation.speed_rad_s
    grid = np.geomspace(0.5 * speeds.min(), 1.15 * speeds.max(), 300)
    friction = STRIBECK.torque(grid, dry)
    scale = scale_for("N m", [float(friction.max())])
    points = STRIBECK.torque(speeds, dry) * scale.factor
    reach = NORMAL_975 * expectation.point_error_nm * scale.factor
    axes.set_title("Friction curve to come, less its viscous part")
    axes.plot(grid, friction * scale.factor, color=COMMAND_PALE, lw=2.6, label="assumed")
    axes.errorbar(
        speeds,
        points,
        yerr=reach,
        fmt="o",
        ms=3.0,
        color=MEASURED,
        elinewidth=1.0,
        capsize=2.5,
        label="expected 95 % interval",
    )
    axes.set_xscale("log")
    axes.set_xlim(grid[0], grid[-1])
    ticks = _ticks(grid)
    axes.set_xticks(ticks, [f"{t:g}" for t in ticks])
    axes.set_xticks([], minor=True)
    axes.set_ylabel(f"torque, {scale.unit}")
    axes.set_xlabel("motor speed, rad/s")
    _held_time(axes, trajectory)
    axes.legend(loc="upper right")


def _held_time(axes: Axes, trajectory: Trajectory) -> None:
    """Write below each point for how long its speed is held in all."""
    held: dict[float, float] = {}
    for window in trajectory.steady_windows():
        speed = abs(window.velocity_rad_s)
        held[speed] = held.get(speed, 0.0) + window.end_s - window.start_s
    low, high = axes.get_ylim()
    axes.set_ylim(low - 0.25 * (high - low), high)
    for row, (speed, seconds) in enumerate(sorted(held.items())):
        axes.annotate(
            f"{seconds:.1f} s",
            (speed, 0.02 + 0.09 * (row % 2)),  # neighbours do not touch
            xycoords=("data", "axes fraction"),
            ha="center",
            fontsize=7.5,
            color=MUTED,
        )


def _ticks(grid: Floats) -> list[float]:
    """Return 1, 2 and 5 of every decade that the grid covers."""
    decades = range(int(np.floor(np.log10(grid[0]))), int(np.ceil(np.log10(grid[-1]))) + 1)
    ticks = [digit * 10.0**d for d in decades for digit in (1.0, 2.0, 5.0)]
    return [t for t in ticks if grid[0] <= t <= grid[-1]]
