"""What a minimum lacks, as far as what it leaves of the torque can show it: its rivals.

A fit ends where no change of its own parameters explains more. Whether something else would is
asked of single columns that the model does not have: one more swinging mass at any frequency, a
friction that bends with speed, gravity, a spring that stiffens, friction behind the spring, a
filter that the torque passed where the model has a delay. Each is freed of what the model's own
Jacobian can say and laid against what is left (a score test, Rao 1948). A column that explains more
than chance would also have moved the model's parameters; by how much follows to first order, and
belongs to what is not known about them.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from typing import Literal, NamedTuple

import numpy as np

from agent.identify.flexible.attenuation import covariance_of, moved_by_noise, noise_in_common
from agent.identify.flexible.chain import (
    Complexes,
    apparent_inertia,
    behind_spring,
    chain_of,
    stiffening,
)
from agent.identify.flexible.preparation import Prepared
from agent.identify.flexible.projection import (
    Point,
    Problem,
    cubic_column,
    friction_columns,
)
from agent.identify.flexible.slopes import jacobian_of
from agent.identify.flexible.spectra import PLACES, frequency_range_hz
from agent.identify.flexible.twist import cubes_of
from agent.identify.result import Floats
from agent.identify.uncertainty import correlation_time
from agent.physics.friction import STRIBECK

Effect = Literal[
    "mode", "friction", "gravity", "stiffening", "arm-viscous", "arm-coulomb", "filter"
]

PLAIN = 0.5
"""Share of what is left that a rival explains where the model is plainly another than the joint:
no chance, however few the samples look, and too much for first order."""

_RATIOS = (0.01, 0.05, 0.2)  # dampings of a further mode
_SEEN = 0.9  # of the cutoff, as far as a mode is sought
_SPEEDS = 8  # at which friction may bend: from a hundredth of the fastest to twice it
_EXPONENTS = (1.0, 2.0)
_FILTERS_S = np.geomspace(0.0003, 0.005, 13)  # as late as a delay may be
_FALSE_ALARMS = 1e-3
_FALSE_MODES = 1e-2  # a bound: half of chi square's tail is a tenth of it, and places overlap
_NEW = 1e-6  # of a column's energy: where less is left of it, the model says the same already


@dataclass(frozen=True)
class Rival:
    """A column that the model lacks and that explains part of what it leaves.

    Parameters
    ----------
    effect : Effect
    at_rad_s : float
        Angular frequency of the mode, corner of the filter, or speed at which friction bends; NaN
        for the others.
    share : float
        Of the squared residual, what it explains.
    """

    effect: Effect
    at_rad_s: float
    share: float


@dataclass(frozen=True)
class Lack:
    """What a minimum lacks.

    Parameters
    ----------
    rivals : tuple of Rival
        In the order in which they explain most; empty where chance explains what is left.
    shift : ndarray, shape (p,)
        By how much they would move the linear parameters and then the searched ones.
    """

    rivals: tuple[Rival, ...]
    shift: Floats

    def share_of(self, effect: Effect) -> float:
        """Return what an effect explains of the squared residual; 0 where it is not lacking."""
        return max((r.share for r in self.rivals if r.effect == effect), default=0.0)


@dataclass(frozen=True)
class _Family:
    """Columns of one effect, shape (n, c), with the place that each stands for.

    `common` is what they and the residual have in common by the motion's noise, shape (c,).
    """

    effect: Effect
    places_rad_s: Floats
    columns: Floats
    positive: bool
    common: Floats = field(default_factory=lambda: np.zeros(1))


class _Taken(NamedTuple):
    """A rival, its column, and what that and the residual have in common by noise."""

    rival: Rival
    column: Floats
    common: float


def lack_of(problem: Problem, point: Point) -> Lack:
    """Return what a minimum of a problem with a chain lacks."""
    jacobian = jacobian_of(problem, point)
    size = np.sqrt(np.einsum("ij,ij->j", jacobian, jacobian))
    there = size > 0.0
    u, s, vt = np.linalg.svd(jacobian[:, there] / size[there], full_matrices=False)
    good = s > 1e-10 * s[0]
    basis, own = u[:, good], int(good.sum())
    inverse = np.zeros((jacobian.shape[1], own))
    inverse[there] = (vt[good].T / s[good]) / size[there, np.newaxis]
    # A minimum has given way to the noise that columns and residual share.
    given = jacobian @ moved_by_noise(problem, point)
    families = [replace(f, common=f.common + given @ f.columns) for f in _families(problem, point)]
    taken = _one_by_one(families, basis, problem, point)
    if not taken:
        return Lack((), np.zeros(jacobian.shape[1]))
    columns = np.stack([each.column for each in taken], axis=-1)
    inside = basis.T @ columns
    outside = columns - basis @ inside
    shared = np.array([each.common for each in taken])
    amplitudes = np.linalg.lstsq(
        outside.T @ outside, outside.T @ point.residual - shared, rcond=1e-13
    )[0]
    shift = np.asarray(-inverse @ (inside @ amplitudes), dtype=np.float64)
    return Lack(tuple(each.rival for each in taken), shift)


def _one_by_one(
    families: list[_Family], basis: Floats, problem: Problem, point: Point
) -> list[_Taken]:
    """Return one column of each family that explains more than chance, the best first.

    Each is weighed beside those before it, whose part is taken from the residual; `basis` is what
    the model itself can say.
    """
    whole = {f.effect: f.common for f in families}
    left, taken = point.residual, list[_Taken]()
    while families:
        found = [_best(f, basis, left, problem, point) for f in families]
        i = max(range(len(found)), key=lambda k: found[k][0])
        share, column = found[i]
        if share <= 0.0:
            break
        family = families.pop(i)
        rival = Rival(family.effect, float(family.places_rad_s[column]), share)
        own = family.columns[:, column]
        taken.append(_Taken(rival, own, float(whole[family.effect][column])))
        fresh = own - basis @ (basis.T @ own)
        norm = float(np.linalg.norm(fresh))
        fresh, bias = fresh / norm, float(family.common[column]) / norm
        families = [replace(f, common=f.common - bias * (fresh @ f.columns)) for f in families]
        basis = np.column_stack((basis, fresh))
        left = left - fresh * float(fresh @ left)
    return taken


def _best(
    family: _Family, basis: Floats, left: Floats, problem: Problem, point: Point
) -> tuple[float, int]:
    """Return the share of the residual that a family's best column explains, and which it is.

    The share is zero where chance explains as much: a log-likelihood of half a log of the samples
    (Schwarz 1978), and the log of the places tried over the false alarms allowed. A mode need not
    be worth its parameters to say that the masses are not all: chance alone is asked. Chance is no
    less than the measuring noise makes it, which has its peaks where columns may have theirs.
    """
    columns = family.columns
    fresh = columns - basis @ (basis.T @ columns)
    energy = np.einsum("ij,ij->j", fresh, fresh)
    new = energy > _NEW * np.einsum("ij,ij->j", columns, columns)
    moment = fresh.T @ left - family.common
    amplitude = np.where(new, moment / np.where(new, energy, 1.0), 0.0)
    if family.positive:
        amplitude = np.maximum(amplitude, 0.0)
    gain = moment * amplitude
    best = int(np.argmax(gain))
    rest = left - amplitude[best] * fresh[:, best]
    samples = max(rest.shape[0] / correlation_time([rest]), 2.0)
    wanted = 0.5 * math.log(samples) + math.log(gain.shape[0] / _FALSE_ALARMS)
    if family.effect == "mode":
        wanted = math.log(PLACES / _FALSE_MODES)
    total = max(float(left @ left), 1e-300)
    evidence = -0.5 * samples * math.log1p(-min(float(gain[best]) / total, 1.0 - 1e-12))
    share = float(gain[best]) / max(point.cost, 1e-300)
    if share > PLAIN or evidence <= wanted:
        return (share if share > PLAIN else 0.0), best
    noise = float(covariance_of(problem, point, fresh[:, best][np.newaxis])[0, 0])
    known = 0.5 * float(moment[best]) ** 2 / max(noise, 1e-300)
    return (share if known > wanted else 0.0), best


def _families(problem: Problem, point: Point) -> list[_Family]:
    out = [_modes(problem, point), _frictions(problem, point), _filters(problem, point)]
    if not problem.has_gravity:
        out.append(_gravity(problem, point))
    if problem.kind == "two-mass" and problem.cubes is None:
        out.append(_stiffening(problem, point))
    if problem.kind == "two-mass":
        out += _arm_frictions(problem, point)
    return out


def _modes(problem: Problem, point: Point) -> _Family:
    """Return one more mass behind a spring of its own, which cannot be negative."""
    low_hz, high_hz = frequency_range_hz(problem.stretches)
    places = 2.0 * math.pi * np.geomspace(low_hz, _SEEN * high_hz, PLACES)
    chains = [chain_of(np.log([w, z])) for w in places for z in _RATIOS]
    delay_s = float(point.search[-1])

    def rows(p: Prepared) -> Floats:
        return np.stack([p.through(apparent_inertia(c, p.omega_rad_s), delay_s) for c in chains])

    def response(omega: Floats, _: Complexes) -> Complexes:
        return np.stack([apparent_inertia(c, omega) for c in chains])

    common = noise_in_common(problem, point, response)
    return _Family("mode", np.repeat(places, len(_RATIOS)), _kept(problem, rows), True, common)


def _frictions(problem: Problem, point: Point) -> _Family:
    """Return frictions that change about some speed: Stribeck's line, of either sign."""
    fastest = problem.fastest_rad_s
    places = np.geomspace(fastest / 100.0, 2.0 * fastest, _SPEEDS)
    pairs = [(float(v), e) for v in places for e in _EXPONENTS]
    line = STRIBECK.linear.index("static_extra_nm")
    delay_s = float(point.search[-1])

    def rows(p: Prepared) -> Floats:
        bends = [friction_columns(p, STRIBECK, pair)[line] for pair in pairs]
        return p.thinned(np.stack(bends), delay_s)

    return _Family("friction", np.repeat(places, len(_EXPONENTS)), _kept(problem, rows), False)


