"""All recordings of one axis as one table of rows: every signal filtered alike, strata apart.

The full rate is kept for laws with a memory; what they give passes `Table.band`, the same
zero-phase low-pass and stride as the measured torque and every column of the base model, the sign
of the velocity included. Standstill, where friction is indeterminate, and the filter's own ends
are left out; what lies just after a start or a reversal is an edge, judged apart from what slides.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from agent.explain.run import OPTIONAL, Run
from agent.identify.lowpass import lowpass
from agent.identify.preprocess import Motion, direction_of, read_motion
from agent.identify.result import Floats
from agent.identify.sampling import Stretch
from agent.physics import rigid_body
from agent.physics.effects.motion import Motion as Measured
from agent.physics.twin import Twin

BASE: tuple[str, ...] = rigid_body.PARAMETERS[:5]
"""The plain twin's numbers, in the order of the table's base columns."""

STEADY, ACCELERATING, EDGE = 0, 1, 2
_MOST_ROWS = 30_000
_ROWS_PER_CUTOFF = 3.0  # rows a second for every hertz of the band
_BLOCK_S = 2.0
_MOST_BLOCKS = 240
_EDGE_ARM_RAD = 2e-4
_LONGEST_LAG_S = 0.03
_ALIGNED_GAINS = 0.98  # of the squared residual: less is no reason to move the velocity
_STANDING_S = 0.1  # a reversal crosses zero faster; longer is standstill
_END_PERIODS = 1.5
_UNKNOWN_SHARE = 0.05
_MEMORY = 1.0  # of the cutoff's period: so far an edge's misfit reaches through the filter
_WIDEST_SHARE, _WIDEST_HZ, _NARROWEST_HZ = 0.1, 40.0, 2.0
_OWN = (
    "time_s",
    "elapsed_s",
    "position_rad",
    "velocity_rad_s",
    "velocity_raw_rad_s",
    "acceleration_rad_s2",
    "direction",
    "torque_nm",
    "run",
    "bridged",
)
_STEADY_SHARE = 0.03  # of the 99 % acceleration


@dataclass(frozen=True)
class Piece:
    """One stretch of one run: where it stands among the full-rate samples and among the rows."""

    run: int
    stretch: Stretch
    full: slice
    rows: slice
    stride: int

    @property
    def period_s(self) -> float:
        """Return the even grid's period."""
        return self.stretch.period_s


