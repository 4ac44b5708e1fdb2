"""Speed, starts, coverage and validation of the flexible joint: ``-m tests.benchmarks.flexible``.

The simulation stands beside scipy's solve_ivp in the same run; coverage is over seeds of noise.
"""

from __future__ import annotations

import math
import statistics
import sys
import time
from collections.abc import Callable

import numpy as np

from agent.identify.flexible.chain import Chain
from agent.identify.flexible.fit import Options, fit_flexible
from agent.identify.flexible.result import FlexibleFit
from agent.identify.flexible.simulation import FlexibleJoint, simulate, state_space
from agent.identify.flexible.validation import validate
from agent.identify.result import Floats
from tests.science.flexible_chain import (
    DEFAULT_COUNTS,
    NOISE_NM,
    SAMPLE_S,
    STRIBECK,
    THREE,
    TWO,
    Robot,
    Run,
    run,
)
from tests.science.flexible_plant import PLAIN, drive, stair, there_and_back, triangle_wave

RATE_HZ = 4000.0
STAIR_S = 40.0
SEEDS = 100
FEWER = 4  # times fewer seeds for what takes longer


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


def bound(recorded: Run, robot: Robot, counts: int) -> dict[str, float]:
    """Return the Cramer-Rao bound of standard errors, noise of torque and of encoder in it.

    An error of the position is one of the torque that the motion needs: the noise is coloured,
    ``S(w) = s_torque^2 + |F(w)|^2 s_position^2`` with ``F = s^2 (Jm + Ja M(s)) + fv s`` and the
    steps of the encoder as white noise of variance ``step^2/12``. Every moving sample counts,
    reversals too; offset and delay are unknown. The arm behind the motor's prescribed motion is
    simulated, and its torque differenced by every parameter.
    """
    from scipy.signal import lsim

    names = [*robot.values, "torque_offset_nm", "torque_delay_s"]
    truth, position = robot.truth, recorded.position_rad - recorded.position_rad[0]
    speed = np.gradient(position, SAMPLE_S)
    acceleration = np.gradient(speed, SAMPLE_S)

    def torque(values: dict[str, float]) -> Floats:
        k, d = values["spring_nm_per_rad"], values["damper_nm_s_per_rad"]
        per_arm = 1.0 / values["arm_inertia_kg_m2"]
        # Twist and its rate; input: the motor's acceleration.
        a = np.array([[0.0, 1.0], [-k * per_arm, -d * per_arm]])
        b, c = np.array([[0.0], [1.0]]), np.array([[k, d]])
        shaft = lsim((a, b, c, [[0.0]]), acceleration, recorded.time_s)[1]
        moved = values["motor_inertia_kg_m2"] * acceleration + shaft
        moved += values["coulomb_nm"] * np.sign(speed) + values["viscous_nm_s_per_rad"] * speed
        late = values["torque_delay_s"] * np.gradient(moved, SAMPLE_S)
        return np.asarray(moved - late + values["torque_offset_nm"], dtype=np.float64)

    moving = np.abs(speed) > 0.5
    columns = []
    for name in names:
        step = 1e-4 * (abs(truth[name]) or 1.0)
        ahead = torque(truth | {name: truth[name] + step})
        change = ahead - torque(truth | {name: truth[name] - step})
        columns.append(np.where(moving, change, 0.0) / (2.0 * step))
    lines = np.fft.fft(np.stack(columns, axis=-1), axis=0, norm="ortho")
    jacobian = lines / np.sqrt(_noise_power(truth, position.size, counts))[:, np.newaxis]
    size = np.linalg.norm(jacobian, axis=0)
    inverse = np.linalg.inv(((jacobian / size).conj().T @ (jacobian / size)).real)
    errors = np.sqrt(np.diag(inverse)) / size
    return dict(zip(names, errors.tolist(), strict=True))


def _noise_power(truth: dict[str, float], samples: int, counts: int) -> Floats:
    """Return the power of the noise in the torque balance at every line, (N m)^2."""
    s = 2j * np.pi * np.abs(np.fft.fftfreq(samples, SAMPLE_S))
    k, d = truth["spring_nm_per_rad"], truth["damper_nm_s_per_rad"]
    arm, motor = truth["arm_inertia_kg_m2"], truth["motor_inertia_kg_m2"]
    carried = arm * (d * s + k) / (arm * s * s + d * s + k)
    stiffness = s * s * (motor + carried) + truth["viscous_nm_s_per_rad"] * s
    step = 2.0 * math.pi / counts / math.sqrt(12.0)
    return np.asarray(NOISE_NM**2 + np.abs(stiffness * step) ** 2, dtype=np.float64)


def coverage(title: str, robot: Robot, options: Options, seeds: int) -> None:
    """Print coverage of the 95 % intervals, errors over the bound, and bias; 2^16 counts a turn.

    Where a parameter is not identified there is no interval: it counts in neither column, and is
    counted in the last.
    """
    truth = robot.truth
    least: dict[str, float] = {}
    if robot.values.keys() == TWO.keys():
        least = bound(run(triangle_wave(6), counts=1 << 22), robot, DEFAULT_COUNTS)
    inside = dict.fromkeys(truth, 0)
    errors: dict[str, list[float]] = {name: [] for name in truth}
    for seed in range(seeds):
        rng = np.random.default_rng(seed)
        recorded = run(triangle_wave(6), robot=robot, start_rad=0.01 * rng.uniform())
        fit = fit_flexible([recorded.measured(seed + 1)], options)
        for name, value in truth.items():
            parameter = fit.parameters.get(name)
            if parameter is None or parameter.ci95 is None:
                continue
            inside[name] += parameter.ci95[0] <= value <= parameter.ci95[1]
            errors[name].append(parameter.value - value)
    print(f"{title}: {seeds} seeds{'coverage':>24}{'rmse/bound':>12}{'bias/sd':>9}{'none':>6}")
    for name, found in errors.items():
        if not found:
            print(f"  {name:<34}{'':>38}{seeds:>6}")
            continue
        rmse = math.sqrt(statistics.fmean(e * e for e in found))
        ratio = f"{rmse / least[name]:.2f}" if name in least else ""
        bias = statistics.fmean(found) / (statistics.pstdev(found) or math.inf)
        share = 100.0 * inside[name] / len(found)
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
    """Print the tables; the first argument is the number of seeds."""
    simulation()
    validation(starts())
    seeds = int(sys.argv[1]) if len(sys.argv) > 1 else SEEDS
    alone = Options(starts=1)
    coverage("two masses", Robot(), alone, seeds)
    fewer = max(seeds // FEWER, 1)
    stiff = Robot().with_(cubic_spring_nm_per_rad3=200.0)
    coverage("a stiffening spring", stiff, Options(starts=1, cubic=True), fewer)
    coverage("Stribeck friction, not asked for", Robot().with_(**STRIBECK), alone, fewer)
    slight = Robot().with_(**STRIBECK | {"static_extra_nm": 0.03})
    coverage("slight Stribeck friction, not asked for", slight, alone, fewer)
    coverage("three masses", Robot(dict(THREE)), Options(kind="three-mass", starts=1), fewer)


if __name__ == "__main__":
    main()
