"""What a lake of many recordings costs beside estimating: listing, packing, knowing what is due.

    python -m tests.benchmarks.fleet_size [--entries 1000000] [--keep FOLDER]

The recordings are tiny (32 bytes, under names that are right), the rows of results short: what is
measured is the number of things, not their size. Times are processor seconds of this process (a
disk's waiting is not in them), memory is what this process takes in all.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import tempfile
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from agent.fleet.entry import digest_of
from agent.fleet.estimates import estimates_of
from agent.fleet.histories import stands
from agent.fleet.lake import Lake
from agent.fleet.listing import listed
from agent.fleet.packs import pack_all
from agent.fleet.parquet import without_keys

JOINTS = 1200
AXES = 6
_LATER = "2099-01"
_NIGHTS = 28  # of a month


def paths(count: int) -> Iterator[tuple[str, str, bytes]]:
    """Yield month, path and content: month by month, joint by joint, night by night."""
    nights = -(-count // JOINTS)
    for first in range(0, nights, _NIGHTS):
        number = first // _NIGHTS
        month = f"{2020 + number // 12}-{number % 12 + 1:02d}"
        for joint in range(JOINTS):
            folder = (
                f"recordings/site=plant/robot=robot-{joint // AXES:04d}/axis={joint % AXES + 1}"
                f"/month={month}"
            )
            for night in range(first, min(first + _NIGHTS, nights)):
                content = f"{joint:016d}{night:016d}".encode()
                started = f"{month.replace('-', '')}{night - first + 1:02d}T020000Z"
                yield month, f"{folder}/{started}-{digest_of(content)}.parquet", content


@contextmanager
def measured(what: str) -> Iterator[None]:
    """Print what something took."""
    began = time.process_time()
    yield
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    mib = pages * os.sysconf("SC_PAGE_SIZE") >> 20
    print(f"{what}: {time.process_time() - began:.1f} s of processor, {mib} MiB", flush=True)


def made(lake: Lake, count: int) -> None:
    """Write the recordings, and of each a row of results."""
    results = estimates_of(lake)
    folders = set()
    for month, path, content in paths(count):
        full = Path(lake.root) / path
        if full.parent not in folders:
            full.parent.mkdir(parents=True, exist_ok=True)
            folders = {full.parent}
        full.write_bytes(content)  # without waiting for the disk, as `put` would
        row = {"key": path, "site": "plant", "robot": path.split("/")[2][6:], "failure": ""}
        results.add(month, {**row, "axis": 1, "started": "", "decidable": True, "cycle": "{}"})
    results.flush()


def main() -> None:
    """Make, list, know, pack, list, know; print."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--entries", type=int, default=1_000_000)
    arguments.add_argument("--keep", type=Path, help="keep the lake here")
    given = arguments.parse_args()
    with contextlib.ExitStack() as stack:
        folder = given.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        lake = Lake(str(folder / "lake"))
        with measured(f"{given.entries} recordings and rows made"):
            made(lake, given.entries)
        known(lake, "loose")
        results = estimates_of(lake)
        with measured("results put together"):
            for month in results.months():
                results.tidy(month, most_parts=0)
        with measured("packed"):
            done = pack_all(lake, _LATER)
        print(f"{done.recordings} recordings of {len(done.months)} months")
        known(lake, "packed")
        with measured("what each joint's history is now"):
            joints = stands(lake, "")
        print(f"{len(joints)} joints, {sum(j.cycles for j in joints)} cycles")


def known(lake: Lake, how: str) -> None:
    """List the lake and see what is due."""
    with measured(f"listed, {how}"):
        there = listed(lake)
    results, due, number = estimates_of(lake), 0, 0
    with measured(f"what is due, {how}"):
        for month in there.months:
            table = there.table(month)
            number += table.num_rows
            due += without_keys(table, results.keys(month)).num_rows
    files = sum(map(len, results.months().values()))
    print(f"{number} recordings, {due} due, {files} files of results")


if __name__ == "__main__":
    main()
