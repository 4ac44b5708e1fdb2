"""What is said of a joint, in one sentence for a technician."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from datetime import UTC, datetime

from agent.identify.result import Parameter
from agent.monitor.change.change_time import ChangeTime
from agent.monitor.change.outlook import Outlook
from agent.monitor.compensation.kind import FEWEST_SIBLINGS, Siblings
from agent.monitor.detection.series import State
from agent.monitor.history.cycle import Cycle
from agent.monitor.verdict.comparison import Comparison, Effect
from agent.monitor.verdict.reasons import Reasons
from agent.monitor.verdict.since_first import SinceFirst
from agent.numbers import signed

_NOTABLE_PERCENT = 3.0
_MONTHS = (
    *("January", "February", "March", "April", "May", "June"),  # strftime's are the locale's
    *("July", "August", "September", "October", "November", "December"),
)


def since(change: ChangeTime, cycles: tuple[Cycle, ...]) -> str:
    """Return since when, in words; empty where that is not decidable."""
    if not change.decidable:
        return ""
    began = datetime.fromtimestamp(cycles[0].started_s + change.time_s, UTC).date()
    return f" since about {began.day} {_MONTHS[began.month - 1]} {began.year}"


def day(seconds: float) -> str:
    """Return a date in UTC."""
    return datetime.fromtimestamp(seconds, UTC).date().isoformat()


def began(found: SinceFirst, day_of: Callable[[float], str]) -> str:
    """Return when a rise that is there from the first cycle on began."""
    low, high = found.change.time_ci95_s
    share = f"{100.0 * found.change.probability:.0f} %"
    if found.no_healthy_period:
        return f"The rise began before {day_of(high)} ({share}), perhaps before the first cycle."
    return f"The rise began between {day_of(low)} and {day_of(high)} ({share})."


def rising(found: SinceFirst, reasons: Reasons, cycles: int, *, high: bool) -> str:
    """Return the sentence of friction that rises from the first cycle on."""
    start = "Friction has been rising since the first cycle"
    far = ", and is now high" if high else ""
    compared = "; there is no healthy period to compare with"
    if not found.no_healthy_period:
        start, compared = "Friction has been rising since soon after the first cycle", ""
    return (
        f"{start}{far}: {_share(found.rise)} at low speed in {cycles} cycles, at equal "
        f"conditions{compared}; {_why(reasons)}."
    )


def unsettled(sentence: str, fall: Parameter, cycles: int) -> str:
    """Return the sentence of a joint without alarm whose friction fell over its baseline."""
    start = "Not decidable yet: " if sentence.startswith("Not decidable yet: ") else "No alarm, "
    but = "" if start.startswith("Not") else "yet "
    rest = sentence.removeprefix(start).rstrip(".")
    return (
        f"{start}{but}the baseline is not settled: friction has fallen by "
        f"{_share(fall, signed=False)} at low speed over its {cycles} cycles, as in a new "
        f"gear that runs in, and a rise of less than that may go unseen ({rest})."
    )


def lent(siblings: Siblings, cycles: int, share: float | None) -> str:
    """Return what joints of the same kind are to one, a sentence.

    `share` is how far its law is theirs, with `cycles` of its own; None where it has no law yet.
    """
    known, grown = siblings.known, len(siblings.grown)
    if not siblings.kinds:
        return (
            f"Nothing is learned from joints of its kind: {grown} of the {known} that are known "
            "have lived long enough in health, and at least "
            f"{FEWEST_SIBLINGS} are needed."
        )
    show = f"what {grown} joints of its kind show of temperature, payload and scatter"
    if share is None:
        return f"Its first cycles are asked beside {show}."
    if share < 0.5:
        return (
            f"It is unlike the {grown} joints of its kind that are known "
            f"({100.0 * (1.0 - share):.0f} %), and compensated by its own {cycles} healthy cycles."
        )
    return f"Compensated by {show}, beside its own {cycles} healthy cycles; its level is its own."


def alarmed(state: State, found: Comparison, reasons: Reasons, since_when: str) -> str:
    """Return what is said of an alarm to a technician: the news, then the numbers behind it."""
    a_lot = " a lot" if state is State.HIGH else ""
    return (
        f"Friction is up{a_lot}{_how_far(found, bool(a_lot))}{since_when}: {_why(reasons)}. "
        f"Change at low speed {in_percent(found.effects['low'])}, at high speed "
        f"{in_percent(found.effects['high'])}, compared {_at(found)}."
    )


def _how_far(found: Comparison, apart: bool) -> str:
    """Return by how much friction rose and where; nothing where no part of the curve shows it."""
    for name, where in (("low", "low speed"), ("whole", "all speeds"), ("high", "high speed")):
        effect = found.effects[name]
        if effect.clear and effect.percent > 0.0:
            return f"{', by' if apart else ''} {effect.percent:.1f} % at {where}"
    return ""


def dated(ahead: Outlook) -> Outlook:
    """Return an outlook that says in plain words where no date can be given, and why."""
    if ahead.decidable:
        return ahead
    rise = f"{100.0 * ahead.limit_rise:.0f} %"
    reason = ahead.sentence.removeprefix("outlook not decidable: ")
    far = reason.removeprefix(f"a rise of {rise} lies ")
    if far != reason:
        reason = f"it is {far.removesuffix(' ahead, further than the trend bears')} away"
    return replace(ahead, sentence=f"no date can be given for +{rise}: {reason}")


def _why(reasons: Reasons) -> str:
    """Return the likeliest cause, or those that are not told apart."""
    likely = [cause.short for cause in reasons.likely]
    told = len(likely) == 1
    return f"most likely {likely[0]}" if told else f"perhaps {' or '.join(likely)}, not told apart"


def _share(change: Parameter, *, signed: bool = True) -> str:
    """Return a change with its interval in per cent; without its sign where words say it."""
    assert change.ci95 is not None
    value, ends = 100.0 * change.value, [100.0 * end for end in change.ci95]
    if signed:
        return f"{_signed(value)} % ({_signed(ends[0])} to {_signed(ends[1])} %)"
    low, high = sorted(abs(end) for end in ends)
    return f"{abs(value):.1f} % ({low:.1f} to {high:.1f} %)"


def quiet(found: Comparison, healthy: int, *, fell: bool = False) -> str:
    """Return the sentence of a joint without alarm, compared with so many healthy cycles."""
    word = moved(found)
    start = "No alarm, friction is as it was"
    if fell:
        start = "No alarm, yet friction has fallen"
    elif word:
        start = f"No alarm, yet friction is {word} than it was"
    return (
        f"{start}: {in_percent(found.effects['low'])} at low speed, "
        f"{in_percent(found.effects['high'])} at high speed, compared {_at(found)} with "
        f"{healthy} healthy cycles."
    )


def afterwards(found: Comparison) -> str:
    """Return how the first cycles after an event differ from the healthy ones before it."""
    return (
        f"friction was then {in_percent(found.effects['low'])} at low speed, "
        f"{in_percent(found.effects['high'])} at high speed, beside the healthy cycles before, "
        f"compared {_at(found)}"
    )


def moved(found: Comparison) -> str:
    """Return "lower" or "higher" where friction has clearly moved; empty where it has not."""
    off = [e for e in found.effects.values() if e.clear and abs(e.percent) > _NOTABLE_PERCENT]
    return ("lower" if off[0].percent < 0.0 else "higher") if off else ""


def in_percent(effect: Effect) -> str:
    """Return a change in per cent with its interval, for example ``+5.8 % (+5.1 to +6.4 %)``."""
    low, high = effect.ci95_percent
    return f"{_signed(effect.percent)} % ({_signed(low)} to {_signed(high)} %)"


def parts_of(said: str) -> tuple[str, str]:
    """Return the first sentence of what is said of a joint, and the rest, which may be empty."""
    first, more, rest = said.partition(". ")
    return (f"{first}.", rest) if more else (said, "")


def as_sentence(words: str) -> str:
    """Return words as a sentence: a capital letter, a full stop."""
    return f"{words[0].upper()}{words[1:]}."


def _signed(percent: float) -> str:
    return signed(round(percent, 1) + 0.0, "+.1f")


def _at(found: Comparison) -> str:
    if not math.isfinite(found.temperature_degc):
        return "at unknown temperature (not compensated)"
    beyond = " (which the baseline has not seen)" if found.extrapolated else ""
    return f"at {found.temperature_degc:.0f} °C{beyond}"
