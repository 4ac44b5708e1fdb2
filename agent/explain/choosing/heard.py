"""What shows above the band that is compared: it needs no size within it to be worth a name."""

from __future__ import annotations

from agent.explain.forms.form import Form
from agent.explain.rows.scene import Scene

BACKLASH = "backlash"

LIKE_A_GAP = frozenset({"presliding-hysteresis", "joint-flexibility"})
"""What a gap looks like within the band, where its blows are not heard."""


def heard(scene: Scene, form: Form) -> bool:
    """Return whether a form's effect shows above the band: the blows of a gear's loose teeth."""
    return form.effect == BACKLASH and scene.blows is not None