def _filters(problem: Problem, point: Point) -> _Family:
    """Return what a filter of first order does to the model's torque beyond a delay as long."""
    named = len(problem.linear_names) - 1  # all but the offset
    torque = problem.all_columns(point.search)[:, :named] @ point.linear[:named]
    ends = np.cumsum([p.torque_nm.shape[0] for p in problem.stretches])
    rows = []
    for p, own in zip(problem.stretches, np.split(torque, ends[:-1]), strict=True):
        lags = 1j * np.outer(_FILTERS_S, p.omega_rad_s)
        rows.append(np.stack([p.passed(own, np.exp(s) / (1.0 + s) - 1.0) for s in lags], axis=-1))
    columns = problem.counted(np.concatenate(rows))

    def response(omega: Floats, inertia: Complexes) -> Complexes:
        lags = 1j * np.outer(_FILTERS_S, omega)
        return np.asarray((np.exp(lags) / (1.0 + lags) - 1.0) * inertia, dtype=np.complex128)

    common = noise_in_common(problem, point, response)
    return _Family("filter", 1.0 / _FILTERS_S, columns, True, common)


def _gravity(problem: Problem, point: Point) -> _Family:
    """Return sine and cosine of the arm's angle; zero where no position was recorded."""
    delay_s = float(point.search[-1])
    columns = _kept(problem, lambda p: p.thinned(p.angles, delay_s))
    return _Family("gravity", np.full(2, math.nan), columns, False)


