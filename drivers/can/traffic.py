"""What is said on a bus, by whom, how often, and how full the bus is: whole blocks at once.

The control tick needs each frame as a value of its own, two to thirty at a time, and `struct` is
the quicker way there. Whoever looks at a bus needs none of them: counts, times and bits of
hundreds of frames, which NumPy reads where the reader process has put them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from drivers.can_reader.ring import SLOT_BYTES

SLOTS = np.dtype(
    {
        "names": ["seconds", "nanoseconds", "can_id", "length", "data"],
        "formats": ["<i8", "<i8", "<u4", "u1", ("u1", 8)],
        "offsets": [16, 24, 56, 60, 64],
        "itemsize": SLOT_BYTES,
    }
)
"""A slot of the reader's ring as `drivers.can_reader.ring.SLOT` has it: a view, not a copy."""

EXTENDED, REMOTE, ERROR = 1 << 31, 1 << 30, 1 << 29  # linux/can.h, in the identifier
BUSIEST_OVER_S = 0.1
_IDS = 0x800
_DATA_BYTES_MAX = 8
_BITS, _EXTENDED_BITS = 47, 67  # ISO 11898-1: all but the data, three bits of silence included
_STUFFED, _EXTENDED_STUFFED = 34, 54  # of them, how many may need stuffing

Times = NDArray[np.float64]


class Block(NamedTuple):
    """Frames in the order in which they came.

    Parameters
    ----------
    time_s : ndarray, shape (n,)
        When each came, in seconds of any clock.
    can_id : ndarray of uint32, shape (n,)
        Identifier, with `EXTENDED`, `REMOTE` and `ERROR` in its highest bits.
    length : ndarray of uint8, shape (n,)
        Bytes of data.
    """

    time_s: Times
    can_id: NDArray[np.uint32]
    length: NDArray[np.uint8]


def block_of(slots: memoryview | bytes, ahead_s: float, oldest_s: float, newest_s: float) -> Block:
    """Return the frames of a piece of the ring; identifier and length stay where they lie.

    Parameters
    ----------
    slots : buffer
        One slot after the other.
    ahead_s : float
        How far the wall clock, with which the kernel stamps, is ahead of the monotonic one.
    oldest_s, newest_s : float
        Between which monotonic times the frames came; a stamp that says otherwise is moved to the
        nearer one, as `drivers.can.routing` does it.
    """
    seen = np.frombuffer(slots, SLOTS)
    wall_s = seen["seconds"] + seen["nanoseconds"] * 1e-9
    return Block(np.clip(wall_s - ahead_s, oldest_s, newest_s), seen["can_id"], seen["length"])


@dataclass(frozen=True)
class Stream:
    """What came under one identifier.

    Parameters
    ----------
    cob_id : int
        11-bit identifier.
    frames : int
        How many.
    period_s, jitter_s, longest_s : float
        Between two of them: mean, standard deviation, longest; NaN where fewer than two came.
    """

    cob_id: int
    frames: int
    period_s: float
    jitter_s: float
    longest_s: float


