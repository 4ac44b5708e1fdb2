"""How close the estimators come to the information that the data hold, on a rigid joint.

The Cramer-Rao bound is computed here from the prescribed motion and the noise that was added:
for white torque noise of variance s^2 and a linear model it is ``s^2 (F' F)^-1``, F without noise.
"""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np

from agent.identify.estimate import estimate
from agent.identify.result import Parameter
from tests.science.identify_plant import Floats, Joint, Motion, record, stair

NOISE_NM = 0.05
VELOCITY_NOISE_RAD_S = 0.002
JOINT = Joint()
_GIVEN = 0.98  # of the seeds: a fall that is seen and not there may leave its law few numbers
# As in the thesis: twenty steady velocities in forty seconds, two seconds for each.
# The ramp has an odd number of samples: none is exactly at zero speed, where friction has no sign.
MOTION = stair(rate_hz=250.0, stroke_rad=1e9, longest_s=1.75, ramp_s=0.252, start_rad=-120.0)

BODY = (
    "inertia_kg_m2",
    "viscous_nm_s_per_rad",
    "coulomb_nm",
    "gravity_sin_nm",
    "gravity_cos_nm",
    "torque_offset_nm",
)
CURVE = ("coulomb_nm", "viscous_nm_s_per_rad")


@dataclass(frozen=True)
class Score:
    """One parameter over many seeds: coverage of its 95 % interval, error against the bound.

    `bound` is that of all samples that carry the parameter, `used` that of those which the
    estimate's steady windows kept, NaN where there are none.
    """

    fit: str
    parameter: str
    truth: float
    coverage: float
    rmse: float
    bound: float
    used: float = math.nan

    @property
    def ratio(self) -> float:
        return self.rmse / self.bound

    @property
    def ratio_of_used(self) -> float:
        return self.rmse / self.used


def body_bound(joint: Joint, motion: Motion, noise_nm: float) -> dict[str, float]:
    """Return the bound for every parameter of the regression, all moving samples."""
    moving = motion.velocity_rad_s != 0.0
    arm = motion.position_rad / joint.gear_ratio
    columns = np.column_stack(
        (
            motion.acceleration_rad_s2,
            motion.velocity_rad_s,
            np.sign(motion.velocity_rad_s),
            np.sin(arm),
            np.cos(arm),
            np.ones_like(arm),
        )
    )
    return dict(zip(BODY, deviations(columns[moving], noise_nm), strict=True))


def curve_bound(speed: Floats, samples: Floats, noise_nm: float) -> dict[str, float]:
    """Return the bound for the law of a friction curve, from all samples of steady velocity.

    Which of them the windows keep is a loss of the estimator, not of the data. The curve takes half
    the difference of two directions at one speed: a point of n samples in all, half of them each
    way, has the variance ``s^2/n``.
    """
    root = np.sqrt(samples)
    columns = np.column_stack((np.ones_like(speed), speed)) * root[:, np.newaxis]
    return dict(zip(CURVE, deviations(columns, noise_nm), strict=True))


def steady_samples(motion: Motion) -> tuple[Floats, Floats]:
    """Return the stair's speeds and for how many samples, both ways, each is held."""
    speed = np.abs(motion.velocity_rad_s)
    steady = (np.abs(motion.acceleration_rad_s2) < 1e-6) & (speed > 0.0)
    levels, counts = np.unique(speed[steady], return_counts=True)
    return levels, counts.astype(np.float64)


def deviations(columns: Floats, noise_nm: float) -> list[float]:
    size = np.linalg.norm(columns, axis=0)
    inverse = np.linalg.inv((columns / size).T @ (columns / size))
    return [float(x) for x in noise_nm * np.sqrt(np.diag(inverse)) / size]


FALL = Joint(static_extra_nm=0.4, stribeck_velocity_rad_s=12.0, exponent=1.3)
FALL_NOISE_NM = 0.0175
LAW = (*CURVE, "static_extra_nm", "stribeck_velocity_rad_s", "exponent")


