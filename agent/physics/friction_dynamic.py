"""Friction with memory: Dahl, Bliman-Sorine and LuGre, driven by a velocity signal.

Between two samples velocity is a straight line, and a step in which it changes sign is cut in two
there. Within a piece the state runs to its steady value exactly as for the piece's mean velocity,
so that no step, however long, is unstable. A sample whose time or velocity is not finite has no
torque (NaN) and moves no state.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from agent.physics.friction import STRIBECK
from agent.physics.law import Law, require

Floats = NDArray[np.float64]


@dataclass(frozen=True)
class Dahl:
    """Stress-strain friction: a spring that yields at the Coulomb level."""

    law: ClassVar[Law] = Law(
        "dahl",
        "tau = s0 z; dz/dt = v - s0 |v| z / fc",
        {
            "coulomb_nm": "fc, level that the spring yields at",
            "stiffness_nm_per_rad": "s0, slope at rest",
        },
        "Dahl, Aerospace Corp. TOR-0158 (1968); thesis 3.7",
        "independent of rate: no stiction, no Stribeck fall, no viscous part",
    )
    coulomb_nm: float
    stiffness_nm_per_rad: float

    def __post_init__(self) -> None:
        """Refuse a spring that is none."""
        require(self.law, self, positive="coulomb_nm stiffness_nm_per_rad")

    def torque_nm(self, time_s: Floats, velocity_rad_s: Floats, start_nm: float = 0.0) -> Floats:
        """Return the friction torque at the samples, shape (n,), from a torque at the start."""
        return _relaxed(
            time_s, velocity_rad_s, self.coulomb_nm, self.stiffness_nm_per_rad, start_nm
        )


@dataclass(frozen=True)
class BlimanSorine:
    """Two Dahl elements side by side, the slower one negative: stiction without rate."""

    law: ClassVar[Law] = Law(
        "bliman-sorine",
        "tau = x1 + x2 + fv v; dx1/ds = (f1 sign v - x1)/(h e); dx2/ds = (-f2 sign v - x2)/e;"
        " ds = |v| dt",
        {
            "fast_nm": "f1, level of the fast element",
            "slow_nm": "f2, level that the slow one takes away; f1 - f2 is Coulomb friction",
            "fast_share": "h, space constant of the fast element as a share of the slow one's",
            "space_constant_rad": "e, travel in which the slow element reaches 1 - 1/e",
            "viscous_nm_s_per_rad": "fv (the four of the paper have none; the thesis ticks it)",
        },
        "Bliman & Sorine, ECC 1995; Olsson et al., Eur. J. Control 4 (1998) 176; thesis 3.7",
        "a function of travel, whatever the speed: breakaway and hysteresis know no rate",
    )
    fast_nm: float
    slow_nm: float
    fast_share: float
    space_constant_rad: float
    viscous_nm_s_per_rad: float = 0.0

    def __post_init__(self) -> None:
        """Refuse elements in the wrong order, and a pair that would drive the joint."""
        require(
            self.law,
            self,
            positive="fast_nm slow_nm fast_share space_constant_rad",
            not_negative="viscous_nm_s_per_rad",
        )
        if not (self.slow_nm < self.fast_nm and self.fast_share < 1.0):
            raise ValueError(
                f"bliman-sorine: expected slow_nm < fast_nm and fast_share < 1, got {self}"
            )

    def torque_nm(self, time_s: Floats, velocity_rad_s: Floats) -> Floats:
        """Return the friction torque at the samples, shape (n,), from a relaxed start."""
        slow_slope = self.slow_nm / self.space_constant_rad
        fast_slope = self.fast_nm / (self.fast_share * self.space_constant_rad)
        fast = _relaxed(time_s, velocity_rad_s, self.fast_nm, fast_slope)
        slow = _relaxed(time_s, velocity_rad_s, -self.slow_nm, slow_slope)
        return np.asarray(fast + slow + self.viscous_nm_s_per_rad * velocity_rad_s)


@dataclass(frozen=True)
class LuGre:
    """Bristles whose yield level falls with speed: every phenomenon of thesis Table 3.2."""

    law: ClassVar[Law] = Law(
        "lugre",
        "tau = s0 z + s1 dz/dt + fv v; dz/dt = v - s0 |v| z / g(v); g(v) = fc + fs exp(-|v/vs|^d)",
        {
            "coulomb_nm": "fc, as in the Stribeck law",
            "viscous_nm_s_per_rad": "fv, as in the Stribeck law",
            "static_extra_nm": "fs, as in the Stribeck law",
            "stribeck_velocity_rad_s": "vs, as in the Stribeck law",
            "exponent": "d, as in the Stribeck law (2 in the six parameters of the thesis)",
            "stiffness_nm_per_rad": "s0, bristles' slope at rest",
            "damping_nm_s_per_rad": "s1, bristles' damping",
        },
        "Canudas de Wit, Olsson, Astrom, Lischinsky, IEEE TAC 40 (1995) 419; thesis 3.7",
        "one point of contact; s1 dz/dt may drive the joint where s1 is large against s0 fc/(v fs)",
    )
    coulomb_nm: float
    viscous_nm_s_per_rad: float
    static_extra_nm: float
    stribeck_velocity_rad_s: float
    stiffness_nm_per_rad: float
    damping_nm_s_per_rad: float = 0.0
    exponent: float = 2.0

    def __post_init__(self) -> None:
        """Refuse bristles that are none."""
        require(
            self.law,
            self,
            positive="coulomb_nm stribeck_velocity_rad_s stiffness_nm_per_rad exponent",
            not_negative="viscous_nm_s_per_rad static_extra_nm damping_nm_s_per_rad",
        )

    def level_nm(self, velocity_rad_s: Floats) -> Floats:
        """Return g(v), shape (n,): what the bristles yield at."""
        speed = np.maximum(np.abs(velocity_rad_s), np.finfo(np.float64).tiny)
        return STRIBECK.torque(speed, {**vars(self), "viscous_nm_s_per_rad": 0.0})

    def rate_rad_s(self, velocity_rad_s: Floats, bristles_nm: Floats) -> Floats:
        """Return ``dz/dt``, shape (n,), of bristles that hold a torque ``s0 z``."""
        yielding = np.abs(velocity_rad_s) * bristles_nm / self.level_nm(velocity_rad_s)
        return np.asarray(velocity_rad_s - yielding)

    def torque_nm(self, time_s: Floats, velocity_rad_s: Floats, start_nm: float = 0.0) -> Floats:
        """Return the friction torque at the samples, shape (n,), from a bristles' torque."""
        stiffness = self.stiffness_nm_per_rad
        bristles = _relaxed(time_s, velocity_rad_s, self.level_nm, stiffness, start_nm)
        damping = self.damping_nm_s_per_rad * self.rate_rad_s(velocity_rad_s, bristles)
        return np.asarray(bristles + damping + self.viscous_nm_s_per_rad * velocity_rad_s)


