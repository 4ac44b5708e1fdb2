"""What is said of a joint, in one sentence for a technician."""

from __future__ import annotations

import math
from datetime import UTC, datetime

from agent.monitor.change_time import ChangeTime
from agent.monitor.comparison import Comparison, Effect
from agent.monitor.cycle import Cycle
from agent.monitor.reasons import Reasons
from agent.monitor.series import State

_NOTABLE_PERCENT = 3.0


def since(change: ChangeTime, cycles: tuple[Cycle, ...]) -> str:
    """Return since when, in words; empty where that is not decidable."""
    if not change.decidable:
        return ""
    return f" since about {day(cycles[0].started_s + change.time_s)}"


def day(seconds: float) -> str:
    """Return a date in UTC."""
    return datetime.fromtimestamp(seconds, UTC).date().isoformat()


def alarmed(state: State, found: Comparison, reasons: Reasons, since_when: str) -> str:
    """Return an alarm's sentence for a technician."""
    word = "has increased a lot" if state is State.HIGH else "has increased"
    cause = reasons.causes[0]
    likely = reasons.likely
    short = cause.words.split(" (")[0]
    why = f"most likely {short}" if len(likely) == 1 else f"perhaps {short}, not told apart yet"
    return (
        f"Friction {word}: {_in_words(found.effects['low'])} at low speed, "
        f"{_in_words(found.effects['high'])} at high speed{since_when}, compared {_at(found)}; "
        f"{why}."
    )


def quiet(found: Comparison, healthy: int) -> str:
    """Return the sentence of a joint without alarm, compared with so many healthy cycles."""
    word = moved(found)
    start = "No alarm, friction is as it was"
    if word:
        start = f"No alarm, yet friction is {word} than it was"
    return (
        f"{start}: {_in_words(found.effects['low'])} at low speed, "
        f"{_in_words(found.effects['high'])} at high speed, compared {_at(found)} with "
        f"{healthy} healthy cycles."
    )


def moved(found: Comparison) -> str:
    """Return "lower" or "higher" where friction has clearly moved; empty where it has not."""
    off = [e for e in found.effects.values() if e.clear and abs(e.percent) > _NOTABLE_PERCENT]
    return ("lower" if off[0].percent < 0.0 else "higher") if off else ""


def _in_words(effect: Effect) -> str:
    low, high = effect.ci95_percent
    return f"{_signed(effect.percent)} % ({_signed(low)} to {_signed(high)} %)"


def as_sentence(words: str) -> str:
    """Return words as a sentence: a capital letter, a full stop."""
    return f"{words[0].upper()}{words[1:]}."


def _signed(percent: float) -> str:
    return f"{percent:+.1f}".replace("-", "−")


def _at(found: Comparison) -> str:
    if not math.isfinite(found.temperature_degc):
        return "at unknown temperature (not compensated)"
    beyond = " (which the baseline has not seen)" if found.extrapolated else ""
    return f"at {found.temperature_degc:.0f} °C{beyond}"
