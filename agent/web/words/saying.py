"""What the engine decided, in the reader's language; where it cannot be said so, as it was said."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

from agent.record.verdict_file import Verdict
from agent.web.words.language import number
from agent.web.words.verdict import ADVICE, CAUSES, MOVED, REFUSED, SAID

_TOO_FEW = (
    "Noch {n} gesunde Tests derselben Art fahren; bis dahin wird aufgezeichnet, nicht geurteilt."
)


class Said(NamedTuple):
    """Words, and the language that they are in (for screen readers)."""

    text: str
    language: str


def verdict(language: str, judged: Verdict) -> Said:
    """Return a verdict's sentence."""
    facts = judged.facts
    template = SAID.get(str(facts.get("said", ""))) if language == "de" else None
    if template is None:
        return Said(judged.sentence, "en")
    try:
        return Said(template.format(**_filled(facts)), "de")
    except (KeyError, TypeError, ValueError, AttributeError, IndexError):
        return Said(judged.sentence, "en")  # facts of another version, or spoilt ones


def steps(language: str, judged: Verdict) -> list[Said]:
    """Return what to do next, by what was decided; empty where nothing is known of it."""
    facts = judged.facts
    if language != "de":
        said = facts.get("next_steps")
        return [Said(_sentence(str(s)), "en") for s in said] if isinstance(said, list) else []
    if facts.get("said") == "too-few":
        missing = _whole(facts.get("needed")) - _whole(facts.get("healthy"))
        return [Said(_TOO_FEW.format(n=missing), "de")] if missing > 0 else []
    causes = facts.get("causes")
    known = [str(c) for c in causes] if isinstance(causes, list) else []
    return [Said(CAUSES[cause][1], "de") for cause in known if cause in CAUSES]


def reasons(language: str, estimate: Mapping[str, Any]) -> list[Said]:
    """Return why an estimate is not decidable."""
    said = [Said(ADVICE[a][0], "de") for a in _advice(language, estimate) if ADVICE[a][0]]
    return said + [Said(str(r), "en") for r in _list(estimate, "reasons")]


def advice(language: str, estimate: Mapping[str, Any]) -> list[Said]:
    """Return what to record instead; empty where the estimate does not say."""
    keys = _advice(language, estimate)
    if keys:
        return [Said(ADVICE[key][1], "de") for key in keys]
    return [Said(str(s), "en") for s in _list(estimate, "next_steps")]


def refusal(language: str, name: str, reason: str) -> list[Said]:
    """Return why a precondition does not hold: in the reader's language, then in detail."""
    own = [Said(REFUSED[name], "de")] if language == "de" and name in REFUSED else []
    return [*own, Said(reason, "en")]


def _advice(language: str, estimate: Mapping[str, Any]) -> list[str]:
    known = [str(key) for key in _list(estimate, "advice")]
    return known if language == "de" and all(key in ADVICE for key in known) else []


def _list(document: Mapping[str, Any], name: str) -> Sequence[Any]:
    found = document.get(name)
    return found if isinstance(found, list) else []


def _filled(facts: Mapping[str, Any]) -> dict[str, str]:
    """Return what goes into a template's braces; KeyError and the like where facts are missing."""
    out = {name: str(facts[name]) for name in ("healthy", "needed", "cycles") if name in facts}
    for name in ("low", "high", "since_first"):
        if name in facts:
            percent, low, high = (float(facts[name][n]) for n in ("percent", "from", "to"))
            out[name] = f"{_signed(percent)} % ({_signed(low)} bis {_signed(high)} %)"
    if "temperature_degc" in facts:
        degc = facts["temperature_degc"]
        beyond = " (die die Referenz nicht gesehen hat)" if facts.get("extrapolated") else ""
        out["at"] = (
            "bei unbekannter Temperatur (nicht ausgeglichen)"
            if degc is None
            else f"bei {number('de', float(degc), 0)} °C{beyond}"
        )
    if facts.get("moved"):
        out["moved"] = MOVED[facts["moved"]]
    causes = facts.get("causes")
    if causes:
        first = CAUSES[causes[0]][0]
        single = len(causes) == 1
        out["why"] = (
            f"am wahrscheinlichsten {first}" if single else f"vielleicht {first}, noch nicht sicher"
        )
    began, between = facts.get("began"), facts.get("began_between")
    out["since"] = f" seit etwa {_day(began)}" if began else ""
    ends = "" if not between else f"zwischen {_day(between[0])} und {_day(between[1])}"
    out["between"] = f" Die Änderung begann {ends} (95 %)." if ends else ""
    return out


def _signed(percent: float) -> str:
    return number("de", percent, 1, sign=True)


def _day(text: str) -> str:
    year, month, day = text.split("-")
    return f"{day}.{month}.{year}"


def _sentence(words: str) -> str:
    return f"{words[:1].upper()}{words[1:]}{'' if words.endswith('.') else '.'}"


def _whole(value: object) -> int:
    return value if isinstance(value, int) else 0
