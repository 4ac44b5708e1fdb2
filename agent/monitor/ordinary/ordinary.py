"""Friction from ordinary work cycles, where they excite enough, and why not where they do not.

A dedicated cycle stops production; ordinary motion is free, but "the parameters can only be
identified if their frequency range is excited" (thesis, chapter 7.2). Torque is regressed on
inertia, gravity, offset and friction by speed: straight lines between speeds that the motion itself
visits, so that low-speed friction does not have to be Coulomb plus viscous. What the motion must
have is checked first, and said: speeds from slow to fast, both directions, columns that can be
told apart.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from agent.identify import diagnosis
from agent.identify.objections import objections
from agent.identify.result import Floats, FrictionCurve, Parameter, RigidBodyFit
from agent.identify.rigid.carried import variance_inflation
from agent.identify.rigid.linear import time_blocks
from agent.identify.rigid.regression import regress
from agent.identify.signals.direction import direction_of
from agent.identify.signals.lowpass import lowpass
from agent.identify.signals.preprocess import FilteredStretch, Motion, filter_motion
from agent.identify.signals.windows import find_windows
from agent.identify.uncertainty import block_jackknife, student_975
from agent.monitor.ordinary.excitation import MOVING, Excitation, excitation_of
from agent.monitor.ordinary.swinging import swinging_of
from agent.numbers import signed
from agent.physics.rigid_body import PARAMETERS

KNOTS = 5
_BLOCKS = 40
_FEWEST_BLOCKS = 14
_FIRM = 0.1  # of the value: half of the widest interval that counts as known
_LEAST_RANGE = 2.0  # fastest to slowest speed at which friction is known
_INFLATION = 1000.0


@dataclass(frozen=True)
class OrdinaryFriction:
    """What ordinary work says of friction.

    Parameters
    ----------
    decidable : bool
    reasons : tuple of str
        Why not, in plain words; where decidable, at which speeds it is not.
    excitation : Excitation or None
        None where the recordings cannot be used at all.
    speed_rad_s, friction_nm : ndarray, shape (k,)
        Friction by speed; empty where not decidable.
    deviation_nm : ndarray, shape (k,)
        Standard deviation from leaving out blocks of time.
    dof : float
        Of these deviations.
    body : RigidBodyFit or None
        The plain law's regression: Coulomb, viscous, inertia, gravity, offset.
    temperature_degc : float
        Mean of the gearbox; NaN where it was not recorded.
    """

    decidable: bool
    reasons: tuple[str, ...]
    excitation: Excitation | None
    speed_rad_s: Floats
    friction_nm: Floats
    deviation_nm: Floats
    dof: float
    body: RigidBodyFit | None
    temperature_degc: float

    @classmethod
    def undecided(
        cls, reasons: Sequence[str], excitation: Excitation | None = None
    ) -> OrdinaryFriction:
        """Return what carries no friction, with the reasons."""
        none = np.zeros(0)
        return cls(False, tuple(reasons), excitation, none, none, none, math.nan, None, math.nan)

    def parameter(self, name: str) -> Parameter:
        """Return a number of the plain law by the twin's name."""
        if self.body is None:
            return Parameter.not_identified("; ".join(self.reasons))
        return self.body.parameters[name]


@dataclass(frozen=True)
class Comparison:
    """Ordinary work's friction beside a dedicated cycle's; arrays of shape (m,).

    `agrees` is a chi-squared test at 1 %; `sentence` says by how much they differ.
    """

    speed_rad_s: Floats
    difference_nm: Floats
    deviation_nm: Floats
    agrees: bool
    sentence: str


