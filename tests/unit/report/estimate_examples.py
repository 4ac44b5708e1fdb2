"""Estimates as identify would make them, with the thesis's numbers, for the report's tests."""

from __future__ import annotations

import dataclasses

import numpy as np

from agent.identify.result import (
    Estimate,
    Floats,
    FrictionCurve,
    FrictionModelFit,
    Parameter,
    Quality,
    RigidBodyFit,
    Validation,
)
from agent.identify.signals.arrays import Signals
from agent.identify.signals.windows import SteadyWindow
from agent.physics.friction import COULOMB_VISCOUS, FEENY_MOON, STRIBECK, FrictionLaw
from agent.report.views import EstimateViews, RecordingView

RATE_HZ = 1000.0
STEP_S = 2.0
SPEEDS_RAD_S = np.geomspace(1.0, 60.0, 10)
GEAR_RATIO = 224.0
INERTIA_KG_M2 = 0.0184
TRUTH = {
    "coulomb_nm": 0.6042,
    "viscous_nm_s_per_rad": 0.0107,
    "static_extra_nm": 0.12,
    "stribeck_velocity_rad_s": 7.0,
    "exponent": 1.3,
}
METADATA: dict[str, object] = {
    "schema": "stribeck.recording/1",
    "robot": "cell7-irb6650",
    "axis": 1,
    "gear_ratio": GEAR_RATIO,
    "started_at": "2026-03-01T02:03:04.567Z",
    "trajectory": {"name": "stair", "parameters": {"from_arm_deg": -50.0, "to_arm_deg": 50.0}},
    "drive": {"name": "EPOS4", "vendor_id": 251, "serial": 123456},
    "software": "stribeck 0.1.0",
    "coolant": {"kind": "none"},
}


def recording(
    name: str = "stair-2026-03-01.parquet",
    *,
    seed: int = 1,
    reverse: bool = False,
    position: bool = True,
    temperature: bool = True,
    gravity_nm: float = 0.0,
    windows: bool = True,
) -> RecordingView:
    """Return a 40 s stair at 1 kHz, ten speeds forward and ten backward, with its prediction."""
    rng = np.random.default_rng(seed)
    levels = np.concatenate((SPEEDS_RAD_S, -SPEEDS_RAD_S)) * (-1.0 if reverse else 1.0)
    step = int(STEP_S * RATE_HZ)
    time_s = np.arange(levels.size * step) / RATE_HZ
    command = np.repeat(levels, step)
    window = np.hanning(400)
    velocity = np.convolve(command, window / window.sum(), mode="same")
    acceleration = np.gradient(velocity, time_s)
    position_rad = np.cumsum(velocity) / RATE_HZ
    position_rad -= np.mean([position_rad.min(), position_rad.max()])
    gravity = gravity_nm * np.sin(position_rad / GEAR_RATIO)
    ripple = 0.015 * np.sin(2.0 * np.pi * position_rad / 25.0)
    noise = 0.02 * rng.standard_normal(time_s.size)
    rigid = INERTIA_KG_M2 * acceleration + gravity
    measured = rigid + STRIBECK.torque(velocity, TRUTH) + ripple + noise
    predicted = rigid + COULOMB_VISCOUS.torque(velocity, {**TRUTH, "coulomb_nm": 0.63})
    signals = Signals.from_columns(
        {
            "time_s": time_s,
            "torque_nm": measured,
            "velocity_rad_s": velocity + 0.05 * rng.standard_normal(time_s.size),
            "velocity_command_rad_s": command,
            **({"position_rad": position_rad} if position else {}),
            **(
                {"gearbox_temperature_degc": np.round(24.1 + 0.5 * time_s / time_s[-1], 2)}
                if temperature
                else {}
            ),
        },
        GEAR_RATIO,
        name=name,
    )
    steady = tuple(
        SteadyWindow(0, k * step + 450, (k + 1) * step - 450, float(level))
        for k, level in enumerate(levels)
    )
    return RecordingView(
        signals=signals,
        windows=steady if windows else (),
        velocity_rad_s=velocity,
        torque_predicted_nm=predicted,
        compared=np.abs(velocity) > 0.2,
        validation=reverse,
        started_at="2026-03-01T02:03:04.567Z",
    )


def friction_curve(gravity_nm: float = 0.0) -> FrictionCurve:
    """Return ten points on the truth with a little scatter, and their intervals."""
    rng = np.random.default_rng(3)
    half = np.full(SPEEDS_RAD_S.size, 0.004)
    friction: Floats = STRIBECK.torque(SPEEDS_RAD_S, TRUTH) + rng.normal(0.0, 0.0015, half.size)
    return FrictionCurve(
        velocity_rad_s=SPEEDS_RAD_S,
        friction_nm=friction,
        ci95_nm=np.column_stack((friction - half, friction + half)),
        gravity_nm=np.full(SPEEDS_RAD_S.size, gravity_nm),
        samples=np.full(SPEEDS_RAD_S.size, 2200, dtype=np.int64),
    )


def both_directions(curve: FrictionCurve) -> FrictionCurve:
    """Return the curve as it is when the two directions are not combined."""
    sign = np.concatenate((-np.ones(curve.samples.size), np.ones(curve.samples.size)))
    order = np.concatenate((np.arange(curve.samples.size)[::-1], np.arange(curve.samples.size)))
    return FrictionCurve(
        velocity_rad_s=sign * curve.velocity_rad_s[order],
        friction_nm=sign * curve.friction_nm[order],
        ci95_nm=np.sort(sign[:, None] * curve.ci95_nm[order], axis=1),
        gravity_nm=curve.gravity_nm[order],
        samples=curve.samples[order],
    )


