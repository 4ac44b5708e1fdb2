"""A generated lake, estimated by one and by two workers: rate, scaling, memory.

    python -m tests.benchmarks.fleet [--cycles 100000] [--keep FOLDER]

The cycles are small (a stair of four speeds both ways, 100 Hz) and seeded; each robot has its own
friction. Scaling: one slice of the lake is estimated from nothing by one worker and by two in turn,
workers warm (each has estimated some cycles before the clock starts); the medians are compared.
Then the whole lake is estimated by two workers. With `--keep`, whatever ends this goes on where it
was when it is started again: what was pushed and estimated is there, and its times are kept in
`benchmark.json`. Memory is that of the largest worker and of this process.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import multiprocessing
import os
import shutil
import tempfile
import time
from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache, partial
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np
from numpy.typing import NDArray

from agent.fleet.cluster import cluster
from agent.fleet.estimates import estimate_all
from agent.fleet.lake import Lake
from agent.fleet.listing import listed
from agent.record.recording import Metadata, Recording
from agent.record.writing import write
from trajectories import stair_between

RATE_HZ = 100.0
GEAR = 224.0
ROBOTS, AXES = 50, 6
_MIB = 1 << 20
_CHUNK = 500  # cycles that a process generates and pushes at a time
_PUSHERS = 6  # more than cores: a push waits for the disk to have it for good
_PAIRS = 3


def cycles(count: int, seed: int = 1, first: int = 0) -> Iterator[Recording]:
    """Yield small cycles: robot by robot, night by night."""
    columns = _motion()
    velocity = columns["velocity_rad_s"]
    rigid, direction = 0.0184 * _acceleration(), np.sign(velocity)
    for number in range(first, first + count):
        night, joint = divmod(number, ROBOTS * AXES)
        robot, axis = divmod(joint, AXES)
        own = np.random.default_rng((seed, joint))
        coulomb, viscous = 0.6 * own.uniform(0.8, 1.2), 0.0107 * own.uniform(0.8, 1.2)
        rng = np.random.default_rng((seed, joint, night))
        torque = rigid + direction * (coulomb + viscous * np.abs(velocity))
        torque = torque + 0.01 * rng.standard_normal(velocity.size)
        day, month = night % 28 + 1, night // 28
        start = f"{2020 + month // 12}-{month % 12 + 1:02d}-{day:02d}T02:00:00+00:00"
        yield Recording(
            {**columns, "torque_nm": torque},
            Metadata(robot=f"robot-{robot:03d}", axis=axis + 1, gear_ratio=GEAR, started_at=start),
        )


@cache
def _motion() -> dict[str, NDArray[np.float64]]:
    """Return what all cycles have in common."""
    time_s, path = _path()
    return {
        "time_s": time_s,
        "position_rad": np.asarray(path.position_rad),
        "velocity_rad_s": np.asarray(path.velocity_rad_s),
    }


def _acceleration() -> NDArray[np.float64]:
    return np.asarray(_path()[1].acceleration_rad_s2)


def _path() -> tuple[NDArray[np.float64], Any]:
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
    return time_s, motion.sample(time_s)


def fill(lake: Lake, count: int, first: int = 0) -> None:
    """Push the cycles."""
    with tempfile.TemporaryDirectory() as folder:
        for recording in cycles(count, first=first):
            path = write(recording, Path(folder) / "cycle.parquet", overwrite=True)
            lake.push(path, "plant")


@dataclass
class State:
    """What has been done of the whole lake, kept in a file: seconds and notes add up over runs."""

    path: Path

    def __post_init__(self) -> None:
        self.known: dict[str, Any] = {"chunks": [], "push_s": 0.0, "runs": [], "scaling": {}}
        if self.path.exists():
            self.known |= json.loads(self.path.read_text())

    def keep(self) -> None:
        part = self.path.with_suffix(".part")
        part.write_text(json.dumps(self.known, indent=1))
        part.replace(self.path)


def fill_all(url: str, count: int, state: State, processes: int) -> None:
    """Push what is not there yet, in chunks, by several processes."""
    chunks = [(i, min(_CHUNK, count - i)) for i in range(0, count, _CHUNK)]
    due = [c for c in chunks if list(c) not in state.known["chunks"]]
    if not due:
        return
    began = time.monotonic()
    with multiprocessing.get_context("spawn").Pool(processes) as pool:
        for chunk in pool.imap_unordered(partial(_fill_chunk, url), due):
            state.known["chunks"].append(list(chunk))
            state.known["push_s"] += time.monotonic() - began
            began = time.monotonic()
            state.keep()


def _fill_chunk(url: str, chunk: tuple[int, int]) -> tuple[int, int]:
    fill(Lake(url), chunk[1], chunk[0])
    return chunk


@dataclass
class Run:
    """One run over a lake: how many, in how many seconds, and what memory was taken when."""

    done: int
    seconds: float
    memory: list[tuple[int, float, float]]

    @property
    def rate(self) -> float:
        """Return cycles a second."""
        return self.done / self.seconds


def estimated(lake: Lake, workers: int) -> Run:
    """Estimate what is due in the lake by warm workers."""
    memory: list[tuple[int, float, float]] = []
    with cluster(workers=workers) as client:
        client.run(_warm)
        began = time.monotonic()

        def show(done: int, of: int) -> None:
            if done == of or done % max(of // 20, 1) == 0:
                largest = max(client.run(_resident_mib).values())
                memory.append((done, largest, _resident_mib()))

        tally = estimate_all(lake, lambda: contextlib.nullcontext(client), show)
        spent = time.monotonic() - began
    assert not tally.failed, tally.failed[:3]
    return Run(tally.done, spent, memory)


def _warm() -> None:
    """Import what an estimate needs and estimate some cycles, so that no start is counted."""
    from agent.conclude.outcome import conclude

    for recording in cycles(20):
        conclude([recording])


def _resident_mib() -> float:
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / _MIB


def scaling(folder: Path, count: int, state: State) -> None:
    """Estimate one slice by one worker and by two in turn; print the rates and their ratio."""
    part = Lake(str(folder / "slice"))
    if not listed(part).months:
        fill(part, count)
    rates: dict[str, list[float]] = {"1": [], "2": []}
    for workers in (1, 2) * _PAIRS:  # in turn: others may be at work on the machine
        shutil.rmtree(folder / "slice" / "results", ignore_errors=True)
        rates[str(workers)].append(estimated(part, workers).rate)
        print(f"{count} cycles, {workers} worker(s): {rates[str(workers)][-1]:.1f}/s", flush=True)
    state.known["scaling"] = rates
    state.keep()
    one, two = median(rates["1"]), median(rates["2"])
    print(f"medians: {one:.1f}/s with one worker, {two:.1f}/s with two")
    print(f"scaling from one worker to two: {two / one:.2f}", flush=True)


def pushed(folder: Path, count: int, state: State) -> None:
    """Push the whole lake; print rate and size."""
    lake = Lake(str(folder / "lake"))
    fill_all(lake.url, count, state, _PUSHERS)
    seconds = state.known["push_s"]
    print(f"{count} cycles pushed in {seconds:.0f} s by {_PUSHERS} processes")
    loose = listed(lake).loose.values()
    size, number = sum(sum(m.sizes) for m in loose), sum(len(m.sizes) for m in loose)
    print(f"{number} there, {size / max(number, 1) / 1024:.1f} KiB each", flush=True)


def whole(folder: Path, state: State) -> None:
    """Estimate the whole lake; print rate and memory."""
    run = estimated(Lake(str(folder / "lake")), 2)
    if run.done:
        state.known["runs"].append([run.done, run.seconds, run.memory])
        state.keep()
    done = sum(r[0] for r in state.known["runs"])
    seconds = sum(r[1] for r in state.known["runs"])
    rate = done / seconds
    print(f"{done} cycles in {seconds:.0f} s, {len(state.known['runs'])} run(s)")
    print(f"{rate:.1f}/s with two workers, {rate / 2:.1f}/s and core")
    for at, worker, here in (m for r in state.known["runs"] for m in r[2]):
        print(f"{at:>7}: worker {worker:.0f} MiB, here {here:.0f} MiB")


def main() -> None:
    """Generate, estimate, print."""
    arguments = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    arguments.add_argument("--cycles", type=int, default=100_000)
    arguments.add_argument("--slice", type=int, default=1500, help="cycles for scaling")
    arguments.add_argument("--stages", default="push,scaling,estimate", help="which, in order")
    arguments.add_argument("--keep", type=Path, help="keep the lake here, and go on with it")
    given = arguments.parse_args()
    with contextlib.ExitStack() as stack:
        folder = given.keep or Path(stack.enter_context(tempfile.TemporaryDirectory()))
        folder.mkdir(parents=True, exist_ok=True)
        state = State(folder / "benchmark.json")
        stages = {
            "push": lambda: pushed(folder, given.cycles, state),
            "scaling": lambda: scaling(folder, given.slice, state),
            "estimate": lambda: whole(folder, state),
        }
        for stage in given.stages.split(","):
            stages[stage]()


if __name__ == "__main__":
    main()
