"""What the observer's findings may be on a healthy joint, and when it asks for a dedicated cycle.

The band of the friction states and what colour the innovations have are learned from recordings of
ordinary motion that are held to be healthy. Friction follows the gearbox's temperature: where the
healthy recordings span enough of it, the band follows a line over it and widens away from it as a
line's prediction does, and more, for the line may bend.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from agent.identify.result import Floats
from agent.identify.signals.preprocess import Motion
from agent.monitor.observer.model import ObserverModel, blocks_of
from agent.monitor.observer.observer import ObserverRun, observe
from agent.monitor.observer.whiteness import Whiteness, whiteness
from agent.monitor.ordinary.swinging import swinging_of
from agent.numbers import signed

FEWEST_HEALTHY = 5
_SPAN_DEGC = 2.0  # of healthy temperatures that carry a line
_FEWEST_FOR_LINE = 6
_BOW_PER_K = 1.0 / 25.0  # viscosity falls to 1/e over some 20 to 60 K: so much its slope changes
_FEWEST_INNOVATIONS = 60


@dataclass(frozen=True)
class Seen:
    """One recording as the observer saw it.

    Parameters
    ----------
    name : str
    temperature_degc : float
        Mean of the gearbox; NaN where it was not recorded.
    rises_nm : tuple of float
        Rise of friction above the healthy curve at each of the band's speeds.
    whiteness : Whiteness
    """

    name: str
    temperature_degc: float
    rises_nm: tuple[float, ...]
    whiteness: Whiteness


@dataclass(frozen=True)
class HealthyBand:
    """What a healthy joint shows on ordinary motion.

    Parameters
    ----------
    model : ObserverModel
    shares : tuple of float
        Of the top speed: the low and the high speed at which friction is watched.
    seen : tuple of Seen
        The healthy recordings.
    follows_temperature : bool
        Whether the band is a line over the gearbox's temperature.
    false_rate : float
        How often a healthy recording leaves one of the bands or fails the whiteness test, all
        tests together.
    set_aside : tuple of str
        Why recordings that were to be learned from are not among the seen ones.
    """

    model: ObserverModel
    shares: tuple[float, ...]
    seen: tuple[Seen, ...]
    follows_temperature: bool
    false_rate: float
    set_aside: tuple[str, ...] = ()

    @property
    def each_rate(self) -> float:
        """Return the false rate of one of the tests: an equal share."""
        return self.false_rate / (len(self.shares) + 1)

    def band_nm(self, which: int, temperature_degc: float) -> tuple[float, float]:
        """Return the ends within which a healthy recording's rise lies at a temperature.

        The two-sided prediction interval of Student's t, of a mean or of a line that may bend as
        an oil's viscosity does.
        """
        rises = np.array([s.rises_nm[which] for s in self.seen])
        bow = _BOW_PER_K if self.follows_temperature else 0.0
        columns, row = self._columns(), self._row(temperature_degc)
        return _prediction(columns, rises, row, self.each_rate, bow)

    @property
    def whiteness_threshold(self) -> float:
        """Return what the whiteness statistic may reach.

        That of white innovations; where the healthy ones are coloured themselves (a soft gear,
        ripple), what the spread of their statistics allows for, if that is more.
        """
        logs = np.log([max(s.whiteness.statistic, 1e-9) for s in self.seen])
        ones = np.ones((logs.size, 1))
        _, upper = _prediction(ones, logs, np.ones(1), 2.0 * self.each_rate)
        nominal = self.seen[0].whiteness.threshold
        passed = sum(s.whiteness.statistic <= nominal for s in self.seen)
        return nominal if passed == len(self.seen) else max(nominal, math.exp(upper))

    @property
    def healthy_are_white(self) -> bool:
        """Tell whether the healthy recordings' innovations all pass for white."""
        return all(s.whiteness.white for s in self.seen)

    def _columns(self) -> Floats:
        ones = np.ones(len(self.seen))
        if not self.follows_temperature:
            return ones[:, np.newaxis]
        return np.column_stack((ones, [s.temperature_degc - self._middle_degc for s in self.seen]))

    def _row(self, temperature_degc: float) -> Floats:
        if not self.follows_temperature:
            return np.ones(1)
        return np.array([1.0, temperature_degc - self._middle_degc])

    @property
    def _middle_degc(self) -> float:
        return float(np.mean([s.temperature_degc for s in self.seen]))


@dataclass(frozen=True)
class Watch:
    """What the observer says of one recording.

    `asks` is True where a dedicated cycle is wanted, None where nothing can be said; `reasons` say
    why. `bands_nm` belong to the speeds in `speeds_rad_s`.
    """

    seen: Seen | None
    speeds_rad_s: tuple[float, ...]
    bands_nm: tuple[tuple[float, float], ...]
    whiteness_threshold: float
    asks: bool | None
    reasons: tuple[str, ...]


def seen_of(run: ObserverRun, motion: Motion, shares: Sequence[float], false_rate: float) -> Seen:
    """Sum one recording's run up.

    Raises
    ------
    ValueError
        Too few blocks slide one way: nothing can be said of the innovations.
    """
    tested = whiteness(run.judged(), false_rate)
    if tested.innovations < _FEWEST_INNOVATIONS:
        raise ValueError(
            f"{motion.signals.name}: only {tested.innovations} blocks in which the joint slides "
            f"one way, of {_FEWEST_INNOVATIONS} needed: record a longer piece of work"
        )
    temperature = motion.signals.gearbox_temperature_degc
    known = np.zeros(0) if temperature is None else temperature[np.isfinite(temperature)]
    return Seen(
        motion.signals.name,
        float(known.mean()) if known.size else math.nan,
        tuple(run.rise_nm(share) for share in shares),
        tested,
    )


