"""`--oil` of `stribeck thermal`: which oil is in the gearbox, and which ones to set beside it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from agent.errors import InputError, UsageError
from agent.physics.thermal import THESIS_OILS, Oil
from agent.record.recording import Recording

_FORM = "NAME=V40/V100, its kinematic viscosities at 40 and 100 °C in mm²/s, as in oil=150/18"


def oils_for(text: str, recordings: Sequence[Recording]) -> tuple[str, Mapping[str, Oil]]:
    """Return the name of the oil in use, and all oils to compare; none where it is not known.

    Parameters
    ----------
    text : str
        One of the thesis's oils, ``NAME=V40/V100`` or any other name; where it is empty, what the
        recordings' metadata (``oil``) say.
    recordings : sequence of Recording

    Raises
    ------
    agent.errors.InputError
        The viscosities are none, or the recordings are of different oils.
    """
    said = {str(r.metadata.extra["oil"]) for r in recordings if r.metadata.extra.get("oil")}
    if len(said) > 1:
        raise InputError(
            f"These recordings are of different oils: {', '.join(sorted(said))}.",
            "Take those of each oil by themselves.",
        )
    text = text.strip() or next(iter(said), "")
    if "=" not in text:
        name = _known(text)
        return (name, THESIS_OILS) if name else (text, {})
    name, _, numbers = text.rpartition("=")
    try:
        at_40, at_100 = (float(number) for number in numbers.split("/"))
        own = Oil(at_40, at_100)
    except ValueError as error:
        raise UsageError(f"--oil {text}: expected {_FORM} ({error}).") from error
    return name.strip(), {name.strip(): own, **THESIS_OILS}


def unknown_oil(name: str) -> str:
    """Return what is missing to compare an oil with others."""
    return f"the viscosities of {name} are not known; give them as --oil {_FORM}."


def _known(text: str) -> str:
    """Return which of the thesis's oils a text names: "oil 1", "Oil1" or "1"; else nothing."""
    plain = text.lower().replace(" ", "").removeprefix("oil")
    return next((name for name in THESIS_OILS if name.removeprefix("oil ") == plain), "")
