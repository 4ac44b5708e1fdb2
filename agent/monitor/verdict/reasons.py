"""What else than wear could explain a change of the friction curve: the shape of each, weighed.

Each hypothesis says how the curve would change, speed by speed, up to an amplitude with a stated
prior; with it, how the measured gravity and inertia would change, which friction leaves alone. The
change and its covariance then give each a marginal likelihood (a small Bayesian regression), and
all together their probabilities. What shapes cannot tell apart comes out as probable alike, and is
said so.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from agent.identify.result import Floats
from agent.monitor.verdict.beside import Beside
from agent.monitor.verdict.comparison import Comparison
from agent.physics.friction import boundary_share

WEAR, OIL, TEMPERATURE, PAYLOAD, MEASUREMENT, OTHER = (
    "wear",
    "oil",
    "temperature",
    "payload",
    "measurement",
    "other",
)
WORDS: Mapping[str, str] = {
    WEAR: "wear in the gearbox (friction rises most at low speed)",
    OIL: "another, thicker or aged lubricant (the viscous part changes, low speed hardly)",
    TEMPERATURE: "a gearbox temperature other than the one measured",
    PAYLOAD: "another payload or load than the one stated",
    MEASUREMENT: "the torque measurement: torque constant, or a winding warmer than usual",
    OTHER: "something else, such as a swap that nobody entered",
}
_ACTIONS: Mapping[str, str] = {
    WEAR: "run a second cycle at the same temperature tonight; if the rise stays, take a grease "
    "sample and look for metal",
    OIL: "ask whether oil or grease was changed or added, and enter it as an event; else check the "
    "lubricant's level and age, and sample it",
    TEMPERATURE: "check the gearbox temperature sensor, and run a second cycle at a temperature "
    "that the baseline has seen",
    PAYLOAD: "run a second cycle without payload, or with the baseline's",
    MEASUREMENT: "compare the current sensor's calibration and the winding temperature with those "
    "of the baseline, and run a second cycle with a cold motor",
    OTHER: "check whether gearbox, arm or drive were exchanged, enter it as an event, and run a "
    "second cycle",
}
SURE = 0.8
_FRICTION_SHARE = 0.3  # of the mean friction: how large a change is expected, one deviation
_MISFIT = 0.1  # of the largest change: shapes are not exact
_SENSOR_K, _UNKNOWN_K = 2.0, 10.0
_TORQUE_SHARE = 0.05
_LOAD_SHARE = 0.3
_STATED = 0.2  # how much a hypothesis weighs that contradicts what the recordings state
_OTHER_WEIGHT = 0.3
_WEAR_AT_ONCE = 0.4  # how much wear weighs where friction rose from one cycle to the next
_SWAP_BY_AND_BY = 1e-3  # and another gearbox, where it rose little by little: courses are not exact
UNKNOWN_COURSE = 0.5
_LOAD_TO_FRICTION, _LOAD_TO_BOUNDARY = 0.023, 0.126  # N m per N m (JDSMC 134 (2012) 051013)
_FALLS = (0.15, 0.35, 0.7)  # of the low-speed bound: where wear's rise has fallen to 1/e


@dataclass(frozen=True)
class Cause:
    """One explanation and how probable it is among those considered."""

    id: str
    probability: float

    @property
    def words(self) -> str:
        """Return it in words."""
        return WORDS[self.id]

    @property
    def short(self) -> str:
        """Return it in a few words, without what speaks for it."""
        return _parted(self.words)[0]

    @property
    def ground(self) -> str:
        """Return what speaks for it, in words; empty where its name says it."""
        return _parted(self.words)[1]

    @property
    def slight(self) -> bool:
        """Return whether it has less than a hundredth."""
        return self.probability < 0.01

    @property
    def share(self) -> str:
        """Return the probability in per cent, as far as six shapes can bear it."""
        if self.probability > 0.99:
            return "over 99 %"
        return "under 1 %" if self.slight else f"{100.0 * self.probability:.0f} %"

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {"cause": self.id, "probability": round(self.probability, 4), "words": self.words}


def _parted(words: str) -> tuple[str, str]:
    """Part a cause's words into its name and what speaks for it: in brackets or after a colon."""
    for mark, end in ((" (", ")"), (": ", "")):
        name, found, ground = words.partition(mark)
        if found:
            return name, ground.removesuffix(end)
    return words, ""


