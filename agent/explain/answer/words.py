"""What an explanation says in sentences that a technician understands."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from agent.explain.answer.places import place_in_words
from agent.explain.answer.result import Finding, Fit, Holdout, Region, Ringing
from agent.identify.result import Parameter
from agent.numbers import fixed, scale_for, significant

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
        "torque-constant-error": "a torque constant that is not what the simulation says",
        "torque-offset": "a constant torque beside the reported one",
        "torque-saturation": "a drive that clips its torque",
        "measurement-delay": "one channel that is late against another",
        "resolver-error": "a motor angle that is measured with a periodic error",
        "inertia-error": "an inertia that is not what the simulation says",
        "wrong-number": "a Coulomb or viscous friction that is not what the simulation says",
        "gravity-imbalance": "a payload or imbalance that the simulation does not know",
        "cable-force": "hoses and cables that pull like a spring",
        "joint-flexibility": "an arm that swings behind a soft gear",
        "backlash": "clearance in the gear",
        "local-fault": "a bump at one place of the position",
    }
)
"""What each effect of contract section 4 is called in a sentence."""

FOLLOWS_DIRECTION = frozenset(
    {
        "stribeck",
        "viscous-nonlinear",
        "load-dependent-friction",
        "temperature-dependent-friction",
        "position-dependent-friction",
        "presliding-hysteresis",
        "friction-drift",
        "wrong-number",
    }
)
"""Effects whose torque brakes: told in the direction of motion."""

OWN_NUMBER = "the twin's own number"
"""The form of a finding that is no missing physics."""

_SAME_NUMBER = 0.01  # of it: less is not told where another number of the kind moved more
_TOLD = 3  # findings in the summary
_WORSE = 1.1  # times the error before: more is no law for what was not seen
_AS_NOISE = 1.1  # times the noise floor: up to there the band of the comparison holds nothing
# Of the greater side: less on the other side is not worth a word. Where friction grows, the twin's
# own level, fitted without it, makes up for some elsewhere.
_ONE_SIDED, _ONE_SIDED_FRICTION = 0.15, 0.6


def finding_sentence(
    effect: str,
    where: Sequence[Region],
    reach_nm: tuple[float, float],
    energy_share: float,
    parameters: Mapping[str, Parameter],
    *,
    first: bool = True,
) -> str:
    """Return a finding's sentence: where, how much, what it is, how much it explains.

    Parameters
    ----------
    effect : str
    where : sequence of Region
        The first is said.
    reach_nm : tuple of float
        The least and the greatest torque that the effect adds; along the motion for friction.
    energy_share : float
    parameters : mapping of str to Parameter
        As in a twin; a number that says more than the torque is added.
    first : bool
        Whether this is the main finding; another one is told more shortly.
    """
    place = place_in_words(where[0] if where else None, effect)
    begin = f"{place[:1].upper()}{place[1:]} {_amount(effect, reach_nm)}"
    name = NAMES[effect] + _detail(effect, parameters)
    if first:
        return f"{begin}; {name} explains {_percent(energy_share)} of the mismatch."
    return f"{begin}: {name}, {_percent(energy_share)} of the mismatch."


def ringing_sentence(ringing: Ringing) -> str:
    """Return that loose teeth are heard, and by how much."""
    return (
        f"Its blows are heard: {ringing.instants} times the load on the gear changed sides in "
        f"motion, and right after that the motor rang {_times(ringing.louder)} as strongly as "
        "before and later."
    )


def only_heard(ringing: Ringing) -> str:
    """Return that loose teeth are heard, where no torque shows them."""
    return (
        f"the gear has play: {ringing.instants} times the load on it changed sides in motion, and "
        f"right after that the motor rang {_times(ringing.louder)} as strongly as before and later;"
        " in the torque that is compared it does not show"
    )


def _times(louder: float) -> str:
    """Return the root of an energy's factor in words: what a velocity shows."""
    return f"{significant(math.sqrt(louder), 2)} times"


def _amount(effect: str, reach_nm: tuple[float, float]) -> str:
    """Return by how much the joint differs from the simulation."""
    low, high = reach_nm
    largest = max(-low, high)
    size = _torque(largest)
    kind = "friction torque" if effect in FOLLOWS_DIRECTION else "torque"
    one_sided = _ONE_SIDED_FRICTION if effect in FOLLOWS_DIRECTION else _ONE_SIDED
    if high > 0.0 and -low <= one_sided * high:
        return f"the joint needs up to {size} more {kind} than the simulation"
    if low < 0.0 and high <= -one_sided * low:
        return f"the joint needs up to {size} less {kind} than the simulation"
    return f"the {kind} differs from the simulation's by up to ±{size}"


