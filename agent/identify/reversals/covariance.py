"""How far the torque's noise and the encoder's steps move a law's parameters.

What is white in the recorded torque has passed the regression's low-pass, and is no longer white;
how it moves the parameters is known exactly, because the low-pass is linear. Besides, the encoder
says where the joint turned round to no better than a part of its step: a stiff contact remembers
that over all of the presliding, alike at every turn that is made at the same place.
"""

from __future__ import annotations

import math
from collections import defaultdict
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats
from agent.identify.reversals.data import Data, columns_of, common_columns
from agent.identify.reversals.laws import ReversalLaw
from agent.identify.reversals.turns import Motion, Track
from agent.identify.uncertainty import student_975

_INDEPENDENT = 0.5  # of the samples used: there are four to one period of the cutoff


@dataclass(frozen=True)
class Linear:
    """A law about its minimum: ``torque = jacobian @ change + rest``.

    Parameters
    ----------
    jacobian : ndarray, shape (N, k)
        Slope of the predicted torque by every parameter.
    inverse : ndarray, shape (k, k)
        Of ``jacobian' jacobian``.
    rest : ndarray, shape (N,)
        Residual torque, N m.
    """

    jacobian: Floats
    inverse: Floats
    rest: Floats


def noise_covariance(data: Data, at: Linear) -> tuple[Floats, float]:
    """Return the parameters' covariance under white torque noise, and its degrees of freedom.

    The noise's variance comes from the residual, as unbiased as behind the same low-pass.
    """
    size = at.jacobian.shape[1]
    moved = np.zeros((size, size))
    expected = 0.0
    first = 0
    for track, kept in zip(data.motion.tracks, data.kept, strict=True):
        sparse = np.zeros((track.time_s.size, size))
        np.add.at(sparse, kept, at.jacobian[first : first + kept.size])
        first += kept.size
        passed = track.filtered(sparse)
        moved += passed.T @ passed
        expected += kept.size * _passed(track)
    expected -= float(np.trace(at.inverse @ moved))
    freedom = max(_INDEPENDENT * at.rest.size - size, 1.0)
    variance = float(at.rest @ at.rest) / max(expected, 1e-300)
    return variance * at.inverse @ moved @ at.inverse, freedom


def turn_covariance(law: ReversalLaw, data: Data, x: Floats, weights: Floats, at: Linear) -> Floats:
    """Return the parameters' covariance from not knowing where exactly each turn was.

    Parameters
    ----------
    law, data, x, weights
        The minimum: logarithms of the shape, and weights of `columns_of`.
    at : Linear
        The same, linear.
    """
    size = at.jacobian.shape[1]
    if not law.shape or not any(t.place_error_rad > 0.0 for t in data.motion.tracks):
        return np.zeros((size, size))
    ahead, behind = (columns_of(law, _turned(data, sign), x) @ weights for sign in (1.0, -1.0))
    change = 0.5 * (ahead - behind)
    pulls = data.sums(at.jacobian * change[:, np.newaxis])
    places: dict[object, Floats] = defaultdict(lambda: np.zeros(size))
    for place, pull in zip(_places(data.motion), pulls, strict=True):
        places[place] = places[place] + pull
    total = sum((np.outer(p, p) for p in places.values()), np.zeros((size, size)))
    return np.asarray(at.inverse @ total @ at.inverse)


def _turned(data: Data, sign: float) -> Data:
    """Return the data with every turn further out by its error, or less far.

    What of a wrong extreme passes the regression's low-pass bends position, velocity and
    acceleration alike.
    """
    tracks = []
    for track in data.motion.tracks:
        peaks = np.zeros(track.time_s.size)
        for turn in track.turns:
            peaks[turn.at] = 1.0 if turn.forward_before else -1.0
        path = sign * track.place_error_rad * track.filtered(peaks) / _height(track)
        velocity = np.gradient(path, track.period_s)
        tracks.append(
            replace(
                track,
                position_rad=track.position_rad + path,
                velocity_rad_s=track.velocity_rad_s + velocity,
                acceleration_rad_s2=track.acceleration_rad_s2
                + np.gradient(velocity, track.period_s),
                driving_rad_s=track.driving_rad_s + velocity,
            )
        )
    motion = replace(data.motion, tracks=tuple(tracks))
    return replace(data, motion=motion, common=common_columns(motion, data.kept))


def _height(track: Track) -> float:
    """Return the peak of the regression's low-pass, as an impulse leaves it."""
    return float(track.filtered(_impulse(track)).max())


def _places(motion: Motion) -> list[object]:
    """Return one name for every turn: the same where an encoder's step errs alike."""
    names: list[object] = []
    for track in motion.tracks:
        for turn in track.turns:
            if track.step_rad > 0.0:
                step = round(float(track.position_rad[turn.at]) / track.step_rad)
                names.append((track.recording, turn.forward_before, step))
            else:
                names.append(len(names))
    return names


def _passed(track: Track) -> float:
    """Return the share of white noise's variance that the regression's low-pass lets through."""
    return float(np.sum(track.filtered(_impulse(track)) ** 2))


def _impulse(track: Track) -> Floats:
    impulse = np.zeros(track.time_s.size)
    impulse[impulse.size // 2] = 1.0
    return impulse


def half_interval(
    gradient: Floats, noise: tuple[Floats, float], turning: Floats, own: tuple[float, float]
) -> float:
    """Return half of the 95 % interval of a function with this gradient.

    The wider of two: what noise and the encoder explain, which is known well; and what the
    reversals differ by, which holds whatever the reason is, but is known from a few of them.

    Parameters
    ----------
    gradient : ndarray, shape (k,)
    noise, turning
        As `noise_covariance` and `turn_covariance` give them.
    own : tuple of float
        Variance by leaving out each reversal, and its degrees of freedom.
    """
    covariance, freedom = noise
    known = float(gradient @ (covariance + turning) @ gradient)
    by_model = student_975(freedom) * math.sqrt(max(known, 0.0))
    return max(by_model, student_975(max(own[1], 1.0)) * math.sqrt(own[0]))
