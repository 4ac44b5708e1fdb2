"""What a plan can and cannot see, in words."""

from __future__ import annotations

import math
from dataclasses import dataclass

from agent.cli.cycle.plan_outlook import EXPONENTS, STRIBECK_RAD_S, Outlook
from agent.numbers import (
    decimals_for,
    fixed,
    parameter_label,
    parameter_unit,
    scale_for,
    significant,
)
from trajectories import lasting

_AS_PRECISE = 1.005  # an interval as wide as another, as far as two decimals show
_MORE_PRECISE = 0.95
_MOST_TIMES = 10


def rows(outlook: Outlook) -> list[tuple[str, str, str]]:
    """Return parameter, assumed value and expected half-interval, with their units.

    Infinite intervals are written as what they are: not seen.
    """
    out = []
    for name, half in outlook.half_widths.items():
        value = outlook.nominal[name]
        if not math.isfinite(half):
            out.append((parameter_label(name), _amount(name, value), "not seen"))
            continue
        scale = scale_for(parameter_unit(name), (value or half,))
        places = decimals_for(half * scale.factor)
        assumed = f"{fixed(value * scale.factor, places)} {scale.unit}".strip()
        width = f"± {fixed(half * scale.factor, places)} {scale.unit}".strip()
        out.append((parameter_label(name), assumed, width))
    return out


def in_short(outlook: Outlook, *, fits: bool) -> tuple[str, str]:
    """Return what a plan is worth: a sentence, and how it compares with a plain stair.

    Parameters
    ----------
    outlook : Outlook
    fits : bool
        Whether it stays within the axis's limits.

    Returns
    -------
    tuple of str
        The second is empty where no plain stair fits the axis.
    """
    limits = "within all limits" if fits else "NOT within the axis's limits"
    first = (
        f"{lasting(outlook.trajectory.duration_s)}, {limits}: shows a friction rise of "
        f"{_rise_percent(outlook)} % between two runs at one temperature."
    )
    beside = _beside_plain(outlook)
    if beside is None:
        return first, ""
    best, worst = beside
    plain = f"a plain stair of {lasting(outlook.design.plain_s or 0.0)}"
    if worst.ratio <= _AS_PRECISE:
        more = f", {_times(best)} as precise in {best.label}" if best.ratio < _MORE_PRECISE else ""
        return first, f"As precise as {plain} in every number{more}."
    return first, (
        f"Beside {plain}: {_times(best)} as precise in {best.label}, "
        f"{_times(worst)} in {worst.label}."
    )


@dataclass(frozen=True)
class _Beside:
    """One number's interval over that of a plain stair."""

    label: str
    ratio: float


def _beside_plain(outlook: Outlook) -> tuple[_Beside, _Beside] | None:
    """Return the numbers that gain most and least over a plain stair; None without one."""
    ratios = outlook.beside_plain
    if not ratios or outlook.design.plain_s is None:
        return None
    best, worst = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
    return _Beside(_in_text(best), ratios[best]), _Beside(_in_text(worst), ratios[worst])


def _times(beside: _Beside) -> str:
    """Say how many times as precise; a long plain stair has slow speeds only, and tells little."""
    times = 1.0 / beside.ratio
    return (
        f"more than {_MOST_TIMES} times"
        if times > _MOST_TIMES
        else f"{significant(times, 2)} times"
    )


def _in_text(name: str) -> str:
    """Return a parameter's name as it stands inside a sentence; people's names stay capital."""
    label = parameter_label(name)
    return label if label.startswith(("Coulomb", "Stribeck")) else f"{label[0].lower()}{label[1:]}"


def _rise_percent(outlook: Outlook) -> str:
    """Return the rise at all speeds that two runs show, in per cent of Coulomb friction."""
    share = outlook.design.expectation.visible_rise_nm / outlook.nominal["coulomb_nm"]
    return significant(100.0 * share, 2)


def can_see(outlook: Outlook) -> list[str]:
    """Return what this plan tells, a sentence each."""
    seen, speeds = outlook.design.expectation, outlook.design.expectation.speed_rad_s
    out = [
        f"The friction curve at {speeds.size} speeds from {significant(float(speeds.min()), 3)} to "
        f"{significant(float(speeds.max()), 3)} rad/s, both directions over the same positions.",
        f"A rise of friction of {_amount('_nm', seen.visible_rise_nm)} at all speeds "
        f"({_rise_percent(outlook)} % of Coulomb), or of "
        f"{_amount('_nm', seen.visible_rise_at_one_speed_nm)} at any one speed, between two such "
        "runs at one temperature: four of five such rises are found, with one false alarm in "
        "twenty.",
    ]
    beside = _beside_plain(outlook)
    if beside is not None:
        best, worst = beside
        out.append(
            "Every number to an interval that is between "
            f"{significant(best.ratio, 2)} times ({best.label}) and {fixed(worst.ratio, 2)} times "
            f"({worst.label}) as wide as from a plain stair, ten rising speeds over the same "
            f"stroke in {lasting(outlook.design.plain_s or 0.0)}."
        )
    found = outlook.stribeck_range_rad_s
    if found is not None:
        out.append(
            f"A Stribeck velocity between {significant(found[0], 2)} and "
            f"{significant(found[1], 2)} rad/s, to within half of its value."
        )
    return out


def cannot_see(outlook: Outlook) -> list[str]:
    """Return what this plan does not tell, a sentence each."""
    out = []
    if outlook.stribeck_range_rad_s is None:
        out.append(
            "The Stribeck velocity, to within half of its value: more time or slower speeds would."
        )
    for name in outlook.half_widths:
        if outlook.sees(name) or (
            name.startswith("stribeck_") and not outlook.stribeck_range_rad_s
        ):
            continue
        if math.isfinite(outlook.half_widths[name]):
            out.append(f"{parameter_label(name)}, to within half of its value: more time would.")
        else:
            out.append(f"{parameter_label(name)}: this stroke and these speeds do not carry it.")
    slowest = float(outlook.design.expectation.speed_rad_s.min())
    out.append(
        f"Friction below {significant(slowest, 3)} rad/s, presliding and backlash: they need slow "
        "reversals of small amplitude."
    )
    shortest_s = min(w.end_s - w.start_s for w in outlook.trajectory.steady_windows())
    out.append(
        f"A speed at which a soft arm goes on ringing (the shortest dwell is {shortest_s:.2f} s): "
        "such dwells are left out of the estimate; a longer --dwell-s keeps them."
    )
    out.append(
        "The gearbox temperature's part in a change of friction: compare runs at one temperature."
    )
    return out


def basis(outlook: Outlook) -> str:
    """Say what the numbers stand on."""
    noise = outlook.request.noise
    return (
        f"Reckoned with torque noise of {_amount('_nm', noise.white_nm)} white and "
        f"{_amount('_nm', noise.coloured_nm)} coloured ({1e3 * noise.correlation_s:.0f} ms), "
        f"sampled at {noise.sample_rate_hz:g} Hz; Stribeck velocities from "
        f"{min(STRIBECK_RAD_S):g} to {max(STRIBECK_RAD_S):g} rad/s and exponents from "
        f"{min(EXPONENTS):g} to {max(EXPONENTS):g}; a rigid joint without ripple."
    )


def _amount(name: str, value: float) -> str:
    scale = scale_for(parameter_unit(name), (value,))
    return f"{significant(scale.factor * value, 3)} {scale.unit}".strip()
