"""The same low-pass where only every so many-th sample is kept: a sum over its impulse response.

A transform gives all samples, and costs the more the longer a stretch is. The filter's response
has died away after some ten periods of the cutoff; where a few samples are kept for each of these,
that sum is less work than the transform, for every band alike.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from agent.identify.result import Floats
from agent.identify.signals.lowpass import circular_length, extension, lowpass, response

_GONE = 1e-9  # of the response's sum: what is left out of it
_MOST_WORK = 160  # products for each sample: with more, the transform is quicker


@dataclass(frozen=True)
class Part:
    """A stretch among others, sampled evenly: where it stands, and how it is thinned.

    Parameters
    ----------
    samples, rows : slice
        Where it stands among the samples, and among those that are kept.
    period_s : float
        Time between samples.
    cutoff_hz : float
        Where the response has fallen to one half.
    every : int
        Of so many samples one is kept, the first one first.
    """

    samples: slice
    rows: slice
    period_s: float
    cutoff_hz: float
    every: int


class Thinned:
    """The low-pass of stretches that lie one behind the other, each by itself, and thinned.

    To a billionth what `lowpass` returns at the samples that are kept. Columns are many and some
    stretches short: all that is the same for every column is found once.

    Parameters
    ----------
    parts : sequence of Part
    """

    def __init__(self, parts: Sequence[Part]) -> None:
        self._count = max((part.rows.stop for part in parts), default=0)
        taps: list[Floats] = []
        summed: list[tuple[int, ...]] = []
        self._transformed: list[Part] = []
        for part in parts:
            found = _summable(part)
            if found is None:
                self._transformed.append(part)
                continue
            response, length, pad = found
            at = sum(own.shape[0] for own in taps)
            ends = part.samples.start, part.samples.stop, part.rows.start, part.rows.stop
            summed.append((*ends, at, at + response.shape[0], length, pad, part.every))
            taps.append(response)
        self._summed: NDArray[np.int64] = np.array(summed, dtype=np.int64).reshape(-1, 9)
        self._taps = np.concatenate([np.empty(0), *taps])

    def __call__(self, columns: Floats) -> Floats:
        """Return columns, shape (N, k), at the rows that are kept, shape (n, k)."""
        from agent.identify.signals.thinning_kernel import summed_stretches

        out = np.empty((self._count, columns.shape[1]))
        if self._summed.shape[0]:
            own = np.ascontiguousarray(columns, dtype=np.float64)
            summed_stretches(own, self._summed, self._taps, out)
        for part in self._transformed:
            out[part.rows] = _transformed(columns[part.samples].T, part).T
        return out


def _summable(part: Part) -> tuple[Floats, int, int] | None:
    """Return response, transform's length and extension; None where no sum is less work."""
    samples, cutoff = part.samples.stop - part.samples.start, part.cutoff_hz * part.period_s
    if samples < 3 or cutoff >= 0.5:
        return None
    length = circular_length(samples, cutoff)
    taps = _taps(length, cutoff)
    if taps.shape[0] > samples or taps.shape[0] > _MOST_WORK * part.every:
        return None
    return taps, length, extension(samples, cutoff)


def _transformed(rows: Floats, part: Part) -> Floats:
    """Return a part's rows, shape (k, n), low-passed as a whole, every so many-th sample."""
    return lowpass(rows, part.period_s, part.cutoff_hz)[:, :: part.every]


@lru_cache(maxsize=256)
def _taps(length: int, cutoff: float) -> Floats:
    """Return the filter's response to one sample, both ways, as far as it counts, shape (2 r + 1,).

    Parameters
    ----------
    length : int
        Samples of the transform whose response it is.
    cutoff : float
        In cycles per sample.
    """
    impulse = np.fft.irfft(response(length, cutoff), n=length)
    half = impulse[: length // 2]
    beyond = 2.0 * np.cumsum(np.abs(half[::-1]))[::-1]
    reach = int(np.count_nonzero(beyond > _GONE)) - 1
    taps = np.concatenate((half[reach:0:-1], half[: reach + 1]))
    taps.flags.writeable = False
    return np.asarray(taps)
