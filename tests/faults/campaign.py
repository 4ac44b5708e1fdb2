"""Which variations a campaign runs: every phase in turn, each with a seed of its own."""

from __future__ import annotations

import zlib
from collections.abc import Iterator

from tests.faults.scenario import Scenario


def variations(scenario: Scenario, count: int, *, offset: int = 0) -> Iterator[tuple[str, int]]:
    """Yield `count` phases and seeds.

    Parameters
    ----------
    scenario : Scenario
        Its name decides with which phase it begins, so that few runs of many faults cover all.
    count : int
        How many.
    offset : int
        How many of the sequence to leave out: another part of the same campaign.
    """
    first = zlib.crc32(scenario.name.encode()) % 1000
    for number in range(offset, offset + count):
        phase = scenario.phases[(first + number) % len(scenario.phases)]
        yield phase, 1000 * number + first
