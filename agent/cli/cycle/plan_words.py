"""What a plan can and cannot see, in words."""

from __future__ import annotations

import math

from agent.cli.cycle.plan_outlook import EXPONENTS, STRIBECK_RAD_S, Outlook
from agent.numbers import (
    decimals_for,
    fixed,
    parameter_label,
    parameter_unit,
    scale_for,
    significant,
)


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


def can_see(outlook: Outlook) -> list[str]:
    """Return what this plan tells, a sentence each."""
    seen, speeds = outlook.design.expectation, outlook.design.expectation.speed_rad_s
    share = 100.0 * seen.visible_rise_nm / outlook.nominal["coulomb_nm"]
    out = [
        f"The friction curve at {speeds.size} speeds from {significant(float(speeds.min()), 3)} to "
        f"{significant(float(speeds.max()), 3)} rad/s, both directions over the same positions.",
        f"A rise of friction of {_amount('_nm', seen.visible_rise_nm)} at all speeds "
        f"({significant(share, 2)} % of Coulomb), or of "
        f"{_amount('_nm', seen.visible_rise_at_one_speed_nm)} at any one speed, between two such "
        "runs at one temperature (four of five such rises, one false alarm in twenty).",
    ]
    ratios = outlook.beside_plain
    if ratios and outlook.design.plain_s is not None:
        best, worst = min(ratios, key=ratios.__getitem__), max(ratios, key=ratios.__getitem__)
        out.append(
            f"Intervals of {fixed(ratios[best], 2)} times ({parameter_label(best)}) to "
            f"{fixed(ratios[worst], 2)} times ({parameter_label(worst)}) those of ten rising "
            f"speeds over the same stroke in {outlook.design.plain_s:.1f} s."
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
