"""The results of complete months put together, of this version of the code."""

from __future__ import annotations

from agent.fleet.entry import UNKNOWN
from agent.fleet.estimates import estimates_of
from agent.fleet.explanations import explanations_of
from agent.fleet.lake import Lake
from agent.fleet.verdicts import verdicts_of


def tidy_all(lake: Lake, before: str) -> int:
    """Put together the present results of every month before one; return of how many.

    Raises
    ------
    agent.errors.StorageError
        The lake does not answer, or does not take results.
    """
    months = set()
    for results in (estimates_of(lake), verdicts_of(lake), explanations_of(lake)):
        for month in results.months():
            if month < before and month != UNKNOWN and results.tidy(month, most_parts=0):
                months.add(month)
    return len(months)