def _detail(effect: str, parameters: Mapping[str, Parameter]) -> str:
    """Return the one number that says more than the torque, in brackets; nothing without one."""
    known = {n: p.value for n, p in parameters.items() if p.identified and math.isfinite(p.value)}
    if effect == "torque-constant-error":
        return _factor(known)
    if "torque_delay_s" in known:
        by = _time(known["torque_delay_s"])
        if known["torque_delay_s"] > 0.0:
            return f" (the torque is reported {by} later than the motion)"
        return f" (the motion is reported {by} later than the torque)"
    if "velocity_delay_s" in known:
        late = "late" if known["velocity_delay_s"] > 0.0 else "early"
        return f" (the velocity is {_time(known['velocity_delay_s'])} {late})"
    if effect == "torque-ripple" and {"cos_nm", "sin_nm"} <= known.keys():
        return _amplitudes(known)
    if effect == "torque-saturation" and "limit_nm" in known:
        return f" (at {_torque(known['limit_nm'])})"
    return ""


def _amplitudes(known: Mapping[str, float]) -> str:
    """Return a ripple's amplitude, and that of the double order where it has one, in brackets."""
    first = _torque(math.hypot(known["cos_nm"], known["sin_nm"]))
    if not {"cos_second_nm", "sin_second_nm"} <= known.keys():
        return f" (amplitude {first})"
    second = _torque(math.hypot(known["cos_second_nm"], known["sin_second_nm"]))
    return f" (amplitude {first}, at the double order {second})"


def _factor(known: Mapping[str, float]) -> str:
    per_k = known.get("factor_per_k", 0.0)
    if per_k:
        way = "falls" if per_k < 0.0 else "grows"
        return (
            f" (the factor from reported to real torque {way} by {_short(100.0 * abs(per_k))} % "
            "per kelvin of the motor)"
        )
    if "factor" in known:
        return f" (the real torque is the reported one times a factor of {known['factor']:.3f})"
    return ""


def number_sentence(
    effect: str,
    changes: Mapping[str, tuple[float, float, str]],
    share: float,
    *,
    recorded: bool = False,
) -> str:
    """Return the sentence of a wrong number.

    Parameters
    ----------
    effect : str
    changes : mapping of str to (float, float, str)
        What is wrong in words, to what the twin says, what the recordings say, and the SI unit.
    share : float
        Of what the twin as given leaves.
    recorded : bool
        Whether the simulation is a recorded one, whose own numbers nobody here knows: then only
        what it lacks can be told.
    """
    worth = f"This explains {_percent(share)} of the difference to the simulation as given."
    if effect == "torque-constant-error":
        _, found, _ = next(iter(changes.values()))
        return (
            "The torque constant is wrong: the real torque is the reported one times a factor of "
            f"{found:.3f}. {worth}"
        )
    told = {name: numbers for name, numbers in changes.items() if _differs(numbers, changes)}
    change = _lack if recorded else _change
    said = " and ".join(change(name, *numbers) for name, numbers in (told or changes).items())
    if effect == "gravity-imbalance":
        return f"The simulation does not know all of the load: {said}. {worth}"
    return f"A number of the simulation is wrong: {said}. {worth}"


def _differs(
    numbers: tuple[float, float, str], changes: Mapping[str, tuple[float, float, str]]
) -> bool:
    """Return whether a number's change is worth a word beside another number's."""
    given, found, unit = numbers
    # Gravity's two parts are one vector: a part that is nothing is measured by the other.
    size = max(max(abs(was), abs(now)) for was, now, own in changes.values() if own == unit)
    return abs(found - given) >= _SAME_NUMBER * (abs(given) or size)


def _lack(name: str, given: float, found: float, unit: str) -> str:
    scale = scale_for(unit, (found - given,))
    size = significant(abs(found - given) * scale.factor, 3)
    way = "more" if found > given else "less"
    return f"{name} is {size} {scale.unit} {way} than the simulation has"


def _change(name: str, given: float, found: float, unit: str) -> str:
    scale = scale_for(unit, (given, found))
    texts = [significant(value * scale.factor, 3) for value in (found, given)]
    return f"{name} is {texts[0]}, not {texts[1]} {scale.unit}".rstrip()


def saturation_sentence(limit_nm: float, tops: int, shortfall_rad_s: float) -> str:
    """Return the sentence of a torque limit: how often it is reached, and what the motion lacks."""
    return (
        f"{tops} times the torque stays at {_torque(limit_nm)} while the velocity falls short of "
        f"its command by {_short(shortfall_rad_s)} rad/s: the drive clips its torque there."
    )


