"""The whole answer in sentences that a technician understands."""

from __future__ import annotations

import math

from agent.explain.answer.amounts import percent, torque
from agent.explain.answer.as_if import as_if, in_spells
from agent.explain.answer.fits import UNSEEN, Edges
from agent.explain.answer.names import COSTS_NO_TORQUE, OWN_EFFECT, OWN_NUMBER, effect_name
from agent.explain.answer.own_effect import finding_name
from agent.explain.answer.places import place_in_words
from agent.explain.answer.result import Explanation, Finding, Holdout
from agent.explain.answer.small_share import weighed
from agent.explain.answer.ties import first_tie, is_far_likelier
from agent.numbers import scale_for, significant

TOLD = 3
"""Findings in the summary: smaller ones are counted there."""

_NOT_RECORDED, _SO = " was not recorded", ", so "
_HALF = 0.5  # of what stands above the noise: with less, most of what was found is not there
_WORSE = 1.1  # times the error before: more is no law for what was not seen
_LITTLE = 0.01  # of the mismatch: what has no name is in the unseen recordings alone
_WHOLE = 1.05  # of a mismatch: shares of more are not of one whole
_AS_NOISE = 1.1  # times the noise floor: up to there the band of the comparison holds nothing


def proof_sentence(holdout: Holdout, floor_nm: float) -> str:
    """Return what the findings are worth on data that was not seen."""
    before, after = holdout.baseline.rmse_nm, holdout.extended.rmse_nm
    values = (before, after, floor_nm)
    scale = scale_for("N m", [v for v in values if math.isfinite(v)])
    texts = [significant(value * scale.factor, 2) for value in values]
    noise = f"; noise is {texts[2]} {scale.unit}" if math.isfinite(floor_nm) else ""
    if holdout.denied:
        goes = f"the error goes from {texts[0]} to {texts[1]} {scale.unit}{noise}"
        return f"On {holdout.source} {goes}. On the recordings held out {holdout.denied}."
    if texts[0] == texts[1]:  # what keeps the motion back, as a torque limit does, costs no torque
        return f"On {holdout.source} the error stays at {texts[0]} {scale.unit}{noise}."
    falls = "falls" if after < before else "does not fall: it goes"
    lost = " What was found does not hold there." if after > _WORSE * before else ""
    unsure = "" if lost else _unsure(holdout)
    return (
        f"On {holdout.source} the error {falls} from {texts[0]} to {texts[1]} {scale.unit}{unsure}"
        f"{noise}.{lost}{' What was found is not proven.' if unsure else ''}"
    )


def _unsure(holdout: Holdout) -> str:
    """Return by how much the error falls, where it may not fall at all."""
    interval = holdout.improvement_ci95_percent
    if interval is None or not holdout.unsure:
        return ""
    low, high = (f"{round(end)}".replace("-", "\N{MINUS SIGN}") for end in interval)
    return f" (by {low} to {high} %)"


def tie_sentence(finding: Finding, *, to_decide: bool = True) -> str:
    """Return what a finding cannot be told apart from, and what decides."""
    others = " or ".join(effect_name(a.effect) for a in finding.alternatives)
    name = f"{'the ' if finding.form == OWN_EFFECT else ''}{finding_name(finding)}"
    said = f"These recordings cannot tell {name} from {others}."
    if is_far_likelier(finding):
        said = f"Far less likely than {name}, and not ruled out: {others}."
    first = after_colon(finding.alternatives[0].told_apart_by)
    return f"{said} To decide: {first}" if to_decide else said


def after_colon(sentence: str) -> str:
    """Return a sentence as it goes on behind a colon."""
    return f"{sentence[:1].lower()}{sentence[1:]}"


def smaller_sentence(count: int) -> str:
    """Return how many findings the summary leaves to the list; nothing for none."""
    more = count - TOLD
    return f"{more} smaller finding{'s are' if more > 1 else ' is'} listed below." * (more > 0)


