"""The rigid body run forward: how far the simulated position strays from the recorded one.

Inverse dynamics asks for a torque and is judged by it. Run forward from the recorded torque alone,

    J dv/dt = tau - fc sign(v) - fv v - gravity(q) - offset,    dq/dt = v,

nothing holds the joint in place, and the smallest error grows with the square of time. The joint
was not recorded alone, but in its loop, so it is simulated there too: to the recorded torque is
added what the drive's own linear controller would answer to the deviation ``d = q - q_sim``,

    tau_sim = tau + k0 d + k1 dd/dt + k2 integral d.

For a linear controller this is the closed loop of the EMPS benchmark (Janot, Gautier and Brunot,
Workshop on Nonlinear System Identification Benchmarks, 2019): set-points, feed-forward and pulses
are in the recorded torque already. The gains are not asked for: they are read from the recordings
that hold a set-point, and where they cannot be, the reason is given. Beside it stands the error
after a short time without any loop.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import (
    ClosedLoopError,
    Floats,
    OpenLoopError,
    PositionError,
    RigidBodyFit,
)
from agent.identify.rigid.body import weights
from agent.identify.rigid.drive_loop import Loop, find_loop, on_grid, pieces_of
from agent.identify.signals.preprocess import Motion
from agent.numbers import significant
from agent.physics.rigid_body import PARAMETERS, gravity_columns, weight_nm

_HORIZON_S = 0.2
_RESTARTS = 400
_NO_INERTIA = "the inertia was not identified"


@dataclass(frozen=True)
class _Plant:
    """The rigid body in plain numbers, N m and SI units, motor side."""

    inertia: float
    viscous: float
    coulomb: float
    gravity: tuple[float, float]
    offset: float
    gear_ratio: float

    def position_torque(self, position: Floats) -> Floats:
        """Return gravity and offset at motor angles, shape (n,)."""
        if self.gravity == (0.0, 0.0):
            return np.full(position.shape, self.offset)
        columns = gravity_columns(position, self.gear_ratio)
        return np.asarray(columns @ np.array(self.gravity) + self.offset, dtype=np.float64)

    def advance(self, velocity: Floats, torque: Floats, step_s: float) -> Floats:
        """Return the velocity one step later, shapes (n,): see `_follow`."""
        by_inertia = step_s / self.inertia
        half = 0.5 * by_inertia * self.viscous
        free = (1.0 - half) * velocity + by_inertia * torque
        slid = np.sign(free) * np.maximum(np.abs(free) - by_inertia * self.coulomb, 0.0)
        return np.asarray(slid / (1.0 + half))


def position_error(
    body: RigidBodyFit, fitted: Sequence[Motion], unseen: Motion
) -> PositionError | None:
    """Simulate an unseen run forward and compare its position with the recorded one.

    Parameters
    ----------
    body : RigidBodyFit
        What was identified; parameters that were not count as zero.
    fitted : sequence of Motion
        The recordings of the fit: the drive's loop is read from them.
    unseen : Motion
        The run to simulate.

    Returns
    -------
    PositionError or None
        None where the run has no position to compare with.
    """
    if unseen.signals.position_rad is None or not unseen.timing.stretches:
        return None
    if not body.parameters["inertia_kg_m2"].identified:
        return PositionError(None, None, _NO_INERTIA)
    plant = _plant(body, unseen.signals.gear_ratio)
    if not plant.inertia > 0.0 or plant.coulomb < 0.0 or plant.viscous < 0.0:
        return PositionError(None, None, "inertia or friction came out negative")
    open_loop = _open_loop(plant, unseen)
    loop = find_loop(fitted)
    if isinstance(loop, str):
        return PositionError(None, open_loop, loop)
    return PositionError(_closed_loop(plant, loop, unseen), open_loop, "")


def in_words(error: PositionError) -> str:
    """Say in one or two sentences what a forward simulation gave."""
    said = []
    loop, free = error.closed_loop, error.open_loop
    if loop is not None:
        said.append(
            f"simulated in the drive's own loop, the position is {_angle(loop.rmse_rad)} rms off "
            f"({loop.relative_percent:.2g} % of its travel), at most "
            f"{_angle(loop.largest_rad)}; the loop's law was read from the recorded set-point "
            f"(torque within {loop.loop_torque_error_percent:.2g} %)"
        )
    else:
        said.append(
            f"simulated position in the drive's loop: not decidable, because {error.reason}"
        )
    if free is not None:
        said.append(
            f"without the loop it is {_angle(free.rmse_rad)} rms off after {free.horizon_s:g} s"
        )
    return "; ".join(said)


def _angle(angle_rad: float) -> str:
    """Return an angle with two digits in the largest of three units that it fills."""
    for factor, unit in ((1.0, "rad"), (1e3, "mrad")):
        if angle_rad * factor >= 0.1:
            return f"{significant(angle_rad * factor, 2)} {unit}"
    return f"{significant(angle_rad * 1e6, 2)} µrad"


def _plant(body: RigidBodyFit, gear_ratio: float) -> _Plant:
    value = dict(zip(PARAMETERS, weights(body).tolist(), strict=True))
    return _Plant(
        value["inertia_kg_m2"],
        value["viscous_nm_s_per_rad"],
        value["coulomb_nm"],
        (value["gravity_sin_nm"], value["gravity_cos_nm"]),
        value["torque_offset_nm"],
        gear_ratio,
    )


def _closed_loop(plant: _Plant, loop: Loop, motion: Motion) -> ClosedLoopError:
    """Simulate every stretch in its loop from its first sample on."""
    errors, positions = [], []
    for stretch, velocity in pieces_of(motion):
        position = on_grid(motion, stretch, motion.signals.position_rad)
        torque = on_grid(motion, stretch, motion.signals.torque_nm)
        errors.append(position - _follow(plant, loop, stretch.period_s, position, velocity, torque))
        positions.append(position)
    error, position = np.concatenate(errors), np.concatenate(positions)
    rms = float(np.sqrt(np.mean(error**2)))
    travel = float(np.std(position))
    return ClosedLoopError(
        rmse_rad=rms,
        largest_rad=float(np.max(np.abs(error))),
        relative_percent=100.0 * rms / travel if travel > 0.0 else float("nan"),
        stiffness_nm_per_rad=loop.stiffness_nm_per_rad,
        damping_nm_s_per_rad=loop.damping_nm_s_per_rad,
        integral_nm_per_rad_s=loop.integral_nm_per_rad_s,
        loop_torque_error_percent=loop.torque_error_percent,
    )


def _follow(
    plant: _Plant, loop: Loop, step_s: float, position: Floats, velocity: Floats, torque: Floats
) -> Floats:
    """Return the simulated position of one stretch, shape (n,).

    The torque is held for a sample, as a drive does, and the position is then exact. Implicit in
    the loop and in Coulomb friction, so that no loop is too stiff for the sampling rate and a joint
    which friction holds comes to rest and stays there (Moreau's time stepping). One sample needs
    the one before it: this is a loop over plain numbers, about a microsecond each.
    """
    k0, k1, k2 = loop.stiffness_nm_per_rad, loop.damping_nm_s_per_rad, loop.integral_nm_per_rad_s
    by_inertia, half_s = step_s / plant.inertia, 0.5 * step_s
    held, half = by_inertia * plant.coulomb, 0.5 * by_inertia * plant.viscous
    shrink = 1.0 / (1.0 + half + by_inertia * (k1 + k0 * half_s))
    sine, cosine = plant.gravity
    heavy, ratio = plant.gravity != (0.0, 0.0), plant.gear_ratio
    q, v, summed = float(position[0]), float(velocity[0]), 0.0
    out = np.empty_like(position)
    out[0] = q
    driven = (torque[:-1] + k1 * velocity[1:] - plant.offset).tolist()
    for i, (there, push) in enumerate(zip(position[1:].tolist(), driven, strict=True), start=1):
        total = push + k0 * (there - q - half_s * v) + k2 * summed
        if heavy:
            total -= weight_nm(q / ratio, sine, cosine)
        free = (1.0 - half) * v + by_inertia * total
        faster = (free - held if free > held else free + held if free < -held else 0.0) * shrink
        q += half_s * (v + faster)
        v = faster
        summed += (there - q) * step_s
        out[i] = q
    return out


def _open_loop(plant: _Plant, motion: Motion) -> OpenLoopError | None:
    """Simulate from many recorded states for a short time each, all side by side."""
    errors = []
    for stretch, velocity in pieces_of(motion):
        steps = round(_HORIZON_S / stretch.period_s)
        starts = velocity.shape[0] - 1 - steps
        if steps < 2 or starts < 1:
            continue
        position = on_grid(motion, stretch, motion.signals.position_rad)
        torque = on_grid(motion, stretch, motion.signals.torque_nm)
        at = np.unique(np.linspace(0, starts, min(_RESTARTS, starts)).astype(np.int64))
        q, v = position[at], velocity[at]
        for k in range(steps):
            drive = torque[at + k] - plant.position_torque(q)
            faster = plant.advance(v, drive, stretch.period_s)
            q = q + 0.5 * stretch.period_s * (v + faster)
            v = faster
        errors.append(position[at + steps] - q)
    if not errors:
        return None
    error = np.concatenate(errors)
    return OpenLoopError(_HORIZON_S, float(np.sqrt(np.mean(error**2))))
