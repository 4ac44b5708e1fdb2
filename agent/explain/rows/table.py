"""All recordings of one axis as one table of rows: every signal filtered alike, strata apart.

The full rate is kept for laws with a memory; what they give passes `Table.band`, the same
zero-phase low-pass and stride as the measured torque and every column of the base model, the sign
of the velocity included. Every stretch has the band that its own sampling rate carries.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from agent.explain.rows.forgetting import Forgetting
from agent.explain.rows.full_rate import choose_band, motion_columns, recorded_columns
from agent.explain.rows.in_step import in_step
from agent.explain.rows.lag import lags_of
from agent.explain.rows.laid_out import laid_out, long_enough
from agent.explain.rows.louder import AboveBand, above_band
from agent.explain.rows.pieces import (
    Piece,
    as_recorded,
    band_of_pieces,
    banded,
    known_part,
    thinned,
)
from agent.explain.rows.run import CORNERS, Run, are_simulated
from agent.explain.rows.strata import EDGE, blocks_of, since_s, strata_of, travel_rad
from agent.explain.rows.twin_effects import Predictions, effects_nm, load_nm
from agent.explain.rows.use import use_columns
from agent.identify.result import Floats
from agent.identify.signals.preprocess import SPEED_CHANGE, read_motion
from agent.identify.signals.thinning import Thinned
from agent.physics import rigid_body
from agent.physics.derivative import slope
from agent.physics.effects.motion import Recorded
from agent.physics.twin import Twin

BASE: tuple[str, ...] = rigid_body.PARAMETERS[:5]
"""The plain twin's numbers, in the order of the table's base columns."""

GRAVITY_AT: NDArray[np.int64] = np.array([BASE.index(name) for name in rigid_body.GRAVITY])
"""Where a weight's two stand among them."""

_EXACT = 3e-4  # of the torque, rms: textbook joints without noise leave a third of it at corners


class TooShortError(ValueError):
    """No stretch of the recordings is long enough to be filtered."""


