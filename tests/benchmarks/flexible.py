"""Speed, starts, coverage and validation of the flexible joint: ``-m tests.benchmarks.flexible``.

The simulation stands beside scipy's solve_ivp in the same run; coverage is over seeds of noise and
motion. ``--keep FOLDER`` writes every seed down when it is done, and goes on from there.
"""

from __future__ import annotations

import argparse
import json
import math
import statistics
import time
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from agent.identify.flexible.chain import Chain
from agent.identify.flexible.fit import Options, fit_flexible
from agent.identify.flexible.result import FlexibleFit
from agent.identify.flexible.simulation import FlexibleJoint, simulate, state_space
from agent.identify.flexible.validation import validate
from agent.identify.result import Floats
from tests.science.flexible_bound import bound
from tests.science.flexible_chain import DEFAULT_COUNTS, STRIBECK, THREE, Robot, run
from tests.science.flexible_plant import PLAIN, drive, stair, there_and_back, triangle_wave

RATE_HZ = 4000.0
STAIR_S = 40.0
PEAK_RAD_S, PEAK_SPREAD = 60.0, 1.0
_ALONE = Options(starts=1)
CASES: dict[str, tuple[Robot, Options, int]] = {
    "two masses": (Robot(), _ALONE, 1),
    "three masses": (Robot(dict(THREE)), Options(kind="three-mass", starts=1), 1),
    "a stiffening spring": (
        Robot().with_(cubic_spring_nm_per_rad3=200.0),
        Options(starts=1, cubic=True),
        1,
    ),
    "Stribeck friction not asked for": (Robot().with_(**STRIBECK), _ALONE, 8),
    "slight Stribeck friction not asked for": (
        Robot().with_(**STRIBECK | {"static_extra_nm": 0.03}),
        _ALONE,
        8,
    ),
}
"""Robot, how to fit, and how many times fewer seeds it gets."""


def seconds(work: Callable[[], object]) -> float:
    """Return how long `work` takes, in seconds."""
    began = time.perf_counter()
    work()
    return time.perf_counter() - began


def simulation() -> None:
    """Print the time of 40 s at 4 kHz, two masses with Coulomb friction, beside scipy."""
    from scipy.integrate import solve_ivp

    joint = FlexibleJoint(0.0084, Chain((0.01,), (25.3,), (0.04,)), 0.6042, 0.0107)
    time_s = np.arange(0.0, STAIR_S, 1.0 / RATE_HZ)
    torque = 3.0 * np.sin(2.0 * np.pi * 0.5 * time_s)
    a, b, _ = state_space(joint)

    def slope(t: float, x: Floats) -> Floats:
        friction = 0.6042 * math.tanh(x[0] / 0.05)
        drive_nm = 3.0 * math.sin(2.0 * math.pi * 0.5 * t)
        return np.asarray(a @ x + b * (drive_nm - friction), dtype=np.float64)

    first = seconds(lambda: simulate(joint, torque, 1.0 / RATE_HZ))
    ours = statistics.median(
        seconds(lambda: simulate(joint, torque, 1.0 / RATE_HZ)) for _ in range(9)
    )
    peer = seconds(lambda: solve_ivp(slope, (0.0, STAIR_S), np.zeros(3), rtol=1e-6, atol=1e-8))
    print(f"two masses, 40 s at 4 kHz    {1e3 * ours:8.2f} ms (first call {first:.2f} s)")
    print(f"scipy solve_ivp, tanh        {1e3 * peer:8.0f} ms, {peer / ours:.0f} times as long")


def starts() -> FlexibleFit:
    """Print the time of 20 starts, and what became of 100; return the fit."""
    recording = drive(triangle_wave(6), seed=1, fine=True)
    took = seconds(lambda: fit_flexible([recording], Options(starts=20)))
    print(f"grey box, 20 starts          {took:8.2f} s")
    fit = fit_flexible([recording], Options(starts=100))
    ends = [s.outcome for s in fit.starts]
    counts = {end: ends.count(end) for end in ("best", "local", "unfinished")}
    print(f"100 starts over two decades  {counts}")
    return fit


