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
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from agent.physics.effects import Motion
    from agent.physics.prediction import Smooth

Floats = NDArray[np.float64]

SCHEMA = "stribeck.twin/1"

_TABLES = {
    "rigid_body": ("inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm"),
    "friction": ("coulomb_nm", "viscous_nm_s_per_rad"),
}
_NOT_NEGATIVE = ("inertia_kg_m2", "coulomb_nm", "viscous_nm_s_per_rad")


class TwinError(ValueError):
    """A twin's text cannot be used; the message is one sentence that names the key."""


class DrivingFrictionError(TwinError):
    """A drift of a twin was carried on until friction would drive the joint."""


@dataclass(frozen=True)
class Effect:
    """One more thing that the simulation includes: an id of contract section 4 and its numbers.

    Two of one id are two of a kind, as two orders of a ripple are.
    """

    id: str
    parameters: Mapping[str, Any]
    extra: Mapping[str, Any] = field(default_factory=dict)

    @property
    def numbers(self) -> dict[str, float]:
        """Return its numbers by name, without what else its table has."""
        return {
            name: float(value)
            for name, value in self.parameters.items()
            if isinstance(value, int | float) and not isinstance(value, bool)
        }


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
        started_at_unix_s: float | None = None,
        run: float | None = None,
        turned_rad: Floats | None = None,
        payload_kg: float | None = None,
    ) -> Floats:
        """Return the torque in N m, shape (n,), that the drive reports for a measured motion.

        As `predict`, with the columns of `agent.physics.effects.Motion` one by one; `direction`
        is the velocity's sign where none is given.
        """
        # Late: a twin that is only written (`stribeck twin`) needs none of the library.
        from agent.physics.effects import Motion

        motion = Motion(
            velocity_rad_s,
            acceleration_rad_s2,
            np.sign(velocity_rad_s) if direction is None else direction,
            position_rad,
            time_s,
            gearbox_temperature_degc,
            motor_temperature_degc,
            started_at_unix_s,
            run,
            turned_rad=turned_rad,
            payload_kg=payload_kg,
        )
        return self.predict(motion)

    def predict(self, motion: Motion, smooth: Smooth | None = None) -> Floats:
        """Return the torque in N m, shape (n,), that the drive reports for a measured motion.

        The sum of `predict_parts`, with the same arguments and errors.
        """
        parts = self.predict_parts(motion, smooth)
        return np.asarray(np.sum(list(parts.values()), axis=0), dtype=np.float64)

    def predict_parts(self, motion: Motion, smooth: Smooth | None = None) -> dict[str, Floats]:
        """Return the torque in N m by part, each shape (n,), in the order in which they act.

        Inverse dynamics of thesis (4.4) as ``rigid-body``, ``gravity`` and ``friction``, then what
        each effect adds (`agent.physics.effects`), hidden states simulated along `time_s`. Part of
        an effect on the report (torque constant, limit, offset, delay) is what it changes in the
        sum of those before. An effect that comes again is numbered: ``torque-ripple 2``. NaN where
        a late channel's past or future was not recorded.

        A column is only needed by a twin whose effects depend on it, the motor angle also by
        gravity. Hidden states start as if the joint had long been moving as at first: the arm
        rides on its spring at the motion's first acceleration, friction's springs are drawn out
        where it has a direction. Prediction in pieces starts anew with each, but for those springs
        where a motion says what was `before` it.

        Parameters
        ----------
        motion : Motion
            Measured motion of the motor, from where hidden states are to start.
        smooth : callable, optional
            A linear zero-phase filter that every part goes through, shape (n,) to (n,): for a
            comparison with torque that went through the same. The laws themselves, which are
            not linear, then still see the motion as it is. Motion that is filtered already is
            taken as it is, with its filtered `direction`; presliding then follows the filtered
            velocity, and is as blurred as that.

        Raises
        ------
        TwinError
            An effect cannot be predicted, lacks a number, or a column is not there.
        """
        from agent.physics.prediction import predict_parts

        try:
            return predict_parts(self, motion, smooth)
        except DrivingFrictionError:
            raise
        except ValueError as error:
            raise TwinError(f"effects: {error}.") from error


def parse_twin(text: str) -> Twin:
    """Return the twin that a TOML text describes.

    Raises
    ------
    TwinError
        With one sentence: which key, what was expected, what came.
    """
    try:
        document = tomllib.loads(text)
    except (tomllib.TOMLDecodeError, RecursionError) as error:
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
