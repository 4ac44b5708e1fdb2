"""One way to work off what is due: every item's row is kept, every failure is listed.

An item that cannot be used, or that ends its worker, gets a row that says so and is not tried again
by the same version of the code. One that the store did not give is listed too, but gets no row: it
is tried again the next time.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Any, Protocol, TypeVar

from agent.fleet.cluster import Opened, outcomes
from agent.fleet.results import Results

Row = dict[str, Any]


class Due(Protocol):
    """What there is to do for one row."""

    @property
    def month(self) -> str:
        """Return the month that its row belongs to."""

    @property
    def name(self) -> str:
        """Return what a list of failures calls it."""

    def refused(self, failure: str) -> Row:
        """Return the row of one that failed, with the reason."""


Item = TypeVar("Item", bound=Due)


@dataclass(frozen=True)
class Done:
    """What became of the items: how many have an answer, and why the others have none."""

    done: int
    failed: tuple[str, ...]


def carry_out(
    opened: Opened,
    function: Callable[[Item], Row],
    due: Iterable[Item],
    results: Results,
    progress: Callable[[int], None] = lambda _done: None,
    batch: int = 1,
) -> Done:
    """Work off what is due and keep the rows; what is done is kept whatever ends this.

    Parameters
    ----------
    opened : callable
        Opens the cluster; without an item it is not called.
    function : callable
        Pure: from an item to its row, which says under ``failure`` why it could not be used.
    due : iterable
        Taken as it is needed; best in order of the months.
    results : Results
        Where the rows go.
    progress : callable
        Told how many have been seen to.
    batch : int
        Items that go to a worker together.
    """
    failed: list[str] = []
    months: set[str] = set()
    count = 0
    try:
        for outcome in outcomes(opened, function, due, batch):
            item, count = outcome.item, count + 1
            row = outcome.value or item.refused(outcome.failure)
            if row["failure"]:
                failed.append(f"{item.name}: {row['failure']}")
            if not outcome.transient:
                results.add(item.month, row)
                months.add(item.month)
            progress(count)
    finally:
        results.flush()
    for month in sorted(months):
        results.tidy(month)
    return Done(count - len(failed), tuple(sorted(failed)))
