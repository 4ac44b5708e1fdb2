"""How fast the commands are: ``uv run python -m tests.benchmarks.speed``.

Each figure is the median of several runs, beside a peer that was measured in turn with it
in the same run: on a shared machine only the ratio is worth remembering.
"""

from __future__ import annotations

import statistics
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

from agent.cell.cell import parse_cell
from agent.cli.devices.fake_cell import fake_cell_text
from agent.wire.wire import CycleRequest, drive_cycle
from drivers.clock import SteppedClock
from fakes.can_drive import FakeDrive
from fakes.process import open_bus
from fakes.specification import FakeSpecification
from tests.system.processes import STRIBECK

RUNS = 5
STAIR_S = 40.0


def seconds(work: Callable[[], object]) -> float:
    """Return how long `work` takes, in seconds."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def python(*arguments: str) -> Callable[[], object]:
    """Return a run of this interpreter as a process."""
    return lambda: subprocess.run([sys.executable, *arguments], check=True, capture_output=True)


def command(*arguments: str) -> Callable[[], object]:
    """Return a run of `stribeck` as a process."""
    return lambda: subprocess.run([*STRIBECK, *arguments], check=True, capture_output=True)


def in_turn(ours: Callable[[], object], peer: Callable[[], object]) -> tuple[float, float]:
    """Return the medians of both, run in turn."""
    pairs = [(seconds(ours), seconds(peer)) for _ in range(RUNS)]
    return statistics.median(p[0] for p in pairs), statistics.median(p[1] for p in pairs)


def drive_a_stair(folder: Path, rate_hz: float) -> Path:
    """Drive the 40 s stair through the in-process bus and return the recording."""
    specification = FakeSpecification()
    text = fake_cell_text(specification, interface="virtual", channel="speed")
    text = text.replace("sample_rate_hz = 500.0", f"sample_rate_hz = {rate_hz}")
    cell, clock, bus = parse_cell(text), SteppedClock(), open_bus("virtual", "speed")
    try:
        drive = FakeDrive(bus, specification=specification, seed=1)
        clock.attach(drive.step_to)
        return drive_cycle(CycleRequest(cell, cell.axis[0], folder), clock).recording
    finally:
        bus.shutdown()


def main() -> None:
    """Print the table."""
    print(f"{'what':<52}{'seconds':>9}{'peer':>9}{'ratio':>8}  peer")
    rows = [("stribeck --help", command("--help"), python("-c", "import typer"), "import typer")]
    with tempfile.TemporaryDirectory() as folder:
        recordings: list[Path] = []
        took = [
            seconds(lambda: recordings.append(drive_a_stair(Path(folder), 1000.0)))
            for _ in range(3)
        ]
        median = statistics.median(took)
        print(
            f"{'40 s stair at 1 kHz, in-process bus, fake included':<52}{median:9.2f}{STAIR_S:9.2f}"
            f"{median / STAIR_S:8.3f}  real time"
        )
        imports = "import numpy, scipy.linalg, scipy.optimize, scipy.signal, pyarrow.parquet"
        estimate = command("estimate", str(recordings[0]), "--json")
        rows.append(
            ("estimate, 40 s at 1 kHz, start-up included", estimate, python("-c", imports), imports)
        )
        for what, ours, peer, name in rows:
            mine, theirs = in_turn(ours, peer)
            print(f"{what:<52}{mine:9.2f}{theirs:9.2f}{mine / theirs:8.2f}  {name}")


if __name__ == "__main__":
    main()
