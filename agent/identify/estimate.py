"""The whole chain: signals of one axis in, an honest estimate out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.acquisition import total
from agent.identify import diagnosis
from agent.identify.detail import RecordingDetail, detail_of
from agent.identify.friction.curve import CurveFit, friction_curve
from agent.identify.friction.models import fit_friction_models
from agent.identify.friction.passes import PositionTorque
from agent.identify.objections import jumps, objections, too_few_speeds, too_slow
from agent.identify.possible import possible_body, possible_models
from agent.identify.result import (
    Estimate,
    FrictionModelFit,
    Parameter,
    Quality,
    RigidBodyFit,
)
from agent.identify.rigid.alike import mixed_units
from agent.identify.rigid.beside_law import NOTE, beside_law
from agent.identify.rigid.body import validate, weights, without_negative_inertia
from agent.identify.rigid.forward import position_error
from agent.identify.rigid.regression import Regression, regress, rows_of
from agent.identify.rigid.twin_numbers import with_twin_numbers
from agent.identify.sentence import is_method, missing_samples, verdict
from agent.identify.signals.arrays import Signals
from agent.identify.signals.glitches import without_glitches
from agent.identify.signals.preprocess import Motion, read_motion
from agent.identify.signals.repeats import held_of, repeats, said_of, with_motion_between
from agent.identify.signals.windows import SteadyWindow, find_windows
from agent.identify.signals.wrapped import counted_on
from agent.identify.slips import slips_said
from agent.physics.rigid_body import PARAMETERS
from agent.physics.twin import Twin

_FEWEST_SPEEDS = 3
_MOSTLY_STEADY = 0.2  # of the moving samples


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
    motions = [_motion_of(s) for s in signals]
    windows = [w for i, motion in enumerate(motions) for w in find_windows(motion, i)]
    refused = diagnosis.refusals(motions)
    refused = (*refused, *_objections(motions, windows, refused))
    mixed = "" if refused else mixed_units(motions)
    refused = (mixed,) if mixed else refused
    if refused:
        return _undecided(motions, windows, refused)
    regression = regress(motions, cutoff_hz)
    body, chosen_hz = regression.body, regression.cutoff_hz
    inertia = None if body is None else body.parameters["inertia_kg_m2"]
    known_kg_m2 = inertia.value if inertia is not None and inertia.identified else 0.0
    curve = friction_curve(motions, windows, _position_torque(body), known_kg_m2)
    models = () if curve is None else fit_friction_models(curve)
    reasons = _undecidable(curve, models, regression, motions, windows)
    if reasons:
        return _undecided(motions, windows, reasons)
    body = with_twin_numbers(beside_law(regression, models), regression.rows, models)
    body = possible_body(None if body is None else without_negative_inertia(body))
    models = possible_models(models)
    unseen = None if validation is None or body is None else _motion_of(validation)
    validated = None
    if unseen is not None and body is not None:
        validated = replace(
            validate(body, rows_of([unseen], chosen_hz), unseen.signals.name),
            position=position_error(body, motions, unseen),
        )
    notes = [note for motion in motions for note in motion.notes]
    notes += [*diagnosis.unlikely_units(motions), *diagnosis.coasts_too_long(motions, body)]
    notes += slips_said([motion.signals for motion in motions])
    scaled = diagnosis.scaled_velocity(motions)
    notes += [scaled] if scaled else []
    notes += [] if models else [f"no friction curve: {diagnosis.no_curve(windows)}"]
    notes += regression.notes
    notes += [NOTE] if body is not None and body.straight_line else []
    notes += [] if curve is None else list(curve.notes)
    del regression  # its rows are as large as the recordings
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
        notes=_in_order([*signals, *([] if validation is None else [validation])], notes),
    )
    details = tuple(
        detail_of(m, [w for w in windows if w.recording == i], chosen_hz, body)
        for i, m in enumerate(motions)
    )
    seen = None if unseen is None else detail_of(unseen, find_windows(unseen), chosen_hz, body)
    return Identification(result, details, seen, chosen_hz)


def _in_order(signals: Sequence[Signals], notes: Sequence[str]) -> tuple[str, ...]:
    """Return all notes: first what is missing, last how was computed."""
    missing = [note for s in signals for note in missing_samples(s)]
    return (*missing, *sorted(notes, key=is_method))


def _motion_of(signals: Signals) -> Motion:
    """Return a recording's motion without rows that say nothing or stand alone: its notes tell."""
    counted = counted_on(signals)
    signals = counted.signals
    twice = repeats(signals)
    again = int(np.count_nonzero(twice))
    # Not cut out: what is shown of a recording stands at its own samples.
    once = replace(signals, valid=signals.valid & ~twice) if again else signals
    moving, held = with_motion_between(once)
    kept, alone = without_glitches(moving)
    motion, rows = read_motion(kept), twice.shape[0]
    said = (counted.said, said_of(again, rows) if again else "", held_of(held, rows))
    notes = [f"{signals.name}: {sentence}" for sentence in said if sentence]
    notes += [alone] if alone else []
    return replace(motion, notes=(*notes, *motion.notes))


