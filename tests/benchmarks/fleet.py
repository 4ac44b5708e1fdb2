"""A generated lake, estimated by one and by two workers: rate, scaling, memory.

    python -m tests.benchmarks.fleet [--cycles 100000] [--keep FOLDER]

The cycles are small (a stair of four speeds both ways, 100 Hz) and seeded; each robot has its own
friction. The lake is estimated twice from nothing: a slice of it by one worker, then all by two.
Memory is that of the largest worker and of this process, when a tenth was done and at the end.
"""

from __future__ import annotations

import argparse
import contextlib
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from agent.fleet.cluster import cluster
from agent.fleet.estimates import estimate_all
from agent.fleet.lake import Lake
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from trajectories import stair_between

RATE_HZ = 100.0
GEAR = 224.0
ROBOTS, AXES = 50, 6
_MIB = 1 << 20


def cycles(count: int, seed: int = 1) -> Iterator[Recording]:
    """Yield small cycles: robot by robot, night by night."""
    motion = stair_between(
        0.0,
        300.0,
        duration_s=15.0,
        acceleration_rad_s2=800.0,
        jerk_rad_s3=40000.0,
        speeds_rad_s=(8.0, 25.0, 80.0, 160.0),
        dwell_min_s=0.5,
    )
    time_s = np.arange(int(motion.duration_s * RATE_HZ) + 1) / RATE_HZ
    path = motion.sample(time_s)
    velocity = np.asarray(path.velocity_rad_s)
    rigid = 0.0184 * np.asarray(path.acceleration_rad_s2)
    for number in range(count):
        night, joint = divmod(number, ROBOTS * AXES)
        robot, axis = divmod(joint, AXES)
        own = np.random.default_rng((seed, joint))
        coulomb, viscous = 0.6 * own.uniform(0.8, 1.2), 0.0107 * own.uniform(0.8, 1.2)
        rng = np.random.default_rng((seed, joint, night))
        torque = rigid + np.sign(velocity) * (coulomb + viscous * np.abs(velocity))
        torque = torque + 0.01 * rng.standard_normal(time_s.size)
        day, month = night % 28 + 1, night // 28
        start = f"{2020 + month // 12}-{month % 12 + 1:02d}-{day:02d}T02:00:00+00:00"
        yield Recording(
            {
                "time_s": time_s,
                "position_rad": np.asarray(path.position_rad),
                "velocity_rad_s": velocity,
                "torque_nm": torque,
            },
            Metadata(robot=f"robot-{robot:03d}", axis=axis + 1, gear_ratio=GEAR, started_at=start),
        )


def fill(lake: Lake, count: int) -> float:
    """Push the cycles; return how many a second."""
    began = time.monotonic()
    with tempfile.TemporaryDirectory() as folder:
        for recording in cycles(count):
            path = write(recording, Path(folder) / "cycle.parquet", overwrite=True)
            lake.push(path, "plant")
    return count / (time.monotonic() - began)


def estimated(lake: Lake, workers: int) -> tuple[float, list[str]]:
    """Estimate the lake; return cycles a second, and what memory was taken when."""
    notes: list[str] = []
    with cluster(workers=workers) as client:
        client.run(_warm)
        began = time.monotonic()

        def show(done: int, of: int) -> None:
            if done in (max(of // 10, 1), of):
                largest = max(client.run(_resident_mib).values())
                notes.append(f"{done:>7}: worker {largest:.0f} MiB, here {_resident_mib():.0f} MiB")

        tally = estimate_all(lake, lambda: contextlib.nullcontext(client), show)
        spent = time.monotonic() - began
    assert not tally.failed, tally.failed[:3]
    return tally.done / spent, notes


def _warm() -> None:
    """Import and compile what an estimate needs, so that it is not counted as work."""
    import agent.conclude.outcome
    import agent.identify.estimate  # noqa: F401 - imported for what importing does


def _resident_mib() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / _MIB


def main() -> None:
    """Generate, estimate, print."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--cycles", type=int, default=100_000)
    arguments.add_argument("--slice", type=int, default=500, help="cycles for each side of scaling")
    arguments.add_argument("--keep", type=Path, help="keep the lake here")
    given = arguments.parse_args()
    with contextlib.ExitStack() as stack:
        folder = given.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        part, whole = Lake(str(folder / "slice")), Lake(str(folder / "lake"))
        fill(part, given.slice)
        rates = []
        for workers in (1, 2, 1, 2):  # interleaved: the machine is shared
            shutil.rmtree(folder / "slice" / "results", ignore_errors=True)
            rates.append(estimated(part, workers)[0])
        one, two = max(rates[0], rates[2]), max(rates[1], rates[3])
        print(f"{given.slice} cycles: {one:.1f}/s with one worker, {two:.1f}/s with two")
        print(f"scaling from one worker to two: {two / one:.2f}")
        rate = fill(whole, given.cycles)
        size = sum(e.size_bytes for e in whole.entries()[0])
        each = f"{size / given.cycles / 1024:.1f} KiB each"
        print(f"{given.cycles} cycles pushed at {rate:.0f}/s, {each}")
        rate, notes = estimated(whole, 2)
        print(f"{given.cycles} cycles: {rate:.1f}/s with two workers, {rate / 2:.1f}/s and core")
        print("\n".join(notes))


if __name__ == "__main__":
    main()
