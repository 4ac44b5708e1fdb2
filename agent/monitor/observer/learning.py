"""The observer's model: friction and body from a dedicated cycle, noise from healthy motion."""

from __future__ import annotations

import contextlib
import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from agent.identify.result import Estimate
from agent.identify.signals.preprocess import Motion
from agent.monitor.observer.model import ObserverModel, blocks_of
from agent.monitor.observer.observer import observe

_TUNED_ON = 4  # recordings that the unknown torque's density is learned from
_HALVINGS = 14


def model_of(estimate: Estimate, motions: Sequence[Motion]) -> ObserverModel:
    """Return the observer's model from a dedicated cycle's estimate and healthy motion.

    Parameters
    ----------
    estimate : Estimate
        Of a dedicated cycle: friction curve and rigid body.
    motions : sequence of Motion
        Ordinary motion that is held to be healthy; the noise is taken from it.

    Raises
    ------
    ValueError
        The estimate carries no friction curve or no inertia, or the motion carries no filter.
    """
    curve, body = estimate.friction_curve, estimate.rigid_body
    if curve is None or curve.velocity_rad_s.size < 2:
        raise ValueError("the dedicated cycle carries no friction curve")
    if body is None or not body.parameters["inertia_kg_m2"].identified:
        raise ValueError("the dedicated cycle does not carry the inertia")
    known = {n: p.value if p.identified else 0.0 for n, p in body.parameters.items()}
    fastest = max(float(np.abs(v).max()) for m in motions for v in m.velocity_rad_s)
    noise = float(np.median([m.velocity_noise_rad_s for m in motions]))
    model = ObserverModel(
        inertia_kg_m2=known["inertia_kg_m2"],
        gravity_sin_nm=known["gravity_sin_nm"],
        gravity_cos_nm=known["gravity_cos_nm"],
        torque_offset_nm=known["torque_offset_nm"],
        speed_rad_s=curve.velocity_rad_s,
        friction_nm=curve.friction_nm,
        top_rad_s=fastest,
        torque_density_nm2_s=1e-4,
        velocity_sd_rad_s=max(noise, 1e-6 * fastest),
        position_sd_rad=max(_position_noise(motions), 1e-9 * fastest),
    )
    return _tuned(model, motions)


def _position_noise(motions: Sequence[Motion]) -> float:
    """Return the standard deviation of the position's error, from its third differences.

    A smooth motion leaves nothing of them; white error s leaves ``s sqrt(20)``. Steps of an
    encoder look alike.
    """
    found = []
    for motion in motions:
        position = motion.signals.position_rad
        if position is None:
            continue
        for stretch in motion.timing.stretches:
            third = np.diff(stretch.on_grid(motion.signals, position), n=3)
            found.append(float(np.median(np.abs(third))) / (0.6745 * math.sqrt(20.0)))
    return float(np.median(found)) if found else 0.0


def _tuned(model: ObserverModel, motions: Sequence[Motion]) -> ObserverModel:
    """Return the model with the density at which the innovations have the size they should.

    Their mean square falls as the density grows; bisection on the density's logarithm.
    """
    blocks = []
    for motion in motions:
        with contextlib.suppress(ValueError):  # the band says which recordings it cannot follow
            blocks.append(blocks_of(motion, model))
    blocks = blocks[:_TUNED_ON]
    if not blocks:
        raise ValueError("the observer can follow none of the healthy recordings")

    def mean_nis(log_density: float) -> float:
        tried = replace(model, torque_density_nm2_s=math.exp(log_density))
        squares = [np.sum(observe(b, tried).judged() ** 2, axis=1) for b in blocks]
        return float(np.nanmean(np.concatenate(squares)))

    low, high = math.log(1e-10), math.log(1e2)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if mean_nis(middle) > 2.0 else (low, middle)
    return replace(model, torque_density_nm2_s=math.exp(0.5 * (low + high)))
