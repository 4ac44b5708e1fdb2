"""Cycles of a joint over months, with truth known; written apart from every law of the monitor."""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from agent.monitor.history.cycle import Cycle, CycleCurve, Joint

JOINT = Joint("cell7", 2, 224.0)
SPEEDS = np.array([2.0, 4.0, 7.0, 12.0, 20.0, 32.0, 48.0, 70.0, 100.0, 140.0])
START_S = 1.7e9
DAY_S = 86_400.0


@dataclasses.dataclass(frozen=True)
class Truth:
    """What befalls the joint; each is full-grown at the last cycle, from `onset` on."""

    wear_nm: float = 0.0
    thicker: float = 0.0
    torque_gain: float = 0.0
    sensor_k: float = 0.0
    onset: int = 60
    swing_k: float = 5.0
    scatter: float = 0.004


def friction_nm(speed: np.ndarray, degc: float, grown: Truth, share: float) -> np.ndarray:
    """A film that thins with temperature over a dry level with a boundary bump; no law of ours."""
    film = 8e-3 * math.exp(-(degc - 30.0) / 25.0) * (1.0 + grown.thicker * share) * speed
    worn = grown.wear_nm * share * (0.3 + np.exp(-((speed / 25.0) ** 0.9)))
    return np.asarray(0.6 + 0.12 * np.exp(-((speed / 8.0) ** 1.3)) + film + worn)


def cycle(
    day: int, rng: np.random.Generator, truth: Truth | None = None, share: float = 0.0
) -> Cycle:
    """Return one night's cycle."""
    truth = truth or Truth()
    degc = 28.0 + truth.swing_k * math.sin(2 * math.pi * day / 40.0) + rng.normal(0.0, 1.0)
    gain = 1.0 + truth.torque_gain * share
    torque = friction_nm(SPEEDS, degc, truth, share) * gain
    torque = torque * (1.0 + truth.scatter * rng.standard_normal())
    return Cycle(
        name=f"cycle-{day:04d}.parquet",
        joint=JOINT,
        started_s=START_S + DAY_S * day,
        duration_s=40.0,
        curve=CycleCurve(
            SPEEDS, torque + 0.003 * rng.standard_normal(SPEEDS.size), np.full(SPEEDS.size, 0.003)
        ),
        temperature_degc=degc - truth.sensor_k * share,
        payload_kg=10.0,
        load_nm=0.5 * gain * (1.0 + 0.002 * rng.standard_normal()),
        inertia_kg_m2=0.018 * gain * (1.0 + 0.004 * rng.standard_normal()),
        inertia_deviation_kg_m2=1e-4,
        trajectory="stair",
        parts={"gearbox": "G1"},
        oil="VG150",
        fingerprint=f"{day}-{rng.integers(1 << 40)}",
    )


def months(seed: int, cycles: int = 90, truth: Truth | None = None) -> list[Cycle]:
    """Return a cycle a night."""
    truth = truth or Truth()
    rng = np.random.default_rng(seed)
    grown = [max(0.0, (i - truth.onset + 1) / (cycles - truth.onset)) for i in range(cycles)]
    if truth.thicker:  # oil is changed at once
        grown = [float(g > 0.0) for g in grown]
    return [cycle(i, rng, truth, g) for i, g in enumerate(grown)]