@dataclass(frozen=True)
class Reasons:
    """The causes, most probable first, and what to do next."""

    causes: tuple[Cause, ...]

    @property
    def likely(self) -> tuple[Cause, ...]:
        """Return the fewest causes that together are sure, in order."""
        out: list[Cause] = []
        for cause in self.causes:
            out.append(cause)
            if sum(c.probability for c in out) >= SURE:
                break
        return tuple(out)

    @property
    def sentence(self) -> str:
        """Return the likely causes in one sentence."""
        likely = self.likely
        if len(likely) == 1:
            ground = f": {likely[0].ground}" if likely[0].ground else ""
            return f"Among the causes weighed, {likely[0].share} for {likely[0].short}{ground}."
        listed = "; ".join(
            f"{c.short} ({', '.join(filter(None, (c.share, c.ground)))})" for c in likely
        )
        return f"The curve's change cannot tell these apart: {listed}."

    @property
    def others(self) -> str:
        """Return what was weighed beside the likely causes, in one sentence; empty for nothing."""
        rest = self.causes[len(self.likely) :]
        notable = "; ".join(f"{c.short} ({c.share})" for c in rest if not c.slight)
        slight = "; ".join(c.short for c in rest if c.slight)
        if not slight:
            return f"Less likely: {notable}." if notable else ""
        before = f": {notable}; " if notable else ", "
        return f"Less likely{before}under 1 % each: {slight}."

    @property
    def actions(self) -> tuple[str, ...]:
        """Return what to do next, for each likely cause."""
        return tuple(_ACTIONS[c.id] for c in self.likely)

    def to_json(self) -> dict[str, Any]:
        """Return plain JSON."""
        return {
            "sentence": self.sentence,
            "causes": [c.to_json() for c in self.causes],
            "next_actions": list(self.actions),
        }


@dataclass(frozen=True)
class _Shape:
    """A hypothesis: columns (m + 2, r) for curve, gravity and inertia, amplitudes' deviations (r,).

    With `rises`, only a change that raises the mean friction counts.
    """

    columns: Floats
    deviations: Floats
    rises: bool = False


def reasons_of(
    found: Comparison, low_rad_s: float, beside: Beside, at_once: float = UNKNOWN_COURSE
) -> Reasons:
    """Weigh what could explain the change of a friction curve, and how it came.

    Wear grows, and a part of another is there from one cycle to the next: where the rise is one
    that both could make, its course in time decides.

    Parameters
    ----------
    found : Comparison
    low_rad_s : float
        Where the low-speed part ends.
    beside : Beside
    at_once : float
        The probability that friction changed from one cycle to the next, not little by little.
    """
    data = np.concatenate((found.change_nm, [beside.load_change_nm, beside.inertia_change_kg_m2]))
    noise = _noise(found, beside)
    weights = {}
    for name, shapes in _hypotheses(found, low_rad_s, beside).items():
        logs = np.array([_evidence(data, noise, shape) for shape in shapes])
        weights[name] = float(np.logaddexp.reduce(logs)) - math.log(len(shapes))
    weights[OTHER] += math.log(_OTHER_WEIGHT)
    swap = _evidence_of_swap(found, data, noise) + math.log(max(at_once, _SWAP_BY_AND_BY))
    weights[OTHER] = float(np.logaddexp(weights[OTHER], math.log(_OTHER_WEIGHT) + swap))
    weights[WEAR] += math.log(1.0 - (1.0 - _WEAR_AT_ONCE) * at_once)
    if beside.payload_stated:
        weights[PAYLOAD] += math.log(_STATED)
    top = max(weights.values())
    shares = {name: math.exp(w - top) for name, w in weights.items()}
    total = sum(shares.values())
    causes = [Cause(name, share / total) for name, share in shares.items()]
    return Reasons(tuple(sorted(causes, key=lambda c: -c.probability)))


def _evidence_of_swap(found: Comparison, data: Floats, noise: Floats) -> float:
    """Return the evidence of another gearbox of the same kind: friction at all speeds alike.

    By one torque, or by one share; the arm's gravity and inertia stay as they were.
    """
    level = _FRICTION_SHARE * float(np.mean(found.healthy_nm))
    shapes = (
        _shape([np.ones_like(found.healthy_nm)], [level]),
        _shape([found.healthy_nm], [_FRICTION_SHARE]),
    )
    logs = np.array([_evidence(data, noise, shape) for shape in shapes])
    return float(np.logaddexp.reduce(logs)) - math.log(logs.size)


def _noise(found: Comparison, beside: Beside) -> Floats:
    """Return the covariance of curve, gravity and inertia changes, shape (m + 2, m + 2)."""
    count = found.speed_rad_s.size
    out = np.zeros((count + 2, count + 2))
    out[:count, :count] = found.covariance_nm2
    misfit = _MISFIT * float(np.max(np.abs(found.change_nm)))
    out[:count, :count] += misfit**2 * np.eye(count)
    beyond = 1e3 * float(np.max(np.abs(found.healthy_nm)))  # what is not known weighs nothing
    for i, deviation in enumerate((beside.load_deviation_nm, beside.inertia_deviation_kg_m2)):
        out[count + i, count + i] = min(deviation, beyond) ** 2
    return out