def learn_band(
    model: ObserverModel, motions: Sequence[Motion], false_rate: float = 0.01
) -> HealthyBand:
    """Learn from healthy recordings what ordinary motion shows.

    Raises
    ------
    ValueError
        Fewer than five recordings that the observer can follow, with the reason; an arm that swings
        so slowly that wear would hide in it.
    """
    if len(motions) < FEWEST_HEALTHY:
        raise ValueError(
            f"a band needs {FEWEST_HEALTHY} healthy recordings of ordinary work, "
            f"there are {len(motions)}"
        )
    swinging = swinging_of(motions)
    if swinging is not None and swinging.refusal:
        raise ValueError(swinging.refusal)
    shares = _watched(motions, model)
    each = false_rate / (len(shares) + 1)
    seen, aside = [], []
    for motion in motions:
        try:
            run = observe(blocks_of(motion, model), model)
            seen.append(seen_of(run, motion, shares, each))
        except ValueError as error:
            aside.append(f"{error}")
    if len(seen) < FEWEST_HEALTHY:
        raise ValueError(
            f"the observer can follow {len(seen)} of {len(motions)} healthy recordings, "
            f"{FEWEST_HEALTHY} are needed: {'; '.join(aside)}"
        )
    temperatures = np.array([s.temperature_degc for s in seen])
    follows = (
        len(seen) >= _FEWEST_FOR_LINE
        and bool(np.all(np.isfinite(temperatures)))
        and float(np.ptp(temperatures)) >= _SPAN_DEGC
    )
    return HealthyBand(model, shares, tuple(seen), follows, false_rate, tuple(aside))


def watch(motion: Motion, band: HealthyBand) -> Watch:
    """Say whether a recording of ordinary motion calls for a dedicated cycle."""
    speeds = tuple(share * band.model.top_rad_s for share in band.shares)
    try:
        run = observe(blocks_of(motion, band.model), band.model)
        seen = seen_of(run, motion, band.shares, band.each_rate)
    except ValueError as error:
        return Watch(None, speeds, (), band.whiteness_threshold, None, (f"{error}",))
    if band.follows_temperature and not math.isfinite(seen.temperature_degc):
        why = f"{seen.name}: the healthy band follows the temperature, which was not recorded"
        return Watch(seen, speeds, (), band.whiteness_threshold, None, (why,))
    bands = tuple(band.band_nm(i, seen.temperature_degc) for i in range(len(speeds)))
    reasons = [
        f"friction at {speed:.3g} rad/s is {signed(rise, '+.3g')} N m from the healthy curve, "
        f"where {signed(low, '+.3g')} to {signed(high, '+.3g')} N m is healthy"
        for speed, rise, (low, high) in zip(speeds, seen.rises_nm, bands, strict=True)
        if not low <= rise <= high
    ]
    if seen.whiteness.statistic > band.whiteness_threshold:
        reasons.append(
            f"the innovations are not white any more (Ljung-Box {seen.whiteness.statistic:.3g}, "
            f"up to {band.whiteness_threshold:.3g} is healthy): the motion holds something that "
            "the healthy joint did not show"
        )
    return Watch(
        seen, speeds, bands, band.whiteness_threshold, asks=bool(reasons), reasons=tuple(reasons)
    )


def _prediction(
    columns: Floats, values: Floats, row: Floats, false_rate: float, bow_per_k: float = 0.0
) -> tuple[float, float]:
    """Return the two-sided prediction interval of least squares at a row of its columns.

    With `bow_per_k`, the second column is a temperature, and the law may bend: its second
    derivative is that share of the slope a kelvin (one standard deviation). What a parabola of
    that size leaves beside the line at the row widens the interval.
    """
    from scipy.special import stdtrit

    inverse = np.linalg.pinv(columns.T @ columns)
    theta = inverse @ columns.T @ values
    dof = values.size - columns.shape[1]
    variance = float(np.sum((values - columns @ theta) ** 2)) / dof
    variance *= 1.0 + float(row @ inverse @ row)
    if bow_per_k:
        bent = 0.5 * columns[:, 1] ** 2
        left = 0.5 * float(row[1]) ** 2 - float(row @ inverse @ columns.T @ bent)
        variance += (bow_per_k * float(theta[1]) * left) ** 2
    reach = float(stdtrit(dof, 1.0 - false_rate / 2.0)) * math.sqrt(variance)
    middle = float(row @ theta)
    return middle - reach, middle + reach


def _watched(motions: Sequence[Motion], model: ObserverModel) -> tuple[float, float]:
    """Return a low and a high speed that the healthy motion excites, as shares of the top one."""
    speeds = np.abs(np.concatenate([v for m in motions for v in m.velocity_rad_s]))
    moving = speeds[speeds > 0.02 * model.top_rad_s]
    low, high = np.quantile(moving, (0.1, 0.9)) / model.top_rad_s
    return float(low), float(high)