class Traffic:
    """Counts what is said; hand it every block in turn.

    Attributes
    ----------
    extended, remote, error_frames, malformed : int
        Frames that are no CANopen data frames: 29-bit, remote, of the adapter's own about an error
        on the bus, longer than eight bytes.
    """

    def __init__(self) -> None:
        self.extended = self.remote = self.error_frames = self.malformed = 0
        self._frames = np.zeros(_IDS, np.int64)
        self._gaps = np.zeros(_IDS, np.int64)
        self._sum_s, self._squares_s2, self._longest_s = np.zeros((3, _IDS))
        self._last_s = np.full(_IDS, np.nan)
        self._least_bits = self._most_bits = 0
        self._origin_s = np.nan
        self._bits_over = np.zeros(64)

    def add(self, block: Block) -> None:
        """Count more frames."""
        if not len(block.can_id):
            return
        is_error = (block.can_id & ERROR) != 0
        self.error_frames += int(np.count_nonzero(is_error))
        fits = block.length <= _DATA_BYTES_MAX
        self.malformed += int(np.count_nonzero(~fits & ~is_error))
        real = fits & ~is_error
        time_s, can_id, length = block.time_s[real], block.can_id[real], block.length[real]
        is_extended, is_remote = (can_id & EXTENDED) != 0, (can_id & REMOTE) != 0
        self.extended += int(np.count_nonzero(is_extended))
        self.remote += int(np.count_nonzero(is_remote & ~is_extended))
        self._count_bits(time_s, is_extended, np.where(is_remote, 0, 8 * length.astype(np.int64)))
        ours = ~(is_extended | is_remote)
        self._count_streams(time_s[ours], (can_id[ours] % _IDS).astype(np.intp))

    @property
    def frames(self) -> int:
        """Return how many data frames with 11-bit identifiers came."""
        return int(self._frames.sum())

    def load(self, bitrate: int, duration_s: float) -> tuple[float, float]:
        """Return the share of the bus that was in use: at least, and with the worst stuffing."""
        whole = bitrate * duration_s
        return min(1.0, self._least_bits / whole), min(1.0, self._most_bits / whole)

    def busiest(self, bitrate: int) -> float:
        """Return the share in use, at least, over the busiest tenth of a second."""
        return min(1.0, float(self._bits_over.max()) / (bitrate * BUSIEST_OVER_S))

    def streams(self) -> tuple[Stream, ...]:
        """Return what came under each identifier, in their order."""
        return tuple(self._stream(int(cob_id)) for cob_id in np.flatnonzero(self._frames))

    def _stream(self, cob_id: int) -> Stream:
        frames, gaps = int(self._frames[cob_id]), int(self._gaps[cob_id])
        if not gaps:
            return Stream(cob_id, frames, np.nan, np.nan, np.nan)
        period_s = float(self._sum_s[cob_id]) / gaps
        variance = max(0.0, float(self._squares_s2[cob_id]) / gaps - period_s**2)
        return Stream(cob_id, frames, period_s, variance**0.5, float(self._longest_s[cob_id]))

    def _count_bits(
        self, time_s: Times, is_extended: NDArray[np.bool_], data_bits: NDArray[np.int64]
    ) -> None:
        """Add what the frames take of the bus, without stuffing and with the most there can be."""
        if not len(time_s):
            return
        bits = np.where(is_extended, _EXTENDED_BITS, _BITS) + data_bits
        stuffed = np.where(is_extended, _EXTENDED_STUFFED, _STUFFED) + data_bits
        self._least_bits += int(bits.sum())
        self._most_bits += int((bits + (stuffed - 1) // 4).sum())
        if np.isnan(self._origin_s):
            self._origin_s = float(time_s[0])
        tenth = np.maximum((time_s - self._origin_s) / BUSIEST_OVER_S, 0.0).astype(np.intp)
        over = np.bincount(tenth, weights=bits, minlength=len(self._bits_over))
        if len(over) > len(self._bits_over):
            self._bits_over = np.pad(self._bits_over, (0, 2 * len(over) - len(self._bits_over)))
        self._bits_over[: len(over)] += over

    def _count_streams(self, time_s: Times, ids: NDArray[np.intp]) -> None:
        """Count frames and the gaps between those of the same identifier."""
        if not len(ids):
            return
        self._frames += np.bincount(ids, minlength=_IDS)
        order = np.argsort(ids, kind="stable")
        ids, time_s = ids[order], time_s[order]
        is_first = np.append(True, ids[1:] != ids[:-1])
        before_s = np.append(np.nan, time_s[:-1])
        before_s[is_first] = self._last_s[ids[is_first]]
        self._last_s[ids[np.append(is_first[1:], True)]] = time_s[np.append(is_first[1:], True)]
        gap_s = time_s - before_s
        is_known = np.isfinite(gap_s)
        ids, gap_s = ids[is_known], gap_s[is_known]
        self._gaps += np.bincount(ids, minlength=_IDS)
        self._sum_s += np.bincount(ids, weights=gap_s, minlength=_IDS)
        self._squares_s2 += np.bincount(ids, weights=gap_s**2, minlength=_IDS)
        np.maximum.at(self._longest_s, ids, gap_s)


def who_says(cob_id: int) -> str:
    """Return whose identifier this is by CiA 301's predefined connection set."""
    fixed = {0x000: "NMT command", 0x080: "SYNC", 0x100: "time"}
    if cob_id in fixed:
        return fixed[cob_id]
    service, node = cob_id & 0x780, cob_id & 0x7F
    words = {0x080: "emergency", 0x580: "SDO answer", 0x600: "SDO request", 0x700: "heartbeat"}
    for number in range(4):
        words[0x180 + 0x100 * number] = f"TPDO{number + 1}"
        words[0x200 + 0x100 * number] = f"RPDO{number + 1}"
    return f"{words[service]} of node {node}" if service in words and node else "no CANopen service"
