"""What a technician reads first: how much friction, how well it is known, and what is missing."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats, FrictionModelFit, Parameter, RigidBodyFit
from agent.identify.signals.arrays import Signals
from agent.numbers import Scale, fixed, parameter_unit, scale_for, significant, written
from agent.samples import usable

LOW_PASSED = "signals and regressors were low-passed alike at"
"""How the note on the filter begins."""

_METHODS = (LOW_PASSED, "velocity was derived from position", "interpolated onto an even grid")

_ASKEW = 1.2  # of the interval's halves: beyond, one number for both would be wrong
_WORTH_A_NOTE = 1e-3  # of the samples: fewer change nothing, and the table has them
_NAMED_PLACES = 3


def verdict(models: Sequence[FrictionModelFit], body: RigidBodyFit | None) -> str:
    """Return the verdict of a decidable estimate.

    Parameters
    ----------
    models : sequence of FrictionModelFit
        With the selected one; empty where there is no friction curve.
    body : RigidBodyFit, optional
        Speaks where there is no friction curve.
    """
    selected = next((m for m in models if m.selected), None)
    if selected is None:
        assert body is not None
        return (
            f"{_level(body.parameters)}, from the whole motion (no friction curve); the rigid "
            f"body explains {percent(body.fit_percent)} of the torque."
        )
    left = scale_for("N m", (selected.rmse_nm,))
    explained = (
        f"the law explains {percent(selected.fit_percent)} of the steady torque "
        f"({significant(left.factor * selected.rmse_nm, 2)} {left.unit} rms is left)"
    )
    if selected.model == "stribeck":
        return f"{_stribeck(selected.parameters)}; {explained}."
    if selected.model == "feeny-moon":
        return f"{_feeny_moon(selected.parameters)}; {explained}."
    return f"{_level(selected.parameters)}, with no sign of a fall at low speed; {explained}."


def missing_samples(signals: Signals) -> tuple[str, ...]:
    """Return what is to be said of samples without a number, or lost; nothing where they are few.

    Parameters
    ----------
    signals : Signals
        As read. Its doubtful rows have a note of their own.
    """
    count, lost = signals.time_s.shape[0], signals.samples_lost
    said = []
    channels = _without_number(signals)
    missing = np.logical_or.reduce([np.zeros(count, np.bool_), *channels.values()])
    if missing.sum() >= max(_WORTH_A_NOTE * count, 1.0):
        said.append(
            f"{signals.name}: in {_of(int(missing.sum()), count)} {' or '.join(channels)} is not a "
            f"number ({_places(missing, signals.time_s)}); they were left out"
        )
    if lost >= max(_WORTH_A_NOTE * (count + lost), 1.0):
        said.append(f"{signals.name}: {_of(lost, count + lost)} were lost while recording")
    return tuple(said)


def is_method(note: str) -> bool:
    """Tell whether a note says how was computed, and not what the numbers are worth."""
    return any(words in note for words in _METHODS)


def _without_number(signals: Signals) -> dict[str, NDArray[np.bool_]]:
    """Return the channels that lack a number somewhere, and where, shape (n,)."""
    account = signals.acquisition
    doubtful = np.zeros(signals.time_s.shape, np.bool_)
    if account is not None and signals.left_out:
        doubtful = account.doubts(signals.time_s)
    named = {
        "torque": signals.torque_nm,
        "velocity": signals.velocity_rad_s,
        "position": signals.position_rad,
    }
    found = {n: ~usable(values) & ~doubtful for n, values in named.items() if values is not None}
    return {name: missing for name, missing in found.items() if missing.any()}


def _of(part: int, whole: int) -> str:
    """Write "400 of 20 000 samples (2 %)"."""
    some, all_ = (f"{n:,}".replace(",", "\u202f") for n in (part, whole))
    return f"{some} of {all_} samples ({100.0 * part / whole:.2g} %)"


def _places(missing: NDArray[np.bool_], time_s: Floats) -> str:
    """Say where in time samples are missing: each stretch where they are few."""
    edges = np.flatnonzero(np.diff(missing, prepend=False, append=False))
    first, last = edges[::2], edges[1::2] - 1
    if first.size > _NAMED_PLACES:
        whole = f"{time_s[first[0]]:.4g} and {time_s[last[-1]]:.4g} s"
        return f"in {first.size} places between {whole}"
    stretches = [
        f"{time_s[a]:.4g} to {time_s[b]:.4g} s" if b > a else f"{time_s[a]:.4g} s"
        for a, b in zip(first, last, strict=True)
    ]
    return ", ".join(stretches)


def _level(parameters: Mapping[str, Parameter]) -> str:
    """Return Coulomb and viscous friction in words."""
    coulomb = _quantity("coulomb_nm", parameters["coulomb_nm"])
    viscous = _quantity("viscous_nm_s_per_rad", parameters["viscous_nm_s_per_rad"])
    if coulomb and viscous:
        return f"Friction is {coulomb} Coulomb + {viscous} viscous"
    if coulomb:
        return f"Friction is {coulomb} Coulomb; how much of it is viscous is not identified"
    if viscous:
        return f"Friction is {viscous} viscous; how much of it is Coulomb is not identified"
    return "How much of the friction is Coulomb and how much viscous is not identified"


def _stribeck(parameters: Mapping[str, Parameter]) -> str:
    """Return the Stribeck law in words."""
    extra = _quantity("static_extra_nm", parameters["static_extra_nm"])
    speed = _quantity("stribeck_velocity_rad_s", parameters["stribeck_velocity_rad_s"])
    more = f"{extra} more" if extra else "an amount more that is not identified"
    fading = speed or "a speed that is not identified"
    return f"{_level(parameters)}, and {more} near standstill (Stribeck), fading at {fading}"


def _feeny_moon(parameters: Mapping[str, Parameter]) -> str:
    """Return the Feeny-Moon law in words."""
    top, mu = parameters["coulomb_nm"], parameters["mu"]
    viscous = _quantity("viscous_nm_s_per_rad", parameters["viscous_nm_s_per_rad"])
    scale = scale_for("N m", (top.value,))
    falls = f"{significant(scale.factor * top.value, 3)} {scale.unit}"
    lasts = f"{significant(scale.factor * mu.value * top.value, 3)} {scale.unit}"
    growing = f"grows by {viscous}" if viscous else "how fast it grows with speed is not identified"
    return (
        f"Friction falls from {falls} near standstill to {lasts} Coulomb and {growing} (Feeny-Moon)"
    )


def _quantity(name: str, parameter: Parameter) -> str:
    """Return value, interval and unit; nothing where it was not identified."""
    if not parameter.identified or parameter.ci95 is None:
        return ""
    return with_interval(parameter, scale_for(parameter_unit(name), (parameter.value,)))


def with_interval(parameter: Parameter, scale: Scale) -> str:
    """Write a number with its interval: "2.0 ±0.1 N m", or both ends where the halves differ.

    Parameters
    ----------
    parameter : Parameter
        An identified one.
    scale : Scale
        What it is written in.
    """
    value, interval, half_width = written(parameter, scale.factor)
    if not half_width or parameter.ci95 is None:
        return f"{value} {scale.unit}"
    low, high = parameter.ci95
    below, above = parameter.value - low, high - parameter.value
    if max(below, above) > _ASKEW * min(below, above):
        return f"{value} {scale.unit} ({interval})"
    return f"{value} ±{half_width} {scale.unit}"


def percent(fit_percent: float) -> str:
    """Write a fit; what is not all is not rounded up to all of it."""
    return f"{percent_number(fit_percent)} %"


def percent_number(fit_percent: float) -> str:
    """Write a fit without its unit, for a column that names it."""
    rounded = fixed(fit_percent, 1)
    return "over 99.9" if rounded == "100.0" and fit_percent < 100.0 else rounded
