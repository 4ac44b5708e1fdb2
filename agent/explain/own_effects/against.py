"""What was found in the place of doubted effects, told as an answer about the twin as given."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace

from agent.explain.answer import words
from agent.explain.answer.fits import UNSEEN
from agent.explain.answer.names import OWN_EFFECT, OWN_NUMBER
from agent.explain.answer.own_effect import own_effect_sentence, too_much_sentence, with_share
from agent.explain.answer.result import NAMELESS, Explanation, Finding, Holdout, Moved
from agent.explain.answer.ties import is_tied
from agent.explain.choosing.materiality import MATERIAL
from agent.explain.numbers.wrong import MATERIAL as OF_GIVEN
from agent.explain.own_effects.better import (
    floor_nm2,
    is_better,
    mismatch_nm2,
    on_the_floor_of,
    settles_more,
)
from agent.explain.own_effects.constant import deciding, or_a_constant
from agent.explain.own_effects.doubted import Doubted
from agent.explain.own_effects.energies import Energies
from agent.explain.own_effects.pairs import finding_of
from agent.explain.taken_off import beside_a_finding
from agent.explain.verdict import MUCH_LEFT
from agent.identify.result import Parameter
from agent.physics.twin import Effect

_NAMELESS = 2.0  # times the noise: what leaves more is not what the joint has in its place
_HELPS = 0.1  # of the mismatch: what right numbers in an effect's place take off at least


def told_against(
    doubted: Doubted, answer: Explanation, bare: Explanation, *, plainer: bool = False
) -> Explanation | None:
    """Return what is found in the place of doubted effects as an answer about the twin as given.

    None where that is no better an answer than the one about the twin as given.

    Parameters
    ----------
    doubted : Doubted
    answer : Explanation
        Of the twin as given.
    bare : Explanation
        Of the twin without what is doubted, its proof and pictures against the twin as given.
    plainer : bool
        Whether it is to be told where it needs as many laws.
    """
    if doubted.excess:
        bare = _of_the_whole(bare, answer)
    if bare.twin is None or answer.twin is None:
        return None
    answer = on_the_floor_of(answer, bare)
    if not (plainer or is_better(bare, answer, len(doubted.excess))):
        return None
    trials = [Energies(doubted, bare.twin, floor_nm2(answer), moved=m) for m in (True, False)]
    energy = next((e for e in trials if e.helped >= _HELPS and e.tells), trials[0])
    share = {f.rank: _share(f, bare, answer) for f in bare.findings}
    own, paired, lost = _in_their_place(doubted, bare, energy)
    others = [
        replace(f, energy_share=share[f.rank], said=with_share(f, share[f.rank]))
        for f in bare.findings
        if f.rank not in paired and not (f.form == OWN_NUMBER and share[f.rank] < OF_GIVEN)
    ]
    if not own and (doubted.excess or lost or not others or not settles_more(bare, answer)):
        return None
    found = sorted((*own, *others), key=lambda f: -f.energy_share)
    verdict = beside_a_finding(bare.verdict)
    if verdict in ("explained", "tied"):
        verdict = "tied" if is_tied(found) else "explained"
    reason = _TAKEN_OFF if doubted.excess else _CHANGED if own else _AS_THEY_ARE
    told = replace(
        bare,
        verdict=verdict,
        reasons=(reason, *bare.reasons),
        baseline=answer.baseline,
        refitted=answer.refitted,
        findings=tuple(replace(f, rank=rank) for rank, f in enumerate(found, start=1)),
        cells=answer.cells,
        moved=_moved(answer, bare),
        unexplained_share=_left_share(answer, bare),
        twin=replace(bare.twin, effects=(*bare.twin.effects, *lost)),
        holdout=_held_out(answer.holdout, bare.holdout),
        next_experiment=bare.next_experiment
        or next((deciding(f) for f in own if f.alternatives), None),
    )
    return replace(told, sentence=words.summary_of(told))


def _of_the_whole(bare: Explanation, answer: Explanation) -> Explanation:
    """Return what is found without what was taken off, with the verdict that all of it has.

    What stays is without a name, but little of what the simulation as recorded leaves.
    """
    if bare.verdict in NAMELESS and _left_share(answer, bare) <= MUCH_LEFT:
        return replace(bare, verdict="explained")
    return bare


def _in_their_place(
    doubted: Doubted, bare: Explanation, energy: Energies
) -> tuple[list[Finding], set[int], list[Effect]]:
    """Return what the doubted effects are found to be, one by one.

    Returns
    -------
    own : list of Finding
        Those worth a name, as findings about the twin as given.
    paired : set of int
        Ranks of the bare twin's findings that are the same law again.
    lost : list of Effect
        Too little for a name, found anew or not.
    """
    own: list[Finding] = []
    paired: set[int] = set()
    lost: list[Effect] = []
    factor = _factor_of(bare)
    noise_nm2 = floor_nm2(bare)
    nameless = noise_nm2 > 0.0 and bare.extended.rmse_nm**2 > _NAMELESS**2 * noise_nm2
    for place, law in energy.pairs:
        effect = doubted.twin.effects[place]
        same = law is not None and law.id == effect.id
        finding = finding_of(law, bare.findings, paired) if law is not None and same else None
        if finding is not None:
            paired.add(finding.rank)
        worth, too_much = energy.of(place, law), doubted.excess.get(place)
        if finding is not None and is_the_factors(effect, finding, factor):
            continue
        if energy.helped >= _HELPS and worth >= MATERIAL:
            whole = min(worth, 1.0)
            if too_much is None:
                told = _own_finding(effect, finding, whole, energy, place, law, nameless=nameless)
                own.append(or_a_constant(effect, told))
            else:
                own.append(_too_much_finding(too_much, whole, energy, place, law))
        elif law is None and too_much is None:
            lost.append(effect)
    return own, paired, lost


def _factor_of(bare: Explanation) -> float:
    """Return the factor by which the reported torque was found to be off; 1 where it was not."""
    factors = (f.parameters["factor"].value for f in bare.findings if "factor" in f.parameters)
    return next(factors, 1.0)


def is_the_factors(effect: Effect, found: Finding, factor: float) -> bool:
    """Return whether an effect has other numbers by the factor of the torque constant alone.

    All torques are told in reported newton metres, a spring's stiffness and an arm's inertia too.
    """
    given = effect.numbers
    told = {name: p for name, p in found.parameters.items() if name in given and p.ci95 is not None}
    if factor == 1.0 or not told:
        return False
    for name, parameter in told.items():
        low, high = parameter.ci95 or (math.nan, math.nan)
        is_torque = "_nm" in name or name.endswith("_kg_m2")
        if not low <= given[name] / (factor if is_torque else 1.0) <= high:
            return False
    return True


_CHANGED = (
    "effects of the simulation whose numbers do not fit were taken out of it and looked for "
    "anew; twin.toml holds what was found in their place"
)
_TAKEN_OFF = (
    "what the recorded simulation has too much of was found by asking it and the joint the other "
    "way round, and was taken off before everything else was judged; twin.toml does not hold it: "
    "take it out of the simulation"
)
_AS_THEY_ARE = (
    "effects that the simulation has already were looked for anew beside what it lacks, and found "
    "as it has them"
)


def _own_finding(
    effect: Effect,
    found: Finding | None,
    share: float,
    energy: Energies,
    place: int,
    law: Effect | None,
    *,
    nameless: bool,
) -> Finding:
    """Return that an effect of the simulation is not as the recordings show it."""
    given = effect.numbers
    numbers: Mapping[str, Parameter] = {}
    if found is not None:
        numbers = found.parameters
    elif law is not None and law.id == effect.id:  # modelled, and without a name
        numbers = {
            name: Parameter(value, None, identified=True) for name, value in law.numbers.items()
        }
    said = own_effect_sentence(
        effect.id,
        given,
        numbers,
        share,
        energy.times(place, law),
        of_all=not energy.moved,
        nameless=nameless,
    )
    if found is None:
        return Finding(effect.id, 0, 1.0, share, (), said, numbers, form=OWN_EFFECT)
    return replace(
        found,
        energy_share=share,
        said=said,
        form=OWN_EFFECT,
        holdout_rmse_without_nm=energy.rmse_with(place, law),
        curve=energy.drawn(place, found),
    )


def _too_much_finding(
    found: Finding, share: float, energy: Energies, place: int, law: Effect | None
) -> Finding:
    """Return that a recorded simulation has more of an effect than the joint, or another one.

    What was found of it the other way round is what the simulation has too much: its torque is to
    be taken off. Where a law of its kind is left beside that, neither is a number of its own.
    """
    numbers, curve = ({} if law is not None else found.parameters), found.curve
    said = too_much_sentence(
        found.effect, numbers, share, of_all=not energy.moved, another=law is not None
    )
    if law is not None:
        curve = None
    elif curve is not None:
        curve = replace(
            curve,
            line_nm=-curve.line_nm,
            lower_nm=-curve.upper_nm,
            upper_nm=-curve.lower_nm,
            bin_nm=-curve.bin_nm,
        )
    return replace(
        found,
        energy_share=share,
        said=said,
        parameters=numbers,
        form=OWN_EFFECT,
        holdout_rmse_without_nm=energy.rmse_with(place, law),
        curve=curve,
        ringing=None,
    )


def _left_share(answer: Explanation, bare: Explanation) -> float:
    """Return which share of what the twin as given leaves has no name."""
    before, after = mismatch_nm2(answer), mismatch_nm2(bare)
    if not before > after:
        return bare.unexplained_share
    return bare.unexplained_share * after / before


def _share(finding: Finding, bare: Explanation, answer: Explanation) -> float:
    """Return a finding's share of what the twin as given leaves."""
    energy = finding.energy_share * mismatch_nm2(bare, finding.form)
    before = mismatch_nm2(answer, finding.form)
    return min(energy / before, 1.0) if before > 0.0 else 0.0


def _moved(answer: Explanation, bare: Explanation) -> tuple[Moved, ...]:
    """Return how the numbers moved from those of the twin as given, refitted."""
    after = {moved.parameter: moved.extended for moved in bare.moved}
    return tuple(
        Moved.between(m.parameter, m.given, m.refitted, after[m.parameter]) for m in answer.moved
    )


def _held_out(answer: Holdout | None, bare: Holdout | None) -> Holdout | None:
    """Return the proof against the twin as given; where folds stand in, their own errors as given.

    Parameters
    ----------
    answer, bare : Holdout or None
        Of the twin as given, and of what was found without what is doubted of it: of recordings
        that were held out it has the twin as given already.
    """
    if answer is None or bare is None or bare.source == UNSEEN:
        return bare
    before, after = answer.baseline.rmse_nm, bare.extended.rmse_nm
    return replace(
        bare,
        baseline=answer.baseline,
        refitted=answer.refitted,
        improvement_percent=100.0 * (1.0 - after / before) if before > 0.0 else math.nan,
        improvement_ci95_percent=None,
    )
