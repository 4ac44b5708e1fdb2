"""What else a finding may be: the rivals that explain as much, and the laws that look like it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from agent.explain.answer.result import Alternative
from agent.explain.choosing.aliases import told_apart_by
from agent.explain.choosing.rivals import Term
from agent.explain.forms.reversal import reach_rad
from agent.explain.forms.speed import brakes_both_ways
from agent.explain.numbers.short_stroke import PAYLOAD, pulled_and_offset
from agent.explain.rows.scene import Scene
from agent.explain.study import Study

OFFSET_OR_ASYMMETRY = frozenset({"torque-offset", "direction-asymmetry"})
YIELDING, _BUNDLE = "presliding-hysteresis", "cable-force"
_COULOMB, _HELD = "coulomb_extra_nm", "hysteresis_nm"
_DEGREES_RAD, _REDUCES = 0.02, 10.0  # of an arm behind such a gear: contacts yield over less


def alternatives_of(study: Study, term: Term) -> tuple[Alternative, ...]:
    """Return a term's rivals, each with the measurement that decides."""
    scene, effect = study.library.scene, term.scored.form.effect
    out = []
    for rival in term.rivals[:3]:
        other = rival.scored.form.effect
        out.append(Alternative(other, rival.probability, told_apart_by(effect, other)))
    if effect in OFFSET_OR_ASYMMETRY and not any(a.effect in OFFSET_OR_ASYMMETRY for a in out):
        partner = next(iter(OFFSET_OR_ASYMMETRY - {effect}))
        constant = term.scored.form.name == "constant"
        braking = constant and brakes_both_ways(scene, (), 2.0 * term.scored.coefficients)
        if braking or term.scored.form.name == "Coulomb":
            out = _as_likely(effect, partner, out)
    if term.scored.form is PAYLOAD and all(a.effect != _BUNDLE for a in out):
        library = study.library
        beside = [c.columns for c in study.choice.candidates if c.form is not PAYLOAD]
        if pulled_and_offset(library, library.base, term.candidate.columns, beside):
            out = _as_likely(effect, _BUNDLE, out)
    if effect == YIELDING and _yields_as_a_bundle(scene, term):
        out = _as_likely(effect, _BUNDLE, [a for a in out if a.effect != _BUNDLE])
    if effect == _BUNDLE and is_what_friction_lacks(study):
        out = _as_likely(effect, YIELDING, [a for a in out if a.effect != YIELDING])
    return tuple(out)


def _as_likely(effect: str, other: str, rivals: Sequence[Alternative]) -> list[Alternative]:
    """Return alternatives of which one is as likely as a finding and its rivals together."""
    halved = (replace(rival, probability=0.5 * rival.probability) for rival in rivals)
    return [Alternative(other, 0.5, told_apart_by(effect, other)), *halved]


def _yields_as_a_bundle(scene: Scene, term: Term) -> bool:
    """Return whether friction yields over degrees of an arm, as hoses do, and contacts do not."""
    gear, candidate = scene.table.gear_ratio, term.candidate
    return gear > _REDUCES and reach_rad(candidate.form, candidate.point) > _DEGREES_RAD * gear


def is_what_friction_lacks(study: Study) -> bool:
    """Return whether a bundle's inner friction is as much as the twin has too much of Coulomb's.

    Then both together are the friction that the twin says: one that yields, in part over a longer
    way, and no bundle besides it.
    """
    lacks = [n.parameters[_COULOMB] for n in study.numbers if _COULOMB in n.parameters]
    held = [own[_HELD] for own in study.model.parameters if _HELD in own]
    return any(
        a.ci95 is not None
        and b.ci95 is not None
        and a.ci95[0] <= -b.ci95[0]
        and -b.ci95[1] <= a.ci95[1]
        for a in held
        for b in lacks
        if b.value < 0.0
    )
