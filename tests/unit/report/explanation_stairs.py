"""Small simulated stairs with physics that their twin lacks, for the explanations of the tests."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats

RATE_HZ = 50.0
GEAR_RATIO = 224.0
NOISE_NM = 0.012
SPEEDS_RAD_S = (2.0, 4.0, 7.0, 11.0, 18.0, 30.0, 45.0, 60.0)
BASE = ("inertia_kg_m2", "viscous_nm_s_per_rad", "coulomb_nm", "torque_offset_nm")
TRUTH = np.array([0.0184, 0.0107, 0.6042, 0.0])
GIVEN = np.array([0.0184, 0.0100, 0.6400, 0.0])
Law = Callable[["Run"], Floats]


@dataclass(frozen=True)
class Run:
    """One simulated stair: time, motion, temperature, and what was measured; arrays (n,)."""

    name: str
    time_s: Floats
    velocity: Floats
    acceleration: Floats
    temperature: Floats
    number: int
    measured_nm: Floats

    @property
    def base(self) -> Floats:
        """Return the plain twin's columns, shape (n, 4)."""
        return np.column_stack(
            (self.acceleration, self.velocity, np.sign(self.velocity), np.ones(self.time_s.size))
        )


def drive(name: str, number: int, degc: tuple[float, float], missing: Sequence[Law]) -> Run:
    """Simulate one stair between two temperatures with the physics that the twin lacks."""
    rng = np.random.default_rng(100 + number)
    levels = np.array([s * d for s in SPEEDS_RAD_S for d in (1.0, -1.0)])
    if number % 2:
        levels = levels[::-1]
    step = int(2.0 * RATE_HZ)
    window = np.hanning(int(0.5 * RATE_HZ))
    velocity = np.convolve(np.repeat(levels, step), window / window.sum(), mode="same")
    time_s = np.arange(velocity.size) / RATE_HZ
    bare = Run(
        name,
        time_s,
        velocity,
        np.asarray(np.gradient(velocity, time_s)),
        np.linspace(*degc, time_s.size),
        number,
        np.zeros(time_s.size),
    )
    torque = bare.base @ TRUTH + NOISE_NM * rng.standard_normal(time_s.size)
    return dataclasses.replace(bare, measured_nm=torque + sum(law(bare) for law in missing))


def stribeck(run: Run) -> Floats:
    """Return extra friction near standstill."""
    return 0.31 * np.exp(-(np.abs(run.velocity / 6.0) ** 1.3)) * np.sign(run.velocity)


def temperature(run: Run) -> Floats:
    """Return viscous friction that falls as the gearbox warms."""
    return 0.0042 * (np.exp(-(run.temperature - 35.0) / 35.0) - 1.0) * run.velocity


def bump(run: Run) -> Floats:
    """Return what no library has: a burst of torque in the middle of fast motion."""
    return 0.22 * np.exp(-(((np.abs(run.velocity) - 38.0) / 5.0) ** 2))


def none(run: Run) -> Floats:
    """Return nothing."""
    return np.zeros(run.time_s.size)


def ones(run: Run) -> Floats:
    """Return one everywhere."""
    return np.ones(run.time_s.size)


def at_30_rad_s(run: Run) -> Floats:
    """Return the velocity as a multiple of 30 rad/s."""
    return run.velocity / 30.0


def fitted(runs: Sequence[Run], laws: Sequence[Law]) -> tuple[Floats, Floats]:
    """Return base and law coefficients, and their standard deviations."""
    columns = np.vstack([columns_of(run, laws) for run in runs])
    torque = np.concatenate([run.measured_nm for run in runs])
    theta, *_ = np.linalg.lstsq(columns, torque, rcond=None)
    left = torque - columns @ theta
    covariance = np.linalg.pinv(columns.T @ columns) * np.mean(left**2)
    return theta, np.sqrt(np.diag(covariance))


def columns_of(run: Run, laws: Sequence[Law]) -> Floats:
    return np.column_stack([run.base, *(law(run) for law in laws)])