def proof_sentence(holdout: Holdout, floor_nm: float) -> str:
    """Return what the findings are worth on data that was not seen."""
    before, after = holdout.baseline.rmse_nm, holdout.extended.rmse_nm
    values = (before, after, floor_nm)
    scale = scale_for("N m", [v for v in values if math.isfinite(v)])
    texts = [significant(value * scale.factor, 2) for value in values]
    noise = f"; noise is {texts[2]} {scale.unit}" if math.isfinite(floor_nm) else ""
    if texts[0] == texts[1]:  # what keeps the motion back, as a torque limit does, costs no torque
        return f"On {holdout.source} the error stays at {texts[0]} {scale.unit}{noise}."
    falls = "falls" if after < before else "does not fall: it goes"
    lost = " What was found does not hold there." if after > _WORSE * before else ""
    return (
        f"On {holdout.source} the error {falls} from {texts[0]} to {texts[1]} {scale.unit}{noise}."
        f"{lost}"
    )


def tie_sentence(finding: Finding) -> str:
    """Return what a finding cannot be told apart from, and what decides."""
    others = " or ".join(NAMES[a.effect] for a in finding.alternatives)
    first = finding.alternatives[0].told_apart_by
    return f"These recordings cannot tell {NAMES[finding.effect]} from {others}. To decide: {first}"


def summary(
    verdict: str,
    findings: Sequence[Finding],
    holdout: Holdout | None,
    floor_nm: float,
    refitted: Fit,
    left: Sequence[Region],
    left_share: float,
) -> str:
    """Return the whole answer.

    Parameters
    ----------
    verdict : Verdict
    findings : sequence of Finding
    holdout : Holdout or None
    floor_nm : float
    refitted : Fit
        Of the simulation with its own numbers refitted.
    left : sequence of Region
        Where what nothing explains lies.
    left_share : float
    """
    if verdict == "no-mismatch":
        rest = _torque(refitted.rmse_nm)
        if not math.isfinite(floor_nm):
            return (
                "Simulation and recordings agree as far as can be told: what is left, "
                f"{rest} rms, follows nothing that was recorded, and how much noise there is could "
                "not be measured."
            )
        if 0.0 < left_share < 1.0:  # beside the effects that the simulation has already
            return (
                f"Simulation and recordings agree but for {rest} rms, where noise is "
                f"{_torque(floor_nm)}: {100.0 * left_share:.0f} % of what it would miss without "
                "its effects."
            )
        if refitted.rmse_nm > _AS_NOISE * floor_nm:
            return (
                f"Simulation and recordings agree as far as can be told: what is left, {rest} rms "
                f"where noise is {_torque(floor_nm)}, follows nothing that was recorded."
            )
        return f"Simulation and recordings agree: what is left, {rest} rms, is noise."
    parts = [f.sentence for f in findings[:_TOLD]]
    if len(findings) > _TOLD:
        more = len(findings) - _TOLD
        parts.append(f"{more} smaller finding{'s are' if more > 1 else ' is'} listed below.")
    if verdict in ("unexplained", "partly-explained"):
        parts.append(_left_sentence(findings, floor_nm, refitted, left, left_share))
    if holdout is not None and findings:
        parts.append(proof_sentence(holdout, floor_nm))
    tied = [f for f in findings if f.alternatives]
    if tied:
        parts.append(tie_sentence(tied[0]))
    return " ".join(parts)


def _left_sentence(
    findings: Sequence[Finding],
    floor_nm: float,
    refitted: Fit,
    left: Sequence[Region],
    share: float,
) -> str:
    """Return how much has no name, and where it lies."""
    place = " and ".join(dict.fromkeys(place_in_words(region) for region in left[:2]))
    lies = f"It is greatest {place}." if place else "It follows nothing that was recorded."
    if findings and all(f.form == OWN_NUMBER for f in findings):
        return f"What these numbers do not explain has no name in the library. {lies}"
    if findings:
        return f"{_percent(share)} of the mismatch has no name in the library. {lies}"
    if left and left[0].variable == "frequency_hz" and refitted.rmse_nm < _AS_NOISE * floor_nm:
        return (
            "The simulation, its numbers refitted, agrees with the recordings but for a torque "
            f"that swings {place}: no effect of the library carries that."
        )
    scale = scale_for("N m", (refitted.rmse_nm, floor_nm))
    error, noise = (significant(v * scale.factor, 2) for v in (refitted.rmse_nm, floor_nm))
    return (
        f"The simulation, its numbers refitted, is off by {error} {scale.unit} rms where noise is "
        f"{noise}, and no effect of the library carries that. {lies}"
    )


def _percent(share: float) -> str:
    whole = 100.0 * min(max(share, 0.0), 1.0)
    return f"{fixed(whole, 0)} %" if whole >= 1.0 or whole == 0.0 else "less than 1 %"


def _torque(value: float) -> str:
    scale = scale_for("N m", (value,))
    return f"{significant(value * scale.factor, 2)} {scale.unit}"


def _time(value: float) -> str:
    scale = scale_for("s", (value,))
    return f"{significant(abs(value) * scale.factor, 2)} {scale.unit}"


def _short(value: float) -> str:
    return significant(value, 2)
