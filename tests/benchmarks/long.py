"""How long recordings may be: ``python -m tests.benchmarks.long [MILLIONS ...]``.

Work at 1 kHz, a move of two seconds after the other to random speeds; processor time and memory of
`estimate` and `ordinary`, each in a process of its own, by millions of rows.
"""

from __future__ import annotations

import argparse
import resource
import subprocess
import sys
import time

import numpy as np

from agent.identify.estimate import estimate
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.monitor.ordinary.ordinary import ordinary_friction

GEAR, RATE_HZ, MOVE_S = 100.0, 1000.0, 2.0
SLOWEST, FASTEST, NOISE_NM, NOISE_RAD_S, COUNTS = 5.0, 80.0, 0.02, 0.02, 1 << 16


def work(rows: int) -> Signals:
    """Return moves forth and back, with Coulomb and viscous friction, inertia and gravity."""
    rng = np.random.default_rng(1)
    time_s = np.arange(rows) / RATE_HZ
    count = int(time_s[-1] / MOVE_S) + 2
    speeds = rng.uniform(SLOWEST, FASTEST, count) * np.resize([1.0, -1.0], count)
    begin_s = MOVE_S * np.arange(count)
    ends_s = np.column_stack((begin_s + 0.3, begin_s + 1.9)).ravel()
    velocity = np.interp(time_s, ends_s, np.repeat(speeds, 2))
    position = np.cumsum(velocity) / RATE_HZ
    torque = 0.6 * np.tanh(velocity / 0.05) + 0.0107 * velocity + 0.3 * np.sin(position / GEAR)
    torque += 0.0184 * np.gradient(velocity, 1.0 / RATE_HZ)
    step = 2.0 * np.pi / COUNTS
    columns = {
        "time_s": time_s,
        "torque_nm": torque + NOISE_NM * rng.standard_normal(rows),
        "velocity_rad_s": velocity + NOISE_RAD_S * rng.standard_normal(rows),
        "position_rad": np.round(position / step) * step,
    }
    return Signals.from_columns(columns, GEAR)


def measure(what: str, millions: float) -> None:
    """Print processor time and memory of one command's work on so many rows."""
    signals = work(round(1e6 * millions))
    began = time.process_time()
    if what == "ordinary":
        decidable = ordinary_friction([read_motion(signals)]).decidable
    else:
        decidable = estimate([signals]).decidable
    took = time.process_time() - began
    peak_gb = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
    print(
        f"{what:<9} {millions:5.1f} million rows: {took:6.1f} s, {took / millions:5.1f} s a "
        f"million; {peak_gb:5.2f} GB; {'decidable' if decidable else 'not decidable'}",
        flush=True,
    )


def main() -> None:
    """Print a line for each size and each command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("millions", type=float, nargs="*", default=[1.0, 2.0, 4.0])
    parser.add_argument("--of", choices=["estimate", "ordinary"], help="in this process")
    asked = parser.parse_args()
    for millions in asked.millions:
        for what in [asked.of] if asked.of else ["estimate", "ordinary"]:
            if asked.of:
                measure(what, millions)
                continue
            own = [sys.executable, "-m", "tests.benchmarks.long", str(millions), "--of", what]
            subprocess.run(own, check=True)


if __name__ == "__main__":
    main()