def summary_of(explanation: Explanation) -> str:
    """Return the whole answer of an explanation, whatever its sentence says.

    Parameters
    ----------
    explanation : Explanation
    """
    if explanation.verdict == "no-mismatch":
        agreed = f"{_agreement(explanation)}{_but_for_edges(explanation.edges)}"
        return " ".join(part for part in (explanation.unit_off, agreed) if part)
    findings, floor_nm = explanation.findings, explanation.floor.value_nm
    parts = [explanation.unit_off]
    parts += [weighed(f, explanation.holdout, floor_nm).sentence for f in findings[:TOLD]]
    parts.append(smaller_sentence(len(findings)))
    parts += what_stays(explanation)
    tied = first_tie(findings)
    parts.append("" if tied is None else tie_sentence(tied))
    return " ".join(part for part in parts if part)


def _agreement(explanation: Explanation) -> str:
    """Return that simulation and recordings agree, and how far that can be told."""
    floor_nm, left_nm = explanation.floor.value_nm, explanation.refitted.rmse_nm
    share, rest = explanation.unexplained_share, torque(left_nm)
    if not math.isfinite(floor_nm):
        return (
            "Simulation and recordings agree as far as can be told: what is left, "
            f"{rest} rms, follows nothing that was recorded, and how much noise there is could "
            "not be measured."
        )
    if 0.0 < share < 1.0:  # beside the effects that the simulation has already
        return (
            f"Simulation and recordings agree but for {rest} rms, where noise is "
            f"{torque(floor_nm)}: {100.0 * share:.0f} % of what it would miss without "
            "its effects."
        )
    if _AS_NOISE * floor_nm < left_nm <= _AS_NOISE * explanation.floor.repeats_nm:
        return (
            f"Simulation and recordings agree as far as can be told: what is left, {rest} rms, "
            "does not come again at the same place and speed. Noise within half a second is "
            f"{torque(floor_nm)}."
        )
    if left_nm > _AS_NOISE * floor_nm:
        return (
            f"Simulation and recordings agree as far as can be told: what is left, {rest} rms "
            f"where noise is {torque(floor_nm)}, follows nothing that was recorded."
        )
    return f"Simulation and recordings agree: what is left, {rest} rms, is noise."


def _but_for_edges(edges: Edges | None) -> str:
    """Return where agreement was not asked about, and is not; nothing where it was everywhere."""
    if edges is None:
        return ""
    return (
        f" Not compared is how friction builds up right after starts and reversals: it is off by "
        f"{torque(edges.rms_nm)} rms there, in {percent(edges.share)} of the motion."
    )


def what_stays(explanation: Explanation) -> tuple[str, ...]:
    """Return what has no name, and what the findings are worth, each as it stands on a line."""
    verdict, findings, holdout = explanation.verdict, explanation.findings, explanation.holdout
    nowhere = not explanation.unexplained_where and explanation.unexplained_share < _LITTLE
    only_unseen = bool(findings) and nowhere
    parts = []
    denied = holdout is not None and bool(holdout.denied)
    if verdict in ("unexplained", "partly-explained") and not only_unseen and not denied:
        parts.append(_left_sentence(explanation))
    if holdout is not None and any(map(_costs_torque, findings)):
        parts.append(proof_sentence(holdout, explanation.floor.value_nm))
        little = _taken_there(holdout) if verdict == "partly-explained" else ""
        if little:
            parts.append(little)
        elif verdict == "partly-explained" and only_unseen and not denied:
            why = (
                "they go beyond what was learnt from, where what was found is carried on"
                if explanation.goes_further
                else "these hold something that the recordings to learn from do not show"
            )
            parts.append(f"That is {significant(holdout.floor_ratio, 2)} times the noise: {why}.")
    return tuple(parts)


def _taken_there(holdout: Holdout) -> str:
    """Return how little of what stands above the noise is gone on unseen data; empty for most."""
    share = holdout.taken_share()
    if holdout.source != UNSEEN or not 0.0 <= share < _HALF:
        return ""
    return f"What was found takes away {percent(share)} of what stands above the noise there."


