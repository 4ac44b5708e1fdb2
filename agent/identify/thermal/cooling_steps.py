"""The law of a cooling curve that a coarse sensor reads: half and whole degrees.

A reading of 31 degC in steps of 1 degC says that temperature and noise lay between 30.5 and 31.5,
no more; taken for 31 with noise, its error follows the curve for hours and no average takes it
out. Here every reading has the probability that its step has under the law and the sensor's own
noise (interval-censored likelihood: Gjeddebaek, Skand. Aktuarietidskr. 32 (1949) 135). The moments
at which the reading changes then carry the information. Draws come by importance sampling
around the best fit, so that nothing hangs on a parabola.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.thermal.cooling_fit import DRAWS, CoolingDraws, colour, followed, neighbours
from agent.physics.thermal import relaxed_degc

_BLOCKS = 700
_FINE = 1e-6  # degC: closer readings are one
_COARSE = 1.5  # times what the plain fit leaves: below it, noise makes up for the steps
_PROPOSED = 6_000
_PROPOSAL_DOF = 5.0
_WIDER = 1.2
_QUIETEST, _LOUDEST = 0.02, 3.0  # the sensor's noise, in steps
_RATES = 65
_RATE_REACH = 5.0  # either way from the start value, for a moving environment
_LEAST_SHARE = 1e-12  # an outlier must not forbid a curve


def step_of(temperature_degc: Floats) -> float:
    """Return the step that all readings are multiples of, in degC; 0 where there is none."""
    levels = np.unique(np.round(temperature_degc / _FINE)) * _FINE
    if levels.size < 2:
        return 0.0
    step = float(np.diff(levels).min())
    multiples = (levels - levels[0]) / step
    regular = bool(np.all(np.abs(multiples - np.round(multiples)) < 0.02))
    return step if regular and step > 10.0 * _FINE else 0.0


def is_coarse(step_degc: float, rmse_degc: float) -> bool:
    """Return whether a sensor's steps rule what a fit leaves of its curve."""
    return step_degc > _COARSE * rmse_degc


@dataclass(frozen=True)
class _Readings:
    """Readings, those of one short block and one level counted together; all shape (k,)."""

    time_s: Floats
    level_degc: Floats
    count: Floats
    block: np.ndarray[tuple[int], np.dtype[np.int64]]


def fit_steps(
    time_s: Floats,
    temperature_degc: Floats,
    ambient_degc: Floats | None,
    step_degc: float,
    start: CoolingDraws,
) -> CoolingDraws:
    """Fit the law to readings in coarse steps, rounded to the nearest.

    Parameters
    ----------
    time_s, temperature_degc : ndarray, shape (n,)
        From the curve's start; every reading, none averaged.
    ambient_degc : ndarray, shape (n,), optional
        Measured temperature of the environment.
    step_degc : float
        See `step_of`.
    start : CoolingDraws
        The fit that takes the steps for noise.
    """
    from scipy.optimize import minimize

    readings = _counted(time_s, temperature_degc)
    model = _Model(readings, step_degc, _Environment.of(time_s, ambient_degc, readings, start))
    first = np.array(
        (
            math.log(start.rate_per_s),
            start.settled_degc,
            start.initial_degc,
            math.log(0.3 * step_degc),
        )
    )
    bounds = [
        (first[0] - math.log(_RATE_REACH), first[0] + math.log(_RATE_REACH)),
        (None, None),
        (None, None),
        (math.log(_QUIETEST * step_degc), math.log(_LOUDEST * step_degc)),
    ]
    found = minimize(model.cost, first, jac=True, bounds=bounds, method="L-BFGS-B")
    best = np.asarray(found.x, dtype=np.float64)
    best[3] = np.clip(best[3], bounds[3][0] + 1e-3, bounds[3][1])
    draws = _weighted_draws(model, best)
    rest = readings.level_degc - model.predicted(best[np.newaxis])[0]
    rmse = math.sqrt(float(readings.count @ rest**2) / float(readings.count.sum()))
    return CoolingDraws(
        math.exp(best[0]), float(best[1]), float(best[2]), draws, rmse, 0.0, start.bends
    )


