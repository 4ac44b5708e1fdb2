"""Does friction follow the temperature or the time? Where both explain it alike, that is said.

In one warm-up, temperature and time rise together: a falling friction may be thinner oil or
running-in. The steady passes' torque, less its level for each velocity, is regressed on the
temperature and on time, each as straight or as bent as serves it best, and the two are compared.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.windows import find_windows
from agent.identify.uncertainty import correlation_time, student_975, variance_of_mean

TEMPERATURE, TIME, TIE, NEITHER, UNKNOWN = "temperature", "time", "tie", "neither", "unknown"
_LEAST_PASSES = 8
_LEAST_SPAN_DEGC = 2.0
_DECISIVE = 1.3  # times the 95 % error of the comparison: about 99 %
_MATERIAL = 0.1  # share of the variance that a trend must explain
_SAME_SPEED = 0.05
_BENDS = (0.0, 0.5, 1.0, 2.0, 4.0, 8.0, -0.5, -1.0, -2.0)  # how often it falls by e over the span


@dataclass(frozen=True)
class TemperatureOrTime:
    """What friction follows.

    Parameters
    ----------
    verdict : str
        `TEMPERATURE`, `TIME`, `TIE`, `NEITHER` or `UNKNOWN`.
    sentence : str
        In words, with what to do.
    r2_temperature, r2_time, r2_both : float
        Share of the variance between passes of one velocity that each explains; NaN if unknown.
    passes : int
    """

    verdict: str
    sentence: str
    r2_temperature: float = math.nan
    r2_time: float = math.nan
    r2_both: float = math.nan
    passes: int = 0

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        shares = {
            name: None if math.isnan(value) else value
            for name, value in (
                ("r2_temperature", self.r2_temperature),
                ("r2_time", self.r2_time),
                ("r2_both", self.r2_both),
            )
        }
        return {
            "verdict": self.verdict,
            "sentence": self.sentence,
            "passes": self.passes,
            **shares,
        }


def temperature_or_time(
    recordings: Sequence[Signals],
    temperature_degc: Sequence[Floats | None],
    starts_s: Sequence[float] | None = None,
) -> TemperatureOrTime:
    """Tell whether friction follows temperature or time.

    Parameters
    ----------
    recordings : sequence of Signals
        Of one axis.
    temperature_degc : sequence of ndarray or None
        Temperature at the recordings' own samples.
    starts_s : sequence of float, optional
        When each recording started, on one clock: they then are one history. Without it, time is
        counted within each recording, and each velocity has a level of its own in each.
    """
    rows = []
    for i, (signals, temperature) in enumerate(zip(recordings, temperature_degc, strict=True)):
        if temperature is not None:
            start = None if starts_s is None else starts_s[i]
            rows += _passes(signals, temperature, i, start)
    table = np.array(rows).reshape(-1, 5)
    groups = _levels(table[:, 1], table[:, 0])
    sizes = np.bincount(groups) if groups.size else np.zeros(0, dtype=np.int64)
    table = table[sizes[groups] >= 3] if groups.size else table
    if table.shape[0] < _LEAST_PASSES:
        return TemperatureOrTime(
            UNKNOWN,
            "not identified: too few passes repeat one velocity; repeat the same speeds while the "
            "gearbox warms and cools.",
            passes=table.shape[0],
        )
    span = float(np.ptp(table[:, 2]))
    if span < _LEAST_SPAN_DEGC:
        return TemperatureOrTime(
            UNKNOWN,
            f"not identified: the temperature stays within {span:.1f} degC; warm the gearbox up.",
            passes=table.shape[0],
        )
    return _judge(table)


def _passes(
    signals: Signals, temperature: Floats, recording: int, start_s: float | None
) -> list[tuple[float, ...]]:
    """Return (recording, velocity, temperature, time, friction) of every steady pass.

    With a common clock all recordings are one.
    """
    out: list[tuple[float, ...]] = []
    for window in find_windows(read_motion(signals)):
        index = np.arange(window.start, window.stop)
        index = index[signals.valid[index] & np.isfinite(temperature[index])]
        if index.size:
            friction = math.copysign(1.0, window.velocity_rad_s) * signals.torque_nm[index].mean()
            out.append(
                (
                    float(recording) if start_s is None else 0.0,
                    window.velocity_rad_s,
                    float(temperature[index].mean()),
                    float(signals.time_s[index].mean()) + (start_s or 0.0),
                    float(friction),
                )
            )
    return out


def _levels(velocity: Floats, recording: Floats) -> np.ndarray[tuple[int], np.dtype[np.int64]]:
    """Return the number of every pass's velocity and recording, shape (n,)."""
    order = np.lexsort((velocity, recording))
    out = np.zeros(velocity.size, dtype=np.int64)
    number = -1
    last = (math.nan, math.nan)
    for i in order:
        same = recording[i] == last[0] and abs(velocity[i] - last[1]) <= _SAME_SPEED * abs(last[1])
        if not same:
            number += 1
            last = (float(recording[i]), float(velocity[i]))
        out[i] = number
    return out


