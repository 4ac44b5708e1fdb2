"""Coverage and choice of the laws of reversals: ``python -m tests.benchmarks.reversals [seeds]``.

Truths are integrated apart from the product; a seed draws torque noise, the encoders' phase and
the sampling's phase. The encoder has 2^16 counts a turn.
"""

from __future__ import annotations

import sys
import time

import numpy as np

from agent.identify.reversals.arm import arm_clearance
from agent.identify.reversals.data import data_of
from agent.identify.reversals.laws import LAWS, range_of
from agent.identify.reversals.parameters import parameters_of
from agent.identify.reversals.search import solve
from agent.identify.reversals.selection import select
from agent.identify.reversals.turns import read_tracks
from tests.science.reversal_plant import ARM_COULOMB, VISCOUS, bristled, geared, sampled
from tests.science.test_reversals_recovery import TRUTH

SEEDS = 50
FIRST = 10_000  # seeds that no test and no choice of a constant has seen


def presliding(seeds: int) -> None:
    """Print coverage, bias and spread of every parameter, and how often its law was chosen."""
    print(f"{'law':<15}{'parameter':<26}{'covered':>9}{'bias/truth':>12}{'half/truth':>12}")
    for law, truth in TRUTH.items():
        rows: dict[str, list[tuple[bool, float, float]]] = {name: [] for name in truth}
        chosen = 0
        began = time.perf_counter()
        for seed in range(FIRST, FIRST + seeds):
            motion = read_tracks([sampled(bristled(law), seed)])
            range_, data = range_of(motion), data_of(motion)
            found = [solve(one, data, range_) for one in LAWS.values() if one.presliding]
            winner, _ = select(found, data, range_)
            chosen += winner.law.name == law
            own = next(s for s in found if s.law.name == law)
            for name, parameter in parameters_of(own, range_).items():
                if name in truth and parameter.ci95 is not None:
                    low, high = parameter.ci95
                    inside = low <= truth[name] <= high
                    rows[name].append((inside, parameter.value - truth[name], (high - low) / 2.0))
        for name, seen in rows.items():
            covered, bias, half = np.array(seen, dtype=np.float64).mean(axis=0)
            print(
                f"{law:<15}{name:<26}{100.0 * covered:7.1f} %"
                f"{100.0 * bias / truth[name]:10.2f} %{100.0 * half / truth[name]:10.2f} %"
            )
        took = (time.perf_counter() - began) / seeds
        print(f"{law:<15}chosen in {chosen} of {seeds}, {took:.2f} s for four laws")


def clearance(seeds: int) -> None:
    """Print coverage of gap, lost motion and skew from the arm's encoder."""
    late_s = 0.002
    for gap, stiffness in ((0.03, 400.0), (0.03, 30.0), (0.0, 20.0)):
        truth = {
            "backlash_rad": gap,
            "lost_motion_rad": gap + 2.0 * ARM_COULOMB / stiffness,
            "compliance_rad_per_nm": 1.0 / stiffness,
            "encoder_skew_s": late_s,
        }
        inside = dict.fromkeys(truth, 0)
        given = dict.fromkeys(truth, 0)
        for seed in range(FIRST, FIRST + seeds):
            signals = sampled(geared(gap, stiffness), seed, with_arm=True, arm_late_s=late_s)
            motion = read_tracks([signals])
            found = arm_clearance(motion, range_of(motion), VISCOUS)
            assert found is not None
            for name, parameter in found.named().items():
                if parameter.ci95 is not None:
                    given[name] += 1
                    inside[name] += parameter.ci95[0] <= truth[name] <= parameter.ci95[1]
        counts = ", ".join(f"{n} {inside[n]} of {given[n]}" for n in truth)
        print(f"gap {1e3 * gap:g} mrad, {stiffness:g} N m/rad, {seeds} seeds; covered: {counts}")


def main() -> None:
    """Print the tables; the first argument is the number of seeds."""
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    clearance(seeds)
    presliding(seeds)


if __name__ == "__main__":
    main()
