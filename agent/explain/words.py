"""The explanation in sentences that a technician understands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from agent.explain.result import Finding, Holdout, Region

NAMES: Mapping[str, str] = MappingProxyType(
    {
        "stribeck": "friction that falls with speed (Stribeck)",
        "viscous-nonlinear": "friction that bends with speed",
        "direction-asymmetry": "friction that differs between the two directions",
        "load-dependent-friction": "friction that grows with the load on the gear",
        "temperature-dependent-friction": "friction that changes with the gearbox temperature",
        "position-dependent-friction": "friction that changes along the position",
        "presliding-hysteresis": "friction that yields like a spring before it slips",
        "friction-drift": "friction that changes with time or use",
        "torque-ripple": "torque ripple that repeats with the motor's angle",
        "kinematic-error": "a gear whose ratio wobbles with the angle",
        "torque-constant-error": "a torque constant that is not what the twin says",
        "torque-offset": "a constant torque beside the reported one",
        "torque-saturation": "a drive that clips its torque",
        "measurement-delay": "one channel that is late against another",
        "resolver-error": "a motor angle that is measured with a periodic error",
        "inertia-error": "an inertia that is not what the twin says",
        "wrong-number": "a Coulomb or viscous friction that is not what the twin says",
        "gravity-imbalance": "a payload or imbalance that the twin does not know",
        "cable-force": "hoses and cables that pull like a spring",
        "joint-flexibility": "an arm that swings behind a soft gear",
        "backlash": "clearance in the gear",
        "local-fault": "a bump at one place of the position",
    }
)
"""What each effect of contract section 4 is called in a sentence."""

_AXES: Mapping[str, tuple[str, str, float]] = MappingProxyType(
    {
        "velocity_rad_s": ("a motor speed", "rad/s", 1.0),
        "acceleration_rad_s2": ("an acceleration", "rad/s²", 1.0),
        "arm_position_rad": ("an arm angle", "°", 180.0 / math.pi),
        "load_torque_nm": ("a load", "N m", 1.0),
        "gearbox_temperature_degc": ("a gearbox temperature", "°C", 1.0),
        "motor_temperature_degc": ("a motor temperature", "°C", 1.0),
        "after_reversal_s": ("the time after a reversal", "ms", 1e3),
        "time_s": ("the time", "s", 1.0),
        "frequency_hz": ("a frequency", "Hz", 1.0),
    }
)


def where_in_words(region: Region) -> str:
    """Return where a region lies, to begin a sentence with."""
    low, high = region.lower, region.upper
    if region.variable == "velocity_rad_s" and low < 0.0 < high:
        return f"Below {_short(max(-low, high))} rad/s"
    if region.variable.startswith("order_per_"):
        per = "motor turn" if region.variable.endswith("motor_rev") else "arm turn"
        return f"{_short(0.5 * (low + high))} times per {per}"
    if region.variable == "recording":
        return f"From recording {round(low) + 1} to {round(high) + 1}"
    if region.variable == "after_reversal_s":
        return f"In the first {_short(1e3 * high)} ms after a start or a reversal"
    name, unit, scale = _AXES.get(region.variable, (region.variable, "", 1.0))
    ends = f"{_short(scale * low)} and {_short(scale * high)} {unit}".strip()
    return f"At {name} between {ends}"


def finding_sentence(
    effect: str, where: Sequence[Region], largest_nm: float, energy_share: float
) -> str:
    """Return a finding's sentence: where, how much, what it is, how much it explains.

    Parameters
    ----------
    effect : str
    where : sequence of Region
        The first is said.
    largest_nm : float
        The greatest torque that the effect adds.
    energy_share : float
    """
    place = where_in_words(where[0]) if where else "Over the whole cycle"
    return (
        f"{place} the joint differs from the simulation by up to {_short(largest_nm)} N m; "
        f"{NAMES[effect]} explains {_percent(energy_share)} of the mismatch."
    )


def number_sentence(effect: str, changes: Mapping[str, tuple[float, float]], share: float) -> str:
    """Return the sentence of a wrong number.

    Parameters
    ----------
    effect : str
    changes : mapping of str to (float, float)
        What is wrong in words, to what the twin says and what the recordings say.
    share : float
        Of what the twin as given leaves.
    """
    said = " and ".join(
        f"{name} is {_short(found)}, not {_short(given)}"
        for name, (given, found) in changes.items()
    )
    return (
        f"The twin's number is wrong, no physics is missing: {said}. "
        f"This explains {_percent(share)} of the difference to the twin as given."
        if effect != "gravity-imbalance"
        else f"The twin does not know all of the load: {said}. "
        f"This explains {_percent(share)} of the difference to the twin as given."
    )


def proof_sentence(holdout: Holdout, floor_nm: float) -> str:
    """Return what the findings are worth on data that was not seen."""
    before, after = holdout.baseline.rmse_nm, holdout.extended.rmse_nm
    return (
        f"On {holdout.source} the error falls from {_short(before)} to {_short(after)} N m; "
        f"noise is {_short(floor_nm)} N m."
    )


def tie_sentence(finding: Finding) -> str:
    """Return what a finding cannot be told apart from, and what decides."""
    others = " or ".join(NAMES[a.effect] for a in finding.alternatives)
    first = finding.alternatives[0].told_apart_by
    return f"These recordings cannot tell it from {others}. To decide: {first}"


def summary(
    verdict: str,
    findings: Sequence[Finding],
    holdout: Holdout | None,
    floor_nm: float,
    left: Sequence[Region],
    left_share: float,
) -> str:
    """Return the whole answer."""
    if verdict == "no-mismatch":
        return "Simulation and recordings agree: what is left is noise."
    parts = [f.sentence for f in findings[:3]]
    if verdict in ("unexplained", "partly-explained"):
        place = where_in_words(left[0]) if left else "Over the cycle"
        begin = place[0].lower() + place[1:]
        parts.append(
            f"{_percent(left_share)} of the mismatch is located {begin}, and no known effect "
            "carries it."
        )
    if holdout is not None and findings:
        parts.append(proof_sentence(holdout, floor_nm))
    tied = [f for f in findings if f.alternatives]
    if tied:
        parts.append(tie_sentence(tied[0]))
    return " ".join(parts)


def _percent(share: float) -> str:
    return f"{100.0 * min(max(share, 0.0), 1.0):.0f} %"


def _short(value: float) -> str:
    if value == 0.0 or not math.isfinite(value):
        return f"{value:.0f}"
    digits = max(0, 1 - math.floor(math.log10(abs(value))))
    return f"{value:.{min(digits, 6)}f}"