def _counted(time_s: Floats, temperature: Floats) -> _Readings:
    """Count the readings of one level in every short block."""
    block = neighbours(time_s, _BLOCKS)
    keys, inverse = np.unique(np.stack((block, temperature)), axis=1, return_inverse=True)
    count = np.bincount(inverse.ravel()).astype(np.float64)
    mean = np.bincount(inverse.ravel(), weights=time_s) / count
    return _Readings(mean, keys[1], count, keys[0].astype(np.int64))


@dataclass(frozen=True)
class _Environment:
    """How far the gearbox follows its environment, for rates on a grid: shape (g, k)."""

    log_rate: Floats
    followed_k: Floats | None

    @classmethod
    def of(
        cls, time_s: Floats, ambient: Floats | None, readings: _Readings, start: CoolingDraws
    ) -> _Environment:
        """Tabulate it, so that thousands of rates cost no more than some."""
        reach = math.log(_RATE_REACH)
        log_rate = math.log(start.rate_per_s) + np.linspace(-reach, reach, _RATES)
        if ambient is None:
            return cls(log_rate, None)
        answers = (followed(math.exp(x), time_s, ambient) for x in log_rate)
        return cls(log_rate, np.stack([np.interp(readings.time_s, time_s, a) for a in answers]))

    def at(self, log_rate: Floats) -> Floats | float:
        """Return the answer at rates of shape (m,), shape (m, k)."""
        if self.followed_k is None:
            return 0.0
        place = np.interp(log_rate, self.log_rate, np.arange(self.log_rate.size, dtype=np.float64))
        below = np.minimum(place.astype(np.int64), self.log_rate.size - 2)
        share = (place - below)[:, np.newaxis]
        table = self.followed_k
        return np.asarray((1.0 - share) * table[below] + share * table[below + 1])


