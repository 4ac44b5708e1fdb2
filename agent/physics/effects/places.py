"""What a twin's file says of a place of the arm, and of the bell's shape there."""

from __future__ import annotations

from collections.abc import Mapping

from agent.physics.effects.card import Parameter, free, not_negative, positive

BELL_PARAMETERS: Mapping[str, Parameter] = {
    "center_arm_rad": free(),
    "width_arm_rad": positive(),
    "period_arm_rad": not_negative(0.0),
    "width_above_arm_rad": not_negative(0.0),
    "shape_exponent": positive(2.0),
}