@dataclass(frozen=True)
class Table:
    """n rows in the band of the comparison, from N samples at full rate.

    Parameters
    ----------
    runs : tuple of Run
    pieces : tuple of Piece
    gear_ratio : float
    cutoff_hz : float
        Of the low-pass that everything passed; a slowly sampled piece has a narrower one.
    full : mapping of str to ndarray, shape (N,)
        ``time_s, elapsed_s, operating_s, turned_rad, position_rad, velocity_rad_s,
        acceleration_rad_s2, direction`` and the optional columns; velocity and acceleration are
        smooth; NaN where not recorded.
    rows : mapping of str to ndarray, shape (n,)
        The same at the rows.
    base : ndarray, shape (n, 5)
        Filtered columns of the plain twin, in the order of `BASE`; no gravity without position.
    carried : ndarray of bool, shape (5,)
        Which of the twin's numbers the rows excite.
    measured_nm, given_nm, target_nm : ndarray, shape (n,)
        Measured torque, what the twin as given (or the recorded simulation) says, and the former
        less the latter.
    run, block, stratum : ndarray of int, shape (n,)
    used : ndarray of bool, shape (n,)
        Not standing still, not at a stretch's end.
    simulated : bool
        Whether recorded simulations took the twin's place.
    twin : Twin
        Whose prediction `given_nm` is, or which such simulations stand for.
    aligned : bool
        Whether the velocity was brought in step with the position.
    late_s : float
        By how much it had been later, where it was brought in step.
    velocity_late_s : float
        By how much it is later than the position, where it was not; 0 where unclear.
    creep_rad_s : float
        Up to which speed rows are edges, as friction is not fully there.
    load_nm : ndarray, shape (N,), optional
        What payloads that recordings state add to the arm's load, as far as the twin knows.
    torque_late_s : float
        By how much the torque was found to be later than the motion: its edges are left out, too.
    imaged_orders : tuple of float
        Waves, per motor turn, whose images in the samples are left out.
    arm_forgets : Forgetting, optional
        How an arm behind the gear forgets, whose unknown beginnings are left out.
    elsewhere : tuple of Recorded
        What recordings that nothing is learnt from add to the joint's use.
    one_zero : bool
        Whether no recording's torque is asked for a zero of its own.
    one_load : bool
        Whether no recording is asked for a load of its own.
    in_step_for_a_delay : bool
        Whether the velocity is to be brought in step if a delay of the torque shows.
    predictions : Predictions
        What effects were asked for, by this table or those that it was made of.
    """

    runs: tuple[Run, ...]
    pieces: tuple[Piece, ...]
    gear_ratio: float
    cutoff_hz: float
    full: Mapping[str, Floats]
    rows: Mapping[str, Floats]
    base: Floats
    carried: NDArray[np.bool_]
    measured_nm: Floats
    given_nm: Floats
    run: NDArray[np.int64]
    block: NDArray[np.int64]
    stratum: NDArray[np.int64]
    used: NDArray[np.bool_]
    simulated: bool
    twin: Twin
    aligned: bool
    late_s: float = 0.0
    velocity_late_s: float = 0.0
    creep_rad_s: float = 0.0
    torque_late_s: float = 0.0
    load_nm: Floats | None = None
    imaged_orders: tuple[float, ...] = ()
    arm_forgets: Forgetting | None = None
    elsewhere: tuple[Recorded, ...] = ()
    one_zero: bool = False
    one_load: bool = False
    in_step_for_a_delay: bool = False
    predictions: Predictions = field(default_factory=Predictions, repr=False, compare=False)

    @property
    def target_nm(self) -> Floats:
        """Return measured less given torque, shape (n,)."""
        return self.measured_nm - self.given_nm

    @cached_property
    def exact_nm(self) -> float:
        """Return what a comparison by differences of samples makes of an exact simulation, N m."""
        torque = self.measured_nm[self.used]
        return _EXACT * float(np.sqrt(np.mean(torque**2))) if torque.size else 0.0

    @property
    def exchanged(self) -> bool:
        """Return whether measured and simulated torque have changed places."""
        return any(run.exchanged for run in self.runs)

    @property
    def sliding(self) -> NDArray[np.bool_]:
        """Return which rows are used and no edge, shape (n,)."""
        return np.asarray(self.used & (self.stratum != EDGE))

    def effects_nm(self, twin: Twin) -> Floats:
        """Return what a twin's effects add to its plain torque at full rate, (N,), read only."""
        return self.predictions.effects_nm(twin, self.runs, self.pieces, self.full)

    def has(self, name: str) -> bool:
        """Return whether a column was recorded in every run."""
        return bool(np.isfinite(self.rows[name][self.used]).all()) if self.used.any() else False

    def band(self, raw: Floats) -> Floats:
        """Return full-rate columns, shape (N,) or (N, k), filtered as the torque, at the rows."""
        return banded(raw, self.pieces, self._filter)

    @cached_property
    def as_recorded(self) -> Mapping[str, Floats]:
        """Return the full-rate columns with the motion as recorded, where it is more than noise."""
        return as_recorded(self.full, self.pieces)

    @cached_property
    def _filter(self) -> Thinned:
        return band_of_pieces(self.pieces)

    @cached_property
    def above_band(self) -> AboveBand | None:
        """Return what rings above the band; None where too little of it can be judged."""
        return above_band(self)

    def where_speed_changes(self, raw: Floats) -> Floats:
        """Return full-rate columns, shape (N, k), zero where no change of speed is to be seen."""
        out = raw.copy()
        for piece in self.pieces:
            if not piece.shows_changes:
                out[piece.full] = 0.0
        return out

    @property
    def several_speeds(self) -> bool:
        """Return whether more than one speed was driven."""
        return bool(self.carried[BASE.index("viscous_nm_s_per_rad")])

    def step_folds(self, rows: NDArray[np.int64], count: int) -> NDArray[np.int64] | None:
        """Return for some rows which of `count` folds their velocity step is left out with.

        Drawn by lot: cycles repeat, and every n-th step may be of one speed. None where there are
        not two steps for every fold.
        """
        step = np.unique(self.rows["step"][rows], return_inverse=True)[1].reshape(-1)
        steps = int(step.max(initial=-1)) + 1
        if steps < 2 * count:
            return None
        return np.random.default_rng(0).permutation(steps)[step] % count


def without_edges(table: Table, creep_rad_s: float, torque_late_s: float = 0.0) -> Table:
    """Return a table that leaves out further edges.

    Parameters
    ----------
    table : Table
    creep_rad_s : float
        Up to which speed friction is not fully there.
    torque_late_s : float
        By how much the torque is later than the motion, and so its starts and reversals.
    """
    used, stratum = strata_of(
        table.full,
        table.pieces,
        table.base[:, BASE.index("inertia_kg_m2")],
        table.gear_ratio,
        creep_rad_s,
        torque_late_s,
    )
    return replace(
        table,
        used=table.used & used,
        stratum=stratum,
        creep_rad_s=creep_rad_s,
        torque_late_s=torque_late_s,
    )


