"""One finding in a sentence: where, how much, what it is, and how much it explains."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType

from agent.explain.answer.amounts import amount, duration, factor, percent, short, torque
from agent.explain.answer.names import FOLLOWS_DIRECTION, FOLLOWS_TORQUE, OWN_NUMBER, law_name
from agent.explain.answer.places import place_in_words
from agent.explain.answer.result import Region, Ringing
from agent.explain.answer.said import Said
from agent.identify.result import Parameter
from agent.numbers import significant

_SHOWS_THERE, _TIMES_MORE = 0.2, 3.0  # of what is left; of its usual share
RIGHT_AFTER_S = 0.1
_THAN = " than the simulation"
_OR_WARMTH = ", or with the gear's warmth, which was not recorded,"
LITTLE = 1e-6  # of the mismatch: what has a name is not nothing, though others take all from it
# Of the greater side: less on the other side is not worth a word. Where friction grows, the twin's
# own level, fitted without it, makes up for some elsewhere.
_ONE_SIDED, _ONE_SIDED_FRICTION = 0.15, 0.6
_GROWTH: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "coulomb_nm_per_h": ("Coulomb friction", "N m"),
        "viscous_nm_s_per_rad_per_h": ("viscous friction", "N m s/rad"),
    }
)

_STEPS: Mapping[str, tuple[str, str]] = MappingProxyType(
    {
        "coulomb_step_nm": ("Coulomb friction", "N m"),
        "viscous_step_nm_s_per_rad": ("viscous friction", "N m s/rad"),
    }
)


def finding_sentence(
    effect: str,
    where: Sequence[Region],
    reach_nm: tuple[float, float],
    energy_share: float,
    parameters: Mapping[str, Parameter],
    *,
    first: bool = True,
    beside_numbers: bool = False,
    in_twin: bool = True,
    beside: Mapping[str, float] = MappingProxyType({}),
    or_warmth: bool = False,
) -> Said:
    """Return what is said of a finding: where, how much, what it is, how much it explains.

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
    beside_numbers : bool
        Whether numbers of the simulation are wrong as well.
    in_twin : bool
        Whether the extended twin has it: what no simulation bears out explains nothing yet.
    beside : mapping of str to float
        Numbers that the simulation has in such laws already: what is found comes on top of them.
    or_warmth : bool
        Whether the gear's warmth, which nobody recorded, may do the same.
    """
    place = place_in_words(where[0] if where else None, effect)
    begin = f"{place[:1].upper()}{place[1:]} {_amount(effect, reach_nm)}"
    detail = _detail(effect, parameters, beside)
    called = law_name(effect, parameters)
    name = f"{called} ({detail})" if detail else called
    name += _OR_WARMTH if or_warmth else ""
    whole = shared("", beside_numbers=beside_numbers)
    carried = f"{percent(max(energy_share, LITTLE))} of {whole}"
    if in_twin:
        lead = f"{begin}; {name} explains {carried}." if first else f"{begin}: {name}, {carried}."
    else:
        lead = (
            f"{begin}; {name} has the shape of {carried}, with no numbers that a simulation of it "
            "bears out: twin.toml does not hold it."
        )
    return Said(lead, f"{begin}: {detail}." if detail else f"{begin}.")


def shared(form: str, *, beside_numbers: bool) -> str:
    """Return what a finding's share is of: physics has no part in what wrong numbers make.

    Parameters
    ----------
    form : str
        The finding's.
    beside_numbers : bool
        Whether numbers of the simulation are wrong.
    """
    if form == OWN_NUMBER:
        return "the difference to the simulation as given"
    return "what the right numbers leave" if beside_numbers else "the mismatch"


def counted_from(said: Said, level_nm: float, *, first: bool) -> Said:
    """Return what is said of a place where friction elsewhere is not the simulation's, either.

    Parameters
    ----------
    said : Said
    level_nm : float
        By how much Coulomb friction is more than the simulation's elsewhere.
    first : bool
        Whether this is the main finding, with which it is said.
    """
    way = "more" if level_nm > 0.0 else "less"
    lead, place = (t.replace(_THAN, " than elsewhere") for t in (said.lead, said.place))
    level = f"Elsewhere it needs {torque(abs(level_nm))} {way} than the simulation."
    if first:
        return Said(f"{lead} {level}", f"{place} {level}" if place else "", said.worth, said.caveat)
    return Said(lead, place, said.worth, " ".join(t for t in (level, said.caveat) if t))


def changed_sentence(before: str, after: str) -> str:
    """Return between which recordings friction became another."""
    return f"The change came between {before} and {after}."


def ringing_sentence(ringing: Ringing) -> str:
    """Return that loose teeth are heard, and by how much."""
    return (
        f"Its blows are heard: {ringing.instants} times the load on the gear changed sides in "
        f"motion, and right after that the motor rang {_times(ringing.louder)} as strongly as "
        "before and later."
    )


def shown_sentence(effect: str, size: float, gear_ratio: float) -> str:
    """Return what an encoder on the arm shows of the gear.

    Parameters
    ----------
    effect : str
        Backlash, or a joint's flexibility.
    size : float
        Half the gap, rad of the motor, or the stiffness there, N m/rad.
    gear_ratio : float
        Motor turns per arm turn.
    """
    if effect == "backlash":
        what = (
            f"play, {short(2.0 * size)} rad of the motor ({short(2e3 * size / gear_ratio)} mrad of "
            "the arm) where the load changes sides"
        )
    else:
        what = f"twist, a radian of the motor for {short(size)} N m"
    return f"The arm's encoder shows the {what}, and how the arm moves: nothing of it is simulated."


def spring_sentence(inertia_share: float) -> str:
    """Return where else the spring may be that the motor's signals alone show.

    Parameters
    ----------
    inertia_share : float
        Of the joint's inertia, what swings.
    """
    return (
        f"{percent(inertia_share)} of the joint's inertia swings; whether on the gear, on the "
        "arm's own spring, on what the robot stands on or on a neighbouring axis' servo, the "
        "motor's signals do not say: an encoder on the arm does, or a run with the other axes' "
        "brakes on."
    )


def only_heard(ringing: Ringing, near: float, of_time: float, *, swings: bool = False) -> str:
    """Return that loose teeth are heard, where they have no name.

    A spring that is soft at little load and stiffens strikes as they do; and any soft gear rings
    where an acceleration that begins or ends is what turns the load.

    Parameters
    ----------
    ringing : Ringing
    near, of_time : float
        Which share of what is left lies right after they meet, and of the motion.
    swings : bool
        Whether a soft gear was found.
    """
    shows = (
        f"{percent(near)} of what is left lies within {RIGHT_AFTER_S:g} s of that, in "
        f"{percent(of_time)} of the motion"
        if near > max(_SHOWS_THERE, _TIMES_MORE * of_time)
        else "in the torque that is compared it does not show"
    )
    ringing_alone = ", if it is not the soft gear that rings" if swings else ""
    return (
        f"the gear may have play, or be much softer under little load{ringing_alone}: "
        f"{ringing.instants} times the load on it changed sides in motion, and right after that "
        f"the motor rang {_times(ringing.louder)} as strongly as before and later; {shows}"
    )


def _times(louder: float) -> str:
    """Return the root of an energy's factor in words: what a velocity shows."""
    return f"{significant(math.sqrt(louder), 2)} times"


