"""The whole chain: signals of one axis in, an honest estimate out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify import diagnosis
from agent.identify.detail import RecordingDetail, detail_of
from agent.identify.friction_curve import CurveFit, friction_curve
from agent.identify.friction_models import fit_friction_models
from agent.identify.passes import PositionTorque
from agent.identify.preprocess import Motion, filter_motion, read_motion, shared_cutoff
from agent.identify.result import (
    Estimate,
    FrictionModelFit,
    Parameter,
    Quality,
    RigidBodyFit,
)
from agent.identify.rigid_body import (
    Rows,
    collect_rows,
    fit_rigid_body,
    validate,
    weights,
)
from agent.identify.sentence import verdict
from agent.identify.signals import Signals
from agent.identify.windows import SteadyWindow, find_windows
from agent.physics.rigid_body import PARAMETERS
from agent.physics.twin import Twin

_MOSTLY_STEADY = 0.2  # of the moving samples
_HALVINGS = 2
_FIRM_INERTIA = 0.03
_SAME_INERTIA = 0.01


@dataclass(frozen=True)
class Identification:
    """An estimate together with the arrays that it came from.

    `details` belong to the recordings in order; `validation_detail` to the unseen run.
    """

    estimate: Estimate
    details: tuple[RecordingDetail, ...]
    validation_detail: RecordingDetail | None = None
    cutoff_hz: float = float("nan")


def estimate(
    signals: Sequence[Signals],
    *,
    validation: Signals | None = None,
    cutoff_hz: float | None = None,
) -> Estimate:
    """Estimate friction curve, friction law and rigid body of one axis.

    Parameters
    ----------
    signals : sequence of Signals
        One or more recordings of the same axis.
    validation : Signals, optional
        A run that is predicted, never fitted.
    cutoff_hz : float, optional
        Of the low-pass; chosen from the data without it (`lowpass.choose_cutoff`).

    Raises
    ------
    ValueError
        There is no recording, or the cutoff is not above zero.
    """
    return identify(signals, validation=validation, cutoff_hz=cutoff_hz).estimate


def identify(
    signals: Sequence[Signals],
    *,
    validation: Signals | None = None,
    cutoff_hz: float | None = None,
) -> Identification:
    """Do what `estimate` does, and keep the arrays for pictures. Same parameters and errors."""
    if not signals:
        raise ValueError("expected at least one recording, got none")
    if cutoff_hz is not None and not cutoff_hz > 0.0:
        raise ValueError(f"expected a cutoff above 0 Hz, got {cutoff_hz}")
    motions = [read_motion(s) for s in signals]
    windows = [w for i, motion in enumerate(motions) for w in find_windows(motion, i)]
    refused = diagnosis.refusals(motions)
    if refused:
        return _undecided(motions, windows, refused)
    regression = _regress(motions, cutoff_hz)
    body, chosen_hz = regression.body, regression.cutoff_hz
    inertia = None if body is None else body.parameters["inertia_kg_m2"]
    known_kg_m2 = inertia.value if inertia is not None and inertia.identified else 0.0
    curve = friction_curve(motions, windows, _position_torque(body), known_kg_m2)
    models = () if curve is None else fit_friction_models(curve)
    reasons = _undecidable(curve, models, regression, windows)
    if reasons:
        return _undecided(motions, windows, reasons)
    unseen = None if validation is None or body is None else read_motion(validation)
    validated = None
    if unseen is not None and body is not None:
        validated = validate(body, rows_of([unseen], chosen_hz), unseen.signals.name)
    notes = [note for motion in motions for note in motion.notes]
    notes += [] if curve is None else list(curve.notes)
    notes += regression.notes
    if not models:
        notes.append(f"no friction curve: {diagnosis.no_curve(windows)}")
    result = Estimate(
        recordings=tuple(s.name for s in signals),
        decidable=True,
        reasons=(),
        quality=_quality(motions),
        friction_curve=curve.curve if curve is not None and models else None,
        friction_models=models,
        rigid_body=body,
        validation=validated,
        sentence=verdict(models, body),
        notes=tuple(notes),
    )
    details = tuple(
        detail_of(m, [w for w in windows if w.recording == i], chosen_hz, body)
        for i, m in enumerate(motions)
    )
    seen = None if unseen is None else detail_of(unseen, find_windows(unseen), chosen_hz, body)
    return Identification(result, details, seen, chosen_hz)


@dataclass(frozen=True)
class _Regression:
    """The rigid body's fit, the rows and the cutoff that it was made with."""

    cutoff_hz: float
    rows: Rows
    body: RigidBodyFit | None
    notes: tuple[str, ...]


