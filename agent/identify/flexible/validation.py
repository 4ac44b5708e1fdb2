"""How a flexible and a rigid joint explain a run that neither has seen (thesis 4.3.1).

Two questions are asked of both. *Torque*: which torque does the measured motion need? *Velocity*:
which motion does the measured torque cause? The second is the thesis' own; errors of the torque
add up in it over the whole run, as they do in an open loop.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.identify.flexible.chain import shape_of
from agent.identify.flexible.preparation import Prepared, prepare, tracks_of
from agent.identify.flexible.projection import Point, Problem
from agent.identify.flexible.result import FlexibleFit
from agent.identify.flexible.simulation import FlexibleJoint, simulate
from agent.identify.flexible.stiff_spring import stiffening_torque
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.physics.friction import LAWS

_TURNS = 40  # of a stiffening spring's twist and the free motion that it is known from
_SETTLED = 1e-3  # relative change of the squared error


@dataclass(frozen=True)
class Agreement:
    """How one model agrees with one recording; contract section 6 defines `fit_percent`.

    `torque_rmse_nm` and `torque_fit_percent` are over the moving samples in the band of the fit,
    `velocity_fit_percent` over all samples of the simulated motion.
    """

    torque_rmse_nm: float
    torque_fit_percent: float
    velocity_fit_percent: float

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON; what is not a number is null."""
        return {name: value if math.isfinite(value) else None for name, value in vars(self).items()}


@dataclass(frozen=True)
class FlexibleValidation:
    """Both models on one recording."""

    recording: str
    flexible: Agreement
    rigid: Agreement

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "recording": self.recording,
            "flexible": self.flexible.to_json(),
            "rigid": self.rigid.to_json(),
        }


def validate(fit: FlexibleFit, recording: Signals) -> FlexibleValidation:
    """Compare the flexible and the rigid joint of a fit on another recording.

    Raises
    ------
    ValueError
        The fit is not decidable, or the recording is too short for its filter.
    """
    if fit.joint is None or fit.rigid is None:
        raise ValueError(f"there is nothing to validate: {'; '.join(fit.reasons)}")
    ready = (prepare(t, fit.cutoff_hz) for t in tracks_of(recording))
    stretches = tuple(p for p in ready if p is not None and p.usable.any())
    if not stretches:
        raise ValueError(f"{recording.name}: too short, or never moving, for a validation")
    return FlexibleValidation(
        recording.name,
        _agreement(stretches, fit, fit.joint),
        _agreement(stretches, fit, fit.rigid),
    )


def predicted_torque(
    stretches: tuple[Prepared, ...], fit: FlexibleFit, joint: FlexibleJoint
) -> tuple[Floats, Floats]:
    """Return measured and predicted torque, shape (n,), in the band of the fit.

    The chain's motion at the beginning of every stretch is unknown and is taken from the stretch.
    """
    law = LAWS[fit.friction]
    chain = joint.chain
    problem = Problem(stretches, None if chain is None else fit.kind, law, has_gravity=True)
    shape = np.zeros(0) if chain is None else shape_of(chain)
    nonlinear = [math.log(getattr(joint, name)) for name in law.nonlinear]
    search = np.concatenate((shape, nonlinear, [fit.parameters["torque_delay_s"].value]))
    inertias = [joint.motor_inertia_kg_m2] + ([] if chain is None else [chain.total_kg_m2])
    friction = [getattr(joint, name) for name in law.linear]
    gravity = [joint.gravity_sin_nm, joint.gravity_cos_nm, joint.torque_offset_nm]
    known = np.array([*inertias, *friction, *gravity])
    cubic = joint.cubic_spring_nm_per_rad3
    stiff = np.zeros_like(problem.target)
    point = _freed(problem, search, known, stiff)
    for _ in range(_TURNS if cubic > 0.0 else 0):
        stiff = stiffening_torque(problem, point, cubic)
        point, before = _freed(problem, search, known, stiff), point
        if abs(before.cost - point.cost) < _SETTLED * point.cost:
            break
    return problem.target, problem.target - point.residual


def _freed(problem: Problem, search: Floats, known: Floats, stiff: Floats) -> Point:
    """Return the solution with known parameters, the chain's free motions alone fitted."""
    columns = problem.columns(search)
    rest = problem.target - stiff - columns[:, : known.shape[0]] @ known
    free = columns[:, known.shape[0] :]
    motions = np.linalg.lstsq(free, rest)[0] if free.shape[1] else np.zeros(0)
    rest = rest - free @ motions
    linear = np.concatenate((known, motions))
    return Point(search, linear, rest, columns, float(rest @ rest))


def _agreement(
    stretches: tuple[Prepared, ...], fit: FlexibleFit, joint: FlexibleJoint
) -> Agreement:
    measured, predicted = predicted_torque(stretches, fit, joint)
    velocity, simulated = [], []
    for p in stretches:
        track = p.track
        start = 0.0 if track.position_rad is None else float(track.position_rad[0])
        motion = simulate(
            joint,
            track.torque_nm,
            track.period_s,
            position_rad=start,
            velocity_rad_s=float(track.velocity_rad_s[0]),
        )
        velocity.append(track.velocity_rad_s)
        simulated.append(motion.velocity_rad_s)
    return Agreement(
        float(np.sqrt(np.mean((measured - predicted) ** 2))),
        _fit_percent(measured, predicted),
        _fit_percent(np.concatenate(velocity), np.concatenate(simulated)),
    )


def _fit_percent(measured: Floats, predicted: Floats) -> float:
    """Return ``100 (1 - ||y - yhat|| / ||y - mean y||)``."""
    scatter = float(np.linalg.norm(measured - measured.mean()))
    if scatter == 0.0:
        return math.nan
    return 100.0 * (1.0 - float(np.linalg.norm(measured - predicted)) / scatter)