def one_seed(robot: Robot, options: Options, seed: int) -> dict[str, list[float]]:
    """Return value and 95 % interval of every parameter that one seed's recording gives.

    A seed is noise of the torque and another motion, whose peak differs by some percent. The start
    alone would not do: the velocity loop's integral draws the motor to the same fraction of a count
    wherever it began, so that one and the same error of the encoder would stand in every recording,
    and look like a bias.
    """
    peak = PEAK_RAD_S + np.random.default_rng(seed).uniform(-PEAK_SPREAD, PEAK_SPREAD)
    recorded = run(triangle_wave(6, peak_rad_s=peak), robot=robot)
    fit = fit_flexible([recorded.measured(seed + 1)], options)
    return {name: [p.value, *p.ci95] for name, p in fit.parameters.items() if p.ci95 is not None}


def campaign(title: str, seeds: int, keep: Path | None) -> None:
    """Print one robot's table; seeds that `keep` already holds are not run again."""
    robot, options, asked = CASES[title]
    path = None if keep is None else keep / f"{title.replace(' ', '-')}.jsonl"
    done: list[dict[str, list[float]]] = []
    if path is not None and path.exists():
        done = [json.loads(line) for line in path.read_text(encoding="utf-8").splitlines()]
    for seed in range(len(done), max(seeds // asked, 1)):
        done.append(one_seed(robot, options, seed))
        if path is not None:
            with path.open("a", encoding="utf-8") as file:
                file.write(json.dumps(done[-1]) + "\n")
    table(title, robot, done)


def table(title: str, robot: Robot, done: Sequence[dict[str, list[float]]]) -> None:
    """Print coverage of the 95 % intervals, errors over the bound, and bias; 2^16 counts a turn.

    Where a parameter is not identified there is no interval: it counts in neither column, and is
    counted in the last.
    """
    truth, seeds = robot.truth, len(done)
    lacking = STRIBECK.keys() & robot.values.keys()
    least: dict[str, float] = {}
    if not lacking:
        least = bound(run(triangle_wave(6), robot=robot, counts=1 << 22), robot, DEFAULT_COUNTS)
    print(f"{title}: {seeds} seeds{'coverage':>24}{'rmse/bound':>12}{'bias/sd':>9}{'none':>6}")
    for name, value in truth.items():
        found = [fit[name] for fit in done if name in fit]
        if not found:
            print(f"  {name:<34}{'':>38}{seeds:>6}")
            continue
        errors = [estimate - value for estimate, _, _ in found]
        rmse = math.sqrt(statistics.fmean(e * e for e in errors))
        ratio = f"{rmse / least[name]:.2f}" if name in least else ""
        bias = statistics.fmean(errors) / (statistics.pstdev(errors) or math.inf)
        share = 100.0 * statistics.fmean(low <= value <= high for _, low, high in found)
        print(f"  {name:<34}{share:>10.1f} %{ratio:>12}{bias:>9.2f}{seeds - len(found):>6}")


def validation(fit: FlexibleFit) -> None:
    """Print the flexible joint beside the rigid one, on runs that neither has seen."""
    print(
        f"{'fit in %':<16}{'torque, flexible':>18}{'rigid':>8}{'velocity, flex.':>16}{'rigid':>8}"
    )
    for recording in (
        drive(stair(), seed=11, name="stair"),
        drive(triangle_wave(3, 45.0), seed=12, name="triangle"),
        drive(*there_and_back(), joint=PLAIN, seed=13, name="point-to-point"),
    ):
        result = validate(fit, recording)
        print(
            f"{recording.name:<16}{result.flexible.torque_fit_percent:18.1f}"
            f"{result.rigid.torque_fit_percent:8.1f}{result.flexible.velocity_fit_percent:16.1f}"
            f"{result.rigid.velocity_fit_percent:8.1f}"
        )


def main() -> None:
    """Print the tables."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--seeds", type=int, default=500, help="where no friction is left out")
    parser.add_argument("--keep", type=Path, help="folder of seeds done, to go on from")
    parser.add_argument("--only", choices=CASES, help="one campaign alone")
    arguments = parser.parse_args()
    if arguments.keep is not None:
        arguments.keep.mkdir(parents=True, exist_ok=True)
    if arguments.only is None:
        simulation()
        validation(starts())
    for title in CASES if arguments.only is None else [arguments.only]:
        campaign(title, arguments.seeds, arguments.keep)


if __name__ == "__main__":
    main()
