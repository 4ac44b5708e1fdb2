"""Which robots are of which model, and which twin each model's axes have: `fleet.toml` in the lake.

::

    schema = "stribeck.fleet/1"

    [[model]]
    name = "IRB 6650"
    robots = ["*6650*"]                         # patterns of the robots' names
    twins = { 2 = "twins/irb6650-axis2.toml" }  # below the lake's root; by axis
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Any

from agent.errors import InputError, StorageError
from agent.fleet.lake import Lake
from agent.physics.twin import Twin, TwinError, parse_twin

FILE, SCHEMA = "fleet.toml", "stribeck.fleet/1"
NO_MODEL = "model not recorded"
"""Of a robot that neither `fleet.toml` nor its recordings say the model of."""


@dataclass(frozen=True)
class Model:
    """One model of robot.

    Parameters
    ----------
    name : str
    robots : tuple of str
        Patterns (``*`` and ``?``) of the names of its robots.
    twins : mapping of int to str
        Path of each axis's twin, below the lake's root.
    """

    name: str
    robots: tuple[str, ...]
    twins: Mapping[int, str]


@dataclass(frozen=True)
class Roster:
    """The models of a fleet; a robot is of the first that has a pattern for its name."""

    models: tuple[Model, ...] = ()

    def model_of(self, robot: str) -> Model | None:
        """Return a robot's model, or None where none has a pattern for it."""
        return next((m for m in self.models if any(fnmatchcase(robot, p) for p in m.robots)), None)

    def name_of(self, robot: str, recorded: str = "") -> str:
        """Return the name of a robot's model, for tables: else as its recordings have it."""
        model = self.model_of(robot)
        return (recorded or NO_MODEL) if model is None else model.name


def roster_of(lake: Lake) -> Roster:
    """Read the lake's `fleet.toml`; a lake without one has an empty roster.

    Raises
    ------
    InputError
        It is there and cannot be used.
    """
    if FILE not in lake.files_here():
        return Roster()
    where = f"{lake.url}/{FILE}"
    try:
        document = tomllib.loads(lake.get(FILE).decode())
    except (tomllib.TOMLDecodeError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"{where}: is no TOML ({error}).") from error
    if document.get("schema") != SCHEMA:
        raise InputError(f'{where}: expected schema = "{SCHEMA}", got {document.get("schema")!r}.')
    models = document.get("model", [])
    if not isinstance(models, list):
        raise InputError(f"{where}: expected [[model]] tables.")
    return Roster(tuple(_model(m, f"{where}, model {i}") for i, m in enumerate(models, start=1)))


def twin_of(lake: Lake, path: str) -> Twin:
    """Read a twin that lies in the lake.

    Raises
    ------
    InputError
        It is not there, or it is none.
    """
    try:
        return parse_twin(lake.get(path).decode())
    except (TwinError, UnicodeDecodeError, StorageError) as error:
        raise InputError(f"{lake.url}/{path}: cannot be used as a twin ({error}).") from error


def _model(table: Any, where: str) -> Model:
    match table:
        case {"name": str(name), "robots": list(robots)} if (
            name and robots and all(isinstance(r, str) for r in robots)
        ):
            twins = table.get("twins", {})
        case _:
            raise InputError(f"{where}: expected a name, and robots as a list of patterns.")
    if set(table) - {"name", "robots", "twins"}:
        extra = ", ".join(sorted(set(table) - {"name", "robots", "twins"}))
        raise InputError(f"{where}: does not know {extra}.")
    try:
        return Model(name, tuple(robots), {int(axis): str(path) for axis, path in twins.items()})
    except (AttributeError, ValueError) as error:
        raise InputError(f'{where}: expected twins = {{ AXIS = "PATH" }}.') from error
