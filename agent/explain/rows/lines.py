"""Lines in the spectrum of what is left: torque that swings at a frequency of its own, in time.

Mains, a neighbour that shakes the base, a loop on the verge of ringing: what the joint does at
that moment plays no part, so that no axis of the motion shows it. Below the comparison's band the
residual is searched, above it the measured torque itself, as no twin predicts anything there.

A line stands against its own neighbourhood (`spectra`). A wave of the position has a frequency,
too, but another one at every speed; a cycle that repeats evenly has lines which its motion shows as
well. Neither is a line of time.
"""

from __future__ import annotations

import math
from dataclasses import dataclass, field

import numpy as np

from agent.explain.rows.in_step import hats, least
from agent.explain.rows.pieces import Piece
from agent.explain.rows.spectra import (
    FAR,
    NEAR,
    Sought,
    Spectra,
    seconds_of,
    spectra_of,
    used_of,
)
from agent.explain.rows.table import BASE, Table
from agent.identify.result import Floats
from agent.identify.signals.lowpass import lowpass
from agent.physics.derivative import slope

_SHORTEST_S = 8.0  # stretches: a shorter one has lines as wide as anything else
_SAME_BAND = 0.99  # of the widest: stretches in a narrower one are not compared with the others
_GUARD = 6  # bins to either side of a line that are the line's own
_OWN = 1  # bins to either side that are a line's, and no neighbour's
_FALSE = 0.01  # over all frequencies
_MATERIAL = 0.02  # of what is left
_MOST = 3
_SPEEDS = 24  # knots
_SAME_SPEED = 0.1  # of the speed
_WRONG = 0.2  # of a number of the twin's: it makes no line of the motion that is stronger
_LACKS = 0.6  # of a line's torque: with less beside what the motion takes it is the motion's
_AT_OTHER_SPEEDS = 0.3  # of the line's torque: what is there at two speeds alone is no line of time


@dataclass(frozen=True)
class Line:
    """One line of the spectrum.

    Parameters
    ----------
    frequency_hz, half_width_hz : float
    energy_nm2 : float
        Mean square of its torque over the recordings.
    share : float
        Of what is left, the part of the torque above the band counted in where the line lies there.
    p_value : float
        Of the greatest of as many frequencies as were looked at.
    in_band : bool
        Whether it lies in the band of the comparison.
    spectrum : tuple of ndarray, optional
        Frequencies around it, root mean square torque of a sine there, and that of its
        neighbourhood, each shape (f,).
    """

    frequency_hz: float
    half_width_hz: float
    energy_nm2: float
    share: float
    p_value: float
    in_band: bool
    spectrum: tuple[Floats, Floats, Floats] | None = field(default=None, compare=False, repr=False)

    @property
    def matters(self) -> bool:
        """Return whether it holds a material share of what is left."""
        return self.share > _MATERIAL

    @property
    def axis(self) -> str:
        """Return its axis as the deficiency map names it."""
        return f"frequency_hz {self.frequency_hz:.4g}"


def lines_of(table: Table, left_nm: Floats) -> tuple[Line, ...]:
    """Return the lines of what is left, the strongest first.

    Parameters
    ----------
    table : Table
    left_nm : ndarray, shape (n,)
        What a model leaves at the table's rows.
    """
    pieces = [
        piece
        for piece in table.pieces
        if seconds_of(piece) >= _SHORTEST_S
        and piece.cutoff_hz >= _SAME_BAND * table.cutoff_hz
        and table.used[piece.rows].any()
    ]
    if not pieces:
        return ()
    within = np.where(table.used, left_nm, 0.0)
    energy = Sought(table, pieces, lambda p: within[p.rows], in_band=True).energy_nm2
    searched = within - of_speed(table, within)
    inside = Sought(table, pieces, lambda p: searched[p.rows], in_band=True)
    torque = table.full["torque_nm"]
    outside = Sought(table, pieces, lambda p: _above(table, p, torque[p.full]), in_band=False)
    found = [
        *_lines(inside, energy),
        *_lines(outside, energy + outside.energy_nm2),
    ]
    return tuple(sorted(found, key=lambda line: -line.share)[:_MOST])


def of_speed(table: Table, left_nm: Floats) -> Floats:
    """Return what of a residual follows the velocity, smooth as that may be, shape (n,).

    A cycle that comes back to some speeds every so often has what these speeds lack as a line.
    """
    out = np.zeros_like(left_nm)
    curve = hats(table.rows["velocity_rad_s"][table.used], _SPEEDS)
    out[table.used] = curve @ least(curve, left_nm[table.used])
    return out


def _above(table: Table, piece: Piece, values: Floats) -> Floats:
    """Return a signal above the band of the comparison, 0 where rows are not used."""
    high = values - lowpass(values, piece.period_s, piece.cutoff_hz)
    return np.where(used_of(table, piece, in_band=False), high, 0.0)


