"""A whole motion: frozen, validated when made, cheap to ask at 1 kHz, and plain JSON on disk."""

from __future__ import annotations

import math
from bisect import bisect_right
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from trajectories import document as json_form
from trajectories.checks import ParameterValue, TrajectoryError, finite, frozen_parameters, word
from trajectories.segment import Phase, Piece, Segment

Floats = NDArray[np.float64]


class SetPoint(NamedTuple):
    """Where the motor should be, and what for."""

    position_rad: float
    velocity_rad_s: float
    acceleration_rad_s2: float
    phase: Phase


class SetPoints(NamedTuple):
    """A trajectory sampled at given times; all arrays have shape (n,)."""

    time_s: Floats
    position_rad: Floats
    velocity_rad_s: Floats
    acceleration_rad_s2: Floats
    phase: NDArray[np.str_]


class SteadyWindow(NamedTuple):
    """A dwell at constant velocity."""

    start_s: float
    end_s: float
    velocity_rad_s: float


class PositionWindow(NamedTuple):
    """The stretch of positions that a steady dwell passes; `low_rad` < `high_rad`."""

    low_rad: float
    high_rad: float
    velocity_rad_s: float


@dataclass(frozen=True)
class Trajectory:
    """Segments one after the other, from rest to rest, motor side.

    Parameters
    ----------
    name : str
        What kind of motion it is, "stair-paired" for example.
    parameters : mapping
        What it was made from: numbers, words, or sequences of numbers. Kept with recordings.
    start_position_rad : float
        Where the motor stands before it begins.
    segments : sequence of Segment
        Velocity must be continuous, and zero at both ends. Empty means: stay.

    Raises
    ------
    TrajectoryError
        Something is not finite, velocity jumps, or the motion does not start and end at rest.
    """

    name: str
    parameters: Mapping[str, ParameterValue] = field(hash=False)
    start_position_rad: float
    segments: tuple[Segment, ...]
    pieces: tuple[Piece, ...] = field(init=False, repr=False, compare=False)
    _starts_s: list[float] = field(init=False, repr=False, compare=False)
    _cubics: list[tuple[float, float, float, float, float, Phase]] = field(
        init=False, repr=False, compare=False
    )

    def __post_init__(self) -> None:
        set_ = object.__setattr__
        set_(self, "name", word("name", self.name))
        set_(self, "parameters", MappingProxyType(frozen_parameters(self.parameters)))
        set_(self, "start_position_rad", finite("start_position_rad", self.start_position_rad))
        set_(self, "segments", tuple(self.segments))
        _check_joints(self.segments)
        self._lay_out()

    def _lay_out(self) -> None:
        """Place every piece of constant jerk on the common axes of time and position."""
        time_s, position_rad = 0.0, self.start_position_rad
        pieces: list[Piece] = []
        # A rest before the beginning and one after the end make `at` total and free of branches.
        starts_s = [-math.inf]
        cubics: list[tuple[float, float, float, float, float, Phase]] = [
            (0.0, position_rad, 0.0, 0.0, 0.0, "rest")
        ]
        for segment in self.segments:
            for local in segment.pieces():
                piece = local._replace(
                    start_s=time_s + local.start_s, position_rad=position_rad + local.position_rad
                )
                pieces.append(piece)
                starts_s.append(piece.start_s)
                cubics.append((piece.start_s, *piece[2:], segment.phase))
            time_s += segment.duration_s
            position_rad += segment.displacement_rad
        starts_s.append(time_s)
        cubics.append((time_s, position_rad, 0.0, 0.0, 0.0, "rest"))
        if not all(map(math.isfinite, (time_s, position_rad, *(p.position_rad for p in pieces)))):
            raise TrajectoryError(
                f"a trajectory must stay finite; this one would end at {position_rad} rad "
                f"after {time_s} s"
            )
        object.__setattr__(self, "pieces", tuple(pieces))
        object.__setattr__(self, "_starts_s", starts_s)
        object.__setattr__(self, "_cubics", cubics)

    def __reduce__(self) -> tuple[type[Trajectory], tuple[Any, ...]]:
        """Pickle and copy by construction: the read-only view of the parameters cannot travel."""
        return Trajectory, (
            self.name,
            dict(self.parameters),
            self.start_position_rad,
            self.segments,
        )

    @property
    def duration_s(self) -> float:
        """How long the motion lasts."""
        return self._starts_s[-1]

    @property
    def end_position_rad(self) -> float:
        """Where the motion ends."""
        return self._cubics[-1][1]

    def at(self, time_s: float) -> SetPoint:
        """Return the set-point at `time_s`; the first and last state hold outside the motion.

        A NaN gives NaN, so that whoever guards the command sees it.
        """
        start, x, v, a, j, phase = self._cubics[bisect_right(self._starts_s, time_s) - 1]
        d = time_s - start
        return SetPoint(
            x + d * (v + d * (0.5 * a + d * j / 6.0)), v + d * (a + 0.5 * d * j), a + d * j, phase
        )

    def sample(self, time_s: ArrayLike) -> SetPoints:
        """Return the set-points at many times.

        Parameters
        ----------
        time_s : array_like, shape (n,)
            Seconds, in any order; outside the motion its first and last state hold.

        Returns
        -------
        SetPoints
            The same numbers as `at`, as arrays of shape (n,).
        """
        times = np.asarray(time_s, dtype=np.float64)
        index = np.searchsorted(np.asarray(self._starts_s), times, side="right") - 1
        table = np.array([cubic[:5] for cubic in self._cubics])
        start, x, v, a, j = table[index].T
        d = times - start
        return SetPoints(
            times,
            x + d * (v + d * (0.5 * a + d * j / 6.0)),
            v + d * (a + 0.5 * d * j),
            a + d * j,
            np.array([cubic[5] for cubic in self._cubics])[index],
        )

    def steady_windows(self) -> tuple[SteadyWindow, ...]:
        """Return every dwell at constant velocity, in order of time."""
        out: list[SteadyWindow] = []
        time_s = 0.0
        for segment in self.segments:
            end_s = time_s + segment.duration_s
            if segment.phase == "steady":
                out.append(SteadyWindow(time_s, end_s, segment.velocity_start_rad_s))
            time_s = end_s
        return tuple(out)

    def position_windows(self) -> tuple[PositionWindow, ...]:
        """Return the positions that each steady window passes, in the order of `steady_windows`."""
        out: list[PositionWindow] = []
        position_rad = self.start_position_rad
        for segment in self.segments:
            end_rad = position_rad + segment.displacement_rad
            if segment.phase == "steady":
                low, high = sorted((position_rad, end_rad))
                out.append(PositionWindow(low, high, segment.velocity_start_rad_s))
            position_rad = end_rad
        return tuple(out)

    def reversed(self) -> Trajectory:
        """Return the same path run backward in time: ``q'(t) = q(T - t)`` (thesis 4.1.2).

        It starts where this one ends. Every steady window at ``v`` over some positions becomes one
        at ``-v`` over the same positions, so what was paired stays paired, and the acceleration
        that led into a dwell now leads out of it: unseen data from the same states.
        """
        parameters = dict(self.parameters)
        if parameters.pop("reversed", False) is not True:
            parameters["reversed"] = True
        return Trajectory(
            self.name,
            parameters,
            self.end_position_rad,
            tuple(segment.reversed() for segment in reversed(self.segments)),
        )

    def to_json(self) -> dict[str, Any]:
        """Return the `stribeck.trajectory/1` document (see `trajectories.document`)."""
        return json_form.write(self.name, self.parameters, self.start_position_rad, self.segments)

    @classmethod
    def from_json(cls, document: object) -> Trajectory:
        """Return the trajectory that a `stribeck.trajectory/1` document describes.

        Raises
        ------
        TrajectoryError
            The document is not one; the message names the place.
        """
        return cls(*json_form.read(document))


def _check_joints(segments: Iterable[object]) -> None:
    """Velocity must run on from segment to segment, from zero to zero."""
    velocity = 0.0
    number = 0
    for number, segment in enumerate(segments, start=1):
        if not isinstance(segment, Segment):
            raise TrajectoryError(f"segment {number} must be a Segment, got {segment!r}")
        if segment.velocity_start_rad_s != velocity:
            before = "the trajectory starts at rest" if number == 1 else f"segment {number - 1}"
            ends = "" if number == 1 else f" ends with {velocity:g} rad/s"
            raise TrajectoryError(
                f"velocity must be continuous: {before}{ends}, but segment {number} begins "
                f"with {segment.velocity_start_rad_s:g} rad/s"
            )
        velocity = segment.velocity_end_rad_s
    if velocity != 0.0:
        raise TrajectoryError(
            f"a trajectory must end at rest; segment {number}, the last, ends with "
            f"{velocity:g} rad/s"
        )