def _regress(motions: Sequence[Motion], asked_hz: float | None) -> _Regression:
    """Fit the rigid body; below an arm's resonance, if the inertia shows that there is one.

    A flexible arm seems heavier the closer the motion comes to its resonance. Without a cutoff
    asked for, the rigid fit is repeated at half the cutoff; while a well-determined inertia
    differs by more than 1 %, the lower cutoff is taken, at most twice. What is left of the spring
    there, to the first order, may then take part in the fit.
    """
    cutoff = shared_cutoff(motions)
    share = cutoff.noise_share if asked_hz is None else 0.0
    chosen_hz = cutoff.frequency_hz if asked_hz is None else asked_hz
    rows = rows_of(motions, chosen_hz, share)
    rigid = fit_rigid_body(rows, spring=False)
    notes: list[str] = []
    for _ in range(_HALVINGS if asked_hz is None else 0):
        lower_rows = rows_of(motions, chosen_hz / 2.0, share)
        lower = fit_rigid_body(lower_rows, spring=False)
        if rigid is None or lower is None or not _resonance_between(lower, rigid):
            break
        chosen_hz, rows, rigid = chosen_hz / 2.0, lower_rows, lower
        notes = [
            "the inertia changes with frequency: the arm is flexible, and the cutoff was halved"
        ]
    body = fit_rigid_body(rows)
    if body is not None and rigid is not None and _theta(body) != _theta(rigid):
        notes.append(
            "the torque shows a spring between motor and arm; its first term took part in the "
            "rigid body's fit"
        )
    notes.append(f"signals and regressors were low-passed alike at {chosen_hz:.3g} Hz")
    return _Regression(chosen_hz, rows, body, tuple(notes))


def _theta(fit: RigidBodyFit) -> list[float]:
    return [float(w) for w in weights(fit)]


def _resonance_between(lower: RigidBodyFit, upper: RigidBodyFit) -> bool:
    """Whether a well-determined inertia differs between a lower and a higher cutoff."""
    slow, fast = lower.parameters["inertia_kg_m2"], upper.parameters["inertia_kg_m2"]
    if slow.ci95 is None or fast.ci95 is None or slow.value <= 0.0:
        return False
    margin = (slow.ci95[1] - slow.ci95[0]) / 2.0
    difference = abs(fast.value - slow.value)
    return margin < _FIRM_INERTIA * slow.value and difference > max(
        _SAME_INERTIA * slow.value, margin
    )


def twin_from_estimate(result: Estimate, *, robot: str, axis: int, gear_ratio: float) -> Twin:
    """Return the plain twin (rigid body, gravity, Coulomb, viscous) of an estimate.

    What was not identified is zero in the twin, and listed under `not_identified`.

    Raises
    ------
    ValueError
        The estimate is not decidable, or its friction is not physical.
    """
    if not result.decidable:
        raise ValueError(f"no twin can be made: {'; '.join(result.reasons)}")
    source = dict(result.rigid_body.parameters) if result.rigid_body is not None else {}
    friction_names = ("coulomb_nm", "viscous_nm_s_per_rad")
    if not all(name in source and source[name].identified for name in friction_names):
        plain = next((m for m in result.friction_models if m.model == "coulomb-viscous"), None)
        source |= dict(plain.parameters) if plain is not None else {}
    names = (*friction_names, "inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm")
    missing = [n for n in names if n not in source or not source[n].identified]
    values = {n: 0.0 if n in missing else float(source[n].value) for n in names}
    return Twin(
        robot=robot,
        axis=axis,
        gear_ratio=gear_ratio,
        inertia_kg_m2=values["inertia_kg_m2"],
        coulomb_nm=values["coulomb_nm"],
        viscous_nm_s_per_rad=values["viscous_nm_s_per_rad"],
        gravity_sin_nm=values["gravity_sin_nm"],
        gravity_cos_nm=values["gravity_cos_nm"],
        extra={"not_identified": missing} if missing else {},
    )