def _amount(effect: str, reach_nm: tuple[float, float]) -> str:
    """Return by how much the joint differs from the simulation."""
    low, high = reach_nm
    largest = max(-low, high)
    size = torque(largest)
    kind = "friction torque" if effect in FOLLOWS_DIRECTION else "torque"
    one_sided = _ONE_SIDED_FRICTION if effect in FOLLOWS_DIRECTION else _ONE_SIDED
    whose = "the drive reports" if effect in FOLLOWS_TORQUE else "the joint needs"
    if high > 0.0 and -low <= one_sided * high:
        return f"{whose} up to {size} more {kind} than the simulation"
    if low < 0.0 and high <= -one_sided * low:
        return f"{whose} up to {size} less {kind} than the simulation"
    return f"the {kind} differs from the simulation's by up to ±{size}"


def _detail(effect: str, parameters: Mapping[str, Parameter], beside: Mapping[str, float]) -> str:
    """Return the one number that says more than the torque, nothing without one."""
    known = {n: p.value for n, p in parameters.items() if p.identified and math.isfinite(p.value)}
    if effect == "torque-constant-error":
        return _factor(known)
    if "torque_lag_s" in known and "torque_delay_s" in known:
        late_s = known["torque_delay_s"] + known["torque_lag_s"]
        return (
            f"the torque is reported {duration(late_s)} later than the motion, "
            f"{duration(known['torque_lag_s'])} of it by a low-pass"
        )
    if "torque_delay_s" in known:
        by = duration(known["torque_delay_s"])
        if known["torque_delay_s"] > 0.0:
            return f"the torque is reported {by} later than the motion"
        return f"the motion is reported {by} later than the torque"
    if "velocity_delay_s" in known:
        word = "later" if known["velocity_delay_s"] > 0.0 else "earlier"
        by = f"{duration(known['velocity_delay_s'])} {word}"
        return f"the velocity is reported {by} than the position and the torque"
    if effect == "torque-ripple" and {"cos_nm", "sin_nm"} <= known.keys():
        return _amplitudes(known)
    if effect == "friction-drift":
        return _growth(known, beside)
    if "dent_nm" in known:
        return "a dent, which pushes to one side before it and to the other behind"
    if known.get("period_arm_rad"):
        return "once in every turn of the arm"
    if effect == "torque-saturation" and "limit_nm" in known:
        return f"at {torque(known['limit_nm'])}"
    return ""


