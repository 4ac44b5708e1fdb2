"""Which friction law the curve carries, with which numbers, and how sure that is.

All laws of `physics.friction` are fitted to the curve's points (`law_fit`), and one is chosen among
them (`selection`).
"""

from __future__ import annotations

from agent.identify.friction.curve import CurveFit
from agent.identify.friction.law_fit import LawFit, fit_law
from agent.identify.friction.selection import select
from agent.identify.result import FrictionModelFit
from agent.physics import friction


def fit_friction_models(curve_fit: CurveFit) -> tuple[FrictionModelFit, ...]:
    """Fit every law that the number of speeds allows, and select one.

    Parameters
    ----------
    curve_fit : CurveFit
        The curve with its points' standard errors.

    Returns
    -------
    tuple of FrictionModelFit
        Simplest first; at most one is selected, none with fewer than two speeds.
    """
    fits: list[LawFit] = []
    speeds = curve_fit.curve.velocity_rad_s.shape[0]
    for law in friction.LAWS.values():
        # The exponent may be held; every other parameter needs a speed, and the fit one to spare.
        free = [name for name in law.parameters if name != "exponent"]
        needed = len(free) + (1 if law.ranges else 0)
        if speeds >= needed:
            fits.append(fit_law(law, curve_fit))
    return select(fits)