def kept_share(travel_rad: Floats, stiffness_nm_per_rad: float, level_nm: Floats | float) -> Floats:
    """Return what a travel leaves of a spring's way to its level, ``exp(-|x| s0/fc)``, shape (n,).

    The solution of `Dahl`'s law while the motion keeps its sign; the level is above zero.
    """
    return np.asarray(np.exp(-np.abs(travel_rad) * stiffness_nm_per_rad / level_nm))


def dahl_share(
    time_s: Floats, velocity_rad_s: Floats, reach_rad: float, start: float = 0.0
) -> Floats:
    """Return Dahl's torque over its level, from -1 to 1, shape (n,), for searches of its reach.

    ``z = s + (z0 - s) exp(-travel/reach)``, with one travel of one sign for each sample. `Dahl` has
    steps from sample to sample, cut where the velocity changes sign: half a sample's travel apart.

    Parameters
    ----------
    time_s, velocity_rad_s : ndarray, shape (n,)
        Rising times, at least two.
    reach_rad : float
        fc/s0, travel after a reversal that leaves 1/e of the way; above zero.
    start : float
        Share of the level at first.
    """
    from agent.physics.kernels import settle

    travel = velocity_rad_s * np.gradient(time_s)
    return np.asarray(settle(velocity_rad_s, kept_share(travel, 1.0, reach_rad), start))


def stop(travel_rad: Floats, reach_rad: float) -> Floats:
    """Return how far an element that slips beyond its reach is drawn out, shape (n,).

    ``x <- clip(x + ds, -reach, reach)`` from 0: the stop operator (Prandtl, ZAMM 8 (1928) 85),
    which is a spring under dry friction, or the motor's place in a clearance behind which a held
    arm stands still.

    Parameters
    ----------
    travel_rad : ndarray, shape (n,)
        Signed travel of the step that ends at each sample.
    reach_rad : float
        Travel that it takes up to either side, above zero.
    """
    from agent.physics.kernels import gap_angle

    # A spring that never relaxes in series with the gap moves the gap alone.
    return np.asarray(gap_angle(np.cumsum(travel_rad), np.zeros_like(travel_rad), reach_rad, 0.0))


def _cut(velocity_rad_s: Floats) -> Floats:
    """Return the share of each step, shape (n,), that its first piece takes; the first is 0."""
    before, after = velocity_rad_s[:-1], velocity_rad_s[1:]
    share = np.ones_like(velocity_rad_s)
    crossing = before * after < 0.0
    share[1:][crossing] = (before / np.where(crossing, before - after, 1.0))[crossing]
    return share


def _means(velocity_rad_s: Floats) -> Floats:
    """Return the mean velocity of the two pieces that lead to each sample, shape (n, 2)."""
    means = np.zeros((len(velocity_rad_s), 2))
    before, after = velocity_rad_s[:-1], velocity_rad_s[1:]
    crossing = before * after < 0.0
    means[1:, 0] = np.where(crossing, 0.5 * before, 0.5 * (before + after))
    means[1:, 1] = np.where(crossing, 0.5 * after, 0.0)
    return means


def _relaxed(
    time_s: Floats,
    velocity_rad_s: Floats,
    level_nm: Callable[[Floats], Floats] | float,
    stiffness_nm_per_rad: float,
    start_nm: float = 0.0,
) -> Floats:
    """Return x at the samples, shape (n,): ``dx = s0 (sign(v) - x/level) |v| dt``.

    `level_nm` is a number, or a function of the pieces' mean velocity, shape (2 n,).
    """
    from agent.physics.kernels import relax

    usable = np.isfinite(time_s) & np.isfinite(velocity_rad_s)
    time, velocity = time_s[usable], velocity_rad_s[usable]
    if np.any(np.diff(time) <= 0.0):
        raise ValueError("time_s: expected strictly increasing samples")
    means, share = _means(velocity).ravel(), _cut(velocity)
    level = level_nm(means) if callable(level_nm) else np.full_like(means, level_nm)
    step = np.diff(time, prepend=time[:1])
    travel = means * np.stack([share * step, (1.0 - share) * step], axis=-1).ravel()
    keep = kept_share(travel, stiffness_nm_per_rad, np.abs(level))
    torque = np.full(len(velocity_rad_s), np.nan)
    torque[usable] = relax(np.sign(travel) * level, keep, float(start_nm))
    return torque