@dataclass(frozen=True)
class Table:
    """n rows in the band of the comparison, from N samples at full rate.

    Parameters
    ----------
    runs : tuple of Run
    pieces : tuple of Piece
    gear_ratio : float
    cutoff_hz : float
        Of the low-pass that everything passed.
    full : mapping of str to ndarray, shape (N,)
        ``time_s, elapsed_s, position_rad, velocity_rad_s, acceleration_rad_s2, direction`` and the
        optional columns; velocity and acceleration are smooth; NaN where not recorded.
    rows : mapping of str to ndarray, shape (n,)
        The same at the rows.
    base : ndarray, shape (n, 5)
        Filtered columns of the plain twin, in the order of `BASE`; no gravity without position.
    measured_nm, given_nm, target_nm : ndarray, shape (n,)
        Measured torque, what the twin as given (or the recorded simulation) says, and the former
        less the latter.
    run, block, stratum : ndarray of int, shape (n,)
    used : ndarray of bool, shape (n,)
        Not standing still, not at a stretch's end.
    simulated : bool
        Whether recorded simulations took the twin's place.
    aligned : bool
        Whether the velocity was brought in step with the position.
    """

    runs: tuple[Run, ...]
    pieces: tuple[Piece, ...]
    gear_ratio: float
    cutoff_hz: float
    full: Mapping[str, Floats]
    rows: Mapping[str, Floats]
    base: Floats
    measured_nm: Floats
    given_nm: Floats
    run: NDArray[np.int64]
    block: NDArray[np.int64]
    stratum: NDArray[np.int64]
    used: NDArray[np.bool_]
    simulated: bool
    aligned: bool

    @property
    def target_nm(self) -> Floats:
        """Return measured less given torque, shape (n,)."""
        return self.measured_nm - self.given_nm

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Return which rows are used and no edge, shape (n,)."""
        return np.asarray(self.used & (self.stratum != EDGE))

    def has(self, name: str) -> bool:
        """Return whether a column was recorded in every run."""
        return bool(np.isfinite(self.rows[name][self.used]).all()) if self.used.any() else False

    def band(self, raw: Floats) -> Floats:
        """Return full-rate columns, shape (N,) or (N, k), filtered as the torque, at the rows."""
        two = raw.reshape(raw.shape[0], -1)
        out = np.empty((self.measured_nm.shape[0], two.shape[1]))
        for piece in self.pieces:
            filtered = lowpass(two[piece.full].T, piece.period_s, self.cutoff_hz)
            out[piece.rows] = filtered[:, :: piece.stride].T
        return out[:, 0] if raw.ndim == 1 else out


def tabulate(
    twin: Twin,
    runs: Sequence[Run],
    cutoff_hz: float | None = None,
    *,
    align_velocity: bool | None = None,
) -> Table:
    """Put runs into one table.

    A drive may report its velocity later than its position, and the torque in step with either:
    the velocity is taken in whichever step leaves the plain structure less unexplained.

    Parameters
    ----------
    twin : Twin
        What the simulation knows; its prediction is `Table.given_nm`.
    runs : sequence of Run
        Of one axis, at least one with a stretch that can be filtered.
    cutoff_hz : float, optional
        The band; chosen from the noise where not given, so that hold-out data use the same.
    align_velocity : bool, optional
        Whether the velocity is brought in step with the position; chosen where not given.

    Raises
    ------
    ValueError
        No run has a stretch that is long enough to be filtered.
    """
    motions = [read_motion(run.signals) for run in runs]
    if cutoff_hz is None:
        cutoff_hz = choose_band(motions, twin.inertia_kg_m2)
    shortest = 2.0 * _END_PERIODS / cutoff_hz
    kept = [
        (index, stretch, velocity)
        for index, motion in enumerate(motions)
        for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True)
        if velocity.shape[0] * stretch.period_s > 2.0 * shortest
    ]
    if not kept:
        raise ValueError("no recording has a stretch that is long enough to be compared")
    stride_scale = _thinning(kept, cutoff_hz)
    pieces: list[Piece] = []
    at_full = at_row = 0
    for index, stretch, velocity in kept:
        stride = max(1, int(stride_scale / (_ROWS_PER_CUTOFF * cutoff_hz * stretch.period_s)))
        count = velocity.shape[0]
        rows = -(-count // stride)
        pieces.append(
            Piece(
                index,
                stretch,
                slice(at_full, at_full + count),
                slice(at_row, at_row + rows),
                stride,
            )
        )
        at_full, at_row = at_full + count, at_row + rows
    simulated = all("torque_simulated_nm" in run.columns for run in runs)
    aligned = (False, True) if align_velocity is None else (align_velocity,)
    tables = []
    for align in aligned:
        full = _full_rate(
            runs, motions, pieces, [v for _, _, v in kept], cutoff_hz, at_full, align=align
        )
        tables.append(
            _rows(
                twin,
                tuple(runs),
                tuple(pieces),
                full,
                cutoff_hz,
                at_row,
                simulated=simulated,
                aligned=align,
            )
        )
    if len(tables) == 1:
        return tables[0]
    plain, aligned_table = tables
    better = _structure_leaves(aligned_table) < _ALIGNED_GAINS * _structure_leaves(plain)
    return aligned_table if better else plain


def _structure_leaves(table: Table) -> float:
    """Return the mean square of what the plain structure leaves while sliding.

    Beside a free friction curve and a free torque along the position, so that what is missing of
    either does not decide in which step the signals are.
    """
    rows = table.sliding
    speed = np.abs(table.rows["velocity_rad_s"][rows])
    free = [np.sign(table.rows["velocity_rad_s"][rows])[:, np.newaxis] * _hats(speed)]
    if table.has("position_rad"):
        free.append(_hats(table.rows["position_rad"][rows]))
    columns = np.concatenate([table.base[rows], *free], axis=1)
    size = np.sqrt(np.mean(columns**2, axis=0)) if columns.size else np.zeros(columns.shape[1])
    columns = columns[:, size > 1e-12] / size[size > 1e-12]
    target = table.target_nm[rows]
    left = target - columns @ np.linalg.lstsq(columns, target, rcond=1e-9)[0]
    return float(np.mean(left**2)) if left.size else 0.0


def _hats(values: Floats, count: int = 8) -> Floats:
    """Return hat functions over an axis's quantiles, shape (n, k)."""
    if not values.size:
        return np.zeros((0, 0))
    knots = np.unique(np.quantile(values, np.linspace(0.0, 1.0, count)))
    return np.stack([np.interp(values, knots, row) for row in np.eye(knots.size)], axis=-1)


