"""From recordings to one flexible joint: friction's law, gravity and masses chosen, validated.

A richer model is taken when it gains more than its parameters' worth of chance and leaves visibly
less of the torque, and when the recordings carry what it adds; otherwise the plainer one stands.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np

from agent.cli.identify.flexible_periods import Source, source_of
from agent.conclude.outcome import signals_of
from agent.identify.flexible.fit import Options, fit_flexible
from agent.identify.flexible.preparation import prepare, tracks_of
from agent.identify.flexible.result import FlexibleFit
from agent.identify.flexible.validation import FlexibleValidation, predicted_torque, validate
from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.uncertainty import correlation_time
from agent.physics.friction import STRIBECK
from agent.record.recording import Recording

Choice = Literal["two-mass", "three-mass", "auto"]

_TRIAL_STARTS = 3
_EVIDENCE = 5.0  # log-likelihood that every parameter of a richer model must gain
_LESS = 0.95  # of the plainer model's rms that a richer one may leave
_PLAINLY = 0.5  # of the plainer model's squared residual: no chance, however few the samples
_TRAVEL_DEG = 1.0  # of the arm: on a shorter stroke gravity is a torque offset
_ADDED: Mapping[str, tuple[str, ...]] = {
    "friction": ("static_extra_nm", "stribeck_velocity_rad_s"),
    "gravity": (),  # of sine and cosine a short stroke carries one combination alone
    "kind": ("gear_inertia_kg_m2", "gear_spring_nm_per_rad", "arm_spring_nm_per_rad"),
}


@dataclass(frozen=True)
class Considered:
    """A model that was fitted, and whether it was taken."""

    kind: str
    friction: str
    gravity: bool
    rmse_nm: float
    taken: bool

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON; what is not a number is null."""
        values = dataclasses.asdict(self)
        return values | {"rmse_nm": self.rmse_nm if math.isfinite(self.rmse_nm) else None}


