"""One zero-phase low-pass for every signal and every regressor, and the choice of its cutoff.

The filter is the Butterworth low-pass run forward and backward. Its two passes multiply to the
real response ``1 / (1 + (tan(pi f/fs)/tan(pi fc/fs))^(2n))`` of the bilinear design, which is
applied here in one step in the frequency domain, to all rows at once, on an oddly extended
signal. The whole operation is linear, so that ``torque = regressor @ theta`` holds after it as
before, as long as all columns go through the same filter: the sign of the velocity included.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats

ORDER = 4
_ENERGY_KEPT = 0.90
_NOISE_SHARE = 0.01  # of the acceleration's energy: biases the inertia low by as much


def lowpass(rows: Floats, period_s: float, cutoff_hz: float) -> Floats:
    """Return the rows low-passed without phase shift.

    Parameters
    ----------
    rows : ndarray, shape (..., n)
        Signals sampled evenly in time.
    period_s : float
        Time between samples.
    cutoff_hz : float
        Where the response has fallen to one half (both passes together).

    Returns
    -------
    ndarray, shape (..., n)
        A cutoff at or above the Nyquist frequency returns the rows as they are.
    """
    samples = rows.shape[-1]
    if samples < 3 or cutoff_hz * period_s >= 0.5:
        return rows.astype(np.float64, copy=True)
    pad = min(samples - 1, int(np.ceil(3.0 / (cutoff_hz * period_s))))
    first, last = rows[..., :1], rows[..., -1:]
    extended = np.concatenate(
        (
            2.0 * first - rows[..., pad:0:-1],
            rows,
            2.0 * last - rows[..., -2 : -pad - 2 : -1],
        ),
        axis=-1,
    )
    length = _fast_length(extended.shape[-1])
    frequency = np.fft.rfftfreq(length)
    with np.errstate(over="ignore"):
        ratio = np.tan(np.pi * np.minimum(frequency, 0.499999)) / np.tan(
            np.pi * cutoff_hz * period_s
        )
        response = 1.0 / (1.0 + ratio ** (2 * ORDER))
    # The transform is circular: the tail that is added joins the end to the beginning smoothly.
    missing = length - extended.shape[-1]
    if missing:
        ramp = np.linspace(0.0, 1.0, missing + 2)[1:-1]
        tail = extended[..., -1:] * (1.0 - ramp) + extended[..., :1] * ramp
        extended = np.concatenate((extended, tail), axis=-1)
    spectrum = np.fft.rfft(extended, axis=-1) * response
    out = np.fft.irfft(spectrum, n=length, axis=-1)[..., pad : pad + samples]
    return np.ascontiguousarray(out, dtype=np.float64)


@dataclass(frozen=True)
class Cutoff:
    """The chosen cutoff, and what it was chosen from.

    Parameters
    ----------
    frequency_hz : float
        The cutoff of the low-pass.
    acceleration_rad_s2 : float
        Root mean square of the motion's acceleration, measuring noise taken away.
    noise_rad_s2 : float
        Root mean square of the measuring noise that passes the filter, as acceleration.
    """

    frequency_hz: float
    acceleration_rad_s2: float
    noise_rad_s2: float


def choose_cutoff(channels: Sequence[tuple[Floats, float]], *, differences: int) -> Cutoff:
    """Choose the cutoff from the excitation and the noise of the measured motion.

    The spectrum of the acceleration is taken from the measured channel. Measuring noise is white
    in that channel; its level is read where the motion has least power, in the upper half of the
    band, and its share is taken away. The cutoff is the frequency below which 90 % of the
    remaining energy lies, lowered where the noise that passes would exceed 1 % of that energy
    (an inertia is biased low by that share). Above lie the arm's resonances, which a rigid body
    does not have, and noise.

    Parameters
    ----------
    channels : sequence of (ndarray, float)
        The measured channel in evenly sampled stretches, each with its sampling period in s.
    differences : int
        How often the channel must be differentiated to be an acceleration: 2 for a position, 1
        for a velocity.
    """
    spectra = [_spectrum(x, period_s, differences) for x, period_s in channels if len(x) >= 16]
    samples = sum(len(x) for x, _ in channels)
    fastest_hz = max((1.0 / period_s for _, period_s in channels), default=1.0)
    if not spectra:
        return Cutoff(0.2 * fastest_hz, 0.0, 0.0)
    frequency, power, noise = (np.concatenate(part) for part in zip(*spectra, strict=True))
    order = np.argsort(frequency, kind="stable")
    frequency = frequency[order]
    noise_sum = np.cumsum(noise[order])
    motion_sum = np.cumsum(power[order]) - noise_sum
    motion = float(motion_sum.max(initial=0.0))
    if motion <= 0.0:
        return Cutoff(0.2 * fastest_hz, 0.0, float(np.sqrt(max(noise_sum[-1], 0.0) / samples)))
    index = int(np.argmax(motion_sum >= _ENERGY_KEPT * motion))
    half = int(np.argmax(motion_sum >= 0.5 * motion))
    too_noisy = np.flatnonzero(noise_sum[half : index + 1] > _NOISE_SHARE * motion)
    if too_noisy.size:
        index = half + int(too_noisy[0])
    longest_s = max(len(x) * period_s for x, period_s in channels)
    cutoff_hz = float(np.clip(frequency[index], 4.0 / longest_s, 0.2 * fastest_hz))
    return Cutoff(
        cutoff_hz,
        float(np.sqrt(motion / samples)),
        float(np.sqrt(max(noise_sum[index], 0.0) / samples)),
    )


def _spectrum(x: Floats, period_s: float, differences: int) -> tuple[Floats, Floats, Floats]:
    """Return frequency, energy of the acceleration, and its share of white channel noise."""
    acceleration = np.diff(x, n=differences) / period_s**differences
    window = np.hanning(acceleration.shape[0] + 2)[1:-1]
    window *= np.sqrt(acceleration.shape[0] / np.sum(window**2))
    power = np.abs(np.fft.rfft((acceleration - acceleration.mean()) * window)) ** 2
    frequency = np.fft.rfftfreq(acceleration.shape[0], period_s)
    power *= 2.0 / acceleration.shape[0]
    # White noise, differenced: |1 - exp(-i w)|^2 for every difference taken.
    shape = (2.0 - 2.0 * np.cos(2.0 * np.pi * frequency * period_s)) ** differences
    upper = slice(int(0.5 * frequency.shape[0]), int(0.95 * frequency.shape[0]) + 1)
    # The mean of an exponentially distributed power is its median over log 2; the median does
    # not see a resonance line in the band.
    level = float(np.median(power[upper] / np.maximum(shape[upper], 1e-12))) / np.log(2.0)
    return frequency, power, np.minimum(level * shape, power.max(initial=0.0))


def _fast_length(samples: int) -> int:
    """Return the next length that is a product of small primes, which the transform likes."""
    best = 1 << max(samples - 1, 1).bit_length()
    for five in (1, 5, 25):
        for three in (1, 3, 9):
            odd = five * three
            length = odd << max(-(-samples // odd) - 1, 0).bit_length()
            if samples <= length < best:
                best = length
    return best