def _judge(table: Floats) -> TemperatureOrTime:
    groups = _levels(table[:, 1], table[:, 0])
    # A slope of its own for each velocity: the two directions need not change alike.
    friction = _centred(table[:, 4], groups)
    total = float(friction @ friction)
    n = friction.size
    by_t, by_time = (_best_bent(table[:, i], groups, friction) for i in (2, 3))
    rest = {
        TEMPERATURE: _rest(by_t, friction),
        TIME: _rest(by_time, friction),
        "both": _rest(np.hstack((by_t, by_time)), friction),
    }
    shares = {name: 1.0 - float(e @ e) / max(total, 1e-300) for name, e in rest.items()}
    numbers = (shares[TEMPERATURE], shares[TIME], shares["both"], n)
    said = f"temperature explains {shares[TEMPERATURE]:.0%} of the change between {n} passes"
    both = f"{said}, time {shares[TIME]:.0%}"
    if max(shares[TEMPERATURE], shares[TIME]) < _MATERIAL:
        return TemperatureOrTime(NEITHER, f"friction follows neither: {both}.", *numbers)
    # Vuong's comparison of laws that do not contain each other (Econometrica 57 (1989) 307), with
    # an error that counts how far neighbouring passes share what disturbs them.
    order = np.argsort(table[:, 3], kind="stable")
    gain = (_unlikely(rest[TIME]) - _unlikely(rest[TEMPERATURE]))[order]
    better = TEMPERATURE if gain.sum() > 0.0 else TIME
    tau = correlation_time([rest[better][order]])
    variance, dof = variance_of_mean(gain, tau)
    gap = float(gain.mean())
    if abs(gap) < _DECISIVE * student_975(dof) * math.sqrt(variance):
        return TemperatureOrTime(
            TIE,
            f"a tie: {both}; oil that thins and running-in look alike here. Run the same speeds at "
            "equal temperatures while heating and while cooling, or after a warm restart.",
            *numbers,
        )
    verdict = TEMPERATURE if gap > 0.0 else TIME
    return TemperatureOrTime(verdict, f"friction follows the {verdict}: {both}.", *numbers)


def _unlikely(rest: Floats) -> Floats:
    """Return minus the log likelihood of each residual under its own law's scatter, shape (n,)."""
    power = max(float(rest @ rest) / rest.size, 1e-300)
    return np.asarray(0.5 * (np.log(power) + rest**2 / power))


def _centred(values: Floats, groups: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Floats:
    mean = np.bincount(groups, weights=values) / np.maximum(np.bincount(groups), 1)
    return np.asarray(values - mean[groups], dtype=np.float64)


def _by_group(values: Floats, groups: np.ndarray[tuple[int], np.dtype[np.int64]]) -> Floats:
    out = np.zeros((values.size, int(groups.max()) + 1))
    out[np.arange(values.size), groups] = values
    return out


def _best_bent(
    values: Floats, groups: np.ndarray[tuple[int], np.dtype[np.int64]], target: Floats
) -> Floats:
    """Return the columns of the bend that leaves least of the target.

    Oil thins by a share of itself a kelvin, and running-in slows down: neither is a straight line,
    and where both have passed alike the straighter one of the two is no evidence for itself.
    """
    span = max(float(np.ptp(values)), 1e-300)
    from_start = (values - values.min()) / span
    best: tuple[float, Floats] | None = None
    for bend in _BENDS:
        bent = from_start if bend == 0.0 else -np.expm1(-bend * from_start) / bend
        columns = _by_group(_centred(bent, groups), groups)
        rest = _rest(columns, target)
        left = float(rest @ rest)
        if best is None or left < best[0]:
            best = left, columns
    assert best is not None
    return best[1]


def _rest(columns: Floats, target: Floats) -> Floats:
    """Return what the columns leave of the target."""
    rest = target - columns @ np.linalg.lstsq(columns, target, rcond=None)[0]
    return np.asarray(rest, dtype=np.float64)