@dataclass(frozen=True)
class Flexible:
    """What recordings of one axis say about the spring behind its gear.

    Parameters
    ----------
    sources : tuple of Source
        The recordings as they were fitted, averaged over their periods where they have some.
    fit : FlexibleFit
        The model that is believed; not decidable where none is.
    considered : tuple of Considered
        Every model that was fitted.
    unseen : tuple of Signals
        Recordings that the fit has not seen.
    validations : tuple of FlexibleValidation
        What both joints explain of them.
    not_validated : tuple of str
        Why one of them, or all, are not validated on.
    """

    sources: tuple[Source, ...]
    fit: FlexibleFit
    considered: tuple[Considered, ...]
    unseen: tuple[Signals, ...] = ()
    validations: tuple[FlexibleValidation, ...] = ()
    not_validated: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.flexible/1` document."""
        return self.fit.to_json() | {
            "recordings": [s.to_json() for s in self.sources],
            "models": [c.to_json() for c in self.considered],
            "validation": [v.to_json() for v in self.validations],
            "not_validated": list(self.not_validated),
        }


def flexible_of(
    recordings: Sequence[Recording],
    unseen: Sequence[Recording] = (),
    kind: Choice = "auto",
    *,
    starts: int = 20,
) -> Flexible:
    """Identify the flexible joint, and validate it on recordings that it has not seen."""
    sources = tuple(source_of(r) for r in recordings)
    fit, considered = choose([s.signals for s in sources], kind, starts=starts)
    others = tuple(signals_of(r) for r in unseen)
    if not fit.decidable:
        return Flexible(sources, fit, considered, others)
    reason = ""
    if not swings(fit):
        reason = "the recordings do not carry where the arm swings"
    elif not can_predict(fit):
        reason = "how late the torque is reported came to rest on the bound of its search"
    if reason:
        return Flexible(sources, fit, considered, others, not_validated=(reason,))
    validations, reasons = [], []
    for signals in others:
        try:
            validations.append(validate(fit, signals))
        except ValueError as error:
            reasons.append(str(error))
    return Flexible(sources, fit, considered, others, tuple(validations), tuple(reasons))


def choose(
    signals: Sequence[Signals], kind: Choice, *, starts: int = 20
) -> tuple[FlexibleFit, tuple[Considered, ...]]:
    """Fit the models that come into question, and return the one to believe with all of them.

    Parameters
    ----------
    signals : sequence of Signals
        Of one axis.
    kind : {"two-mass", "three-mass", "auto"}
        `auto` takes three masses where two leave what three explain.
    starts : int
        Of the search for the model that is taken; the others have three at most.
    """
    options = Options(
        kind="two-mass" if kind == "auto" else kind, starts=min(starts, _TRIAL_STARTS)
    )
    best = fit_flexible(signals, options)
    considered = [_considered(best, options)]
    masses: dict[str, dict[str, Any]] = {"kind": {"kind": "three-mass"}} if kind == "auto" else {}
    # A second mode may be all that hides the first.
    rounds: list[dict[str, dict[str, Any]]] = [masses]
    if best.decidable:
        torque: dict[str, dict[str, Any]] = {"friction": {"friction": STRIBECK.name}}
        if _travels(signals):
            torque["gravity"] = {"gravity": True}
        # Masses last: a spring must not explain what friction and gravity do.
        rounds = [torque, torque, masses]
    taken, tried = 0, {(options.kind, options.friction, options.gravity)}
    for changes in rounds:
        for what, change in changes.items():
            trial = dataclasses.replace(options, **change)
            if (trial.kind, trial.friction, trial.gravity) in tried:
                continue
            tried.add((trial.kind, trial.friction, trial.gravity))
            fit = fit_flexible(signals, trial)
            considered.append(_considered(fit, trial))
            if _better(fit, best, signals, _ADDED[what]):
                best, options, taken = fit, trial, len(considered) - 1
    if best.decidable:
        best = fit_flexible(signals, dataclasses.replace(options, starts=starts))
    marked = (dataclasses.replace(c, taken=i == taken) for i, c in enumerate(considered))
    return best, tuple(marked)


def _considered(fit: FlexibleFit, options: Options) -> Considered:
    return Considered(options.kind, options.friction, options.gravity, fit.rmse_nm, taken=False)


def _travels(signals: Sequence[Signals]) -> bool:
    """Return whether the arm goes far enough for gravity to be more than an offset."""
    spans = []
    for s in signals:
        if s.position_rad is None:
            return False
        known = s.position_rad[s.valid]
        spans.append(float(np.ptp(known)) / s.gear_ratio if known.size else 0.0)
    return math.degrees(max(spans)) > _TRAVEL_DEG


def _better(
    rich: FlexibleFit, plain: FlexibleFit, signals: Sequence[Signals], added: Sequence[str]
) -> bool:
    """Return whether a richer model earns its parameters on the same samples."""
    if not rich.decidable or not all(rich.parameters[name].identified for name in added):
        return False
    if not plain.decidable:
        return True
    left = [residual_of(fit, signals, plain.cutoff_hz) for fit in (rich, plain)]
    if not all(r.size and np.isfinite(r).all() for r in left):
        return False
    costs = [float(r @ r) for r in left]
    extra = len(rich.parameters) - len(plain.parameters)
    gain = 0.5 * left[0].size / correlation_time([left[0]]) * math.log(costs[1] / costs[0])
    # Structure that both lack makes what is left look like few samples.
    sure = gain > _EVIDENCE * extra or costs[0] < _PLAINLY * costs[1]
    # Parts that two masses cannot tell are worth a third one, however little torque it explains.
    parted = plain.kind == rich.kind or plain.parameters["arm_inertia_kg_m2"].identified
    less = _LESS if parted else 1.0
    return sure and math.sqrt(costs[0]) < less * math.sqrt(costs[1])


def residual_of(fit: FlexibleFit, signals: Sequence[Signals], cutoff_hz: float) -> Floats:
    """Return what a fit leaves of the torque below a frequency, shape (n,); empty if it cannot."""
    ready = (prepare(t, cutoff_hz) for s in signals for t in tracks_of(s))
    stretches = tuple(p for p in ready if p is not None and p.usable.any())
    if fit.joint is None or not can_predict(fit) or not stretches:
        return np.zeros(0)
    measured, predicted = predicted_torque(stretches, fit, fit.joint)
    return measured - predicted


def swings(fit: FlexibleFit) -> bool:
    """Return whether the recordings carry where motor and arm swing."""
    named = [p for name, p in fit.parameters.items() if "resonance" in name]
    return fit.decidable and all(p.identified for p in named)


def can_predict(fit: FlexibleFit) -> bool:
    """Return whether the fit can be asked for torque: its delay is known."""
    return fit.decidable and math.isfinite(fit.parameters["torque_delay_s"].value)
