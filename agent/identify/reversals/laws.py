"""What can happen at a reversal, as laws that are linear but for one to three lengths or speeds.

Every law turns a track and the logarithms of its shape into columns; their weights (levels,
damping) and those of what every joint has (viscous slope, inertia, a slope along the position, an
offset for each recording) are projected out. Travel is the input, not velocity: the laws but for
LuGre's do not know how fast it went.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np

from agent.identify.result import Floats
from agent.identify.reversals.turns import Motion, Track
from agent.physics.backlash import dead_zone
from agent.physics.friction_dynamic import Dahl, LuGre, stop

COMMON = ("viscous_nm_s_per_rad", "inertia_kg_m2")


@dataclass(frozen=True)
class Range:
    """Where the shape of a law may lie: travel in rad and speeds in rad/s of these recordings."""

    finest_rad: float
    longest_rad: float
    fastest_rad_s: float


@dataclass(frozen=True)
class ReversalLaw:
    """One law of what happens at a reversal.

    Parameters
    ----------
    name : str
        As in the result.
    shape : tuple of str
        Positive parameters that are searched by their logarithm.
    levels : tuple of str
        Names of the law's own columns' weights.
    columns : callable
        ``columns(track, shape) -> (n, len(levels))``.
    bounds : callable
        ``bounds(range) -> (len(shape), 2)``.
    grid : tuple of int
        Points of the first search, for each parameter of the shape.
    step : float
        Change of a logarithm that the derivative is taken over: wide where the columns jump.
    presliding : bool
        Whether it is one of the laws of friction with memory.
    """

    name: str
    shape: tuple[str, ...]
    levels: tuple[str, ...]
    columns: Callable[[Track, Floats], Floats]
    bounds: Callable[[Range], Floats]
    grid: tuple[int, ...] = ()
    step: float = 1e-3
    presliding: bool = True

    @property
    def linear(self) -> tuple[str, ...]:
        """Return the names of all linear parameters that are reported."""
        return (*self.levels, *COMMON)


def _start(track: Track) -> float:
    """Return the direction in which the track sets out: friction is taken to be relaxed there."""
    moving = np.flatnonzero(np.abs(track.velocity_rad_s) > 0.1 * np.abs(track.velocity_rad_s).max())
    return float(np.sign(track.velocity_rad_s[moving[0]]))


def _coulomb(track: Track, _shape: Floats) -> Floats:
    return np.sign(track.driving_rad_s)[:, np.newaxis]


def _dahl(track: Track, shape: Floats) -> Floats:
    law = Dahl(1.0, 1.0 / float(shape[0]))
    return law.torque_nm(track.time_s, track.driving_rad_s, _start(track))[:, np.newaxis]


def _bliman_sorine(track: Track, shape: Floats) -> Floats:
    """Return the fast and the slow element of level 1; the second shape is h/(1 - h)."""
    slow = float(shape[0])
    fast = slow * share_of(float(shape[1]))
    elements = [
        Dahl(1.0, 1.0 / length).torque_nm(track.time_s, track.driving_rad_s, _start(track))
        for length in (fast, slow)
    ]
    # The slow element takes away: its weight is the paper's f2 with the sign turned.
    return np.stack((elements[0], -elements[1]), axis=-1)


def _lugre(track: Track, shape: Floats) -> Floats:
    """Return bristles of Coulomb level 1, and the rate that their damping multiplies."""
    length, extra, speed = (float(x) for x in shape)
    time_s, velocity, start = track.time_s, track.driving_rad_s, _start(track)
    bristles = LuGre(1.0, 0.0, extra, speed, 1.0 / length)
    force = bristles.torque_nm(time_s, velocity, start)
    return np.stack((force, bristles.rate_rad_s(velocity, force)), axis=-1)


def _wind_up(track: Track, shape: Floats) -> Floats:
    """Return the motor's dry friction, and friction and momentum of an arm behind a spring."""
    return _geared(track, 0.0, float(shape[0]))


def _backlash(track: Track, shape: Floats) -> Floats:
    """Return the motor's dry friction, and those of an arm behind a clearance and a spring."""
    return _geared(track, float(shape[0]), float(shape[1]))


