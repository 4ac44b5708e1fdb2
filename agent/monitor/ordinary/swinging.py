"""An arm that swings behind a soft gear: heard in what a rigid joint leaves of the torque.

A drive that keeps its motor on a path answers an arm on a spring by the motor torque

    J_a (H(s) - 1) a,   H(s) = (2 z w s + w^2) / (s^2 + 2 z w s + w^2)

beside the rigid joint's, with a the motor's acceleration, J_a the arm's inertia (motor side), w its
frequency clamped at the motor and z its damping (two-mass model; thesis (3.2),
`agent.physics.flexibility`). That column is tried over frequencies and dampings beside the rigid
body's own columns: whichever explains most of the rest, with an inertia that the joint can have, is
the swinging. Noise, ripple and unknown friction do not follow the motor's acceleration in this way.

Where the arm swings slowly, ringing outlasts the blocks of time in which ordinary motion is
weighed, and drowns what friction does: nothing that stands on a rigid joint is decidable there.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.preprocess import (
    FilteredStretch,
    Motion,
    filter_motion,
    shared_cutoff,
)
from agent.physics.flexibility import lag_share
from agent.physics.rigid_body import PARAMETERS

SLOWEST_BEARABLE_HZ = 7.0
"""Slower swinging makes intervals too narrow and hides wear; measured, docs/ordinary-motion.md."""

_HEARD = 0.5  # of what the rigid joint leaves; rigid joints show up to 0.1, real ones, too
_FREQUENCIES_HZ = np.geomspace(1.0, 12.0, 31)
_DAMPINGS = (0.02, 0.05, 0.1, 0.2)
_OVER = 8.0  # times the cutoff: nothing that a filtered signal has is lost at this rate
_ACCELERATION = PARAMETERS.index("inertia_kg_m2")


@dataclass(frozen=True)
class Swinging:
    """The swinging arm that explains most of what a rigid joint leaves.

    Parameters
    ----------
    frequency_hz, damping : float
        Of the arm, the motor being held.
    inertia_share : float
        Of the joint's inertia that swings.
    explained : float
        Share of the rigid joint's squared rest that it explains.
    """

    frequency_hz: float
    damping: float
    inertia_share: float
    explained: float

    @property
    def refusal(self) -> str:
        """Return why nothing that takes the joint for rigid can be said; empty where it can."""
        if self.explained < _HEARD or self.frequency_hz > SLOWEST_BEARABLE_HZ:
            return ""
        return (
            f"the arm swings at about {self.frequency_hz:.2g} Hz behind a soft gear, which is "
            f"{100.0 * self.explained:.0f} % of what a rigid joint leaves of the torque: below "
            f"{SLOWEST_BEARABLE_HZ:g} Hz friction cannot be told from its ringing in ordinary "
            "motion. Rely on the dedicated cycle; `stribeck flexible` measures the gear"
        )


def swinging_of(motions: Sequence[Motion]) -> Swinging | None:
    """Look for an arm that swings; None where the motion does not accelerate the joint.

    Parameters
    ----------
    motions : sequence of Motion
        Recordings of one axis.
    """
    cutoff_hz = shared_cutoff(motions).frequency_hz
    stretches = [
        _thinned(s, cutoff_hz) for motion in motions for s in filter_motion(motion, cutoff_hz)
    ]
    rows = [s.regressor[s.usable] for s in stretches]
    if not rows:
        return None
    columns = np.concatenate(rows)
    torque = np.concatenate([s.torque_nm[s.usable] for s in stretches])
    kept = np.flatnonzero(np.any(columns != 0.0, axis=0))
    if _ACCELERATION not in kept or torque.size <= kept.size:
        return None
    columns = columns[:, kept] / np.linalg.norm(columns[:, kept], axis=0)
    basis, triangle = np.linalg.qr(columns)
    left = torque - basis @ (basis.T @ torque)
    accelerated = int(np.flatnonzero(kept == _ACCELERATION)[0])
    scale = float(np.linalg.norm(np.concatenate(rows)[:, _ACCELERATION]))
    found = None
    for frequency_hz, damping, swung in _tried(stretches):
        own = swung - basis @ (basis.T @ swung)
        power = float(own @ own)
        if power <= 0.0:
            continue
        arm = float(own @ left) / power
        weights = np.linalg.lstsq(triangle, basis.T @ (torque - arm * swung), rcond=None)[0]
        inertia = float(weights[accelerated]) / scale
        explained = arm**2 * power / float(left @ left)
        if 0.0 < arm <= inertia and (found is None or explained > found.explained):
            found = Swinging(frequency_hz, damping, arm / inertia, explained)
    return found


@dataclass(frozen=True)
class _Thinned:
    """Every so many samples of a filtered stretch: `FilteredStretch` says what they are."""

    period_s: float
    regressor: Floats
    torque_nm: Floats
    usable: NDArray[np.bool_]


def _thinned(filtered: FilteredStretch, cutoff_hz: float) -> _Thinned:
    """Thin a stretch to a rate well above its low-pass; ten million rows took minutes to search."""
    period_s = filtered.stretch.period_s
    every = max(int(1.0 / (_OVER * cutoff_hz * period_s)), 1)
    return _Thinned(
        every * period_s,
        filtered.regressor[::every].copy(),
        filtered.torque_nm[::every].copy(),
        filtered.usable[::every],
    )


def _tried(stretches: Sequence[_Thinned]) -> Iterator[tuple[float, float, Floats]]:
    """Yield each frequency and damping with ``(H - 1) a`` at the usable samples."""
    spectra = [_spectrum(filtered) for filtered in stretches]
    for frequency_hz in _FREQUENCIES_HZ.tolist():
        for damping in _DAMPINGS:
            parts = []
            for filtered, (spectrum, at_hz) in zip(stretches, spectra, strict=True):
                over = at_hz / frequency_hz
                lag = -lag_share(1.0, 1.0, 2.0 * damping, over)  # H - 1, in the swing's own time
                swung = np.fft.irfft(spectrum * lag)[: filtered.usable.size]
                parts.append(swung[filtered.usable])
            yield frequency_hz, damping, np.concatenate(parts)


def _spectrum(filtered: _Thinned) -> tuple[NDArray[np.complex128], Floats]:
    """Return the acceleration's spectrum and its frequencies, shapes (m,).

    At least as many zeros follow as there are samples, so that no ringing of the end comes in at
    the start; a power of two, or the transform takes long.
    """
    acceleration = filtered.regressor[:, _ACCELERATION]
    count = 1 << (2 * acceleration.size - 1).bit_length()
    at_hz: Floats = np.asarray(np.fft.rfftfreq(count, filtered.period_s), np.float64)
    return np.fft.rfft(acceleration, count), at_hz
