"""Friction laws as the report meets them: by the name that a fit carries."""

from __future__ import annotations

import numpy as np

from agent.identify.result import Floats, FrictionModelFit
from agent.physics.friction import LAWS

_LABELS = {
    "coulomb-viscous": "Coulomb + viscous",
    "stribeck": "Stribeck",
    "feeny-moon": "Feeny–Moon",
}


def model_label(model: str) -> str:
    """Return a friction law's name in words."""
    return _LABELS.get(model, model.replace("-", " ").capitalize())


def friction_of_fit_nm(fit: FrictionModelFit, velocity_rad_s: Floats) -> Floats | None:
    """Evaluate a fitted law.

    Parameters
    ----------
    fit : FrictionModelFit
        Carries the law's name and its parameters.
    velocity_rad_s : ndarray, shape (n,)
        Motor side.

    Returns
    -------
    ndarray, shape (n,), or None
        Friction torque in N m; None when the law is not known or a parameter has no number.
    """
    law = LAWS.get(fit.model)
    if law is None:
        return None
    values = {name: parameter.value for name, parameter in fit.parameters.items()}
    if not all(np.isfinite(values.get(name, np.nan)) for name in law.parameters):
        return None
    return law.torque(velocity_rad_s, values)
