"""A cable of the simulation's own that hangs free elsewhere: a constant torque does the same."""

from __future__ import annotations

from dataclasses import replace

from agent.explain.answer.located import NextExperiment
from agent.explain.answer.result import Alternative, Finding
from agent.explain.choosing.aliases import told_apart_by
from agent.physics.twin import Effect

_CABLE, _CONSTANTS = "cable-force", ("torque-offset", "direction-asymmetry")
_STIFF, _FREE = "stiffness_nm_per_arm_rad", "neutral_arm_rad"
_AS_STIFF = 0.05  # of its stiffness
_NO_MOTION = (
    "No motion of this axis tells a cable that hangs free at another angle from a constant torque "
    "beside it. What does: {}"
)


def or_a_constant(given: Effect, own: Finding) -> Finding:
    """Return a finding tied with a constant torque, where it says no more than one would.

    A straight spring that is as stiff as before, and rests elsewhere, pulls by a constant more or
    less; so does an offset of the reading, and friction that differs between the directions.

    Parameters
    ----------
    given : Effect
        As the simulation has it.
    own : Finding
        What the recordings say of it.
    """
    straight = {_STIFF, _FREE}
    said_of = {name for name, value in given.numbers.items() if value}
    found = {name: p for name, p in own.parameters.items() if p.value}
    if given.id != _CABLE or not said_of <= straight or found.keys() != straight:
        return own
    stiffness, ends = given.numbers.get(_STIFF, 0.0), found[_FREE].ci95
    stays = ends is None or ends[0] <= given.numbers.get(_FREE, 0.0) <= ends[1]
    if stays or abs(found[_STIFF].value - stiffness) > _AS_STIFF * abs(stiffness):
        return own
    each = 1.0 / (1 + len(_CONSTANTS))
    others = tuple(
        Alternative(e, each, told_apart_by(_CONSTANTS[0], _CONSTANTS[1])) for e in _CONSTANTS
    )
    said = replace(own.said, lead=own.said.lead.replace(" is not the ", " may not be the "))
    return replace(own, probability=each, alternatives=others, said=said)


def deciding(own: Finding) -> NextExperiment:
    """Return what decides between such a finding and a constant torque."""
    set_up = own.alternatives[0].told_apart_by
    return NextExperiment(
        _NO_MOTION.format(set_up), (_CABLE, *_CONSTANTS), float("nan"), 0.0, set_up=set_up
    )
