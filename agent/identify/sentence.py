"""One sentence for a technician: how much friction, of which kind, and how well it is known."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from agent.identify.result import FrictionModelFit, Parameter, RigidBodyFit


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
    explained = (
        f"the law explains {selected.fit_percent:.1f} % of the steady torque "
        f"({selected.rmse_nm:.2g} N m rms is left)"
    )
    if selected.model == "stribeck":
        return f"{_stribeck(selected.parameters)}; {explained}."
    if selected.model == "feeny-moon":
        return f"{_feeny_moon(selected.parameters)}; {explained}."
    return f"{_level(selected.parameters)}, with no sign of a fall at low speed; {explained}."


def _level(parameters: Mapping[str, Parameter]) -> str:
    """Return Coulomb and viscous friction in words."""
    coulomb = parameters["coulomb_nm"]
    viscous = parameters["viscous_nm_s_per_rad"]
    return (
        f"Friction is {coulomb.value:.3g} N m Coulomb{_margin(coulomb)} + {viscous.value:.3g} "
        f"N m s/rad viscous{_margin(viscous)}"
    )


def _stribeck(parameters: Mapping[str, Parameter]) -> str:
    """Return the Stribeck law in words."""
    extra = parameters["static_extra_nm"]
    speed = parameters["stribeck_velocity_rad_s"]
    return (
        f"{_level(parameters)}, and {extra.value:.2g} N m{_margin(extra)} more towards standstill "
        f"that fades around {speed.value:.2g} rad/s (Stribeck)"
    )


def _feeny_moon(parameters: Mapping[str, Parameter]) -> str:
    """Return the Feeny-Moon law in words."""
    top = parameters["coulomb_nm"]
    mu = parameters["mu"]
    return (
        f"Friction falls from {top.value:.3g} N m near standstill to {mu.value * top.value:.3g} "
        f"N m Coulomb and grows by {parameters['viscous_nm_s_per_rad'].value:.3g} N m s/rad "
        "(Feeny-Moon)"
    )


def _margin(parameter: Parameter) -> str:
    """Return half the interval's width in words; nothing where there is no interval."""
    if not parameter.identified or parameter.ci95 is None:
        return " (not well determined)"
    return f" (±{(parameter.ci95[1] - parameter.ci95[0]) / 2.0:.1g})"