def _stiffening(problem: Problem, point: Point) -> _Family:
    shape = point.search[: problem.shape_size]
    cubes = zip(problem.stretches, cubes_of(problem, point), strict=True)
    column = problem.counted(np.concatenate([cubic_column(p, cube, shape) for p, cube in cubes]))
    return _Family("stiffening", np.array([math.nan]), column[:, np.newaxis], True)


def _arm_frictions(problem: Problem, point: Point) -> list[_Family]:
    """Return viscous and Coulomb friction on the arm, less the motor's of the same size."""
    chain = chain_of(point.search[: problem.shape_size])
    delay_s = float(point.search[-1])

    def viscous(p: Prepared) -> Floats:
        return p.through(behind_spring(chain, p.omega_rad_s), delay_s)[np.newaxis]

    def coulomb(p: Prepared) -> Floats:
        # The arm turns back with the motor but for its ringing.
        sign = p.thinned(p.filtered(p.direction[np.newaxis]), delay_s)[0]
        return -p.passed(sign, stiffening(chain, p.omega_rad_s))[np.newaxis]

    def response(omega: Floats, _: Complexes) -> Complexes:
        return np.asarray(behind_spring(chain, omega)[np.newaxis], dtype=np.complex128)

    nowhere, common = np.array([math.nan]), noise_in_common(problem, point, response)
    return [
        _Family("arm-viscous", nowhere, _kept(problem, viscous), True, common),
        _Family("arm-coulomb", nowhere, _kept(problem, coulomb), True),
    ]


def _kept(problem: Problem, rows: Callable[[Prepared], Floats]) -> Floats:
    """Return columns, made as rows for every stretch, at the rows that count: shape (n, c)."""
    return problem.counted(np.concatenate([rows(p) for p in problem.stretches], axis=1).T)