def choose_band(motions: Sequence[Motion], inertia_kg_m2: float) -> float:
    """Return the widest low-pass in which torque noise prevails over the acceleration's noise, Hz.

    White noise of the velocity, differentiated and multiplied by the inertia, grows with the
    cutoff to the power 3/2; white noise of the torque with its root. At most a tenth of the
    sampling rate, and 40 Hz.
    """
    chosen: float = _WIDEST_HZ
    for motion in motions:
        for stretch, velocity in zip(motion.timing.stretches, motion.velocity_rad_s, strict=True):
            if velocity.shape[0] < 16:
                continue
            rate_hz = 1.0 / stretch.period_s
            torque = stretch.on_grid(motion.signals, motion.signals.torque_nm)
            torque_noise = float(np.sqrt(np.mean(np.diff(torque, n=2) ** 2) / 6.0))
            # High-passed near Nyquist, where neither motion nor its harmonics are left.
            rough = np.diff(velocity, n=3)
            velocity_noise = float(np.sqrt(np.mean(rough**2) / 20.0))
            shaken = inertia_kg_m2 * velocity_noise * 2.0 * math.pi / math.sqrt(3.0)
            balance = torque_noise / shaken if shaken > 0.0 else math.inf
            chosen = min(chosen, max(balance, _NARROWEST_HZ), _WIDEST_SHARE * rate_hz)
    return chosen


def _thinning(kept: Sequence[tuple[int, Stretch, Floats]], cutoff_hz: float) -> float:
    """Return by what factor rows are taken more thinly than the band asks for, at least 1."""
    wanted = sum(
        min(v.shape[0], v.shape[0] * s.period_s * _ROWS_PER_CUTOFF * cutoff_hz) for _, s, v in kept
    )
    return max(1.0, float(wanted) / _MOST_ROWS)


def _full_rate(
    runs: Sequence[Run],
    motions: Sequence[Motion],
    pieces: Sequence[Piece],
    velocities: Sequence[Floats],
    cutoff_hz: float,
    samples: int,
    *,
    align: bool,
) -> dict[str, Floats]:
    """Return the smooth motion and the recorded columns at full rate, each shape (N,)."""
    full = {name: np.full(samples, np.nan) for name in (*_OWN, *OPTIONAL)}
    known = [run.started_s for run in runs if math.isfinite(run.started_s)]
    origin_s = min(known) if len(known) == len(runs) else math.nan
    for piece, reported in zip(pieces, velocities, strict=True):
        velocity = reported
        run, motion, stretch = runs[piece.run], motions[piece.run], piece.stretch
        signals, at = run.signals, piece.full
        if signals.position_rad is not None:
            position = stretch.on_grid(signals, signals.position_rad)
            full["position_rad"][at] = position
            if align:
                velocity = _aligned(velocity, position, piece.period_s, cutoff_hz)
        smooth = lowpass(velocity, piece.period_s, cutoff_hz)
        full["time_s"][at] = stretch.time_s
        started = run.started_s - origin_s if math.isfinite(origin_s) else math.nan
        full["elapsed_s"][at] = stretch.time_s + (started if len(runs) > 1 else 0.0)
        full["velocity_raw_rad_s"][at] = velocity
        full["velocity_rad_s"][at] = smooth
        full["acceleration_rad_s2"][at] = np.gradient(smooth, piece.period_s)
        noise = motion.velocity_noise_rad_s
        full["direction"][at] = direction_of(velocity, piece.period_s, cutoff_hz, noise)
        full["torque_nm"][at] = stretch.on_grid(signals, signals.torque_nm)
        full["run"][at] = piece.run
        full["bridged"][at] = _bridged(stretch, signals.time_s)
        for name, values in run.columns.items():
            full[name][at] = _filled(stretch.on_grid(signals, values))
    return full


def _aligned(velocity: Floats, position: Floats, period_s: float, cutoff_hz: float) -> Floats:
    """Return a drive's velocity in step with its position, shape (n,).

    Observers and differences report the velocity late by a part of a sample or more; the lag is
    what the acceleration explains of the difference to the position's central derivative.
    """
    derived, own = lowpass(
        np.stack((np.gradient(position, period_s), velocity)), period_s, cutoff_hz
    )
    acceleration = np.gradient(own, period_s)
    energy = float(acceleration @ acceleration)
    if energy <= 0.0:
        return velocity
    lag_s = float((derived - own) @ acceleration) / energy
    if abs(lag_s) > _LONGEST_LAG_S:
        return velocity
    time = np.arange(velocity.shape[0]) * period_s
    return np.asarray(np.interp(time + lag_s, time, velocity))