def law_campaign(seeds: Iterable[int]) -> list[Score]:
    """Score Stribeck's law with its exponent free, from 24 speeds of which the fast are noisier."""
    motion = stair(np.geomspace(1.0, 140.0, 24).tolist(), rate_hz=125.0)
    speed, samples = steady_samples(motion)
    laws: list[Mapping[str, Parameter]] = []
    used: list[Floats] = []
    for seed in seeds:
        signals = record(
            FALL,
            motion,
            seed=seed,
            noise_nm=FALL_NOISE_NM,
            memory=0.0,
            velocity_noise_rad_s=VELOCITY_NOISE_RAD_S,
        )
        result = estimate([signals])
        model = result.selected_model
        assert model is not None
        assert result.friction_curve is not None
        assert model.model == "stribeck", seed
        laws.append(model.parameters)
        if result.friction_curve.samples.size == speed.size:
            used.append(result.friction_curve.samples.astype(np.float64))
    truth = np.array([getattr(FALL, name) for name in LAW])

    def friction(x: Floats) -> Floats:
        return np.asarray(x[0] + x[1] * speed + x[2] * np.exp(-((speed / x[3]) ** x[4])))

    steps = 1e-5 * np.diag(truth)
    slopes = [(friction(truth + h) - friction(truth - h)) / (2.0 * h.max()) for h in steps]

    def bound(counts: Floats) -> dict[str, float]:
        columns = np.stack(slopes, axis=1) * np.sqrt(counts)[:, np.newaxis]
        return dict(zip(LAW, deviations(columns, FALL_NOISE_NM), strict=True))

    everything, kept = bound(samples), bound(np.mean(used, axis=0))
    return [_score("stribeck", laws, n, FALL, everything[n], kept[n]) for n in LAW]


def campaign(seeds: Iterable[int], joint: Joint = JOINT, motion: Motion = MOTION) -> list[Score]:
    """Estimate once for every seed and score what was identified."""
    bodies: list[Mapping[str, Parameter]] = []
    laws: list[Mapping[str, Parameter]] = []
    used: list[Floats] = []
    for seed in seeds:
        signals = record(
            joint,
            motion,
            seed=seed,
            noise_nm=NOISE_NM,
            memory=0.0,
            velocity_noise_rad_s=VELOCITY_NOISE_RAD_S,
        )
        result = estimate([signals])
        assert result.rigid_body is not None
        assert result.friction_curve is not None
        bodies.append(result.rigid_body.parameters)
        laws.append(result.friction_models[0].parameters)
        used.append(result.friction_curve.samples.astype(np.float64))
    body = body_bound(joint, motion, NOISE_NM)
    speed, samples = steady_samples(motion)
    curve = curve_bound(speed, samples, NOISE_NM)
    kept = curve_bound(speed, np.mean(used, axis=0), NOISE_NM)
    return [_score("rigid body", bodies, n, joint, body[n]) for n in BODY] + [
        _score("friction curve", laws, n, joint, curve[n], kept[n]) for n in CURVE
    ]


def _score(
    fit: str,
    found: list[Mapping[str, Parameter]],
    name: str,
    joint: Joint,
    bound: float,
    used: float = math.nan,
) -> Score:
    truth = joint.offset_nm if name == "torque_offset_nm" else float(getattr(joint, name))
    parameters = [p[name] for p in found if p[name].identified]
    assert len(parameters) > _GIVEN * len(found), name
    values = np.array([p.value for p in parameters])
    ends = np.array([p.ci95 for p in parameters])
    covered = (ends[:, 0] <= truth) & (truth <= ends[:, 1])
    rmse = float(np.sqrt(np.mean((values - truth) ** 2)))
    return Score(fit, name, truth, float(np.mean(covered)), rmse, bound, used)
