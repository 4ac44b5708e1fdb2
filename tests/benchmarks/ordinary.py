"""What ordinary work carries: `python -m tests.benchmarks.ordinary [--joints N]`.

Simulated joints at work (`fakes.history`): how often friction by speed is decidable, whether its
intervals hold, how often the observer asks for a dedicated cycle without reason, and how far wear
has grown when it asks. ``--soft HZ`` puts a soft gear between the motor and most of its inertia,
which is refused where it swings slowly; ``--even-so`` shows what would come of it otherwise.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np
from scipy.signal import bilinear, lfilter

from agent.identify.estimate import estimate
from agent.identify.result import Estimate
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import Motion, read_motion
from agent.identify.uncertainty import student_975
from agent.monitor.observer.band import HealthyBand, learn_band, watch
from agent.monitor.observer.learning import model_of
from agent.monitor.ordinary import swinging
from agent.monitor.ordinary.ordinary import ordinary_friction
from fakes.history import CycleRun, HistoryPlan, Wear, cycles, ordinary_runs

HEALTHY, ONSET, NIGHTS = 12, 24, 44
SWINGS, DAMPING = 0.7, 0.04  # of the inertia, on the spring; of the critical one
_WEAR = Wear(float(ONSET), days=20.0, low_speed_nm=0.2)


def _motion(run: CycleRun, gear_ratio: float) -> Motion:
    return read_motion(Signals.from_columns(run.columns, gear_ratio, name=run.name))


def softened(run: CycleRun, hz: float, inertia_kg_m2: float) -> CycleRun:
    """Return a recording whose arm, 70 % of the inertia, swings on a spring.

    The drive keeps the motor on its path. The arm answers the motor's acceleration a by
    ``H(s) a``, with ``H = (2 z w s + w^2) / (s^2 + 2 z w s + w^2)``, so that the motor's torque has
    the arm's inertia times (H - 1) a more than with a rigid gear.
    """
    time_s, velocity = run.columns["time_s"], run.columns["velocity_rad_s"]
    smooth = np.hanning(9) / np.hanning(9).sum()
    acceleration = np.convolve(np.gradient(velocity, time_s), smooth, "same")
    turn = 2.0 * np.pi * hz
    rubs = 2.0 * DAMPING * turn
    rate_hz = 1.0 / float(np.median(np.diff(time_s)))
    above, below = bilinear([rubs, turn**2], [1.0, rubs, turn**2], rate_hz)
    lags = lfilter(above, below, acceleration) - acceleration
    torque = run.columns["torque_nm"] + SWINGS * inertia_kg_m2 * lags
    return replace(run, columns={**run.columns, "torque_nm": torque})


def _work(plan: HistoryPlan, soft_hz: float | None) -> Iterator[CycleRun]:
    for run in ordinary_runs(plan):
        yield run if soft_hz is None else softened(run, soft_hz, plan.joint.inertia_kg_m2)


def _by_speed(joints: Sequence[int], each: int, soft_hz: float | None) -> None:
    inside: list[bool] = []
    off: list[float] = []
    swings: list[tuple[float, float]] = []
    decidable = total = 0
    for seed in joints:
        plan = HistoryPlan(cycles=each, seed=seed, repeatability=0.0, load_friction=0.0)
        for run in _work(plan, soft_hz):
            motion = _motion(run, plan.joint.gear_ratio)
            heard = swinging.swinging_of([motion])
            swings += [] if heard is None else [(heard.explained, heard.frequency_hz)]
            found = ordinary_friction([motion])
            total, decidable = total + 1, decidable + found.decidable
            if not found.decidable:
                continue
            law = plan.joint.friction.truth(run.label["gearbox_degc"])
            truth = np.array([law.torque_nm(v) for v in found.speed_rad_s])
            reach = student_975(found.dof) * found.deviation_nm
            inside += (np.abs(found.friction_nm - truth) <= reach).tolist()
            off += ((found.friction_nm - truth) / truth).tolist()
    shares, at_hz = np.array(swings).T
    print(
        f"swinging: {100.0 * shares.min():.0f} to {100.0 * shares.max():.0f} % of what a rigid "
        f"joint leaves, at {at_hz.min():.1f} to {at_hz.max():.1f} Hz"
    )
    print(f"friction by speed from one piece of work: decidable in {decidable} of {total}")
    if not decidable:
        return
    print(f"  speeds whose 95 % interval holds: {100.0 * np.mean(inside):.1f} % of {len(inside)}")
    print(f"  error, rms: {100.0 * np.sqrt(np.mean(np.square(off))):.2f} % of friction")


def _observer(joints: Sequence[int], soft_hz: float | None) -> None:
    false = healthy = missed = refused = 0
    risen: list[float] = []
    for seed in joints:
        plan = HistoryPlan(cycles=NIGHTS, seed=seed, events=(_WEAR,))
        gear = plan.joint.gear_ratio
        reference = estimate([Signals.from_columns(next(cycles(plan)).columns, gear)])
        runs = list(_work(plan, soft_hz))
        motions = [_motion(r, gear) for r in runs]
        band = _band(reference, motions[:HEALTHY])
        if band is None:
            refused += 1
            continue
        asked = [watch(m, band).asks for m in motions[HEALTHY:]]
        before = ONSET + 1 - HEALTHY
        false, healthy = false + asked[:before].count(True), healthy + before
        first = next((k for k in range(before, len(asked)) if asked[k]), None)
        missed += first is None
        if first is not None:
            risen.append(runs[HEALTHY + first].label["low_speed_rise_nm"])
    print(f"observer, band of {HEALTHY} healthy recordings, 1 % false rate stated:")
    print(f"  not decidable: {refused} of {len(joints)}")
    if not healthy:
        return
    print(f"  asks without reason: {false} of {healthy} ({100.0 * false / healthy:.1f} %)")
    print(f"  wear that it never asks about: {missed} of {len(joints) - refused}")
    if risen:
        level = HistoryPlan().joint.friction.coulomb_nm
        middle, worst = np.median(risen), max(risen)
        print(
            f"  rise at low speed when it asks: median {middle:.3f} N m "
            f"({100.0 * middle / level:.0f} % of Coulomb friction), at most {worst:.3f} N m"
        )


def _band(reference: Estimate, motions: Sequence[Motion]) -> HealthyBand | None:
    """Return what healthy work teaches; None where the observer says that it is not decidable."""
    try:
        return learn_band(model_of(reference, motions), motions)
    except ValueError:
        return None


def main() -> None:
    """Print both tables."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--joints", type=int, default=12)
    parser.add_argument("--each", type=int, default=8)
    parser.add_argument("--soft", type=float, metavar="HZ", help="where the arm resonates")
    parser.add_argument("--even-so", action="store_true", help="refuse no slow swinging")
    asked = parser.parse_args()
    if asked.even_so:
        swinging.SLOWEST_BEARABLE_HZ = 0.0
    joints = range(100, 100 + asked.joints)
    _by_speed(joints, asked.each, asked.soft)
    _observer(joints, asked.soft)


if __name__ == "__main__":
    main()
