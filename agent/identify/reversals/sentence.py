"""One sentence for a technician: what the joint does where it turns round."""

from __future__ import annotations

from collections.abc import Mapping

from agent.identify.result import Parameter
from agent.identify.reversals.result import Clearance, PreslidingFit, ReversalFit, without_law
from agent.identify.sentence import with_interval
from agent.numbers import Scale, parameter_unit, scale_for, significant

_NAMES = {"dahl": "Dahl", "bliman-sorine": "Bliman-Sorine", "lugre": "LuGre"}
_MOSTLY = 0.5
_MANY = 5.0  # times the noise: no friction that turns leaves so much
_ANGLES = ((1.0, "rad"), (1e3, "mrad"), (1e6, "µrad"))


def angle_scale(value_rad: float) -> Scale:
    """Return rad, mrad or µrad: the largest unit in which the angle is at least 0.1."""
    for factor, unit in _ANGLES:
        if abs(value_rad) * factor >= 0.1:
            return Scale(factor, unit)
    return Scale(*_ANGLES[-1])


def scale_of(name: str, value: float) -> Scale:
    """Return the unit to write a parameter in, angles in milliradians where they are small."""
    unit = parameter_unit(name)
    return angle_scale(value) if unit == "rad" else scale_for(unit, (value,))


def verdict(fit: PreslidingFit, clearance: Clearance, finest_rad: float, left: float = 0.0) -> str:
    """Return the sentence of a decidable result.

    Parameters
    ----------
    fit : PreslidingFit
        The selected law.
    clearance : Clearance
        What is known of the gap.
    finest_rad : float
        What encoder and sampling resolve.
    left : float
        Share of what a plain change of friction's sign leaves of the squared torque, that the
        selected law leaves as well.
    """
    first = _first(fit, finest_rad)
    if fit.law != "coulomb" and left > _MOSTLY:
        first = (
            f"Most of what these reversals show has no name: {left:.0%} of what friction that "
            f"turns at once leaves is still there. The nearest law says: {first[0].lower()}"
            f"{first[1:]}"
        )
    gap = clearance.backlash_rad
    if clearance.source == "arm-encoder":
        # The arm's encoder knows more of gap and wind-up than a law of the motor's torque.
        told = fit.law in ("backlash", "wind-up") and clearance.lost_motion_rad.identified
        return _by_arm(clearance) if told else f"{first} {_by_arm(clearance)}"
    if gap.identified and fit.law != "backlash":
        return f"{first} The gear has {_quantity('backlash_rad', gap)} of clearance."
    return first


def judged(found: ReversalFit, noise_nm: float) -> ReversalFit:
    """Return a result without numbers of a law where no law tells what is in the torque.

    That is so where many times the noise is left, and most of what friction leaves that turns at
    once: the numbers are then the nearest law's, and not the joint's. What the arm's encoder shows
    stands by itself.

    Parameters
    ----------
    found : ReversalFit
        As identified.
    noise_nm : float
        Standard deviation of the torque's noise, as the laws were fitted (`Data.noise_nm`).
    """
    selected = found.selected
    if not found.decidable or selected is None or not noise_nm > 0.0:
        return found
    times = selected.rmse_nm / noise_nm
    plain = found.law("coulomb").rmse_nm ** 2 - noise_nm**2
    left = (selected.rmse_nm**2 - noise_nm**2) / plain if plain > 0.0 else 0.0
    if not (times > _MANY and left > _MOSTLY):
        return found
    name = _NAMES.get(selected.law, selected.law.capitalize())
    reason = (
        f"not identified: no law explains these reversals, {times:.0f} times the torque's noise is "
        "left"
    )
    sentence = (
        f"These reversals do not tell how friction turns: the nearest law ({name}) leaves "
        f"{times:.0f} times the torque's noise. Something else is in the torque there, such as a "
        "spring, ripple or cables: ask `stribeck explain` what it is, or record slower swings of "
        "several amplitudes."
    )
    if found.clearance.source == "arm-encoder":
        sentence = f"{sentence} {_by_arm(found.clearance)}"
    return without_law(found, reason, sentence)


def undecided(reason: str) -> str:
    """Return the sentence where nothing can be said."""
    return f"What happens at reversals is {reason}."


def _first(fit: PreslidingFit, finest_rad: float) -> str:
    parameters = fit.parameters
    if fit.law == "coulomb":
        limit = angle_scale(4.0 * finest_rad)
        return (
            "At a reversal friction turns at once: if the joint gives before it slips, then by "
            f"less than {significant(4.0 * finest_rad * limit.factor, 2)} {limit.unit}, which is "
            "as fine as these recordings see."
        )
    if fit.law == "backlash":
        gap = _quantity("backlash_rad", parameters["backlash_rad"])
        return f"At a reversal the motor turns {gap} without its arm: the gear has clearance."
    if fit.law == "wind-up":
        return (
            "At a reversal the torque grows in a straight line over "
            f"{_quantity('wind_up_rad', parameters['wind_up_rad'])} and then stays: a spring "
            "under dry friction, in the gear or in the contacts."
        )
    return (
        "Around a reversal the joint gives like a spring for "
        f"{_quantity('space_constant_rad', parameters['space_constant_rad'])} before it slips "
        f"({_detail(fit.law, parameters)})."
    )


def _detail(law: str, parameters: Mapping[str, Parameter]) -> str:
    stiffness = parameters.get("stiffness_nm_per_rad")
    if stiffness is None or not stiffness.identified:
        return _NAMES[law]
    return f"{_NAMES[law]}, stiffness {_quantity('stiffness_nm_per_rad', stiffness)}"


def _by_arm(clearance: Clearance) -> str:
    lost, gap = clearance.lost_motion_rad, clearance.backlash_rad
    if not lost.identified:
        return "The arm's encoder shows no lost motion beyond its noise."
    moved = _quantity("lost_motion_rad", lost)
    if gap.identified:
        own = _quantity("backlash_rad", gap)
        return f"The motor turns {moved} before the arm follows; {own} of it is clearance."
    return f"The motor turns {moved} before the arm follows; it is the gear's wind-up, not a gap."


def _quantity(name: str, parameter: Parameter) -> str:
    """Return value, interval and unit; without an interval, that it has none."""
    scale = scale_of(name, parameter.value)
    if not parameter.identified or parameter.ci95 is None:
        return "a travel that is not well determined"
    return with_interval(parameter, scale)