def _lines(sought: Sought, energy_nm2: float) -> list[Line]:
    """Return a signal's lines; `energy_nm2` is what their shares are of."""
    spectra = spectra_of(sought, sought.signals, falls=sought.in_band)
    count = spectra.hertz.shape[0]
    if count <= 2 * FAR or energy_nm2 <= 0.0:
        return []
    standing, p_values = spectra.standing()
    if p_values.min() * count > _FALSE:
        return []
    moved = _moved(sought, spectra)
    out: list[Line] = []
    free = np.ones(count, dtype=np.bool_)
    for _ in range(_MOST):
        best = int(np.argmax(np.where(free, standing, -np.inf)))
        near, own = (slice(max(best - n, 0), best + n + 1) for n in (_GUARD, _OWN))
        if not free[best] or p_values[best] * count > _FALSE:
            break
        free[near] = False
        if moved[own].min() * count <= _FALSE or not _at_other_speeds(sought, spectra.hertz[best]):
            continue
        if not sought.in_band and _moves_the_joint(sought, float(spectra.hertz[best])):
            continue
        energy, width = _extent(spectra, best)
        hertz = float(spectra.hertz[best])
        share = min(energy / energy_nm2, 1.0)
        p = min(float(p_values[best]) * count, 1.0)
        around = spectra.around(hertz)
        out.append(Line(hertz, width, energy, share, p, sought.in_band, around))
        reach = math.ceil(width / spectra.step_hz)
        free[max(best - reach, 0) : best + reach + 1] = False
    return out


def _moved(sought: Sought, spectra: Spectra) -> Floats:
    """Return how likely each bin of the motion is without a line there, shape (f,).

    The velocity's, and that of its direction, where a number of the twin that is somewhat wrong
    would make the line of it. What shakes the joint moves it, by more where the drive's loop rings
    with it, and turns it round where it is slow.
    """
    swing = spectra_of(sought, [speed - speed.mean() for speed in sought.speeds])
    turn = spectra_of(
        sought,
        [
            np.sign(speed) * used_of(sought.table, piece, in_band=sought.in_band)
            for piece, speed in zip(sought.pieces, sought.speeds, strict=True)
        ],
    )
    inertia, coulomb = _numbers(sought.table)
    found, moves = np.mean(spectra.power, axis=0), np.mean(swing.power, axis=0)
    driven = moves * (_WRONG * inertia * 2.0 * np.pi * swing.hertz) ** 2 > found
    turned = np.mean(turn.power, axis=0) * (_WRONG * coulomb) ** 2 > found
    return np.minimum(
        np.where(driven, swing.standing()[1], 1.0), np.where(turned, turn.standing()[1], 1.0)
    )


def _moves_the_joint(sought: Sought, hertz: float) -> bool:
    """Return whether a line above the band is what the joint's inertia took to move there.

    What shakes a joint from outside is what the motor's torque lacks beside that. A torque that the
    motion asks for, as a staircase's even steps do with their drive's ringing, lacks next to none.
    """
    inertia, _ = _numbers(sought.table)
    whole = lacks = 0.0
    for piece, signal in zip(sought.pieces, sought.signals, strict=True):
        speed = sought.table.full["velocity_raw_rad_s"][piece.full]
        moves = inertia * _above(sought.table, piece, slope(speed, piece.period_s))
        wave = np.exp(-2j * np.pi * hertz * piece.period_s * np.arange(signal.shape[0]))
        wave *= np.hanning(signal.shape[0] + 2)[1:-1]
        whole += abs(signal @ wave) ** 2
        lacks += abs((signal - moves) @ wave) ** 2
    return lacks < _LACKS**2 * whole


def _numbers(table: Table) -> tuple[float, float]:
    """Return inertia, kg m2, and Coulomb friction, N m, that the recordings show by themselves."""
    found = least(table.base[table.used], table.measured_nm[table.used])
    inertia, coulomb = (found[BASE.index(name)] for name in ("inertia_kg_m2", "coulomb_nm"))
    return max(float(inertia), 0.0), max(float(coulomb), 0.0)


def _at_other_speeds(sought: Sought, hertz: float) -> bool:
    """Return whether a line keeps frequency and phase beside the two speeds that show it most."""
    used = [used_of(sought.table, p, in_band=sought.in_band) for p in sought.pieces]
    speed = np.abs(np.concatenate(sought.speeds))[np.concatenate(used)]
    slow = max(float(np.quantile(speed, 0.02)), 1e-3 * float(speed.max()), 1e-300)
    kind = np.log(np.maximum(speed / slow, 1.0)) / _SAME_SPEED
    along = []
    for piece, signal, mask in zip(sought.pieces, sought.signals, used, strict=True):
        wave = np.exp(-2j * np.pi * hertz * sought.period_s(piece) * np.arange(signal.shape[0]))
        turned = (signal * wave)[mask]
        along.append((turned * np.conj(turned.mean() if turned.size else 0.0)).real)
    shown = np.bincount(kind.astype(np.int64), np.concatenate(along))
    there = np.bincount(kind.astype(np.int64)).astype(np.float64)
    whole = float(shown.sum()) / float(there.sum())
    for _ in range(2):
        # A speed that is held wavers over the border between two classes.
        most = int(np.argmax(shown))
        near = slice(max(most - 1, 0), most + 2)
        shown[near] = there[near] = 0.0
    left = float(there.sum())
    return left > 0.0 and float(shown.sum()) / left >= _AT_OTHER_SPEEDS * whole


def _extent(spectra: Spectra, best: int) -> tuple[float, float]:
    """Return a line's mean square, sidebands counted in, and half of its width, Hz."""
    reach = NEAR
    low, high = max(best - reach, 0), min(best + reach + 1, spectra.hertz.shape[0])
    background = spectra.background()[:, low:high]
    excess = np.mean(spectra.power[:, low:high] - background, axis=0)
    level = np.mean(background, axis=0)
    high_bins = excess > 4.0 * level
    high_bins[best - low] = True
    # A sine's energy is spread over 1.5 bins of a Hann window, of which padding makes three.
    energy = float(excess[high_bins].sum()) / 3.0
    away = np.abs(np.flatnonzero(high_bins) - (best - low))
    width = max(float(away.max()), 2.0) * spectra.step_hz
    return max(energy, 0.0), width