def rows_of(motions: Sequence[Motion], cutoff_hz: float, noise_share: float = 0.0) -> Rows:
    """Filter all recordings of an axis and collect their usable rows.

    Parameters
    ----------
    motions : sequence of Motion
        From `read_motion`.
    cutoff_hz : float
        Of the low-pass.
    noise_share : float
        Measuring noise in the filtered acceleration, as a share of its root mean square.
    """
    stretches = [s for motion in motions for s in filter_motion(motion, cutoff_hz)]
    ends = [
        (float(q.min()), float(q.max()))
        for m in motions
        if m.signals.position_rad is not None
        for q in [m.signals.position_rad[m.signals.valid] / m.signals.gear_ratio]
    ]
    # Gravity needs the position of every row; one recording without it takes the columns away.
    complete = len(ends) == len(motions)
    stroke = max(e[1] for e in ends) - min(e[0] for e in ends) if complete else float("nan")
    return collect_rows(stretches, stroke, noise_share)


def _position_torque(body: RigidBodyFit | None) -> PositionTorque | None:
    """Return gravity and offset for speeds whose passes do not meet."""
    if body is None or not body.parameters["torque_offset_nm"].identified:
        return None
    if not body.parameters["coulomb_nm"].identified:
        return None
    values = dict(zip(PARAMETERS, weights(body).tolist(), strict=True))
    return PositionTorque(
        values["gravity_sin_nm"], values["gravity_cos_nm"], values["torque_offset_nm"]
    )


def _undecidable(
    curve: CurveFit | None,
    models: Sequence[FrictionModelFit],
    regression: _Regression,
    windows: Sequence[SteadyWindow],
) -> tuple[str, ...]:
    """Return why neither the curve nor the regression carries the friction.

    Motion that is steady, but at too few speeds or in one direction, is refused: what little its
    ramps say about friction depends on the law being right there. Motion without steady speeds
    is regressed as a whole.
    """
    backwards = ("friction comes out negative: torque and velocity have opposite signs",)
    if models:
        assert curve is not None
        return backwards if np.all(curve.curve.friction_nm < 0.0) else ()
    body, moving = regression.body, regression.rows.torque_nm.shape[0]
    steady = sum(w.stop - w.start for w in windows) > _MOSTLY_STEADY * moving
    if body is None or steady:
        return (diagnosis.no_curve(windows),)
    coulomb = body.parameters["coulomb_nm"]
    if not _is_firm(coulomb):
        return (
            diagnosis.no_curve(windows),
            "the motion as a whole does not carry the Coulomb friction either",
        )
    return backwards if coulomb.value < 0.0 else ()


def _is_firm(parameter: Parameter) -> bool:
    """Whether a parameter's interval is narrower than half of its value, to either side."""
    if not parameter.identified or parameter.ci95 is None:
        return False
    return (parameter.ci95[1] - parameter.ci95[0]) / 2.0 < 0.5 * abs(parameter.value)


def _undecided(
    motions: Sequence[Motion], windows: Sequence[SteadyWindow], reasons: tuple[str, ...]
) -> Identification:
    """Return an estimate that says why there is none."""
    result = Estimate(
        recordings=tuple(m.signals.name for m in motions),
        decidable=False,
        reasons=reasons,
        quality=_quality(motions),
        sentence=f"Not decidable: {'; '.join(reasons)}.",
        notes=tuple(note for motion in motions for note in motion.notes),
    )
    details = tuple(
        detail_of(m, [w for w in windows if w.recording == i], None, None)
        for i, m in enumerate(motions)
    )
    return Identification(result, details)


def _quality(motions: Sequence[Motion]) -> Quality:
    """Return what all recordings together stand on."""
    rates = [m.timing.sample_rate_hz for m in motions]
    temperatures = [
        t[np.isfinite(t)]
        for t in (m.signals.gearbox_temperature_degc for m in motions)
        if t is not None
    ]
    known = np.concatenate(temperatures) if temperatures else np.zeros(0)
    return Quality(
        samples=sum(m.signals.time_s.shape[0] for m in motions),
        samples_lost=sum(m.signals.samples_lost for m in motions),
        masked=sum(int(np.count_nonzero(~m.signals.valid)) for m in motions),
        sample_rate_hz=float(np.median(rates)),
        jitter_s=max(m.timing.jitter_s for m in motions),
        temperature_degc=(float(known.min()), float(known.max())) if known.size else None,
    )
