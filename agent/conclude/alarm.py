"""What an alarm is, asked of the explain engine: healthy and present cycles, questioned together.

A plain twin is identified from healthy cycles. It then has to predict healthy and present ones side
by side: only there do temperature, which comes and goes, and time, which does not come back, part.
What the monitor weighs by the shape of one mean curve is thereby asked of every sample.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from agent.conclude.cycles import fingerprint_of
from agent.conclude.explanation import explained
from agent.conclude.outcome import conclude
from agent.errors import InputError
from agent.explain.answer.amounts import percent, torque
from agent.explain.answer.names import NAMES
from agent.explain.answer.result import Explanation
from agent.explain.answer.result import Finding as Effect
from agent.explain.answer.said import Said
from agent.explain.answer.words import summary_of
from agent.identify.estimate import twin_from_estimate
from agent.monitor.history.cycle import Cycle
from agent.monitor.verdict.verdict import Finding
from agent.physics.twin import Twin
from agent.record.reading import read
from agent.record.recording import Recording

HEALTHY, PRESENT = 8, 5
"""Cycles of each kind that are asked; one more of each is held out."""

BESIDE = "Also left out by the plain simulation"
"""What stands above all that healthy and present cycles show alike."""

_DRIFT = "friction-drift"
_TEMPERATURE = "temperature-dependent-friction"
_NOTHING = "no-mismatch"


@dataclass(frozen=True)
class AlarmExplanation:
    """The answer, and what it was asked of.

    Parameters
    ----------
    sentence : str
        For a technician: whether time or use is needed beside temperature and the rest.
    found : Explanation or None
        None where it could not be asked; the sentence says why.
    twin : Twin or None
        Of the healthy cycles.
    recordings : tuple of Recording
        That it learned from.
    """

    sentence: str
    found: Explanation | None = None
    twin: Twin | None = None
    recordings: tuple[Recording, ...] = ()


def explained_alarm(finding: Finding, paths: Sequence[Path]) -> AlarmExplanation:
    """Explain an alarm.

    Parameters
    ----------
    finding : Finding
        With an alarm.
    paths : sequence of Path
        The history's files, the joint's own among them.
    """
    healthy, present = asked_cycles(finding)
    try:
        kinds = [[_recording(c, paths) for c in kind] for kind in (healthy, present)]
        (learned, h), (now, p) = (_split(kind) for kind in kinds)
        twin = _twin(learned)
        recordings = (*learned, *now)
        found = explained(twin, Path("healthy cycles"), recordings, (h, p))
        found = led_by_drift(found, len(learned))
    except (InputError, ValueError) as error:
        return AlarmExplanation(f"Explain could not be asked: {str(error).rstrip('.')}.")
    how_many = f"{len(learned)} healthy and {len(now)} present cycles together"
    answer = f"Asked of {how_many}, {said(found, len(learned))}"
    return AlarmExplanation(answer, found, twin, recordings)


def led_by_drift(found: Explanation, healthy: int) -> Explanation:
    """Return an explanation that begins with what tells present cycles from healthy ones.

    A plain twin leaves out more than the alarm is about, and some of that has a larger share: it
    comes behind. Where time or use is not found, or may be something else, all stays as it was.

    Parameters
    ----------
    found : Explanation
    healthy : int
        How many of its recordings, the first ones, are of healthy cycles.
    """
    drift = _certain_drift(found)
    if drift is None:
        return found
    share = f"{NAMES[_DRIFT]} explains {percent(drift.energy_share)} of the mismatch."
    change = _change(drift, found, healthy)
    between = f"Between the healthy and the present cycles {change}; {share}"
    told = Said(between, f"Between the healthy and the present cycles {change}.")
    others = [f for f in found.findings if f is not drift]
    findings = (replace(drift, said=told) if change else drift, *others)
    ranked = tuple(replace(f, rank=rank) for rank, f in enumerate(findings, start=1))
    led = replace(found, findings=ranked, beside=BESIDE)
    return replace(led, sentence=summary_of(led))


def _certain_drift(found: Explanation) -> Effect | None:
    """Return that friction changes with time or use, where nothing else may be in its place."""
    drift = [f for f in found.findings if f.effect == _DRIFT]
    return drift[0] if drift and not drift[0].alternatives else None


def _change(drift: Effect, found: Explanation, healthy: int) -> str:
    """Return by how much present friction differs from healthy; empty where it was not measured.

    Of what was measured of each recording, with temperature and all else that was found taken off;
    every sample alike, so that speeds that are held longer count for more.
    """
    curve = drift.curve
    if curve is None or curve.variable != "recording":
        return ""
    present = curve.bin_at > healthy - 0.5  # recordings are counted from 0
    if present.all() or not present.any():
        return ""
    change_nm = float(curve.bin_nm[present].mean() - curve.bin_nm[~present].mean())
    way = "risen" if change_nm > 0.0 else "fallen"
    warmth = "" if _TEMPERATURE in found.not_judged else " at equal temperature"
    by = f"{torque(abs(change_nm))}{warmth}, averaged over the time of a cycle"
    return f"friction has {way} by {by}"


def asked_cycles(finding: Finding) -> tuple[tuple[Cycle, ...], tuple[Cycle, ...]]:
    """Return the healthy cycles to ask, spread over the temperatures, and the latest ones."""
    track = finding.current
    assert track is not None
    cycles = finding.history.cycles[track.segment.start : track.segment.stop]
    known, later = cycles[: finding.compared_with], cycles[finding.compared_with :]
    warm = sorted(known, key=_by_warmth)
    count = min(HEALTHY + 1, len(warm))
    spread = {round(i * (len(warm) - 1) / max(count - 1, 1)) for i in range(count)}
    healthy = sorted((warm[i] for i in spread), key=lambda c: c.started_s)
    return tuple(healthy), tuple(later[-(PRESENT + 1) :])


def _by_warmth(cycle: Cycle) -> tuple[float, float]:
    known = math.isfinite(cycle.temperature_degc)
    return cycle.temperature_degc if known else 0.0, cycle.started_s


def said(found: Explanation, healthy: int) -> str:
    """Return whether time or use is needed to explain what a healthy joint's simulation lacks.

    Parameters
    ----------
    found : Explanation
    healthy : int
        How many of its recordings, the first ones, are of healthy cycles.
    """
    drift = [f for f in found.findings if f.effect == _DRIFT]
    tied = [f for f in found.findings if any(a.effect == _DRIFT for a in f.alternatives)]
    others = _listed([f for f in found.findings if f.effect != _DRIFT])
    certain = _certain_drift(found)
    if certain is not None:
        change = _change(certain, found, healthy)
        named = f"{NAMES[_DRIFT]} ({percent(certain.energy_share)} of the mismatch)"
        first = f"explain finds {f'that between them {change}: ' * bool(change)}{named}."
        return f"{first} {BESIDE}: {others}." if others else first
    if drift or tied:
        one = drift[0] if drift else tied[0]
        rivals = {one.effect, *(a.effect for a in one.alternatives)} - {_DRIFT}
        names = " or ".join(NAMES[r] for r in sorted(rivals))
        return f"explain cannot tell {NAMES[_DRIFT]} from {names}."
    if found.verdict == _NOTHING:
        return "explain finds no difference above the noise."
    if not others:
        return f"explain says: {found.sentence}"
    return f"explain does not need {NAMES[_DRIFT]}: it finds {others}."


def _listed(effects: Sequence[Effect]) -> str:
    """Return effects in words, each once, with its share."""
    shares: dict[str, float] = {}
    for one in effects:
        shares[one.effect] = shares.get(one.effect, 0.0) + one.energy_share
    words = [f"{NAMES[name]} ({100.0 * share:.0f} %)" for name, share in shares.items()]
    return " and ".join([", ".join(words[:-1]), words[-1]] if len(words) > 1 else words)


def _recording(cycle: Cycle, paths: Sequence[Path]) -> Recording:
    """Return a cycle's recording; of several files of one name the one with its samples."""
    named = [path for path in paths if path.name == cycle.name]
    found = [read(path) for path in named]
    if len(found) > 1:
        found = [r for r in found if fingerprint_of(r) == cycle.fingerprint]
    if not found:
        raise InputError(f"{cycle.name} is not there any more")
    return found[0]


def _split(kind: Sequence[Recording]) -> tuple[tuple[Recording, ...], Recording]:
    """Return what is learned from, and the one in the middle, which is held out."""
    if len(kind) < 3:
        raise InputError("it takes three healthy and three present cycles")
    middle = len(kind) // 2
    return (*kind[:middle], *kind[middle + 1 :]), kind[middle]


def _twin(recordings: Sequence[Recording]) -> Twin:
    about = recordings[0].metadata
    return twin_from_estimate(
        conclude(recordings).estimate,
        robot=about.robot,
        axis=about.axis,
        gear_ratio=about.gear_ratio,
    )
