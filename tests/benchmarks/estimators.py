"""How long an estimate takes: ``python -m tests.benchmarks.estimators``.

A 40 s stair at 1 kHz, position and velocity, in a fresh interpreter; CPU time, imports apart.
"""

from __future__ import annotations

import time

started = time.process_time()

from agent.identify.estimate import estimate  # noqa: E402 - the import is what is measured

imported = time.process_time()

from tests.science.identify_plant import Joint, record, stair  # noqa: E402 - after the clock has started


def main() -> None:
    """Print the times."""
    joint = Joint(static_extra_nm=0.3, gravity_sin_nm=0.5, gear_ratio=30.0)
    signals = record(joint, stair(rate_hz=1000.0, longest_s=2.5))
    print(f"import            {imported - started:6.3f} s CPU")
    for label in ("first estimate", "second estimate"):
        start = time.process_time()
        result = estimate([signals])
        print(f"{label:17s} {time.process_time() - start:6.3f} s CPU")
    print(f"{signals.time_s.size} samples, {signals.time_s[-1]:.1f} s: {result.sentence}")


if __name__ == "__main__":
    main()
