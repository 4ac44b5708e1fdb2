"""An explanation's ids as words that a technician reads, the same on the page and in a terminal."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from types import MappingProxyType
from typing import Literal

from agent.explain.answer import amounts
from agent.explain.answer.names import effect_name
from agent.explain.answer.result import Explanation, Moved, NextExperiment
from agent.explain.answer.ties import is_far_likelier
from agent.explain.answer.words import of_the_mismatch
from agent.numbers import NO_NUMBER, fixed, scale_for, significant
from agent.report.advice import next_steps
from trajectories import lasting

Tone = Literal["good", "open", "stop"]

BIASED_SIGMAS = 2.0
"""A move of more than this many standard deviations is a bias that the missing physics caused."""


@dataclass(frozen=True)
class VerdictWords:
    """A verdict as it is shown: what it is called, what that means, and how it is felt."""

    status: str
    meaning: str
    tone: Tone
    sign: str


NOT_DECIDABLE = VerdictWords(
    "Not decidable", "These recordings do not carry an answer.", "stop", "warning"
)
_VERDICTS: Mapping[str, VerdictWords] = MappingProxyType(
    {
        "explained": VerdictWords(
            "Explained",
            "The mismatch has a name, and correcting it holds on data that the correction was "
            "not made from.",
            "good",
            "check",
        ),
        "tied": VerdictWords(
            "Several causes fit equally well",
            "The mismatch can be corrected, but these recordings cannot tell which cause is the "
            "true one.",
            "open",
            "fork",
        ),
        "partly-explained": VerdictWords(
            "Explained in part",
            "A part of the mismatch has a name; another part is located and has none.",
            "open",
            "half",
        ),
        "unexplained": VerdictWords(
            "Located, but not explained",
            "Simulation and recordings differ where the pictures show it, and nothing in the "
            "library carries that.",
            "stop",
            "question",
        ),
        "no-mismatch": VerdictWords(
            "Simulation and recordings agree",
            "What is left between them is noise.",
            "good",
            "equal",
        ),
    }
)
_FAR_LIKELIER = VerdictWords(
    "One cause is far likelier than another",
    "The mismatch can be corrected. Another cause is far less likely, and these recordings do not "
    "rule it out.",
    "open",
    "fork",
)
_NOWHERE = VerdictWords(
    "Not explained",
    "More is left between simulation and recordings than the noise that could be measured, along "
    "nothing that was recorded: slow noise, or something that these recordings do not show.",
    "stop",
    "question",
)
_OTHERS_AGREE = VerdictWords(
    "The other recordings agree",
    "What is left between the simulation and the recordings that were not left aside is noise.",
    "open",
    "equal",
)
_NOT_PROVEN = VerdictWords(
    "Named, but not proven",
    "What is listed fits the recordings that it was learnt from. On data that it was not made from "
    "the error stays above noise and does not surely fall: take the names as suspicions, and "
    "record more before the simulation is corrected by them.",
    "open",
    "half",
)
_DENIED = replace(
    _NOT_PROVEN,
    meaning="What is listed fits the recordings that it was learnt from, and those that were held "
    "out cannot be so: take the names as suspicions, and record more before the simulation is "
    "corrected by them.",
)
_NOT_WORTH = (
    "The mismatch has a name; that correcting it makes the error smaller on data that the "
    "correction was not made from is not shown: it is short, or small against the noise."
)
LITTLE = 1e-6
"""Of one: what has a name is not nothing, though others take all from it."""


def heading(label: str) -> str:
    """Return a label as it begins a line."""
    return label[:1].upper() + label[1:]


def is_biased(moved: Moved) -> bool:
    """Tell whether the missing physics had bent a number of the simulation."""
    return abs(moved.sigmas) > BIASED_SIGMAS


def decidable(explanation: Explanation) -> bool:
    """Tell whether anything was compared and judged at all."""
    if math.isnan(explanation.baseline.rmse_nm):
        return False
    judged = explanation.findings or explanation.cells or explanation.unexplained_where
    return bool(judged) or explanation.verdict == "no-mismatch"


def verdict_words(explanation: Explanation) -> VerdictWords:
    """Return the verdict in words."""
    if not decidable(explanation):
        return NOT_DECIDABLE
    words = _VERDICTS[explanation.verdict]
    if explanation.verdict == "no-mismatch" and explanation.unit_off:
        return _OTHERS_AGREE
    holdout = explanation.holdout
    if not proven(explanation):
        return _NOT_PROVEN if holdout is None or not holdout.denied else _DENIED
    open_ones = [finding for finding in explanation.findings if finding.alternatives]
    if explanation.verdict == "tied" and open_ones and all(map(is_far_likelier, open_ones)):
        return _FAR_LIKELIER
    spells = explanation.unexplained_spells is not None
    placed = explanation.unexplained_where or explanation.unexplained_varies is not None or spells
    if explanation.verdict == "unexplained" and not placed:
        return _NOWHERE
    gained = None if holdout is None else holdout.improvement_ci95_percent
    if explanation.verdict == "explained" and gained is not None and gained[0] <= 0.0:
        return replace(words, meaning=_NOT_WORTH)
    return words


def qualification(explanation: Explanation) -> str:
    """Return what takes a part of the verdict back; what it means as a rule goes without saying."""
    words = verdict_words(explanation)
    usual = _VERDICTS[explanation.verdict]
    ordinary = (NOT_DECIDABLE, _NOWHERE, _FAR_LIKELIER, _OTHERS_AGREE, usual)
    return "" if words in ordinary else words.meaning


def proven(explanation: Explanation) -> bool:
    """Tell whether unseen data bear out what was found, as far as they can; a limit needs none."""
    holdout = explanation.holdout
    judged = any(finding.energy_share > 0.0 for finding in explanation.findings)
    return holdout is None or not judged or not holdout.unsure


def found_title(explanation: Explanation) -> str:
    """Return what stands above the list of findings."""
    return "What was found" if proven(explanation) else "What was found, not proven"


def what_to_do(explanation: Explanation) -> tuple[str, ...]:
    """Return the steps out of an explanation that is not decidable; none where it is."""
    if decidable(explanation):
        return ()
    *steps, _ = next_steps(explanation.reasons)  # the last one speaks of estimates
    return (*steps, f"{'Then record' if steps else 'Record'} this axis again and explain again.")


def torque(value_nm: float, digits: int = 3) -> str:
    """Write a torque with the unit that its size asks for."""
    if not math.isfinite(value_nm):
        return NO_NUMBER
    scale = scale_for("N m", [value_nm])
    return f"{significant(value_nm * scale.factor, digits)} {scale.unit}"


def percent(value: float, decimals: int = 0) -> str:
    """Write a number of percent."""
    return f"{fixed(value, decimals)} %" if math.isfinite(value) else NO_NUMBER


def share(value: float) -> str:
    """Write a share of one as whole percent; what is small is not called nothing."""
    if 0.0 < value < 0.005:
        return "below 1 %"
    return percent(100.0 * value)


def carried(energy_share: float) -> str:
    """Write a finding's share: one that others take all from is little, and not nothing."""
    return amounts.percent(max(energy_share, LITTLE))