def _bridged(stretch: Stretch, time_s: Floats) -> Floats:
    """Return 1 where a grid point lies between samples that are further apart than a period."""
    own = time_s[stretch.index]
    after = np.clip(np.searchsorted(own, stretch.time_s, side="right"), 1, own.shape[0] - 1)
    return (own[after] - own[after - 1] > 1.5 * stretch.period_s).astype(np.float64)


def _filled(values: Floats) -> Floats:
    """Return values with single gaps bridged; all NaN stays all NaN."""
    bad = ~np.isfinite(values)
    if bad.all() or not bad.any():
        return values
    at = np.arange(values.shape[0])
    return np.interp(at, at[~bad], values[~bad])


def _rows(
    twin: Twin,
    runs: tuple[Run, ...],
    pieces: tuple[Piece, ...],
    full: dict[str, Floats],
    cutoff_hz: float,
    count: int,
    *,
    simulated: bool,
    aligned: bool,
) -> Table:
    """Filter everything alike and take it at the rows."""
    samples = full["time_s"].shape[0]
    position = None if np.isnan(full["position_rad"]).any() else full["position_rad"]
    raw = rigid_body.regressor(
        position,
        full["velocity_raw_rad_s"],
        np.zeros(samples),
        full["direction"],
        twin.gear_ratio,
    )[:, : len(BASE)]
    inertia = BASE.index("inertia_kg_m2")
    for piece in pieces:
        # Its filtered form is the derivative of the filtered velocity: both operations are linear.
        raw[piece.full, inertia] = np.gradient(
            full["velocity_raw_rad_s"][piece.full], piece.period_s
        )
    bare = Table(
        runs=runs,
        pieces=pieces,
        gear_ratio=twin.gear_ratio,
        cutoff_hz=cutoff_hz,
        full=full,
        rows={},
        base=np.zeros((count, len(BASE))),
        measured_nm=np.zeros(count),
        given_nm=np.zeros(count),
        run=np.zeros(count, dtype=np.int64),
        block=np.zeros(count, dtype=np.int64),
        stratum=np.zeros(count, dtype=np.int64),
        used=np.ones(count, dtype=np.bool_),
        simulated=simulated,
        aligned=aligned,
    )
    base = bare.band(raw)
    measured = bare.band(full["torque_nm"])
    if simulated:
        given = bare.band(full["torque_simulated_nm"])
    else:
        given = base @ np.array([getattr(twin, name) for name in BASE])
        if twin.effects:
            given = given + bare.band(effects_nm(twin, runs, pieces, full))
    rows = {name: _thin(values, pieces, count) for name, values in full.items()}
    rows["travel_rad"] = _thin(travel_rad(full, pieces), pieces, count)
    run = np.round(rows["run"]).astype(np.int64)
    used, stratum = _strata(bare, base)
    return Table(
        **{
            **{name: getattr(bare, name) for name in ("runs", "pieces", "gear_ratio")},
            "cutoff_hz": cutoff_hz,
            "full": full,
            "rows": rows,
            "base": base,
            "measured_nm": measured,
            "given_nm": given,
            "run": run,
            "block": _blocks(pieces, rows["time_s"]),
            "stratum": stratum,
            "used": used & np.isfinite(measured) & np.isfinite(given),
            "simulated": simulated,
            "aligned": aligned,
        }
    )


def effects_nm(
    twin: Twin, runs: Sequence[Run], pieces: Sequence[Piece], full: Mapping[str, Floats]
) -> Floats:
    """Return what the twin's effects add to its plain torque at full rate, shape (N,)."""
    plain = replace(twin, effects=())
    out = np.zeros(full["time_s"].shape[0])
    for piece in pieces:
        at = piece.full

        def column(name: str, at: slice = at) -> Floats | None:
            values = full[name][at]
            return None if np.isnan(values).any() else values

        started = runs[piece.run].started_s
        motion = Measured(
            full["velocity_rad_s"][at],
            full["acceleration_rad_s2"][at],
            full["direction"][at],
            column("position_rad"),
            full["time_s"][at],
            column("gearbox_temperature_degc"),
            column("motor_temperature_degc"),
            started if math.isfinite(started) else None,
            float(piece.run),
        )
        out[at] = twin.predict(motion) - plain.predict(motion)
    return out


def _thin(values: Floats, pieces: Sequence[Piece], count: int) -> Floats:
    """Return full-rate values at the rows, shape (n,)."""
    out = np.empty(count)
    for piece in pieces:
        out[piece.rows] = values[piece.full][:: piece.stride]
    return out


