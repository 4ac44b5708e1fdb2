"""The effects that a twin can carry: each id's forms, numbers, look-alikes, and its torque.

A form names one law of `agent.physics` and hands it the numbers of a twin's entry; the equations
live with the laws. Several entries of one id add up (several orders of a ripple), but there is one
arm, and so at most one spring and one gap. `LIBRARY` has every id's card.
"""

from agent.physics.effects.card import EffectCard, Form, Parameter, unix_s
from agent.physics.effects.library import (
    CARRIED,
    CORRECTED,
    LIBRARY,
    REPORTED,
    card_of,
    numbers_of,
)
from agent.physics.effects.look_alikes import LookAlike
from agent.physics.effects.motion import Base, Boundary, Motion, Recorded

__all__ = [
    "CARRIED",
    "CORRECTED",
    "LIBRARY",
    "REPORTED",
    "Base",
    "Boundary",
    "EffectCard",
    "Form",
    "LookAlike",
    "Motion",
    "Parameter",
    "Recorded",
    "card_of",
    "numbers_of",
    "unix_s",
]
