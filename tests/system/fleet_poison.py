"""Twelve items on two workers, one of which ends its worker: what became of each, as JSON.

With the word ``forgotten``, Dask has no note of its workers when one dies, as where one dies before
it is written down.
"""

from __future__ import annotations

import json
import os
import sys

from agent.fleet.cluster import cluster, each


def square(number: int) -> int:
    """End the worker for one number, refuse another, square the rest."""
    if number == 7:
        os._exit(3)
    if number == 9:
        raise ValueError("nine is refused")
    return number * number


def main() -> None:
    """Run and print."""
    with cluster(workers=2) as client:
        if "forgotten" in sys.argv:
            assert client.cluster is not None
            client.cluster.scheduler_info["workers"].clear()
        outcomes = list(each(client, square, range(12)))
    values = {o.item: o.value for o in outcomes if not o.failure}
    print(json.dumps([values, {o.item: o.failure for o in outcomes if o.failure}]))  # noqa: T201 - it is run for this


if __name__ == "__main__":
    main()
