"""One sentence for a technician: how much friction, of which kind, and how well it is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from agent.identify.result import FrictionModelFit, Parameter, RigidBodyFit
from agent.numbers import parameter_unit, scale_for, significant, written


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
            f"body explains {body.fit_percent:.1f} % of the torque."
        )
    left = scale_for("N m", (selected.rmse_nm,))
    explained = (
        f"the law explains {selected.fit_percent:.1f} % of the steady torque "
        f"({significant(left.factor * selected.rmse_nm, 2)} {left.unit} rms is left)"
    )
    if selected.model == "stribeck":
        return f"{_stribeck(selected.parameters)}; {explained}."
    if selected.model == "feeny-moon":
        return f"{_feeny_moon(selected.parameters)}; {explained}."
    return f"{_level(selected.parameters)}, with no sign of a fall at low speed; {explained}."


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
    return f"{_level(parameters)}, and {more} near standstill, fading at {fading} (Stribeck)"


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
    """Return value, half of the interval and unit; nothing where it was not identified."""
    if not parameter.identified or parameter.ci95 is None:
        return ""
    scale = scale_for(parameter_unit(name), (parameter.value,))
    value, _, half_width = written(parameter, scale.factor)
    return f"{value} ±{half_width} {scale.unit}" if half_width else f"{value} {scale.unit}"
