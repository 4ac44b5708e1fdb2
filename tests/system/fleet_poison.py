"""Twelve items on two workers, one of which ends its worker: what became of each, as JSON."""

from __future__ import annotations

import json
import os

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
        outcomes = list(each(client, square, range(12)))
    values = {o.item: o.value for o in outcomes if not o.failure}
    print(json.dumps([values, {o.item: o.failure for o in outcomes if o.failure}]))  # noqa: T201 - it is run for this


if __name__ == "__main__":
    main()
