"""Every recording of a lake estimated once: what is new, or what the code now answers otherwise."""

from __future__ import annotations

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

from agent.fleet.cluster import Opened, outcomes
from agent.fleet.lake import Entry, Lake
from agent.fleet.results import Results
from agent.fleet.version import estimate_version

COLUMNS = {
    "site": "string",
    "robot": "string",
    "axis": "int64",
    "started": "string",
    "failure": "string",
    "decidable": "bool",
    "sentence": "string",
    "gear_ratio": "double",
    "temperature_degc": "double",
    "coulomb_nm": "double",
    "viscous_nm_s_per_rad": "double",
    "inertia_kg_m2": "double",
    "estimate": "string",
    "cycle": "string",
}
"""Columns of the estimates' rows; `estimate` and `cycle` are JSON, whole."""


@dataclass(frozen=True)
class Order:
    """One recording to estimate: the lake's address goes along, for the worker opens it itself."""

    url: str
    options: tuple[tuple[str, Any], ...]
    entry: Entry


@dataclass(frozen=True)
class Tally:
    """What one run over a lake did."""

    done: int
    failed: tuple[str, ...]
    already: int
    others: tuple[str, ...]


def estimates_of(lake: Lake) -> Results:
    """Return the lake's estimates by this code."""
    return Results(lake, "estimate", estimate_version(), COLUMNS)


def estimate_all(
    lake: Lake, opened: Opened, progress: Callable[[int, int], None] | None = None
) -> Tally:
    """Estimate every recording that this code has not estimated yet.

    A recording that cannot be read, or that ends its worker, gets a row that says so and is not
    tried again by this version; what it takes is listed in the tally.

    Raises
    ------
    agent.errors.StorageError
        The lake does not answer, or does not take results.
    """
    entries, others = lake.entries()
    results = estimates_of(lake)
    known = results.keys()
    due = [e for e in entries if e.path not in known]
    failed = []
    options = tuple(sorted(lake.options.items()))
    orders = [Order(lake.url, options, e) for e in due]
    try:
        for count, outcome in enumerate(outcomes(opened, estimate_one, orders), start=1):
            entry = outcome.item.entry
            row = outcome.value or _row(entry, failure=outcome.failure)
            if row["failure"]:
                failed.append(f"{entry.path}: {row['failure']}")
            results.add(row)
            if progress is not None:
                progress(count, len(due))
    finally:
        results.flush()
    return Tally(len(due) - len(failed), tuple(sorted(failed)), len(entries) - len(due), others)


def estimate_one(order: Order) -> dict[str, Any]:
    """Estimate one recording of a lake: the very functions of `stribeck estimate`.

    A recording that cannot be used is an answer, not an error.
    """
    from agent.conclude.cycles import cycle_from
    from agent.conclude.outcome import conclude
    from agent.errors import InputError

    lake = Lake(order.url, dict(order.options))
    try:
        recording = lake.recording(order.entry)
        conclusion = conclude([recording])
    except InputError as error:
        return _row(order.entry, failure=str(error))
    estimate = conclusion.estimate
    cycle = cycle_from(recording, estimate)
    low, high = estimate.quality.temperature_degc or (math.nan, math.nan)
    body = {} if estimate.rigid_body is None else estimate.rigid_body.parameters
    return _row(
        order.entry,
        decidable=estimate.decidable,
        sentence=estimate.sentence,
        gear_ratio=recording.gear_ratio,
        temperature_degc=_number(0.5 * (low + high)),
        coulomb_nm=_identified(body.get("coulomb_nm")),
        viscous_nm_s_per_rad=_identified(body.get("viscous_nm_s_per_rad")),
        inertia_kg_m2=_identified(body.get("inertia_kg_m2")),
        estimate=conclusion.json(),
        cycle=json.dumps(cycle.to_json()),
    )


def _row(entry: Entry, failure: str = "", **values: Any) -> dict[str, Any]:
    return {
        "key": entry.path,
        "site": entry.site,
        "robot": entry.robot,
        "axis": entry.axis,
        "started": entry.started,
        "failure": failure,
        **values,
    }


def _identified(parameter: Any) -> float | None:
    return None if parameter is None or not parameter.identified else _number(parameter.value)


def _number(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None
