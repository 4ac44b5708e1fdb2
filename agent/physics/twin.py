"""What the simulation knows about one axis: the twin of contract section 3, as a value.

Text in, text out: reading and writing files is somebody else's. Unknown keys are kept, so that a
twin written by a newer program survives a round trip.
"""

from __future__ import annotations

import copy
import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.physics import effects as library
from agent.physics import rigid_body

Floats = NDArray[np.float64]

SCHEMA = "stribeck.twin/1"

_TABLES = {
    "rigid_body": ("inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm"),
    "friction": ("coulomb_nm", "viscous_nm_s_per_rad"),
}
_NOT_NEGATIVE = ("inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad")


class TwinError(ValueError):
    """A twin's text cannot be used; the message is one sentence that names the key."""


@dataclass(frozen=True)
class Effect:
    """One more thing that the simulation includes: an id of contract section 4 and its numbers."""

    id: str
    parameters: Mapping[str, Any]
    extra: Mapping[str, Any] = field(default_factory=dict)


@dataclass(frozen=True)
class Twin:
    """A simulation of one axis, motor side.

    Parameters
    ----------
    robot : str
        Which robot.
    axis : int
        Which axis, from 1.
    gear_ratio : float
        Motor turns per arm turn.
    inertia_kg_m2, gravity_sin_nm, gravity_cos_nm : float
        The rigid body; gravity torque is ``gravity_sin_nm sin(q_arm) + gravity_cos_nm cos(q_arm)``.
    coulomb_nm, viscous_nm_s_per_rad : float
        The friction law (3.9).
    effects : tuple of Effect
        What else is included; none in a plain twin.
    extra : mapping
        Unknown keys, as nested as they were found.
    """

    robot: str
    axis: int
    gear_ratio: float
    inertia_kg_m2: float
    coulomb_nm: float
    viscous_nm_s_per_rad: float
    gravity_sin_nm: float = 0.0
    gravity_cos_nm: float = 0.0
    effects: tuple[Effect, ...] = ()
    extra: Mapping[str, Any] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Refuse numbers that no joint can have."""
        if not (math.isfinite(self.gear_ratio) and self.gear_ratio > 0.0):
            raise TwinError(f"gear_ratio: expected a number above 0, got {self.gear_ratio}.")
        for table, names in _TABLES.items():
            for name in names:
                value = getattr(self, name)
                if not math.isfinite(value):
                    raise TwinError(f"{table}.{name}: expected a finite number, got {value}.")
                if name in _NOT_NEGATIVE and value < 0.0:
                    raise TwinError(f"{table}.{name}: expected 0 or more, got {value}.")

    @property
    def is_plain(self) -> bool:
        """Whether the twin has no effects beside rigid body, gravity, Coulomb and viscous."""
        return not self.effects

    def predict_torque(
        self,
        position_rad: Floats | None,
        velocity_rad_s: Floats,
        acceleration_rad_s2: Floats,
        direction: Floats | None = None,
        *,
        time_s: Floats | None = None,
        gearbox_temperature_degc: Floats | None = None,
        motor_temperature_degc: Floats | None = None,
    ) -> Floats:
        """Return the torque in N m, shape (n,), that the drive reports for a measured motion.

        Inverse dynamics of thesis (4.4), and what the effects add to it (`agent.physics.effects`
        names them and their numbers); hidden states are simulated along `time_s`. `direction`
        takes the place of the velocity's sign where it has been thresholded or filtered. A column
        is only needed by a twin whose effects depend on it, the motor angle also by gravity.

        Parameters
        ----------
        position_rad, velocity_rad_s, acceleration_rad_s2, direction : ndarray, shape (n,)
            Measured motion of the motor.
        time_s : ndarray, shape (n,), optional
            For effects with a memory.
        gearbox_temperature_degc, motor_temperature_degc : ndarray, shape (n,), optional
            For effects of temperature.

        Raises
        ------
        TwinError
            An effect cannot be predicted, lacks a number, or a column is not there.
        """
        motion = library.Motion(
            velocity_rad_s,
            acceleration_rad_s2,
            np.sign(velocity_rad_s) if direction is None else direction,
            position_rad,
            time_s,
            gearbox_temperature_degc,
            motor_temperature_degc,
        )
        carried = [e.id for e in self.effects if e.id in ("joint-flexibility", "backlash")]
        if len(carried) > 1:
            raise TwinError(
                f"effects: {' and '.join(carried)} carry the same arm; a twin predicts one of them"
            )
        try:
            for effect in self.effects:
                if effect.id == "resolver-error":
                    motion = library.true_motion(effect.parameters, motion)
            torque = self._plain(motion)
            for effect in self.effects:
                numbers = library.numbers_of(effect.id, effect.parameters)
                if effect.id in library.ADDED:
                    law = library.ADDED[effect.id]
                    torque = torque + law.added_nm(numbers, motion, self._base)
            # The drive's torque constant and its limit come last, in this order.
            for last in ("torque-constant-error", "torque-saturation"):
                for effect in self.effects:
                    if effect.id == last:
                        torque = library.reported_nm(last, effect.parameters, motion, torque)
        except ValueError as error:
            raise TwinError(f"effects: {error}.") from error
        return torque

    def _plain(self, motion: library.Motion) -> Floats:
        """Return the torque of rigid body, gravity, Coulomb and viscous friction, shape (n,)."""
        if motion.position_rad is None and (self.gravity_sin_nm or self.gravity_cos_nm):
            raise ValueError("gravity needs a motor position, and none was given")
        columns = rigid_body.regressor(
            motion.position_rad,
            motion.velocity_rad_s,
            motion.acceleration_rad_s2,
            motion.direction,
            self.gear_ratio,
        )
        theta = [getattr(self, name, 0.0) for name in rigid_body.PARAMETERS]
        return np.asarray(columns @ np.array(theta), dtype=np.float64)

    @property
    def _base(self) -> library.Base:
        return library.Base(
            self.gear_ratio,
            self.inertia_kg_m2,
            self.coulomb_nm,
            self.gravity_sin_nm,
            self.gravity_cos_nm,
        )

    @property
    def friction_parameters(self) -> dict[str, float]:
        """Return the Coulomb and viscous parameters under their contract names."""
        return {name: getattr(self, name) for name in _TABLES["friction"]}


def parse_twin(text: str) -> Twin:
    """Return the twin that a TOML text describes.

    Raises
    ------
    TwinError
        With one sentence: which key, what was expected, what came.
    """
    try:
        document = tomllib.loads(text)
    except tomllib.TOMLDecodeError as error:
        raise TwinError(f"not TOML: {error}.") from error
    schema = document.pop("schema", None)
    if schema != SCHEMA:
        raise TwinError(f'schema: expected "{SCHEMA}", got {schema!r}.')
    robot = document.pop("robot", None)
    if not isinstance(robot, str) or not robot:
        raise TwinError(f"robot: expected a name, got {robot!r}.")
    axis = document.pop("axis", None)
    if not isinstance(axis, int) or isinstance(axis, bool) or axis < 1:
        raise TwinError(f"axis: expected a whole number from 1, got {axis!r}.")
    gear_ratio = _number(document, "", "gear_ratio")
    numbers: dict[str, float] = {}
    for table, names in _TABLES.items():
        content = document.get(table)
        if not isinstance(content, dict):
            raise TwinError(f"{table}: expected a table, got {content!r}.")
        for name in names:
            default = 0.0 if name.startswith("gravity") else None
            numbers[name] = _number(content, f"{table}.", name, default)
        if not content:
            del document[table]
    return Twin(
        robot=robot,
        axis=axis,
        gear_ratio=gear_ratio,
        effects=_effects(document.pop("effects", [])),
        extra=document,
        **numbers,
    )


def format_twin(twin: Twin) -> str:
    """Return the twin as TOML text that `parse_twin` reads back to an equal value."""
    import tomli_w

    document: dict[str, Any] = {
        "schema": SCHEMA,
        "robot": twin.robot,
        "axis": twin.axis,
        "gear_ratio": twin.gear_ratio,
    }
    for table, names in _TABLES.items():
        document[table] = {name: getattr(twin, name) for name in names}
    for key, value in copy.deepcopy(dict(twin.extra)).items():
        if key in _TABLES:
            document[key].update(value)
        else:
            document[key] = value
    if twin.effects:
        document["effects"] = [
            {"id": e.id, "parameters": dict(e.parameters), **e.extra} for e in twin.effects
        ]
    return tomli_w.dumps(document)


def _number(table: dict[str, Any], prefix: str, name: str, default: float | None = None) -> float:
    """Take a number out of a table, or refuse with the key's full name."""
    value = table.pop(name, default)
    if isinstance(value, bool) or not isinstance(value, (int, float)):
        raise TwinError(f"{prefix}{name}: expected a number, got {value!r}.")
    return float(value)


def _effects(content: object) -> tuple[Effect, ...]:
    """Return the effects as data; their meaning belongs to the library of effects."""
    if not isinstance(content, list):
        raise TwinError(f"effects: expected a list of tables, got {content!r}.")
    found = []
    for index, entry in enumerate(content):
        if not isinstance(entry, dict) or not isinstance(entry.get("id"), str):
            raise TwinError(f"effects[{index}]: expected a table with an id, got {entry!r}.")
        parameters = entry.get("parameters", {})
        if not isinstance(parameters, dict):
            raise TwinError(f"effects[{index}].parameters: expected a table, got {parameters!r}.")
        extra = {key: value for key, value in entry.items() if key not in ("id", "parameters")}
        found.append(Effect(entry["id"], parameters, extra))
    return tuple(found)
