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
from functools import lru_cache

import numpy as np

from agent.identify.result import Floats

ORDER = 4
_ENERGY_KEPT = 0.90
_BAND_BINS = 16  # of a recording of a minute or less
_BAND_S = 60.0  # the bands of longer ones are as broad as a minute's
_HARMONICS = 4.0
_NOISE_SHARE = 0.01  # of the acceleration's energy: biases the inertia low by as much
_AT_ONCE = 1 << 20  # numbers: of more, one row after the other spares half of the memory


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
    samples, cutoff = rows.shape[-1], cutoff_hz * period_s
    if samples < 3 or cutoff >= 0.5:
        return rows.astype(np.float64, copy=True)
    if rows.ndim > 1 and rows.size > _AT_ONCE:
        out = np.empty(rows.shape)
        for own, row in zip(out, rows, strict=True):
            own[...] = lowpass(row, period_s, cutoff_hz)
        return out
    pad, length = extension(samples, cutoff), circular_length(samples, cutoff)
    first, last = rows[..., :1], rows[..., -1:]
    end, tail = samples + 2 * pad, samples + pad
    # The transform is circular: what comes before the first sample stands at the end of the rows.
    extended = np.empty((*rows.shape[:-1], length))
    extended[..., :samples] = rows
    np.subtract(2.0 * last, rows[..., -2 : -pad - 2 : -1], out=extended[..., samples:tail])
    np.subtract(2.0 * first, rows[..., pad:0:-1], out=extended[..., length - pad :])
    ramp = _ramp(length - end)  # joins what was added behind to what was added before, smoothly
    behind, before = extended[..., tail - 1 : tail], extended[..., length - pad : length - pad + 1]
    extended[..., tail : length - pad] = behind * (1.0 - ramp) + before * ramp
    spectrum = np.fft.rfft(extended, axis=-1)
    spectrum *= response(length, cutoff)
    filtered = np.fft.irfft(spectrum, n=length, axis=-1)
    return np.ascontiguousarray(filtered[..., :samples], dtype=np.float64)


def extension(samples: int, cutoff: float) -> int:
    """Return by how many samples rows are extended at each end; the cutoff is per sample."""
    return min(samples - 1, int(np.ceil(3.0 / cutoff)))


def circular_length(samples: int, cutoff: float) -> int:
    """Return the samples of the transform of extended rows; the cutoff is per sample."""
    return _fast_length(samples + 2 * extension(samples, cutoff))


def response(length: int, cutoff: float) -> Floats:
    """Return the filter's response at every bin of a transform; a short one is kept.

    Parameters
    ----------
    length : int
        Samples of the transform.
    cutoff : float
        In cycles per sample.
    """
    return (_kept if length <= _AT_ONCE else _response)(length, cutoff)


def _response(length: int, cutoff: float) -> Floats:
    frequency = np.fft.rfftfreq(length)
    ratio = np.tan(np.pi * np.minimum(frequency, 0.499999)) / np.tan(np.pi * cutoff)
    response = np.asarray(1.0 / (1.0 + ratio ** (2 * ORDER)))
    response.flags.writeable = False
    return response


_kept = lru_cache(maxsize=256)(_response)


@lru_cache(maxsize=256)
def _ramp(count: int) -> Floats:
    """Return `count` even steps strictly between 0 and 1."""
    ramp = np.linspace(0.0, 1.0, count + 2)[1:-1]
    ramp.flags.writeable = False
    return np.asarray(ramp)


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

    @property
    def noise_share(self) -> float:
        """Return the noise as a share of the motion; 0 for a joint that does not accelerate."""
        if self.acceleration_rad_s2 <= 0.0:
            return 0.0
        return self.noise_rad_s2 / self.acceleration_rad_s2


def choose_cutoff(channels: Sequence[tuple[Floats, float]], *, differences: int) -> Cutoff:
    """Choose the cutoff from the excitation and the noise of the measured motion.

    The spectrum of the acceleration is taken from the measured channel. Measuring noise is white
    in that channel; its level is read where the motion has least power, in the upper half of the
    band; frequencies at which noise prevails are no motion, and its share is taken away from the
    others. The cutoff is the frequency below which 90 % of the remaining energy lies, or four
    times the one below which half of it lies, if that is more: a narrow motion must keep the
    harmonics of its sign. It is lowered where the noise that passes would exceed 1 % of the
    energy, by which share an inertia would be biased low. Above lie the arm's resonances, which
    a rigid body does not have, and noise.

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
    frequency, power, noise = frequency[order], power[order], noise[order]
    # Passes recorded one by one must each be long enough for the filter.
    length_s = float(np.median([len(x) * period_s for x, period_s in channels]))
    end = _drowned(power, noise, length_s)
    noise_sum = np.cumsum(noise[:end])
    motion_sum = np.maximum.accumulate(np.cumsum(power[:end]) - noise_sum)
    motion = float(motion_sum[-1])
    if motion <= 0.0:
        return Cutoff(0.2 * fastest_hz, 0.0, float(np.sqrt(noise_sum[-1] / samples)))
    half = int(np.argmax(motion_sum >= 0.5 * motion))
    most = int(np.argmax(motion_sum >= _ENERGY_KEPT * motion))
    wanted_hz = max(float(frequency[most]), _HARMONICS * float(frequency[half]))
    index = min(int(np.searchsorted(frequency, wanted_hz)), end - 1)
    too_noisy = np.flatnonzero(noise_sum[half : index + 1] > _NOISE_SHARE * motion)
    if too_noisy.size:
        index = half + int(too_noisy[0])
        wanted_hz = float(frequency[index])
    return Cutoff(
        float(np.clip(wanted_hz, min(4.0 / length_s, 0.2 * fastest_hz), 0.2 * fastest_hz)),
        float(np.sqrt(motion / samples)),
        float(np.sqrt(noise_sum[index] / samples)),
    )


def _drowned(power: Floats, noise: Floats, length_s: float) -> int:
    """Return how many bins, from the lowest frequency up, rise above the noise.

    Judged in bands of an eighth of their frequency or 16 bins: the last band whose power is at
    least twice its noise ends the motion's part of the spectrum. The spectrum of work that was
    repeated is lines with nothing between them, as many bins apart as it was repeated: the bands of
    a long recording are no narrower than those of a minute.
    """
    count = power.shape[0]
    narrowest = max(_BAND_BINS, round(_BAND_BINS * length_s / _BAND_S))
    edges = [0]
    while edges[-1] < count:
        edges.append(min(edges[-1] + max(narrowest, edges[-1] // 8), count))
    starts = np.array(edges[:-1])
    clear = np.add.reduceat(power, starts) > 2.0 * np.add.reduceat(noise, starts)
    drowned = np.flatnonzero(~clear)
    # One noisy band may lie in a hole of the motion's spectrum; two in a row are the end.
    ends = drowned[:-1][np.diff(drowned) == 1] if drowned.size > 1 else drowned[:0]
    if ends.size:
        return max(edges[int(ends[0])], 1)
    return edges[int(drowned[-1])] if drowned.size and drowned[-1] == len(clear) - 1 else count


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
    power = np.asarray(power, dtype=np.float64)
    return frequency.astype(np.float64), power, np.asarray(level * shape, dtype=np.float64)


@lru_cache(maxsize=256)
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