def tabulate(
    twin: Twin,
    runs: Sequence[Run],
    cutoff_hz: float | None = None,
    *,
    align_velocity: bool | None = None,
    elsewhere: Sequence[Recorded] = (),
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
    elsewhere : sequence of Recorded
        What recordings that nothing is learnt from add to the joint's use.

    Raises
    ------
    TooShortError
        No run has a stretch that is long enough to be filtered.
    """
    motions = [read_motion(run.signals) for run in runs]
    if cutoff_hz is None:
        cutoff_hz = choose_band(motions, twin.inertia_kg_m2)
    kept = long_enough(motions, cutoff_hz)
    if not kept:
        raise TooShortError("no recording has a stretch that is long enough to be compared")
    pieces = laid_out(kept, cutoff_hz)
    widest_hz = max(piece.cutoff_hz for piece in pieces)
    velocities, passes = [k.velocity for k in kept], [k.held for k in kept]
    recorded = recorded_columns(runs, pieces, passes)
    position, tables = recorded["position_rad"], []
    lags = lags_of(pieces, velocities, position)
    late_s = float(np.median([lag.late_s for lag in lags]))
    if align_velocity is None and not all(lag.part_of_sample for lag in lags):
        align_velocity = False  # so late a velocity has a name
    for align in (False, True) if align_velocity is None else (align_velocity,):
        moved = motion_columns(
            motions, pieces, velocities, passes, position, lags, recorded[CORNERS], align=align
        )
        full = {**recorded, **moved}
        full |= use_columns(runs, pieces, full, elsewhere)
        table = _table(twin, tuple(runs), pieces, full, widest_hz, aligned=align)
        tables.append(
            replace(
                table,
                late_s=late_s if align else 0.0,
                velocity_late_s=0.0 if align else late_s,
                elsewhere=tuple(elsewhere),
            )
        )
    if len(tables) == 1:
        return tables[0]
    plain, aligned = tables
    return aligned if in_step(plain, aligned) else plain


def _table(
    twin: Twin,
    runs: tuple[Run, ...],
    pieces: tuple[Piece, ...],
    full: dict[str, Floats],
    cutoff_hz: float,
    *,
    aligned: bool,
) -> Table:
    """Filter everything alike and take it at the rows."""
    base = _base(full, pieces, twin.gear_ratio)
    simulated = are_simulated(runs)
    if simulated:
        given = banded(full["torque_simulated_nm"], pieces)
        less = replace(twin, effects=runs[0].simulated_less)
        if less.effects:
            given = given - known_part(effects_nm(less, runs, pieces, full), pieces)
    else:
        given = base @ np.array([getattr(twin, name) for name in BASE])
        if twin.effects:
            given = given + known_part(effects_nm(twin, runs, pieces, full), pieces)
    rows = {name: thinned(values, pieces) for name, values in full.items()}
    rows["travel_rad"] = thinned(travel_rad(full, pieces), pieces)
    rows["since_s"] = thinned(since_s(full, pieces), pieces)
    measured = banded(full["torque_nm"], pieces)
    inertia = base[:, BASE.index("inertia_kg_m2")]
    used, stratum = strata_of(full, pieces, inertia, twin.gear_ratio)
    used = used & np.isfinite(measured) & np.isfinite(given)
    return Table(
        runs=runs,
        pieces=pieces,
        gear_ratio=twin.gear_ratio,
        cutoff_hz=cutoff_hz,
        full=full,
        rows=rows,
        base=base,
        carried=_carried(
            base[used], rows["held_rad_s"][used], rows["velocity_rad_s"][used], pieces
        ),
        measured_nm=measured,
        given_nm=given,
        run=np.round(rows["run"]).astype(np.int64),
        block=blocks_of(pieces, rows["time_s"], rows["step"]),
        stratum=stratum,
        used=used,
        simulated=simulated,
        twin=twin,
        aligned=aligned,
        load_nm=load_nm(twin, runs, pieces, full),
    )


def _carried(
    base: Floats, held_rad_s: Floats, velocity_rad_s: Floats, pieces: Sequence[Piece]
) -> NDArray[np.bool_]:
    """Return which base columns, shape (n, 5), say something of their own, shape (5,).

    Where one speed was driven, viscous and Coulomb friction are one number, and where no speed was
    changed nothing tells the inertia: the unrest of a pass follows the torque.
    """
    if not base.shape[0]:
        return np.zeros(len(BASE), dtype=np.bool_)
    out = np.asarray(np.sqrt(np.mean(base**2, axis=0)) > 1e-12)
    speed = np.abs(np.where(held_rad_s != 0.0, held_rad_s, velocity_rad_s))
    out[BASE.index("inertia_kg_m2")] &= any(piece.shows_changes for piece in pieces)
    slow, fast = np.quantile(speed, [0.01, 0.99])
    out[BASE.index("viscous_nm_s_per_rad")] &= fast - slow > SPEED_CHANGE * fast
    return out


def _base(full: Mapping[str, Floats], pieces: Sequence[Piece], gear_ratio: float) -> Floats:
    """Return the plain twin's filtered columns at the rows, shape (n, 5)."""
    out = np.empty((full["torque_nm"].shape[0], len(BASE)))
    located = not np.isnan(full["position_rad"]).any()
    for piece in pieces:
        at = piece.full
        velocity = full["velocity_raw_rad_s"][at]
        # Its filtered form is the derivative of the filtered velocity: both are linear.
        still = np.zeros_like(velocity)
        out[at] = rigid_body.regressor(
            full["position_rad"][at] if located else None,
            velocity,
            still if piece.slow else slope(velocity, piece.period_s) + full[CORNERS][at],
            full["direction"][at],
            gear_ratio,
        )[:, : len(BASE)]
    return banded(out, pieces)
