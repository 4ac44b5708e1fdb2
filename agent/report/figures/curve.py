"""The friction curve (thesis 4.21): its points with intervals, and the laws fitted to them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from agent.identify.result import Floats, FrictionCurve, FrictionModelFit
from agent.numbers import Scale, scale_for
from agent.report.figures.canvas import (
    INK,
    MEASURED,
    MUTED,
    RIVALS,
    WITH_LABELS_IN,
    Panel,
    figure_of,
    plain_ticks,
    side_by_side,
    stacked,
    styled,
)
from agent.report.laws import friction_of_fit_nm, model_label

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_POINTS = 240
_LEAST_SLOW = 4
_KEY_LINE_IN = 0.2
_MEASURED = "measured, 95 % interval"
_SELECTED = " (selected)"
_RIVAL_DASHES: tuple[tuple[float, ...], ...] = ((5, 2), (1.5, 1.5), (5, 1.5, 1.2, 1.5), (9, 3))


@styled
def figure_friction_curve(
    curve: FrictionCurve, models: Sequence[FrictionModelFit] = (), *, narrow: bool = False
) -> Figure:
    """Draw friction over velocity twice: over the whole range, and enlarged at low speeds.

    The second panel has a logarithmic axis of speed without direction; passes in the negative
    direction are hollow there and have their sign turned. Its range is framed in the first panel.

    Parameters
    ----------
    curve : FrictionCurve
        n points, motor side; velocities may be of one sign (directions already combined) or two.
    models : sequence of FrictionModelFit
        Drawn as lines; the selected one is bold.
    narrow : bool
        Draw for a phone's width, the panels below each other.

    Raises
    ------
    ValueError
        If the curve has no point.
    """
    if curve.velocity_rad_s.size == 0:
        raise ValueError("expected a friction curve with points, got none")
    if narrow:
        panel = Panel(2.2, WITH_LABELS_IN)
        whole, low = stacked(
            [panel, panel], narrow=True, header_in=_KEY_LINE_IN * (1 + len(models))
        )
    else:
        whole, low = side_by_side(2.75, header_in=1.4 * _KEY_LINE_IN)
    scale = scale_for("N m", [float(np.max(np.abs(curve.friction_nm)))])
    _whole_range(whole, curve, models, scale)
    _low_speeds(low, curve, models, scale)
    for axes in (whole, low):
        axes.set_ylabel(f"friction torque, {scale.unit}")
    if _low_is_a_part(curve):
        _mark_enlarged(whole, low)
    handles, labels = _key(whole)
    figure = figure_of(whole)
    figure.legend(handles, labels, loc="upper left", ncols=1 if narrow else len(labels))
    return figure


def friction_curve_in_words(curve: FrictionCurve, models: Sequence[FrictionModelFit] = ()) -> str:
    """Say in words what `figure_friction_curve` shows, for those who do not see it."""
    low, high = float(curve.velocity_rad_s.min()), float(curve.velocity_rad_s.max())
    scale = scale_for("N m", [float(np.max(np.abs(curve.friction_nm)))])
    least, most = curve.friction_nm.min() * scale.factor, curve.friction_nm.max() * scale.factor
    laws = ", ".join(model_label(m.model) + (" (selected)" if m.selected else "") for m in models)
    drawn = f" Lines: {laws}." if laws else ""
    return (
        f"Friction torque at {curve.velocity_rad_s.size} steady motor velocities from {low:.3g} to "
        f"{high:.3g} rad/s, between {least:.3g} and {most:.3g} {scale.unit}, with 95 % intervals; "
        f"once over the whole range, once enlarged at low speeds.{drawn}"
    )


def _key(axes: Axes) -> tuple[list[Artist], list[str]]:
    """Return the key's entries: the points, then the law selected, then its rivals."""
    entries = list(zip(*axes.get_legend_handles_labels(), strict=True))
    entries.sort(key=lambda entry: (entry[1] != _MEASURED, not entry[1].endswith(_SELECTED)))
    return [handle for handle, _ in entries], [label for _, label in entries]


def _mark_enlarged(whole: Axes, low: Axes) -> None:
    """Frame in the first panel what the second one shows."""
    from matplotlib.patches import Rectangle

    (left, right), (bottom, top) = low.get_xlim(), low.get_ylim()
    low.set_xlim(left, right)
    low.set_ylim(bottom, top)
    frame = Rectangle(
        (0.0, bottom), right, top - bottom, fill=False, ec=MUTED, lw=0.8, ls=(0, (2, 2)), zorder=2
    )
    whole.add_patch(frame)


def _one_direction(curve: FrictionCurve) -> bool:
    velocity = curve.velocity_rad_s
    return bool((velocity > 0).all() or (velocity < 0).all())