def _geared(track: Track, gap_rad: float, wind_up_rad: float) -> Floats:
    """Return columns of an arm that stands until gap and wind-up are taken up, shape (n, 3).

    The gear's torque is the dead zone of the motor's place between the flanks, and yields at the
    arm's friction. The arm's momentum jumps where it is caught up: the derivative of that is the
    impact.
    """
    reach = 0.5 * (gap_rad + wind_up_rad)
    travel = track.travel_rad
    place = stop(np.concatenate(([_start(track) * reach], travel[1:])), reach)
    load = dead_zone(place, 0.5 * gap_rad) / (0.5 * wind_up_rad)
    before = np.concatenate((place[:1], place[:-1]))
    # The share of a step after the arm was caught up: columns must not jump as the gap grows.
    beyond = np.abs(before + travel) - reach
    share = np.clip(beyond / np.maximum(np.abs(travel), 1e-300), 0.0, 1.0)
    momentum = np.gradient(track.driving_rad_s * share, track.period_s)
    return np.stack((np.sign(track.driving_rad_s), load, momentum), axis=-1)


def share_of(ratio: float) -> float:
    """Return ``r/(1 + r)``, a share below 1 for every positive ratio."""
    return ratio / (1.0 + ratio)


def _length(range_: Range) -> tuple[float, float]:
    return 0.3 * range_.finest_rad, 0.5 * range_.longest_rad


def _bounds(*more: tuple[float, float]) -> Callable[[Range], Floats]:
    return lambda range_: np.array([_length(range_), *more])


_GEARED = ("motor_coulomb_nm", "arm_coulomb_nm", "arm_inertia_kg_m2")

NONE = ReversalLaw("coulomb", (), ("coulomb_nm",), _coulomb, lambda _: np.zeros((0, 2)))

LAWS: Mapping[str, ReversalLaw] = MappingProxyType(
    {
        law.name: law
        for law in (
            NONE,
            ReversalLaw(
                "dahl", ("space_constant_rad",), ("coulomb_nm",), _dahl, _bounds(), grid=(14,)
            ),
            ReversalLaw(
                "bliman-sorine",
                ("space_constant_rad", "fast_ratio"),
                ("fast_nm", "slow_nm"),
                _bliman_sorine,
                _bounds((0.02, 20.0)),
                grid=(10, 4),
            ),
            ReversalLaw(
                "lugre",
                ("space_constant_rad", "static_extra_share", "stribeck_velocity_rad_s"),
                ("coulomb_nm", "damping_nm_s_per_rad"),
                _lugre,
                lambda r: np.array(
                    [_length(r), (1e-3, 5.0), (2e-3 * r.fastest_rad_s, r.fastest_rad_s)]
                ),
                grid=(7, 2, 3),
            ),
            ReversalLaw(
                "wind-up",
                ("wind_up_rad",),
                _GEARED,
                _wind_up,
                _bounds(),
                grid=(24,),
                step=1e-2,
                presliding=False,
            ),
            ReversalLaw(
                "backlash",
                ("backlash_rad", "wind_up_rad"),
                _GEARED,
                _backlash,
                lambda r: np.array([_length(r), _length(r)]),
                grid=(14, 4),
                step=1e-2,
                presliding=False,
            ),
        )
    }
)
"""Every law by its name, simplest first; the last two are the rivals of presliding."""


def range_of(motion: Motion) -> Range:
    """Return what the recordings can tell apart: travel from finest to longest, fastest speed."""
    longest, finest = [], []
    for track in motion.tracks:
        ends = [0, *(turn.at for turn in track.turns), track.position_rad.size - 1]
        legs = np.abs(np.diff(track.position_rad[ends]))
        longest.append(float(legs.max()))
        for turn in track.turns:
            # The first two samples after a turn: less than their travel, nothing was sampled.
            near = track.position_rad[turn.at : turn.at + 3]
            finest.append(max(track.resolution_rad, float(np.ptp(near))))
    fastest = max(float(np.abs(t.velocity_rad_s).max()) for t in motion.tracks)
    return Range(float(np.median(finest)), max(longest), fastest)