def known(value: float, half_width: float) -> Parameter:
    """Return an identified parameter with a symmetric interval."""
    return Parameter(value, (value - half_width, value + half_width))


def friction_models() -> tuple[FrictionModelFit, ...]:
    """Return the three laws of the contract, Stribeck selected."""
    stribeck = {
        "coulomb_nm": known(0.6042, 0.0049),
        "viscous_nm_s_per_rad": known(0.0107, 0.00013),
        "static_extra_nm": known(0.1203, 0.0072),
        "stribeck_velocity_rad_s": known(7.03, 0.61),
        "exponent": known(1.31, 0.16),
    }
    simple = {
        "coulomb_nm": known(0.6421, 0.0312),
        "viscous_nm_s_per_rad": known(0.0097, 0.0011),
    }
    feeny_moon = {
        "coulomb_nm": known(0.7153, 0.0085),
        "viscous_nm_s_per_rad": known(0.0106, 0.0002),
        "mu": known(0.842, 0.013),
        "beta_s_per_rad": known(0.197, 0.031),
    }

    def fit(
        law: FrictionLaw,
        parameters: dict[str, Parameter],
        numbers: tuple[float, float, float],
        reason: str,
    ) -> FrictionModelFit:
        rmse_nm, fit_percent, bic = numbers
        selected = law is STRIBECK
        return FrictionModelFit(law.name, selected, rmse_nm, fit_percent, bic, parameters, reason)

    return (
        fit(
            COULOMB_VISCOUS,
            simple,
            (0.0318, 83.1, -64.4),
            "misses the rise of friction towards standstill",
        ),
        fit(STRIBECK, stribeck, (0.00152, 99.2, -118.2), "lowest BIC, all parameters identified"),
        fit(FEENY_MOON, feeny_moon, (0.00487, 97.4, -97.3), "BIC 20.9 above the best"),
    )


def estimate(*, gravity_nm: float = 0.0, gravity_known: bool = True) -> Estimate:
    """Return a decided estimate with the thesis's numbers (Table 4.1)."""
    absent = Parameter.not_identified("the recording has no position", 0.0173)
    rigid = RigidBodyFit(
        {
            "inertia_kg_m2": known(INERTIA_KG_M2, 0.0002),
            "coulomb_nm": known(0.6302, 0.0849),
            "viscous_nm_s_per_rad": known(0.0107, 0.0007),
            "gravity_sin_nm": known(gravity_nm, 0.0046) if gravity_known else absent,
            "gravity_cos_nm": known(-0.0004, 0.0052) if gravity_known else absent,
            "torque_offset_nm": known(0.0021, 0.0038),
        },
        condition_number=400.47,
        rmse_nm=0.0412,
        fit_percent=95.3,
    )
    return Estimate(
        recordings=("stair-2026-03-01.parquet",),
        decidable=True,
        reasons=(),
        quality=Quality(40000, 0, 12, 1000.0, 0.00004, (24.1, 24.6)),
        friction_curve=friction_curve(0.98 * gravity_nm * 0.1),
        friction_models=friction_models(),
        rigid_body=rigid,
        sentence=(
            "The joint's Coulomb friction is 0.6042 ± 0.0049 N m and its viscous friction "
            "10.70 ± 0.13 mN m s/rad; below 14 rad/s friction rises (Stribeck)."
        ),
    )


def decided() -> tuple[Estimate, EstimateViews]:
    """Return the plain case: one recording, everything identified."""
    return estimate(), EstimateViews((recording(),))


def validated() -> tuple[Estimate, EstimateViews]:
    """Return two recordings, the second reversed and not seen by the estimate, with gravity."""
    second = "reversed-2026-03-01.parquet"
    made = dataclasses.replace(
        estimate(gravity_nm=0.412),
        recordings=("stair-2026-03-01.parquet",),
        validation=Validation(second, 0.0437, 94.8, 4.1),
        notes=("The two recordings lie 0.3 °C apart.",),
    )
    views = (
        recording(gravity_nm=0.412),
        recording(second, seed=2, reverse=True, gravity_nm=0.412),
    )
    return made, EstimateViews(views)


def velocity_only() -> tuple[Estimate, EstimateViews]:
    """Return a drive's recording without position and temperature, friction in both directions."""
    made = estimate(gravity_known=False)
    quality = dataclasses.replace(made.quality, temperature_degc=None, samples_lost=37)
    curve = both_directions(friction_curve())
    view = recording("drive1.parquet", position=False, temperature=False)
    return (
        dataclasses.replace(made, quality=quality, friction_curve=curve, sentence=""),
        EstimateViews((view,)),
    )


def undecided() -> tuple[Estimate, EstimateViews]:
    """Return what a production log gives: reasons, and, wrongly handed over, numbers."""
    made = dataclasses.replace(
        estimate(),
        decidable=False,
        reasons=(
            "the sample rate of 1 Hz is too slow: at least 100 Hz are needed",
            "no steady window was found in either direction",
        ),
        sentence="",
        recordings=("ur3-production.parquet",),
    )
    view = recording("ur3-production.parquet", windows=False)
    return made, EstimateViews((dataclasses.replace(view, torque_predicted_nm=None),))
