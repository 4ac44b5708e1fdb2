"""A fleet's rows, as its page and its pictures show them: a joint, a model's agreement."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

STATES: Mapping[str, tuple[str, str, str]] = {
    "H1": ("▲", "high", "stop"),
    "H0": ("◆", "increased", "stop"),
    "NF": ("●", "healthy", "good"),
    "not-decidable": ("○", "not decidable", "open"),
    "": ("✕", "not judged", "open"),
}
"""Shape, word and colour class of each state, the most urgent first."""


@dataclass(frozen=True)
class JointRow:
    """One joint of the ranking.

    Parameters
    ----------
    site, robot, axis : str, str, int
    model : str
        The robot's; empty where nobody recorded it.
    state : str
        ``NF``, ``H0``, ``H1``, ``not-decidable``; empty where it could not be judged.
    sentence : str
        Why.
    last_cycle : str
        ISO 8601; empty for none.
    rise_percent : tuple of float or None
        Low-speed friction against the baseline at equal temperature: value, lower and upper end.
    coulomb_nm, viscous_nm_s_per_rad : float or None
        Of the last cycle.
    """

    site: str
    robot: str
    axis: int
    model: str
    state: str
    sentence: str
    last_cycle: str = ""
    rise_percent: tuple[float, float, float] | None = None
    coulomb_nm: float | None = None
    viscous_nm_s_per_rad: float | None = None

    @property
    def label(self) -> str:
        """Return the joint in few words."""
        return f"{self.robot}, axis {self.axis}"

    @property
    def sign(self) -> tuple[str, str, str]:
        """Return shape, word and colour class of the state."""
        return STATES[self.state]

    @property
    def alarm(self) -> bool:
        """Return whether friction is increased."""
        return self.state in ("H0", "H1")


@dataclass(frozen=True)
class AgreementRow:
    """What the robots of one model say of one axis's twin: the sentence, and effects by count."""

    sentence: str
    joints: int
    effects: tuple[tuple[str, int], ...]
