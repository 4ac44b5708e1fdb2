"""What swings beside the joint and not behind its gear: other axes in their servos, the base.

For the motor one is like the other: a part of the inertia follows it on a spring. But behind the
gear is all that the joint carries. Where what swings is too little for the weight that the joint
holds, another thing swings. It stays in the model, so that the numbers beside it are right, and
has no name: a gear that is not soft is not exchanged for it.

Nor has a weak swing beside a stronger effect a name where its own numbers do not exclude that there
is none: what is left of the stronger one's shape looks like it. Nor one above the compared band of
which no number is known: there it is one column, an inertia that grows with frequency, which a
drive's filter or torque that was sampled too seldom looks like.

Nor has one that is in the torque of a recorded simulation and not in the joint's, or friction right
after starts that is what another motion asks for (`of_the_loop`).

A swing beside it whose inertia is known to a third is there: that is six standard errors, which no
search among many shapes finds by chance.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

from agent.explain.answer.amounts import percent, short, torque
from agent.explain.answer.names import OWN_NUMBER, effect_name
from agent.explain.answer.result import Finding, Verdict
from agent.explain.choosing.choice import Choice
from agent.explain.choosing.of_the_loop import (
    SUMS_WITHIN_S,
    is_another_motions,
    is_the_simulations,
)
from agent.explain.choosing.search import Library
from agent.explain.choosing.weighted import DELAY
from agent.explain.forms.form import Form
from agent.explain.forms.hidden_arm import inertia_of
from agent.explain.forms.quantities import NOT_NEEDED
from agent.explain.numbers.whole import RUBS
from agent.explain.rows.scene import Scene
from agent.explain.verdict import MUCH_LEFT
from agent.physics.effects.library import CARRIED, YIELDING

_SWINGS = "joint-flexibility"
_IN_ITS_LOOP = frozenset({*CARRIED, "kinematic-error", "resolver-error"})
_OF_STARTS = frozenset({YIELDING, "local-fault"})
_GRAVITY_M_S2 = 9.81
_STEEL_KG_M3 = 7850.0
_KNOWN = 1.0 / 3.0  # of the inertia that swings: half an interval
_SMALL = 0.25  # of the joint's inertia: the arm behind a gear is more of it, or the motor is huge


@dataclass(frozen=True)
class Swing:
    """What swings on a spring beside the motor: its frequency, and its part of the inertia."""

    frequency_hz: float
    inertia_share: float
    weight_nm: float


def least_inertia_kg_m2(weight_nm: float) -> float:
    """Return the least inertia about its axis of anything that pulls with a weight's torque.

    A mass `m` at the distance ``L = T / (m g)`` has ``m L^2`` and what it has about its own centre,
    at least a solid ball's ``2/5 m r^2``, of steel. The least of both over all masses.

    Parameters
    ----------
    weight_nm : float
        Greatest torque of gravity about the axis, on the arm's side, not negative.
    """
    lever = (weight_nm / _GRAVITY_M_S2) ** 2
    ball = 0.4 * (3.0 / (4.0 * math.pi * _STEEL_KG_M3)) ** (2.0 / 3.0)
    mass_kg = (0.6 * lever / ball) ** 0.375
    return lever / mass_kg + ball * mass_kg ** (5.0 / 3.0) if mass_kg > 0.0 else 0.0


def beside_the_joint(scene: Scene, findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the findings of a swing that no arm behind this joint's gear can be.

    Parameters
    ----------
    scene : Scene
        In which they were found.
    findings : sequence of Finding
    """
    return tuple(f for f in findings if any(_too_light(s, scene) for s in _swing(f, scene)))