def ordinary_friction(motions: Sequence[Motion]) -> OrdinaryFriction:
    """Estimate friction by speed from recordings of ordinary work of one axis.

    Parameters
    ----------
    motions : sequence of Motion
        At least one.
    """
    refused = diagnosis.refusals(motions)
    windows = [find_windows(m) for m in motions]
    # A velocity that never settles is what work looks like: not an objection here.
    objected = [
        text
        for motion, own in zip(motions, windows, strict=True)
        for text in objections(motion, own)
        if "never settles" not in text
    ]
    if refused or objected:
        return OrdinaryFriction.undecided([*refused, *objected])
    regression = regress(motions, None)
    steady = sum(w.stop - w.start for own in windows for w in own)
    excitation = excitation_of(motions, steady, regression.rows.arm_stroke_rad)
    reasons = excitation.reasons()
    swinging = swinging_of(motions)
    if swinging is not None and swinging.refusal:
        reasons.append(swinging.refusal)
    if reasons:
        return OrdinaryFriction.undecided(reasons, excitation)
    fastest = max(float(np.abs(v).max()) for m in motions for v in m.velocity_rad_s)
    knots = _knots(excitation, fastest)
    stretches = [(m, s) for m in motions for s in filter_motion(m, regression.cutoff_hz)]
    fitted = _fit(stretches, knots, regression.cutoff_hz)
    if isinstance(fitted, str):
        return OrdinaryFriction.undecided([fitted], excitation)
    friction, deviation, dof = fitted
    knots, friction, deviation = (values[1:-1] for values in (knots, friction, deviation))
    firm = _firm(friction, deviation, dof)
    if not np.any(firm) or knots[firm][-1] < _LEAST_RANGE * knots[firm][0]:
        return OrdinaryFriction.undecided([_loose(knots, friction, deviation, dof)], excitation)
    notes = () if np.all(firm) else (_loose(knots[~firm], friction[~firm], deviation[~firm], dof),)
    return OrdinaryFriction(
        True,
        notes,
        excitation,
        knots[firm],
        friction[firm],
        deviation[firm],
        dof,
        regression.body,
        _warmth(motions),
    )


def compare(
    work: OrdinaryFriction, dedicated: FrictionCurve, dedicated_degc: float = math.nan
) -> Comparison:
    """Lay ordinary work's friction beside a dedicated cycle's curve.

    Parameters
    ----------
    work : OrdinaryFriction
        Decidable.
    dedicated : FrictionCurve
    dedicated_degc : float
        The dedicated cycle's gearbox temperature.

    Raises
    ------
    ValueError
        The work is not decidable, or shares no speed with the curve.
    """
    from scipy.special import chdtrc

    if not work.decidable:
        raise ValueError("expected ordinary work that carries friction")
    own = dedicated.velocity_rad_s
    shared = (work.speed_rad_s >= own[0]) & (work.speed_rad_s <= own[-1])
    if not np.any(shared):
        raise ValueError("the two share no speed")
    speed = work.speed_rad_s[shared]
    half = np.interp(speed, own, 0.5 * (dedicated.ci95_nm[:, 1] - dedicated.ci95_nm[:, 0]))
    deviation = np.hypot(work.deviation_nm[shared], half / 1.96)
    difference = work.friction_nm[shared] - np.interp(speed, own, dedicated.friction_nm)
    agrees = bool(chdtrc(speed.size, float(np.sum((difference / deviation) ** 2))) > 0.01)
    worst = int(np.argmax(np.abs(difference / deviation)))
    share = 100.0 * difference[worst] / float(np.interp(speed[worst], own, dedicated.friction_nm))
    said = (
        f"at {speed[worst]:.3g} rad/s ordinary work says {signed(difference[worst], '+.3g')} N m "
        f"({signed(share, '+.1f')} %, ±{1.96 * deviation[worst]:.2g} N m) "
        "against the dedicated cycle"
    )
    sentence = f"the two agree within what is known; {said}" if agrees else f"they differ: {said}"
    apart = work.temperature_degc - dedicated_degc
    if math.isfinite(apart) and abs(apart) >= 1.0:
        sentence += (
            f"; the gearbox was {signed(apart, '+.1f')} degC from the dedicated cycle's temperature"
        )
    return Comparison(speed, difference, deviation, agrees, sentence)


def _knots(excitation: Excitation, fastest_rad_s: float) -> Floats:
    """Return the knots, shape (KNOTS + 2,): the first and the last are not reported.

    They take up what friction does in the few passes that are slower or faster than the rest.
    """
    slow, _, fast = excitation.speeds_rad_s
    lowest = min(MOVING * fastest_rad_s, 0.5 * slow)
    inner = np.geomspace(slow, fast, KNOTS)
    return np.concatenate(([lowest], inner, [max(fastest_rad_s, 1.05 * fast)]))


