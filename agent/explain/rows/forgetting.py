"""How long an arm behind the gear remembers what nobody has recorded."""

from __future__ import annotations

import math
from dataclasses import dataclass

from agent.physics.gaps import LONGEST_GAP_S
from agent.physics.twin import Twin

_ARMS = ("joint-flexibility", "backlash")
_OF_AN_ARM = {"arm_inertia_kg_m2", "stiffness_nm_per_rad"}
_SEEN = "encoder_late_s"  # an arm that its own encoder shows has nothing to remember
_FORGOTTEN = 4.0  # time constants of its swing
_SOONEST_S, _LATEST_S = 0.1, 1.0
_OF_A_SWING = 0.25  # without samples: in less it does not turn round


@dataclass(frozen=True)
class Forgetting:
    """How long an arm remembers where it began, and without how many samples it goes on as it was.

    Parameters
    ----------
    seconds, gap_s : float
    """

    seconds: float
    gap_s: float


def forgetting(twin: Twin) -> Forgetting | None:
    """Return how the arm that a twin has behind its gear forgets; None where it has none."""
    for effect in twin.effects:
        numbers = effect.parameters
        simulated = set(numbers) >= _OF_AN_ARM and _SEEN not in numbers
        if effect.id not in _ARMS or not simulated:
            continue
        inertia, stiffness = numbers["arm_inertia_kg_m2"], numbers["stiffness_nm_per_rad"]
        damping = max(float(numbers.get("damping_nm_s_per_rad", 0.0)), 1e-300)
        seconds = min(max(_FORGOTTEN * 2.0 * inertia / damping, _SOONEST_S), _LATEST_S)
        swing_s = 2.0 * math.pi * math.sqrt(inertia / stiffness)
        return Forgetting(seconds, min(_OF_A_SWING * swing_s, LONGEST_GAP_S))
    return None
