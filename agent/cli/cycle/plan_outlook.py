"""What a designed stair is expected to tell, from a cell's rough idea of the joint."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.cell.axis import Expected
from agent.cell.cell import Axis, Cell
from agent.errors import InputError
from agent.physics.friction import STRIBECK
from agent.physics.sensitivity import sensitivity
from trajectories import (
    Belief,
    DesignedStair,
    DesignRequest,
    TorqueNoise,
    Trajectory,
    design_stair,
    expect,
)
from trajectories.design_information import BODY_PARAMETERS

Floats = NDArray[np.float64]

CORRELATION_S = 0.02
"""Over which torque noise that a drive's control loop has coloured forgets itself."""

_STATIC_EXTRA_SHARE = 0.25  # of Coulomb friction
STRIBECK_RAD_S = (6.0, 3.0, 12.0)  # nominal, then the range that the design must bear
EXPONENTS = (1.3, 1.0, 1.8)
_SETTLING = 0.4  # of the shortest dwell
_SEEN = 0.5  # an interval wider than half of the value to either side tells little
_SCAN = 60


@dataclass(frozen=True)
class Outlook:
    """A plan for one axis, and what it stands on.

    Parameters
    ----------
    robot, axis : str, int
        Whose joint.
    request, design : DesignRequest, DesignedStair
        What was asked for, and what came of it.
    nominal : dict
        The parameters that were assumed, by name.
    stribeck_range_rad_s : tuple of float or None
        Stribeck velocities that the plan would find to within half of their value.
    """

    robot: str
    axis: int
    request: DesignRequest
    design: DesignedStair
    nominal: dict[str, float]
    stribeck_range_rad_s: tuple[float, float] | None

    @property
    def trajectory(self) -> Trajectory:
        """What would be driven."""
        return self.design.trajectory

    @property
    def half_widths(self) -> dict[str, float]:
        """Half of the expected 95 % intervals, by parameter."""
        return dict(self.design.expectation.half_widths)

    @property
    def beside_plain(self) -> dict[str, float]:
        """Expected intervals over those of a plain stair that takes longer, where both have one."""
        plain = self.design.plain
        theirs = {} if plain is None else dict(plain.half_widths)
        widths = self.half_widths
        return {
            name: widths[name] / half
            for name, half in theirs.items()
            if math.isfinite(half) and math.isfinite(widths[name])
        }

    def sees(self, name: str) -> bool:
        """Tell whether the expected interval stays within half of the value to either side.

        Offset and gravity may well be zero: they are measured against Coulomb friction.
        """
        size = abs(self.nominal[name])
        if name in BODY_PARAMETERS[1:]:
            size = max(size, self.nominal["coulomb_nm"])
        return self.half_widths[name] <= _SEEN * size


def outlook_of(
    cell: Cell, axis: Axis, seconds: float, *, noise_nm: float, dwell_s: float
) -> Outlook:
    """Design the stair for an axis and a time.

    Parameters
    ----------
    cell, axis : Cell, Axis
        Speeds, ramps and stroke come from ``[axis.stair]``, the joint from ``[axis.expected]``.
    seconds : float
        The time budget.
    noise_nm : float
        Standard deviation of white torque noise; coloured noise of the same size is added.
    dwell_s : float
        No speed is held for less; two fifths of it are taken to be lost to settling.

    Raises
    ------
    agent.errors.InputError
        The cell does not say what joint to expect.
    trajectories.TrajectoryError
        No stair fits; says what would be needed.
    """
    expected = axis.expected
    if expected is None or not all(
        (expected.coulomb_nm, expected.viscous_nm_s_per_rad, expected.inertia_kg_m2)
    ):
        raise InputError(
            f"A plan needs a rough idea of axis {axis.number}: [axis.expected] must hold "
            "inertia_kg_m2, coulomb_nm and viscous_nm_s_per_rad above zero.",
            "An earlier estimate, a data sheet or a similar axis will do.",
        )
    friction = {
        "coulomb_nm": expected.coulomb_nm,
        "viscous_nm_s_per_rad": expected.viscous_nm_s_per_rad,
        "static_extra_nm": _STATIC_EXTRA_SHARE * expected.coulomb_nm,
        "stribeck_velocity_rad_s": STRIBECK_RAD_S[0],
        "exponent": EXPONENTS[0],
    }
    noise = TorqueNoise(noise_nm, noise_nm, CORRELATION_S, cell.recording.sample_rate_hz)
    belief = _belief_of(expected, friction, axis.gear_ratio)
    request = _request_of(axis, seconds, belief, noise, dwell_s)
    design = design_stair(request)
    nominal = friction | dict.fromkeys(BODY_PARAMETERS[1:3], expected.gravity_peak_nm)
    nominal |= {"inertia_kg_m2": expected.inertia_kg_m2, "torque_offset_nm": 0.0}
    found = _stribeck_range(request, design.trajectory, friction)
    return Outlook(cell.robot, axis.number, request, design, nominal, found)


def _belief_of(expected: Expected, friction: dict[str, float], gear_ratio: float) -> Belief:
    """Return what is believed of the joint: the design must bear every Stribeck curve of it."""
    prior = [friction] + [
        {**friction, "stribeck_velocity_rad_s": v, "exponent": d}
        for v in STRIBECK_RAD_S
        for d in EXPONENTS[1:]
    ]
    gravity_nm = expected.gravity_peak_nm
    return Belief(
        STRIBECK.parameters,
        tuple(friction[name] for name in STRIBECK.parameters),
        tuple(sensitivity(STRIBECK, member) for member in prior),
        expected.inertia_kg_m2,
        gravity_nm if gravity_nm > 0.0 else expected.coulomb_nm,
        gear_ratio,
    )


def _request_of(
    axis: Axis, seconds: float, belief: Belief, noise: TorqueNoise, dwell_s: float
) -> DesignRequest:
    """Return what is asked of the design, at the motor: the cell speaks of the arm."""
    stair = axis.stair
    return DesignRequest(
        from_rad=axis.motor_rad(stair.arm_from_deg),
        to_rad=axis.motor_rad(stair.arm_to_deg),
        duration_s=seconds,
        speed_min_rad_s=stair.motor_velocity_min_rad_s,
        speed_max_rad_s=stair.motor_velocity_max_rad_s,
        acceleration_rad_s2=stair.motor_acceleration_rad_s2,
        jerk_rad_s3=stair.motor_jerk_rad_s3,
        limits=axis.motor_limits,
        belief=belief,
        noise=noise,
        torque_model=axis.torque_model,
        dwell_min_s=dwell_s,
        settle_s=_SETTLING * dwell_s,
    )


def _stribeck_range(
    request: DesignRequest, trajectory: Trajectory, friction: dict[str, float]
) -> tuple[float, float] | None:
    """Return the longest run of Stribeck velocities that are found to within half their value."""
    scan = np.geomspace(0.25 * request.speed_min_rad_s, request.speed_max_rad_s, _SCAN)
    best: tuple[float, float] | None = None
    begin: float | None = None
    for velocity in scan.tolist():
        member = sensitivity(STRIBECK, {**friction, "stribeck_velocity_rad_s": velocity})
        belief = replace(request.belief, friction=(member,))
        seen = expect(trajectory, belief, request.noise, settle_s=request.settle_s)
        if seen.half_widths["stribeck_velocity_rad_s"] > _SEEN * velocity:
            begin = None
            continue
        begin = velocity if begin is None else begin
        if best is None or velocity / begin >= best[1] / best[0]:
            best = (begin, velocity)
    return best