def _hypotheses(
    found: Comparison, low_rad_s: float, beside: Beside
) -> dict[str, tuple[_Shape, ...]]:
    """Return each hypothesis's shapes, of which one holds."""
    speed, healthy = found.speed_rad_s, found.healthy_nm
    mean = float(np.mean(healthy))
    level = _FRICTION_SHARE * mean
    ones, ramp = np.ones_like(speed), speed / speed[-1]
    learned = found.slope_nm_per_k
    thinner = learned if np.any(learned) else -0.02 * mean * ramp
    measured = math.isfinite(found.temperature_degc)
    kelvin = (_SENSOR_K if measured else _UNKNOWN_K) * (2.0 if found.extrapolated else 1.0)
    return {
        WEAR: tuple(
            shape
            for fall in (boundary_share(speed, share * low_rad_s, 1.0) for share in _FALLS)
            for shape in (
                _shape([fall], [level], rises=True),
                _shape([ones, fall], [level / 2, level], rises=True),
            )
        ),
        OIL: tuple(
            _shape([ramp - share * boundary_share(speed, low_rad_s, 1.0)], [level])
            for share in (0.0, 0.3)
        ),
        TEMPERATURE: (_shape([thinner], [kelvin]),),
        PAYLOAD: _payload(found, low_rad_s, beside),
        MEASUREMENT: (
            _shape(
                [healthy],
                [_TORQUE_SHARE],
                load=[_or_zero(beside.load_nm)],
                inertia=[_or_zero(beside.inertia_kg_m2)],
            ),
        ),
        OTHER: (_smooth(speed, level),),
    }


def _payload(found: Comparison, low_rad_s: float, beside: Beside) -> tuple[_Shape, ...]:
    """Return what load does to friction; where gravity is known, it must have changed as well."""
    mean = float(np.mean(found.healthy_nm))
    level = 0.5 * _FRICTION_SHARE * mean
    size = max(_LOAD_SHARE * _or_zero(beside.load_nm), _FRICTION_SHARE * mean)
    out = []
    for fall in _FALLS:
        bump = boundary_share(found.speed_rad_s, fall * low_rad_s, 1.0)
        shape = _LOAD_TO_FRICTION + _LOAD_TO_BOUNDARY * bump
        if math.isfinite(beside.load_deviation_nm):
            out += [_shape([gain * shape], [size], load=[1.0]) for gain in (0.5, 1.0, 2.0)]
        else:
            out.append(_shape([shape / shape.mean()], [level]))
    return tuple(out)


def _shape(
    columns: Sequence[Floats],
    deviations: Sequence[float],
    *,
    load: Sequence[float] = (),
    inertia: Sequence[float] = (),
    rises: bool = False,
) -> _Shape:
    """Put curve, gravity and inertia of each amplitude in one column."""
    curve = np.stack(columns, axis=-1)
    none = np.zeros(curve.shape[1])
    beside = [np.array(row) if len(row) else none for row in (load, inertia)]
    return _Shape(np.vstack((curve, *beside)), np.array(deviations), rises)


def _smooth(speed: Floats, level: float) -> _Shape:
    """Return any smooth change over the logarithm of speed."""
    apart = np.log(speed)[:, np.newaxis] - np.log(speed)
    values, vectors = np.linalg.eigh(np.exp(-0.5 * apart**2))
    kept = values > 1e-6 * values[-1]
    columns = vectors[:, kept] * np.sqrt(values[kept])
    return _shape(list(columns.T), [level] * int(kept.sum()))


def _evidence(data: Floats, noise: Floats, shape: _Shape) -> float:
    """Return the logarithm of the data's density under a hypothesis."""
    scaled = shape.columns * shape.deviations
    covariance = noise + scaled @ scaled.T
    size = np.sqrt(np.diag(covariance))
    correlation = covariance / np.outer(size, size)
    whitened = np.linalg.solve(correlation, data / size)
    log = -0.5 * float(
        (data / size) @ whitened + np.linalg.slogdet(correlation)[1] + 2.0 * np.sum(np.log(size))
    )
    if not shape.rises:
        return log
    # The mean rise over the curve, given the data: as much of it as is above zero counts, twice.
    rise = scaled[:-2].mean(axis=0)
    solved = np.linalg.solve(correlation, scaled / size[:, np.newaxis])
    gain = solved.T @ (data / size)
    left = np.eye(rise.size) - (scaled / size[:, np.newaxis]).T @ solved
    deviation = math.sqrt(max(float(rise @ left @ rise), 1e-300))
    above = 0.5 * math.erfc(-float(rise @ gain) / deviation / math.sqrt(2.0))
    return log + math.log(max(2.0 * above, 1e-300))


def _or_zero(value: float) -> float:
    return value if math.isfinite(value) else 0.0