def _costs_torque(finding: Finding) -> bool:
    """Return whether the simulation's torque is off by a finding: by a limit of its own it is."""
    own = finding.form == OWN_EFFECT
    return own or finding.effect not in COSTS_NO_TORQUE or finding.energy_share > 0.0


def _lies(explanation: Explanation, place: str) -> str:
    """Return where what has no name lies: best of all by the number that would have to vary."""
    varies, left = explanation.unexplained_varies, explanation.unexplained_where
    if varies is not None:
        return as_if(varies)
    if explanation.unexplained_spells is not None:
        return in_spells(explanation.unexplained_spells)
    if not place:
        like = "blows" if explanation.unexplained_brief else "slow noise"
        return (
            f"It goes along with nothing that was recorded: {like} would, or something that these "
            "recordings do not show."
        )
    return f"It lies {place}." if left[0].everywhere else f"It is greatest {place}."


def of_the_mismatch(explanation: Explanation) -> str:
    """Return of what the share is that has no name.

    What is compared holds nothing that swings above its band, and a finding's share is of that.
    """
    swings = any(region.variable == "frequency_hz" for region in explanation.unexplained_where)
    named = max((f.energy_share for f in explanation.findings), default=0.0)
    more = named + explanation.unexplained_share > _WHOLE
    return "all that differs, swings included," if swings and more else "the mismatch"


def _left_sentence(explanation: Explanation) -> str:
    """Return how much has no name, and where it lies."""
    findings, left = explanation.findings, explanation.unexplained_where
    floor_nm, refitted_nm = explanation.floor.value_nm, explanation.refitted.rmse_nm
    place = " and ".join(dict.fromkeys(place_in_words(region) for region in left[:2]))
    measured = math.isfinite(floor_nm)
    lies = _lies(explanation, place)
    lies += "" if measured else " How much of it is noise could not be measured."
    if findings and all(f.form == OWN_NUMBER for f in findings):
        return f"What these numbers do not explain has no name in the library. {lies}"
    if findings and any(_costs_torque(f) for f in findings):
        much = percent(explanation.unexplained_share)
        of = of_the_mismatch(explanation)
        return f"{much[0].upper()}{much[1:]} of {of} has no name in the library. {lies}"
    if left and left[0].variable == "frequency_hz" and refitted_nm < _AS_NOISE * floor_nm:
        return (
            "The simulation, its numbers refitted, agrees with the recordings but for a torque "
            f"that swings {place}: no effect of the library carries that."
        )
    if not left and refitted_nm < _AS_NOISE * floor_nm:
        return (
            f"The simulation as given is off by {torque(explanation.baseline.rmse_nm)} rms where "
            f"noise is {torque(floor_nm)}. Its numbers refitted, it agrees with the recordings, "
            "which do not say what of it is wrong."
        )
    if not measured:
        return (
            f"The simulation, its numbers refitted, is off by {torque(refitted_nm)} rms, and "
            f"{_no_effect(explanation)}. {lies}"
        )
    scale = scale_for("N m", (refitted_nm, floor_nm))
    error, noise = (significant(v * scale.factor, 2) for v in (refitted_nm, floor_nm))
    return (
        f"The simulation, its numbers refitted, is off by {error} {scale.unit} rms where noise is "
        f"{noise}, and {_no_effect(explanation)}. {lies}"
    )


def _no_effect(explanation: Explanation) -> str:
    """Return that no effect carries a mismatch, and what kept some from being judged."""
    reasons = (why.partition(_SO)[0] for why in explanation.not_judged.values())
    missing = [why[: -len(_NOT_RECORDED)] for why in reasons if why.endswith(_NOT_RECORDED)]
    if not missing:
        return "no effect of the library carries that"
    told = " and ".join(dict.fromkeys(missing))
    were = "were" if len(set(missing)) > 1 else "was"
    return (
        f"no effect of the library that could be judged carries that ({told} {were} not recorded)"
    )
