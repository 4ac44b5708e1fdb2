"""Friction around a reversal: a spring that yields towards a level, in three shapes.

What yields is the joint's sliding friction, Coulomb, Stribeck and what it has beside them by place,
load, age or temperature, so that the torque of lasting motion stays what the sliding laws say. Time
and velocity drive the state; velocity is a straight line between samples, and a step in which it
changes sign is cut there.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.law import Law, require

Floats = NDArray[np.float64]

ELEMENTS = 20  # of a Maxwell-slip chain: its polygon is within 1 % of the curve it stands for


@dataclass(frozen=True)
class YieldingSpring:
    """Dahl's spring with its shape left free; with damping, LuGre's bristles."""

    law: ClassVar[Law] = Law(
        "yielding-spring",
        "tau = F + s1 v y; dF/dx = s0 |y|^i sign(y), y = 1 - F sign(v)/L(v)",
        {
            "stiffness_nm_per_rad": "s0, slope right after a reversal",
            "shape_exponent": "i; 1 is Dahl, below 1 yields sooner, above 1 later",
            "damping_nm_s_per_rad": "s1, the bristles' damping (LuGre)",
        },
        "Dahl, Aerospace Corp. TOR-0158 (1968), with its exponent; i = 1 and L(v) of the Stribeck"
        " law: Canudas de Wit et al., IEEE TAC 40 (1995) 419",
        "one state: small loops inside a large one drift, which Maxwell-slip elements do not",
    )
    stiffness_nm_per_rad: float
    shape_exponent: float = 1.0
    damping_nm_s_per_rad: float = 0.0

    def __post_init__(self) -> None:
        """Refuse a spring that is none."""
        require(
            self.law,
            self,
            positive="stiffness_nm_per_rad shape_exponent",
            not_negative="damping_nm_s_per_rad",
        )

    def torque_nm(
        self, time_s: Floats, velocity_rad_s: Floats, level_nm: Floats, start: float = 0.0
    ) -> Floats:
        """Return friction with its memory, shape (n,).

        Parameters
        ----------
        time_s, velocity_rad_s : ndarray, shape (n,)
            NaN has no torque and moves no state.
        level_nm : ndarray, shape (n,)
            Dry friction of lasting motion at that velocity's size; above zero.
        start : float
            How far the spring is drawn out at first, a share of the level with its sign: 0 from
            rest, 1 or -1 where the joint has been moving.
        """
        from agent.physics.kernels import yielding

        out, usable = _prepared(time_s, velocity_rad_s, level_nm)
        velocity, level = velocity_rad_s[usable], level_nm[usable]
        drawn = float(start * level[0]) if level.size else 0.0
        force = yielding(
            time_s[usable],
            velocity,
            level,
            float(self.stiffness_nm_per_rad),
            float(self.shape_exponent),
            drawn,
        )
        left = 1.0 - force * np.sign(velocity) / level
        out[usable] = force + self.damping_nm_s_per_rad * velocity * left
        return out


@dataclass(frozen=True)
class MaxwellSlip:
    """Springs side by side that slip one after the other; loops inside loops close."""

    law: ClassVar[Law] = Law(
        "maxwell-slip",
        "virgin curve F(x) = L [1 - (1 - x/X)^p] up to x = X; Masing's rule after a reversal",
        {
            "sliding_travel_rad": "X, travel from rest after which all of it slides",
            "shape_exponent": "p; 1 is one spring that slips at once, larger bends sooner",
        },
        "Iwan, J. Appl. Mech. 33 (1966) 893; Lampaert, Swevers, Al-Bender, IEEE TAC 47 (2002) 683",
        "rate plays no part; 20 elements stand for the curve",
    )
    sliding_travel_rad: float
    shape_exponent: float = 2.0

    def __post_init__(self) -> None:
        """Refuse a curve that would stiffen."""
        require(self.law, self, positive="sliding_travel_rad shape_exponent")
        if self.shape_exponent < 1.0:
            raise ValueError("maxwell-slip: shape_exponent: expected a number of at least 1")

    def elements(self) -> tuple[Floats, Floats]:
        """Return stiffness per rad and yield level of the elements, shares of L, shape (20,)."""
        travel = np.linspace(0.0, 1.0, ELEMENTS + 1)
        curve = 1.0 - (1.0 - travel) ** self.shape_exponent
        slope = np.append(np.diff(curve) * ELEMENTS, 0.0)
        stiffness = np.maximum(-np.diff(slope), 0.0)
        return stiffness / self.sliding_travel_rad, stiffness * travel[1:]

    def torque_nm(
        self, time_s: Floats, velocity_rad_s: Floats, level_nm: Floats, start: float = 0.0
    ) -> Floats:
        """Return friction with its memory, shape (n,).

        Arguments as in `YieldingSpring.torque_nm`.
        """
        from agent.physics.kernels import slipping

        out, usable = _prepared(time_s, velocity_rad_s, level_nm)
        share = slipping(time_s[usable], velocity_rad_s[usable], *self.elements(), float(start))
        out[usable] = share * level_nm[usable]
        return out


def across_gaps(
    stretches: Sequence[tuple[Floats, Floats, Floats | None]],
) -> tuple[Floats, Floats, tuple[slice, ...]]:
    """Return time and velocity of stretches of one recording in a row, and where each stands.

    What has a memory keeps it where samples were lost. How far the joint went meanwhile is what its
    positions are apart; in the middle of the gap stands the one velocity that leads there.

    Parameters
    ----------
    stretches : sequence of (time_s, velocity_rad_s, position_rad)
        Each shape (n,), in the order of time; the position is None where it is not known, and the
        velocity a straight line across the gap.
    """
    times, velocities, where, count = [], [], [], 0
    for index, (time, velocity, position) in enumerate(stretches):
        if index:
            time_before, velocity_before, position_before = stretches[index - 1]
            gap_s = float(time[0] - time_before[-1])
            meanwhile = 0.5 * float(velocity_before[-1] + velocity[0])
            if position is not None and position_before is not None:
                meanwhile = 2.0 * float(position[0] - position_before[-1]) / gap_s - meanwhile
            times.append(np.array([time_before[-1] + 0.5 * gap_s]))
            velocities.append(np.array([meanwhile]))
            count += 1
        times.append(time)
        velocities.append(velocity)
        where.append(slice(count, count + time.shape[0]))
        count += time.shape[0]
    return np.concatenate(times), np.concatenate(velocities), tuple(where)


def _prepared(
    time_s: Floats, velocity_rad_s: Floats, level_nm: Floats
) -> tuple[Floats, NDArray[np.bool_]]:
    """Return an array of NaN, shape (n,), and which samples can be used."""
    usable = np.isfinite(time_s) & np.isfinite(velocity_rad_s) & np.isfinite(level_nm)
    if np.any(np.diff(time_s[usable]) <= 0.0):
        raise ValueError("time_s: expected strictly increasing samples")
    if np.any(level_nm[usable] <= 0.0):
        raise ValueError("expected a level of dry friction above 0, for a spring to yield at")
    return np.full(velocity_rad_s.shape, np.nan), usable
