"""An arm dragged through gap and spring, and how what it reads follows every number."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.reversals.arm_record import ArmRecord

SHAPE = (
    "backlash_rad",
    "stiffness",
    "damping",
    "arm_inertia",
    "arm_coulomb",
    "skew_s",
    "load_nm",
    "arm_viscous",
)
"""What the arm's path follows, in order; the encoders' places, one a record, come behind."""
MOTOR = ("inertia", "coulomb", "viscous")
"""What the motor's torque follows in straight lines; offsets, one a record, come behind."""
_LOGARITHMS = slice(1, 5)
_SUBSTEPS = 16
_BEGIN = 5  # samples over which the arm's place at the start is read
_STEP = 1e-3
_STEP_DAMPING = 1e-2  # of a logarithm: what damps tells little
_STEP_RAD = 1e-5
_STEP_S = 1e-5
TWICE = np.array([1 / 90, -3 / 20, 3 / 2, -49 / 18, 3 / 2, -3 / 20, 1 / 90])
"""Differences of the motor's angle that stand for its acceleration: of sixth order.

Those of fourth order miss a thousandth of a swing that turns in eleven samples, as a motor does
against its gear: less than noise in any row, and in all of them a quarter of an error."""


@dataclass(frozen=True)
class Numbers:
    """All numbers of a joint whose arm has an encoder, motor side.

    Parameters
    ----------
    x : ndarray, shape (8 + R,)
        `SHAPE` with the logarithms of the four that are positive, and R places.
    w : ndarray, shape (3 + R,)
        `MOTOR`, and R offsets of the torque.
    """

    x: Floats
    w: Floats

    def gear(self) -> Floats:
        """Return what `agent.physics.kernels_carried.dragged_arm` takes, shape (7,)."""
        stiffness, damping, inertia, coulomb = np.exp(self.x[_LOGARITHMS]).tolist()
        gap, load, viscous = float(self.x[0]), float(self.x[6]), float(self.x[7])
        return np.array([gap, stiffness, damping, inertia, coulomb, viscous, load])

    def moved(self, step: Floats) -> Numbers:
        """Return them a step further, shape (11 + 2 R,); a gap stays one."""
        x = self.x + step[: self.x.size]
        x[0] = max(x[0], 0.0)
        return Numbers(x, self.w + step[self.x.size :])


@dataclass(frozen=True)
class Path:
    """One simulated arm; arrays of shape (n,).

    Parameters
    ----------
    seen_rad : ndarray
        What its encoder reads, late as it is.
    tooth_nm, rate_rad_s : ndarray
        Torque of the teeth, and the arm's velocity, in time.
    felt_nm : ndarray
        Torque of the teeth as differences of the motor's samples feel it.
    """

    seen_rad: Floats
    tooth_nm: Floats
    felt_nm: Floats
    rate_rad_s: Floats


def drag(record: ArmRecord, number: int, motor_rad: Floats, at: Numbers) -> Path:
    """Return the arm's path behind a motor's, shape (n,), in the record of this number."""
    from agent.physics.kernels_carried import dragged_arm

    gear = at.gear()
    skew_s, place = float(at.x[5]), float(at.x[len(SHAPE) + number])
    reach = 0.5 * gear[0] + gear[4] / gear[1]
    velocity = np.gradient(motor_rad, record.period_s)
    # A record may begin while the joint moves: then the arm has gone on since it was read.
    since_s = skew_s - 0.5 * (_BEGIN - 1) * record.period_s
    begin = float(np.mean(record.arm_rad[:_BEGIN])) + place + since_s * velocity[0]
    begin = min(max(begin, motor_rad[0] - reach), motor_rad[0] + reach)
    angle, tooth, rate = dragged_arm(
        motor_rad, velocity, record.period_s, _SUBSTEPS, gear, begin, float(velocity[0])
    )
    when = (np.arange(record.size) - skew_s / record.period_s) * _SUBSTEPS
    index = np.clip(when.astype(np.intp), 0, angle.size - 2)
    share = np.clip(when - index, 0.0, 1.0)
    seen = angle[index] + share * (angle[index + 1] - angle[index]) - place
    return Path(seen, tooth[::_SUBSTEPS], _felt(tooth), rate)


def _felt(tooth_nm: Floats) -> Floats:
    """Return the teeth's torque weighed as `TWICE` weighs acceleration between samples, shape (n,).

    Teeth meet between two samples: the motor's acceleration jumps there, and differences of its
    angle round that off. The drive's torque does not jump, so that the same of both is compared.
    """
    reach = TWICE.size // 2
    between = tooth_nm[:-1].reshape(-1, _SUBSTEPS)
    at = np.arange(-reach * _SUBSTEPS, reach * _SUBSTEPS) / _SUBSTEPS
    away = np.abs(at[:, np.newaxis] - np.arange(-reach, reach + 1))
    weight = (0.5 * away @ TWICE).reshape(-1, _SUBSTEPS) / _SUBSTEPS
    parts = between @ weight.T
    out = tooth_nm[::_SUBSTEPS].copy()
    inside = slice(reach, out.size - reach)
    out[inside] = sum(parts[i : i + out.size - 2 * reach, i] for i in range(2 * reach))
    return out


def slopes(
    record: ArmRecord, number: int, motor_rad: Floats, at: Numbers, free: Sequence[int]
) -> tuple[Floats, Floats]:
    """Return how the arm's reading and the felt torque follow these of `x`, shape (n, k)."""
    seen, tooth = np.zeros((2, record.size, len(free)))
    for column, i in enumerate(free):
        if i >= len(SHAPE) and i != len(SHAPE) + number:
            continue
        step = np.zeros(at.x.size)
        step[i] = _step(i, float(at.x[0]))
        ahead = drag(record, number, motor_rad, Numbers(at.x + step, at.w))
        behind = drag(record, number, motor_rad, Numbers(at.x - step, at.w))
        seen[:, column] = (ahead.seen_rad - behind.seen_rad) / (2.0 * step[i])
        tooth[:, column] = (ahead.felt_nm - behind.felt_nm) / (2.0 * step[i])
    return seen, tooth


def reading(record: ArmRecord, path: Path) -> NDArray[np.bool_]:
    """Tell which samples of the arm's encoder are read, shape (n,)."""
    return record.read(path.rate_rad_s)


def _step(i: int, gap_rad: float) -> float:
    if i == 0:
        return max(2e-3 * gap_rad, 1e-9)
    if i == SHAPE.index("damping"):
        return _STEP_DAMPING
    if i == SHAPE.index("skew_s"):
        return _STEP_S
    return _STEP_RAD if i >= len(SHAPE) else _STEP