def _whole_range(
    axes: Axes, curve: FrictionCurve, models: Sequence[FrictionModelFit], scale: Scale
) -> None:
    velocity = curve.velocity_rad_s
    _points(axes, velocity, curve.friction_nm, curve.ci95_nm, scale, label=_MEASURED)
    for stretch, first in _stretches(velocity):
        _laws(axes, stretch, models, scale, labelled=first)
    axes.set_title("Whole range")
    axes.set_xlabel("motor velocity, rad/s")
    if _one_direction(curve):
        axes.set_xlim(left=0.0) if velocity.min() > 0 else axes.set_xlim(right=0.0)
    else:
        axes.axhline(0.0, color=INK, lw=0.6)


def _low_speeds(
    axes: Axes, curve: FrictionCurve, models: Sequence[FrictionModelFit], scale: Scale
) -> None:
    axes.set_xscale("log")
    limit = slow_limit_rad_s(np.abs(curve.velocity_rad_s))
    for direction in (1.0, -1.0):
        speed = curve.velocity_rad_s * direction
        passed = (speed > 0) & (speed <= limit)
        if not passed.any():
            continue
        _points(
            axes,
            speed[passed],
            direction * curve.friction_nm[passed],
            np.sort(direction * curve.ci95_nm[passed], axis=1),
            scale,
            hollow=direction < 0 and not _one_direction(curve),
        )
        ladder = np.geomspace(speed[passed].min() * 0.8, limit * 1.15, _POINTS)
        _laws(axes, ladder, models, scale, direction=direction)
    axes.set_title("Low speeds, enlarged" if _low_is_a_part(curve) else "The same by speed")
    axes.set_xlabel("motor speed, rad/s (logarithmic)")
    plain_ticks(axes)


def slow_limit_rad_s(speed_rad_s: Floats) -> float:
    """Return up to which speed the enlarged panel reaches: a quarter of the fastest.

    At least the four slowest speeds are in it, so that a few points still make a picture.

    Parameters
    ----------
    speed_rad_s : ndarray, shape (n,)
        Speeds without direction, n > 0.
    """
    slowest = np.unique(speed_rad_s)[:_LEAST_SLOW]
    return float(max(slowest[-1], speed_rad_s.max() / 4.0))


def _low_is_a_part(curve: FrictionCurve) -> bool:
    """Tell whether the second panel leaves out fast points; few points are shown whole."""
    speed = np.abs(curve.velocity_rad_s)
    return bool(slow_limit_rad_s(speed) < speed.max())


def _points(
    axes: Axes,
    velocity: Floats,
    friction_nm: Floats,
    ci95_nm: Floats,
    scale: Scale,
    *,
    label: str = "",
    hollow: bool = False,
) -> None:
    below, above = friction_nm - ci95_nm[:, 0], ci95_nm[:, 1] - friction_nm
    # An interval need not enclose its own point by rounding alone; a bar cannot be negative.
    bars = np.maximum(np.stack((below, above)), 0.0) * scale.factor
    axes.errorbar(
        velocity,
        friction_nm * scale.factor,
        yerr=bars,
        fmt="o",
        ms=4.2,
        mew=1.0,
        color=INK,
        mfc="white" if hollow else INK,
        ecolor=INK,
        elinewidth=1.0,
        capsize=2.6,
        capthick=1.0,
        zorder=4,
        label=label or "_points",
    )


def _laws(
    axes: Axes,
    velocity: Floats,
    models: Sequence[FrictionModelFit],
    scale: Scale,
    *,
    direction: float = 1.0,
    labelled: bool = False,
) -> None:
    rivals = 0
    for fit in models:
        friction = friction_of_fit_nm(fit, direction * velocity)
        if friction is None:
            continue
        friction = direction * friction
        label = model_label(fit.model)
        if fit.selected:
            axes.plot(
                velocity,
                friction * scale.factor,
                color=MEASURED,
                lw=2.6,
                zorder=3,
                label=label + _SELECTED if labelled else "_law",
            )
            continue
        axes.plot(
            velocity,
            friction * scale.factor,
            color=RIVALS[rivals % len(RIVALS)],
            lw=1.2,
            ls=(0, _RIVAL_DASHES[rivals % len(_RIVAL_DASHES)]),
            zorder=3.5,
            label=label if labelled else "_law",
        )
        rivals += 1


def _stretches(velocity: Floats) -> list[tuple[Floats, bool]]:
    """Return dense velocities for each direction passed (a law jumps at zero), first one marked."""
    stretches: list[tuple[Floats, bool]] = []
    for direction in (1.0, -1.0):
        speed = velocity[velocity * direction > 0] * direction
        if speed.size:
            # Half a decade below the slowest point: the law's rise towards standstill is seen.
            dense = np.geomspace(0.3 * speed.min(), 1.02 * speed.max(), _POINTS)
            stretches.append((direction * dense, not stretches))
    return stretches