def not_needed(scene: Scene, findings: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return the swings beside a stronger effect whose numbers exclude neither none nor a filter.

    Parameters
    ----------
    scene : Scene
        In which they were found.
    findings : sequence of Finding
    """
    strongest = max((f.energy_share for f in findings), default=0.0)
    return tuple(
        f
        for f in findings
        if f.energy_share < strongest
        and any(_may_be_none(f) or _out_of_reach(f, own, scene) for own in _swing(f, scene))
    )


def of_the_simulation(
    library: Library, choice: Choice, findings: Sequence[Finding]
) -> tuple[Finding, ...]:
    """Return the findings that are a recorded simulation's own, and not the joint's.

    Arms, and what stands for friction where the simulation moved otherwise than the joint.

    Parameters
    ----------
    library : Library
    choice : Choice
        In which they were found.
    findings : sequence of Finding
    """
    own = {
        (term.scored.form.effect, term.scored.form.name)
        for index, term in enumerate(choice.terms)
        if (term.scored.form.effect in _IN_ITS_LOOP and is_the_simulations(library, choice, index))
        or (_is_friction(term.scored.form) and is_another_motions(library, choice, index))
    }
    return tuple(f for f in findings if (f.effect, f.form) in own)


def _is_friction(form: Form) -> bool:
    """Return whether a form is friction that stands for another motion right after starts.

    A dent pushes to both sides, and sums to nothing by itself.
    """
    return form.effect == YIELDING or form.name in RUBS


def of_its_loop(findings: Sequence[Finding], own: Sequence[Finding]) -> tuple[Finding, ...]:
    """Return a delay that is less than what is the simulation's own: its loop answers late."""
    most = max((f.energy_share for f in own), default=0.0)
    return tuple(f for f in findings if f.effect == DELAY and f.energy_share < most)


def simulations_sentence(own: Finding, findings: Sequence[Finding]) -> str:
    """Return that something is the simulation's own, and what to do.

    Parameters
    ----------
    own : Finding
        Of `of_the_simulation`.
    findings : sequence of Finding
        What is the joint's.
    """
    of = "what the right numbers leave" if any(f.form == OWN_NUMBER for f in findings) else ""
    like = "an arm on a spring" if own.effect in CARRIED else effect_name(own.effect)
    what = "a spring" if own.effect in CARRIED else "that"
    why = f"its torque, and not the recorded one, has a part like that of {like}, as where"
    if own.effect in _OF_STARTS:
        why = (
            f"it is like {like}, but sums to nothing within {short(SUMS_WITHIN_S)} s, as what the "
            "inertia asks for another motion does and friction does not:"
        )
    return (
        f"{percent(own.energy_share)} of {of or 'the mismatch'} is the simulation's own: {why} it "
        "moved in a loop of its own or was computed from a smoothed velocity; have it follow the "
        f"motion as recorded, before {what} is looked for"
    )


def verdict_beside(
    verdict: Verdict, findings: Sequence[Finding], swings: Sequence[Finding]
) -> Verdict:
    """Return the verdict where a swing beside the joint has no name.

    Parameters
    ----------
    verdict : Verdict
        Of the study that holds the swing.
    findings, swings : sequence of Finding
        Without the swing, and of it.
    """
    if not swings:
        return verdict
    if not findings:
        return "unexplained"
    much = sum(swing.energy_share for swing in swings) > MUCH_LEFT
    return "partly-explained" if much and verdict in ("explained", "tied") else verdict


def swing_sentence(swing: Finding, scene: Scene) -> str:
    """Return what swings, why it has no name, and what to do.

    Parameters
    ----------
    swing : Finding
        Of `beside_the_joint` or `not_needed`.
    scene : Scene
    """
    own = next(_swing(swing, scene))
    if not _too_light(own, scene):
        gear = (
            f"a soft gear that lets {percent(own.inertia_share)} of the joint's inertia swing at "
            f"{short(own.frequency_hz)} Hz would explain {percent(swing.energy_share)} of the "
            "mismatch beside what is named, but "
        )
        if _out_of_reach(swing, own, scene):
            return (
                f"{gear}that is above the {short(scene.table.cutoff_hz)} Hz that are compared, and "
                "none of its numbers is known: a filter in the drive, or torque that was sampled "
                "too seldom, looks alike; a faster recording would decide it"
            )
        return (
            f"{gear}within the intervals of its numbers there need be none; faster starts and "
            "reversals would decide it"
        )
    return (
        f"what swings at {short(own.frequency_hz)} Hz ({percent(swing.energy_share)} of the "
        f"mismatch) is not the arm behind this gear: {percent(own.inertia_share)} of the joint's "
        f"inertia takes part, and no mass so small has the weight of {torque(own.weight_nm)} that "
        "the joint carries; look at neighbouring axes that their servos hold, at a tool, and at "
        "what the robot stands on: hold the other axes with their brakes and run it again"
    )


def _swing(finding: Finding, scene: Scene) -> Iterator[Swing]:
    """Yield the swing that a finding has, if it has one."""
    numbers = finding.parameters
    if finding.effect != _SWINGS or scene.has("position_arm_rad"):
        return
    inertia = numbers["arm_inertia_kg_m2"].value
    hertz = (
        numbers["antiresonance_hz"].value
        if "antiresonance_hz" in numbers
        else math.sqrt(numbers["stiffness_nm_per_rad"].value / inertia) / (2.0 * math.pi)
    )
    yield Swing(hertz, inertia / inertia_of(scene), _weight_nm(scene))


def _may_be_none(swing: Finding) -> bool:
    stiffness = swing.parameters.get("stiffness_nm_per_rad")
    if stiffness is None or stiffness.identified or stiffness.reason != NOT_NEEDED:
        return False
    inertia = swing.parameters["arm_inertia_kg_m2"]
    if not inertia.identified or inertia.ci95 is None:
        return True
    return inertia.ci95[1] - inertia.ci95[0] > 2.0 * _KNOWN * inertia.value


def _out_of_reach(finding: Finding, swing: Swing, scene: Scene) -> bool:
    known = any(number.identified for number in finding.parameters.values())
    return swing.frequency_hz > scene.table.cutoff_hz and not known


def _too_light(swing: Swing, scene: Scene) -> bool:
    gear = scene.table.gear_ratio
    arm_kg_m2 = swing.inertia_share * inertia_of(scene) * gear**2
    return swing.inertia_share < _SMALL and arm_kg_m2 < least_inertia_kg_m2(swing.weight_nm * gear)


def _weight_nm(scene: Scene) -> float:
    """Return gravity's greatest torque on the motor's side."""
    return math.hypot(*scene.theta[3:5])
