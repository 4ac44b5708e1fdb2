"""Which stretches are compared, and how they lie one behind the other."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

from agent.explain.rows.full_rate import band_of
from agent.explain.rows.held import Held, held_speeds
from agent.explain.rows.pieces import Piece
from agent.explain.rows.strata import END_PERIODS
from agent.identify.result import Floats
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.sampling import Stretch

_MOST_ROWS = 30_000
_ROWS_PER_CUTOFF = 3.0  # rows a second for every hertz of the band


@dataclass(frozen=True)
class Kept:
    """A stretch that is compared: its run, its velocity and its passes."""

    run: int
    stretch: Stretch
    velocity: Floats
    held: Held


def long_enough(motions: Sequence[Motion], cutoff_hz: float) -> list[Kept]:
    """Return the stretches that are longer than what the filter spoils of them."""
    return [
        Kept(index, stretch, velocity, held)
        for index, motion in enumerate(motions)
        for stretch, velocity, held in zip(
            motion.timing.stretches, motion.velocity_rad_s, held_speeds(motion), strict=True
        )
        if velocity.shape[0] * stretch.period_s * band_of(stretch, cutoff_hz) > 4.0 * END_PERIODS
    ]


def laid_out(kept: Sequence[Kept], cutoff_hz: float) -> tuple[Piece, ...]:
    """Lay the stretches one behind the other, thinned to what the band and the memory ask for."""
    stretches = [k.stretch for k in kept]
    sizes = [stretch.time_s.shape[0] for stretch in stretches]
    bands = [band_of(stretch, cutoff_hz) for stretch in stretches]
    dense = [_ROWS_PER_CUTOFF * b * s.period_s for b, s in zip(bands, stretches, strict=True)]
    wanted = math.fsum(n * min(1.0, d) for n, d in zip(sizes, dense, strict=True))
    thinly = max(1.0, wanted / _MOST_ROWS)
    pieces: list[Piece] = []
    at_full = at_row = 0
    for one, count, density, band in zip(kept, sizes, dense, bands, strict=True):
        stride = max(1, int(thinly / density))
        rows = -(-count // stride)
        full, row = slice(at_full, at_full + count), slice(at_row, at_row + rows)
        pieces.append(Piece(one.run, one.stretch, full, row, stride, band, one.held.one_speed))
        at_full, at_row = full.stop, row.stop
    return tuple(pieces)
