"""What is said of a wrong number of the simulation, and of a torque that is clipped."""

from __future__ import annotations

import math
from collections.abc import Mapping

from agent.explain.answer.amounts import factor, percent, short, torque
from agent.explain.answer.names import OWN_NUMBER
from agent.explain.answer.said import Said
from agent.explain.answer.sentences import shared
from agent.numbers import scale_for, significant

_SAME_NUMBER = 0.01  # of it: less is not told where another number of the kind moved more


def number_sentence(
    effect: str,
    changes: Mapping[str, tuple[float, float, str]],
    share: float,
    *,
    recorded: bool = False,
    doubtful: bool = False,
) -> Said:
    """Return what is said of a wrong number.

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
    doubtful : bool
        Whether something else explains as much.
    """
    worth = f"This explains {percent(share)} of {shared(OWN_NUMBER, beside_numbers=True)}."
    if effect == "torque-constant-error":
        _, found, _ = next(iter(changes.values()))
        wrong, real = ("may be", "would be") if doubtful else ("is", "is")
        lead = (
            f"The torque constant {wrong} wrong: the real torque {real} the reported one times a "
            f"factor of {factor(found)}."
        )
        return Said(lead, worth=worth)
    differ = {name: numbers for name, numbers in changes.items() if _differs(numbers, changes)}
    told = differ or changes
    change = _lack if recorded else change_said
    said = " and ".join(change(name, *numbers) for name, numbers in told.items())
    if effect == "gravity-imbalance":
        return Said(f"The simulation {_of_the_load(changes)}: {said}.", worth=worth)
    many = "Numbers of the simulation" if len(told) > 1 else "A number of the simulation"
    wrong = "may be" if doubtful else "are" if len(told) > 1 else "is"
    return Said(f"{many} {wrong} wrong: {said}.", worth=worth)


def _of_the_load(changes: Mapping[str, tuple[float, float, str]]) -> str:
    """Return what a simulation does to a load that it has too little or too much of."""
    given = math.hypot(*(was for was, _, _ in changes.values()))
    found = math.hypot(*(now for _, now, _ in changes.values()))
    if sum(was * now for was, now, _ in changes.values()) < 0.0:
        return "has the load on another side"
    return "does not know all of the load" if found >= given else "has too much of the load"


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


def change_said(name: str, given: float, found: float, unit: str) -> str:
    """Return what a number is, and what it is not, with its unit."""
    scale = scale_for(unit, (given, found))
    texts = [significant(value * scale.factor, 3) for value in (found, given)]
    return f"{name} is {texts[0]}, not {texts[1]} {scale.unit}".rstrip()


def saturation_sentence(limit_nm: float, tops: int, shortfall_rad_s: float) -> Said:
    """Return what is said of a torque limit: how often it is met, and what the motion lacks."""
    return Said(
        f"{_often(tops)} the torque stays at {torque(limit_nm)} while the velocity falls short of "
        f"its command by {short(shortfall_rad_s)} rad/s: the drive clips its torque there."
    )


def reading_sentence(
    limit_nm: float, tops: int, missing_nm: float, share: float = 0.0, *, by_motion: bool = False
) -> Said:
    """Return what is said of a reading that ends before the torque does, and what it explains."""
    asks = "the joint's motion takes" if by_motion else "the drive asks for"
    goes_on = "" if by_motion else ", and the joint moves as if it had that"
    lead = (
        f"{_often(tops)} the torque is reported as {torque(limit_nm)} where {asks} up to "
        f"{torque(missing_nm)} more{goes_on}: the reading is clipped, at its range, and the drive "
        "is at no limit."
    )
    worth = f"This explains {percent(share)} of the mismatch." if share > 0.0 else ""
    return Said(lead, worth=worth)


def _often(times: int) -> str:
    """Return how often, as a sentence begins."""
    return "Once" if times == 1 else f"{times} times"
