"""Every recording of a lake estimated once: what is new, or what the code now answers otherwise."""

from __future__ import annotations

import json
import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

from agent.fleet.cluster import Opened
from agent.fleet.entry import Entry
from agent.fleet.lake import Lake
from agent.fleet.listing import Listing, listed
from agent.fleet.parquet import without_keys
from agent.fleet.results import Results
from agent.fleet.version import estimate_version
from agent.fleet.work import carry_out

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


_BATCH = 16  # recordings that go to a worker together: some tenths of a second


@dataclass(frozen=True)
class Order:
    """One recording to estimate: the lake's address goes along, for the worker opens it itself."""

    url: str
    options: tuple[tuple[str, Any], ...]
    entry: Entry

    @property
    def month(self) -> str:
        """Return the month of the recording."""
        return self.entry.month

    @property
    def name(self) -> str:
        """Return the recording's path."""
        return self.entry.path

    def refused(self, failure: str) -> dict[str, Any]:
        """Return the row of a recording that cannot be used."""
        return _row(self.entry, failure=failure)


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
    """Estimate every recording that this code has not estimated yet, month by month.

    A recording that cannot be read, or that ends its worker, gets a row that says so and is not
    tried again by this version; what it takes is listed in the tally.

    Raises
    ------
    agent.errors.StorageError
        The lake does not answer, or does not take results.
    """
    listing, results = listed(lake), estimates_of(lake)
    due, already = _counted(listing, results)
    total = sum(due.values())

    def show(done: int) -> None:
        if progress is not None:
            progress(done, total)

    orders = _orders(lake, listing, results, [m for m, number in due.items() if number])
    done = carry_out(opened, estimate_one, orders, results, show, _BATCH)
    return Tally(done.done, done.failed, already, listing.others)


def _counted(listing: Listing, results: Results) -> tuple[dict[str, int], int]:
    """Return how many recordings of each month are due, and how many are not."""
    due, already = {}, 0
    for month in listing.months:
        table = listing.table(month)
        due[month] = without_keys(table, results.keys(month)).num_rows
        already += table.num_rows - due[month]
    return due, already


def _orders(lake: Lake, listing: Listing, results: Results, months: list[str]) -> Iterator[Order]:
    """Yield the orders of the months that have any, none of which is held after its turn."""
    options = tuple(sorted(lake.options.items()))
    for month in months:
        for entry in listing.entries(month, results.keys(month)):
            yield Order(lake.url, options, entry)


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