def short(value: float) -> str:
    """Write a number of at most three digits without the zeros that would only fill them."""
    text = significant(value, 3)
    return text.rstrip("0").rstrip(".") if "." in text else text


def unexplained_in_words(explanation: Explanation) -> str:
    """Say how much of the mismatch has no explanation."""
    part = explanation.unexplained_share
    known = share(part) if math.isfinite(part) else "A part"
    return f"{heading(known)} of {of_the_mismatch(explanation)} has no explanation."


_UNJUDGED = {"torque-constant-error": "a torque constant that changes with temperature"}
"""What of an effect was not judged, where a part of it always is: a constant factor."""


def not_judged(explanation: Explanation) -> tuple[tuple[str, tuple[str, ...]], ...]:
    """Return why effects were not judged, each reason with what those effects are called."""
    out: dict[str, tuple[str, ...]] = {}
    for effect, sentence in explanation.not_judged.items():
        why = sentence.removesuffix(f", so {effect} cannot be judged")
        out[why] = (*out.get(why, ()), _UNJUDGED.get(effect, effect_name(effect)))
    return tuple(out.items())


def tells_apart(experiment: NextExperiment) -> str:
    """Say which causes an experiment tells apart; empty where it names none, or has said so."""
    if experiment.set_up and not set_up_beside(experiment):
        return ""
    labels = [effect_name(effect) for effect in experiment.tells_apart]
    if all(label in experiment.sentence for label in labels):
        return ""
    if len(labels) == 2:
        return f"It tells {labels[0]} from {labels[1]}."
    return f"It tells apart: {'; '.join(labels)}." if labels else ""


def motion_needed(experiment: NextExperiment) -> str:
    """Return how long an experiment must be driven; empty where its sentence says so."""
    lasts = experiment.seconds
    if not math.isfinite(lasts):
        return ""
    if f" {lasting(math.ceil(lasts))} of driving" in experiment.sentence:
        return ""
    return f"about {lasting(lasts)}"


def briefly(experiment: NextExperiment) -> str:
    """Return an experiment's sentence without what it tells apart, for a list of such."""
    first, *others = [effect_name(effect) for effect in experiment.tells_apart] or [""]
    return experiment.sentence.replace(f" should tell {first} from {' and from '.join(others)}", "")


def set_up_beside(experiment: NextExperiment) -> str:
    """Return what must be changed about the joint, where the sentence does not say so itself."""
    return "" if experiment.set_up in experiment.sentence else experiment.set_up


def trajectory_hint(experiment: NextExperiment, file: str) -> str:
    """Say where the trajectory of an experiment is to be had, where no file holds it yet."""
    if experiment.trajectory is None or file:
        return ""
    return "Save next_experiment.trajectory of explanation.json as next.json."


def next_command(experiment: NextExperiment, axis: str, file: str) -> str:
    """Return the command that drives an experiment; empty where it is a change of the set-up.

    Parameters
    ----------
    experiment : NextExperiment
    axis : str
        As the cell numbers it; empty where it is not known.
    file : str
        Where its trajectory was written; empty where it was not.
    """
    if experiment.trajectory is None:
        return ""
    return f"stribeck run CELL.toml --axis {axis or 'N'} --trajectory {file or 'next.json'}"