def _hats(speed: Floats, knots: Floats) -> Floats:
    """Return the weights of straight lines between knots, shape (n, k); held flat beyond."""
    at = np.clip(speed, knots[0], knots[-1])
    return np.stack(
        [np.interp(at, knots, np.eye(knots.size)[k]) for k in range(knots.size)], axis=-1
    )


def _columns(motion: Motion, filtered: FilteredStretch, knots: Floats, cutoff_hz: float) -> Floats:
    """Return one stretch's usable rows, shape (n, k + 4): friction by speed, then the rest.

    The friction columns pass the same filter as torque.
    """
    which = next(i for i, s in enumerate(motion.timing.stretches) if s is filtered.stretch)
    velocity, period_s = motion.velocity_rad_s[which], filtered.stretch.period_s
    sign = direction_of(velocity, period_s, cutoff_hz, motion.velocity_noise_rad_s)
    friction = lowpass(
        (sign[:, np.newaxis] * _hats(np.abs(velocity), knots)).T, period_s, cutoff_hz
    )
    rest = [i for i, n in enumerate(PARAMETERS) if n not in ("coulomb_nm", "viscous_nm_s_per_rad")]
    return np.column_stack((friction.T, filtered.regressor[:, rest]))[filtered.usable]


def _fit(
    stretches: Sequence[tuple[Motion, FilteredStretch]], knots: Floats, cutoff_hz: float
) -> tuple[Floats, Floats, float] | str:
    """Return friction at the knots, its deviation and degrees of freedom, or why there is none."""
    columns, torque, times, clock_s = [], [], [], 0.0
    for motion, filtered in stretches:
        time_s = filtered.stretch.time_s - filtered.stretch.time_s[0] + clock_s
        clock_s = float(time_s[-1]) + filtered.stretch.period_s
        columns.append(_columns(motion, filtered, knots, cutoff_hz))
        torque.append(filtered.torque_nm[filtered.usable])
        times.append(time_s[filtered.usable])
    if not columns:
        return "no stretch of data is long enough to be filtered"
    rows, target = np.concatenate(columns), np.concatenate(torque)
    kept = _kept(rows, knots.size)
    if kept is None:
        return (
            "the speeds that the motion visits cannot be told apart: some are only passed while "
            "the joint speeds up or slows down"
        )
    blocks: NDArray[np.int64] = time_blocks(np.concatenate(times), _BLOCKS)
    if int(blocks[-1]) + 1 < max(_FEWEST_BLOCKS, len(kept) + 2):
        return "the motion is too short to say how well its friction is known"
    theta, covariance, dof = block_jackknife(rows[:, kept], target, blocks)
    deviation = np.sqrt(np.maximum(np.diag(covariance), 0.0))
    return theta[: knots.size], deviation[: knots.size], dof


def _kept(rows: Floats, knots: int) -> list[int] | None:
    """Return the columns that can be told apart; None where friction itself cannot.

    Gravity goes first, then the offset.
    """
    inertia, sine, cosine, offset = range(knots, knots + 4)
    friction = list(range(knots))
    for others in ([inertia, sine, cosine, offset], [inertia, offset], [inertia]):
        kept = [*friction, *(c for c in others if np.any(rows[:, c] != 0.0))]
        if float(np.max(variance_inflation(rows[:, kept]))) <= _INFLATION:
            return kept
    return None


def _firm(friction: Floats, deviation: Floats, dof: float) -> NDArray[np.bool_]:
    """Tell where friction is known well enough to be given, shape (k,)."""
    half = student_975(dof) * deviation
    return np.asarray((friction > 0.0) & (half <= _FIRM * np.abs(friction)), dtype=np.bool_)


def _loose(knots: Floats, friction: Floats, deviation: Floats, dof: float) -> str:
    """Say where friction is not known well enough."""
    half = student_975(dof) * deviation
    found = [
        f"at {v:.3g} rad/s friction comes out as {f:.3g} ±{h:.2g} N m"
        for v, f, h in zip(knots, friction, half, strict=True)
    ]
    return f"{', '.join(found)}: too loose to be called known (10 %)"


def _warmth(motions: Sequence[Motion]) -> float:
    known = [
        t[np.isfinite(t)]
        for t in (m.signals.gearbox_temperature_degc for m in motions)
        if t is not None
    ]
    together = np.concatenate(known) if known else np.zeros(0)
    return float(together.mean()) if together.size else math.nan