def travel_rad(full: Mapping[str, Floats], pieces: Sequence[Piece]) -> Floats:
    """Return the motor's travel since it last started or turned round, rad, shape (N,)."""
    out = np.zeros(full["time_s"].shape[0])
    for piece in pieces:
        sign, velocity = full["direction"][piece.full], full["velocity_rad_s"][piece.full]
        way = np.cumsum(np.abs(velocity)) * piece.period_s
        known = sign != 0.0
        last = sign[known]
        start = np.zeros(sign.shape[0], dtype=np.bool_)
        start[np.flatnonzero(known)] = np.diff(last, prepend=0.0) != 0.0
        start |= known & ~np.concatenate(([False], known[:-1]))
        anchor = np.maximum.accumulate(np.where(start, np.arange(sign.shape[0]), 0))
        out[piece.full] = way - way[anchor]
    return out


def _strata(bare: Table, base: Floats) -> tuple[NDArray[np.bool_], NDArray[np.int64]]:
    """Return which rows are used, and steady, accelerating or edge for each."""
    full = bare.full
    standing = np.zeros(full["time_s"].shape[0])
    edge, apart = np.zeros_like(standing), np.zeros_like(standing)
    reach = _EDGE_ARM_RAD * bare.gear_ratio
    travel = travel_rad(full, bare.pieces)
    ends = np.zeros(base.shape[0], dtype=np.bool_)
    for piece in bare.pieces:
        sign = full["direction"][piece.full]
        standing[piece.full] = _lasting(sign == 0.0, _STANDING_S / piece.period_s)
        near = (sign == 0.0) | (travel[piece.full] < reach)
        edge[piece.full] = _widened(near, round(_MEMORY / (bare.cutoff_hz * piece.period_s)))
        apart[piece.full] = _widened(
            full["bridged"][piece.full] > 0.0,
            round(_MEMORY / (bare.cutoff_hz * piece.period_s)),
        )
        end = math.ceil(_END_PERIODS / (bare.cutoff_hz * piece.period_s * piece.stride))
        ends[piece.rows.start : piece.rows.start + end] = True
        ends[max(piece.rows.stop - end, piece.rows.start) : piece.rows.stop] = True
    edges = _thin(edge, bare.pieces, base.shape[0]) > 0.5
    bridged = _thin(apart, bare.pieces, base.shape[0]) > 0.5
    used = (bare.band(standing) < _UNKNOWN_SHARE) & ~(edges | ends | bridged)
    size = np.abs(base[:, BASE.index("inertia_kg_m2")])
    hard = float(np.quantile(size[used], 0.99)) if used.any() else 0.0
    stratum = np.where(size > _STEADY_SHARE * hard, ACCELERATING, STEADY)
    stratum = np.where(edges, EDGE, stratum)
    return np.asarray(used), stratum.astype(np.int64)


def _widened(flag: NDArray[np.bool_], samples: int) -> Floats:
    """Return 1 where a flag holds within so many samples, shape (n,)."""
    count = np.cumsum(np.concatenate(([0], flag.astype(np.int64))))
    at = np.arange(flag.shape[0])
    low = np.maximum(at - samples, 0)
    high = np.minimum(at + samples + 1, flag.shape[0])
    return (count[high] > count[low]).astype(np.float64)


def _lasting(flag: NDArray[np.bool_], samples: float) -> Floats:
    """Return 1 where a flag holds for at least so many samples in a row, shape (n,)."""
    edges = np.flatnonzero(np.diff(flag.astype(np.int8), prepend=0, append=0))
    out = np.zeros(flag.shape[0])
    for begin, end in zip(edges[::2], edges[1::2], strict=True):
        if end - begin >= samples:
            out[begin:end] = 1.0
    return out


def _blocks(pieces: Sequence[Piece], time_s: Floats) -> NDArray[np.int64]:
    """Return the number of the block of time of every row, rising over the table."""
    total_s = sum(float(np.ptp(time_s[p.rows])) for p in pieces)
    length_s = max(_BLOCK_S, total_s / _MOST_BLOCKS)
    out = np.empty(time_s.shape[0], dtype=np.int64)
    first = 0
    for piece in pieces:
        time = time_s[piece.rows] - time_s[piece.rows.start]
        count = max(1, round(float(time[-1]) / length_s))
        number = np.minimum(
            (time / max(float(time[-1]), 1e-12) * count).astype(np.int64), count - 1
        )
        out[piece.rows] = first + number
        first += count
    return out