def _growth(known: Mapping[str, float], beside: Mapping[str, float]) -> str:
    """Return how fast friction grows with time, where it does so steadily or at once."""
    said = []
    for key, (name, unit) in _GROWTH.items():
        rate, own = known.get(key, 0.0), beside.get(key, 0.0)
        if rate:
            said.append(f"{name} {_grows(rate + own, own, unit)}")
    for key, (name, unit) in _STEPS.items():
        step = known.get(key, 0.0)
        if step:
            way = "more" if step > 0.0 else "less"
            said.append(f"{name} is {amount(abs(step), unit)} {way} from one recording on")
    return " and ".join(said)


def _grows(rate: float, given: float, unit: str) -> str:
    """Return how fast a number grows or falls, and how fast it does in the simulation."""
    size = amount(abs(rate), unit)
    grows = f"{'grows' if rate > 0.0 else 'falls'} by {size} an hour"
    if not given:
        return grows
    other = "" if rate * given > 0.0 else f"{'growing' if given > 0.0 else 'falling'} by "
    return f"{grows} instead of {other}{amount(abs(given), unit)}"


def _amplitudes(known: Mapping[str, float]) -> str:
    """Return a ripple's amplitude, and that of the double order or of a loaded motor's."""
    own_nm = math.hypot(known["cos_nm"], known["sin_nm"])
    per_nm = known.get("load_growth_per_nm", 0.0) * own_nm
    per_nm = per_nm or math.hypot(known.get("cos_share", 0.0), known.get("sin_share", 0.0))
    first = torque(own_nm)
    if per_nm:
        return f"amplitude {first} without load, and {torque(per_nm)} for every N m of torque"
    if not {"cos_second_nm", "sin_second_nm"} <= known.keys():
        return f"amplitude {first}"
    second = torque(math.hypot(known["cos_second_nm"], known["sin_second_nm"]))
    return f"amplitude {first}, at the double order {second}"


def _factor(known: Mapping[str, float]) -> str:
    per_k = known.get("factor_per_k", 0.0)
    if per_k:
        way = "falls" if per_k < 0.0 else "grows"
        return (
            f"the factor from reported to real torque {way} by {short(100.0 * abs(per_k))} % "
            "per kelvin of the motor"
        )
    if known.get("tenth_less_nm"):
        return (
            f"of {torque(known['tenth_less_nm'])} that are reported a tenth is not there, and the "
            "smaller a torque, the smaller the part: iron that saturates"
        )
    if "factor" in known:
        return f"the real torque is the reported one times a factor of {factor(known['factor'])}"
    return ""
