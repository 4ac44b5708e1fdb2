"""What drives and pulls an arm behind the gear, in a row across the samples that were lost.

A search asks for hundreds of arms of one scene: what is the same for all of them is laid out once.
"""

from __future__ import annotations

from dataclasses import dataclass

from agent.explain.rows.bridged import Bridged
from agent.identify.result import Floats


@dataclass(frozen=True)
class ArmMotion:
    """The motor's motion and what the arm is held against, all shape (M,) as `bridged` has it.

    Parameters
    ----------
    bridged : Bridged
    velocity_rad_s : ndarray
        What drives the gear's spring.
    stiff_rad_s2 : ndarray
        The acceleration of an arm behind a stiff gear.
    drawn : ndarray
        How far the arm's dry friction is drawn out behind a stiff gear, -1 to 1.
    worn_share : ndarray
        What time and use have made of that friction.
    weight_nm : ndarray
        Gravity, and what was found beside it.
    lighter_nm_per_rad : ndarray
        By how much less gravity is for every radian of the motor that the arm is behind it.
    oil_rad_s : ndarray
        The smooth speed by which oil brakes the arm.
    """

    bridged: Bridged
    velocity_rad_s: Floats
    stiff_rad_s2: Floats
    drawn: Floats
    worn_share: Floats
    weight_nm: Floats
    lighter_nm_per_rad: Floats
    oil_rad_s: Floats
