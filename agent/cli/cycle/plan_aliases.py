"""What a planned cycle cannot tell apart, before anything is recorded; in words and as JSON."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations
from typing import Any

from agent.cell.cell import Axis, Cell
from agent.errors import InputError
from trajectories import Trajectory

SCHEMA = "stribeck.aliases/1"

_BASIS = (
    "Reckoned for one run at one gearbox temperature, of a joint as the cell expects it that "
    "follows the plan exactly; no noise. A pair is named where the one copies 95 % of what the "
    "other adds to the torque, whatever their numbers."
)


@dataclass(frozen=True)
class PlannedAliases:
    """What one planned cycle confuses.

    Parameters
    ----------
    sets : tuple of tuple of str
        Effects that it cannot tell apart.
    not_shown : tuple of str
        Effects that a single run at one temperature does not show at all.
    """

    sets: tuple[tuple[str, ...], ...]
    not_shown: tuple[str, ...]

    def lines(self) -> list[str]:
        """Return it as a technician reads it in a terminal."""
        from agent.explain.answer.names import NAMES
        from agent.explain.choosing.aliases import told_apart_by

        out = ["This cycle cannot tell apart:" if self.sets else "This cycle confuses no effects."]
        for group in self.sets:
            out.append(f"  - {'; '.join(NAMES[effect] for effect in group)}.")
            for first, second in combinations(group, 2):
                pair = "" if len(group) == 2 else f"{first} / {second}: "
                out.append(f"      {pair}{told_apart_by(first, second)}")
        if self.not_shown:
            out += ["", "One run at one temperature does not show:"]
            out += [f"  - {NAMES[effect]}" for effect in self.not_shown]
        return [*out, "", _BASIS]

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        from agent.explain.choosing.aliases import told_apart_by

        return {
            "sets": [
                {
                    "effects": list(group),
                    "told_apart_by": [
                        {"effects": [a, b], "sentence": told_apart_by(a, b)}
                        for a, b in combinations(group, 2)
                    ],
                }
                for group in self.sets
            ],
            "not_shown": list(self.not_shown),
            "basis": _BASIS,
        }


def planned_aliases(cell: Cell, axis: Axis, trajectory: Trajectory) -> PlannedAliases:
    """Return what a trajectory on an axis will not tell apart.

    Raises
    ------
    agent.errors.InputError
        The cell does not say what joint to expect, or the cycle is too short.
    """
    from agent.explain.choosing.aliases import aliases
    from agent.explain.experiment.planned import planned_library
    from agent.explain.rows.table import TooShortError
    from agent.physics.twin import Twin

    expected = axis.expected
    if expected is None or not all(
        (expected.coulomb_nm, expected.viscous_nm_s_per_rad, expected.inertia_kg_m2)
    ):
        raise InputError(
            f"Aliases need a rough idea of axis {axis.number}: [axis.expected] must hold "
            "inertia_kg_m2, coulomb_nm and viscous_nm_s_per_rad above zero.",
            "An earlier estimate, a data sheet or a similar axis will do.",
        )
    twin = Twin(
        cell.robot,
        axis.number,
        axis.gear_ratio,
        expected.inertia_kg_m2,
        expected.coulomb_nm,
        expected.viscous_nm_s_per_rad,
        gravity_sin_nm=expected.gravity_peak_nm,
    )
    try:
        library, not_shown = planned_library(trajectory, twin, cell.recording.sample_rate_hz)
    except TooShortError as error:
        raise InputError(f"The cycle is too short to say what it confuses: {error}.") from error
    return PlannedAliases(aliases(library), not_shown)


def aliases_document(cell: Cell, axis: Axis, trajectory: Trajectory) -> dict[str, Any]:
    """Return the `stribeck.aliases/1` document of a cycle that was not designed here."""
    return {
        "schema": SCHEMA,
        "robot": cell.robot,
        "axis": axis.number,
        "trajectory": trajectory.to_json(),
        **planned_aliases(cell, axis, trajectory).to_json(),
    }
