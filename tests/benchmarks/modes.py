"""What each mode asks of the torque: ``uv run python -m tests.benchmarks.modes [--rounding 0]``.

One short stair on the simulated joint in every mode and at several rates, in stepped time; for each
the highest torque, and the highest while the speed should be steady. `--rounding` says over how
many seconds streamed positions are averaged, in place of the product's own.
"""

from __future__ import annotations

import argparse
import tempfile
from pathlib import Path
from typing import Any

import numpy as np

from agent.cycle import feed
from agent.cycle.streamed import ROUNDING_S
from agent.record.reading import read
from tests.system.rig import rig
from tests.system.test_modes import offering

MODES = ("pv", "csv", "csp", "ip")
RATES_HZ = (100.0, 250.0, 500.0)
LIMIT_NM = 9.8


def peaks_nm(mode: str, rate_hz: float) -> tuple[float, float]:
    """Return the highest torque of a cycle, and that of its steady windows."""

    def short(cell: dict[str, Any]) -> None:
        cell["axis"][0]["stair"] |= {"duration_s": 3.2, "speeds": 2}
        cell["recording"]["sample_rate_hz"] = rate_hz

    with (
        tempfile.TemporaryDirectory() as folder,
        rig(Path(folder), specification=offering(mode), edit=short) as cell,
    ):
        columns = read(cell.run().recording).columns
    torque_nm = np.abs(np.asarray(columns["torque_nm"], dtype=np.float64))
    steady = np.asarray(columns["phase"]) == "steady"
    return float(torque_nm.max()), float(torque_nm[steady].max())


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--rounding", type=float, default=ROUNDING_S, metavar="S")
    vars(feed)["ROUNDING_S"] = parser.parse_args().rounding
    print(
        f"| mode | Hz | highest torque, N m of {LIMIT_NM} | in steady windows |\n|---|---|---|---|"
    )
    for mode in MODES:
        for rate_hz in RATES_HZ:
            highest_nm, steady_nm = peaks_nm(mode, rate_hz)
            print(f"| {mode} | {rate_hz:.0f} | {highest_nm:.2f} | {steady_nm:.2f} |", flush=True)


if __name__ == "__main__":
    main()