@dataclass(frozen=True)
class _Model:
    """The likelihood of (log r, settled, initial, log sigma)."""

    readings: _Readings
    step_degc: float
    environment: _Environment

    def predicted(self, points: Floats) -> Floats:
        """Return the temperature for parameters of shape (m, 4), shape (m, k)."""
        rate, settled, initial = np.exp(points[:, 0]), points[:, 1], points[:, 2]
        law = relaxed_degc(
            rate[:, np.newaxis],
            settled[:, np.newaxis],
            initial[:, np.newaxis],
            self.readings.time_s[np.newaxis],
        )
        return np.asarray(law + self.environment.at(points[:, 0]))

    def log_share(self, points: Floats) -> Floats:
        """Return the log probability of every reading, shape (m, k)."""
        from scipy.special import ndtr

        noise = np.exp(points[:, 3:4])
        near = np.abs(self.readings.level_degc - self.predicted(points)) / noise
        half = 0.5 * self.step_degc / noise
        # Both ends on the lower tail, where the difference of two small numbers stays exact.
        return np.asarray(np.log(np.maximum(ndtr(half - near) - ndtr(-half - near), _LEAST_SHARE)))

    def score(self, point: Floats) -> tuple[Floats, Floats, Floats, Floats]:
        """Return log share and its slopes by temperature and log sigma; law's slopes (k, 3)."""
        from scipy.special import ndtr

        noise = math.exp(point[3])
        gap = self.readings.level_degc - self.predicted(point[np.newaxis])[0]
        low, high = ((gap + end * 0.5 * self.step_degc) / noise for end in (-1.0, 1.0))
        flipped = np.where(low > 0.0, -1.0, 1.0)
        share = flipped * (ndtr(flipped * high) - ndtr(flipped * low))
        share = np.maximum(share, _LEAST_SHARE)
        at_low, at_high = (np.exp(-0.5 * end**2) / math.sqrt(2.0 * math.pi) for end in (low, high))
        by_level = (at_low - at_high) / (noise * share)
        by_noise = (low * at_low - high * at_high) / share
        return np.log(share), by_level, by_noise, self._slopes(point)

    def _slopes(self, point: Floats) -> Floats:
        """Return the temperature's derivatives by log r, settled, initial: shape (k, 3)."""
        steps = np.diag((1e-5, 1e-3, 1e-3, 0.0))[:3]
        above, below = (self.predicted(point + sign * steps) for sign in (1.0, -1.0))
        return np.asarray(((above - below) / (2.0 * np.array((1e-5, 1e-3, 1e-3)))[:, None]).T)

    def cost(self, point: Floats) -> tuple[float, Floats]:
        """Return minus the log likelihood and its gradient."""
        share, by_level, by_noise, slopes = self.score(point)
        count = self.readings.count
        gradient = np.append(slopes.T @ (count * by_level), count @ by_noise)
        return -float(count @ share), -gradient

    def dispersion(self, point: Floats) -> float:
        """Return by how much the readings carry less than independent ones would.

        Readings that repeat a held value, or that wander, make the scores of whole blocks larger
        or longer than the law of the noise does; the likelihood is flattened by that factor.
        """
        _, by_level, _, _ = self.score(point)
        block, count = self.readings.block, self.readings.count
        scores: Floats = np.bincount(block, weights=count * by_level).astype(np.float64)
        expected = float(np.bincount(block, weights=count * self._information(point)).mean())
        squares = scores**2
        excess = float(squares.mean()) / expected
        doubt = 2.0 * float(squares.std()) / (math.sqrt(squares.size) * expected)
        return (excess if excess > 1.0 + doubt else 1.0) * colour(scores)

    def _information(self, point: Floats) -> Floats:
        """Return what one reading at each time tells of the temperature, 1/degC^2: shape (k,)."""
        from scipy.special import ndtr

        noise = math.exp(point[3])
        temperature = self.predicted(point[np.newaxis])[0]
        nearest = np.round((temperature - self.readings.level_degc) / self.step_degc)
        centre = self.readings.level_degc + nearest * self.step_degc
        reach = math.ceil(5.0 * noise / self.step_degc) + 1
        total = np.zeros_like(temperature)
        for k in range(-reach, reach + 1):
            low = (centre + (k - 0.5) * self.step_degc - temperature) / noise
            high = low + self.step_degc / noise
            share = np.maximum(ndtr(high) - ndtr(low), _LEAST_SHARE)
            total += (np.exp(-0.5 * low**2) - np.exp(-0.5 * high**2)) ** 2 / share
        return np.asarray(total / (2.0 * math.pi * noise**2))


def _weighted_draws(model: _Model, best: Floats) -> Floats:
    """Return draws of (r, settled, initial) in proportion to the likelihood; a fixed seed."""
    flatter = model.dispersion(best)
    steps = np.array((1e-4, 1e-3, 1e-3, 1e-3))
    rows = [
        (model.cost(best + s)[1] - model.cost(best - s)[1]) / (2.0 * size)
        for s, size in zip(np.diag(steps), steps, strict=True)
    ]
    curvature = 0.5 * (np.stack(rows) + np.stack(rows).T)
    values, vectors = np.linalg.eigh(curvature)
    spread = vectors * np.sqrt(_WIDER * flatter / np.maximum(values, 1e-6 * values.max()))
    generator = np.random.default_rng(0)
    normal = generator.standard_normal((_PROPOSED, 4))
    scale = np.sqrt(_PROPOSAL_DOF / generator.chisquare(_PROPOSAL_DOF, _PROPOSED))
    standard = normal * scale[:, np.newaxis]
    points = best + standard @ spread.T
    inside = points[:, 3] > math.log(_QUIETEST * model.step_degc)
    points, standard = points[inside], standard[inside]
    shares = [
        model.log_share(part) @ model.readings.count
        for part in np.array_split(points, 40)
        if part.size
    ]
    proposal = -0.5 * (_PROPOSAL_DOF + 4.0) * np.log1p(np.sum(standard**2, axis=1) / _PROPOSAL_DOF)
    weight = np.concatenate(shares) / flatter - proposal
    weight = np.exp(weight - weight.max())
    picked = generator.choice(weight.size, size=DRAWS, p=weight / weight.sum())
    return np.column_stack((np.exp(points[picked, 0]), points[picked, 1:3]))