def twin_from_estimate(result: Estimate, *, robot: str, axis: int, gear_ratio: float) -> Twin:
    """Return the plain twin (rigid body, gravity, Coulomb, viscous) of an estimate.

    What was not identified is zero in the twin, and listed under `not_identified`. A twin has no
    constant torque, no inertia below zero and no friction that pushes: where the data show none,
    its numbers are those of a fit without. Where friction is bent, its friction is the best
    straight line.

    Raises
    ------
    ValueError
        The estimate is not decidable, or its friction is not physical.
    """
    if not result.decidable:
        raise ValueError(f"no twin can be made: {'; '.join(result.reasons)}")
    body = result.rigid_body
    source = {} if body is None else dict(body.parameters)
    source |= {} if body is None else {n: Parameter(v, None) for n, v in body.straight_line.items()}
    friction_names = ("coulomb_nm", "viscous_nm_s_per_rad")
    if not all(name in source and source[name].identified for name in friction_names):
        plain = next((m for m in result.friction_models if m.model == "coulomb-viscous"), None)
        source |= dict(plain.parameters) if plain is not None else {}
    names = (*friction_names, "inertia_kg_m2", "gravity_sin_nm", "gravity_cos_nm")
    bare = {} if body is None else body.as_twin
    left = {n for n in names if bare and body and body.parameters[n].identified} - set(bare)
    missing = [n for n in names if n in left or n not in source or not source[n].identified]
    values = {n: 0.0 if n in missing else bare.get(n, float(source[n].value)) for n in names}
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


def _objections(
    motions: Sequence[Motion], windows: Sequence[SteadyWindow], said: Sequence[str]
) -> list[str]:
    """Return what speaks against each recording, one by one, beside what has been said."""
    found = [
        text
        for i, motion in enumerate(motions)
        for text in objections(motion, [w for w in windows if w.recording == i])
    ]
    if any("cut off at a limit" in reason for reason in said):
        return [text for text in found if "cut off at a limit" not in text]
    return found


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
    regression: Regression,
    motions: Sequence[Motion],
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
        speeds = curve.curve.velocity_rad_s
        if speeds.size < _FEWEST_SPEEDS:
            return (too_few_speeds(speeds.tolist()),)
        return backwards if np.all(curve.curve.friction_nm < 0.0) else ()
    body, moving = regression.body, regression.rows.torque_nm.shape[0]
    steady = sum(w.stop - w.start for w in windows) > _MOSTLY_STEADY * moving
    if regression.rows.one_way:
        return (diagnosis.ONE_WAY,)
    if body is None or steady:
        return (diagnosis.no_curve(windows),)
    slow = tuple(too_slow(motion) for motion in motions if jumps(motion))
    if slow:
        return slow
    coulomb = body.parameters["coulomb_nm"]
    if not _is_firm(coulomb):
        return (
            diagnosis.no_curve(windows),
            "the motion as a whole does not carry the Coulomb friction either",
        )
    if coulomb.value < 0.0:
        return backwards
    inertia = body.parameters["inertia_kg_m2"]
    if inertia.identified and inertia.ci95 is not None and inertia.ci95[1] < 0.0:
        return ("inertia comes out negative, which no mass has: the torque is not this motion's",)
    return ()


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
        sentence=f"Not decidable, friction is not identified: {'; '.join(reasons)}.",
        notes=_in_order([m.signals for m in motions], [n for m in motions for n in m.notes]),
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
        acquisition=total(
            [m.signals.acquisition for m in motions if m.signals.acquisition is not None]
        ),
    )
