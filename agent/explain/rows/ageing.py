"""What time and use were found to make of the dry friction: an arm behind the gear rubs it, too."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from agent.identify.result import Floats

if TYPE_CHECKING:
    from agent.explain.rows.scene import Scene


@dataclass(frozen=True)
class Ageing:
    """An effect by which time or use change the dry friction, as far as it was found.

    Parameters
    ----------
    effect : str
        Id of contract section 4.
    torque_nm : callable
        Scene to what its dry part adds at full rate, shape (N,).
    tables : callable
        Scene to the parameter tables of the twin's effect.
    """

    effect: str
    torque_nm: Callable[[Scene], Floats]
    tables: Callable[[Scene], Sequence[Mapping[str, Any]]]

    def __call__(self, scene: Scene) -> Floats:
        """Return its torque at full rate, shape (N,)."""
        return self.torque_nm(scene)
