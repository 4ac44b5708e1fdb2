"""The effects that a twin can carry: each id's forms, numbers, look-alikes, and its torque.

A form names one law of `agent.physics` and hands it the numbers of a twin's entry; the equations
live with the laws. Several entries of one id add up (several orders of a ripple), but there is one
arm, and so at most one spring and one gap. `LIBRARY` has every id's card.
"""

from agent.physics.effects.card import EffectCard, Form, Parameter, unix_s
from agent.physics.effects.library import (
    CARRIED,
    CORRECTED,
    HOLDING,
    LIBRARY,
    REPORTED,
    SLIDING,
    YIELDING,
    card_of,
    numbers_of,
)
from agent.physics.effects.look_alikes import LookAlike
from agent.physics.effects.motion import (
    LEAST_LEVEL,
    Base,
    Boundary,
    Motion,
    Recorded,
    along_the_way,
)

__all__ = [
    "CARRIED",
    "CORRECTED",
    "HOLDING",
    "LEAST_LEVEL",
    "LIBRARY",
    "REPORTED",
    "SLIDING",
    "YIELDING",
    "Base",
    "Boundary",
    "EffectCard",
    "Form",
    "LookAlike",
    "Motion",
    "Parameter",
    "Recorded",
    "along_the_way",
    "card_of",
    "numbers_of",
    "unix_s",
]
