"""What the gear's warming may have done to a friction law that knows no temperature.

A stair that holds its fast speeds last has them on warmer oil than its slow ones; that bends the
curve as if friction itself bent. The sensor shows it but for its last step. Friction's work warms
the gear, and for the minute of a cycle nearly all of it stays there: what is hidden rises with the
work done. A law's intervals hold what both may have made of it. Strokes that are driven back
mirrored in time pass every speed at the same mean warmth, and nothing is added.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.friction.passes import Pass
from agent.identify.result import Floats, FrictionModelFit, Parameter
from agent.identify.signals.preprocess import Motion
from agent.identify.signals.windows import SteadyWindow
from agent.physics.friction import FrictionLaw
from agent.physics.sensitivity import sensitivity

_THINNING_PER_K = 0.05  # of the viscous part: mineral gear oils lose 2 to 5 % a kelvin
_WARMER_DEGC = 1.0  # less is not worth a note
_FEWEST_SPEEDS = 3
_TENTH_K = 0.1  # what drives and transmitters count in; a steady reading shows no step of its own


@dataclass(frozen=True)
class Warming:
    """How much warmer the oil may have been at one point of the curve than at another.

    Parameters
    ----------
    rise_k : ndarray, shape (n,)
        Above any common temperature: what the sensor showed, and what it may have hidden.
    """

    rise_k: Floats


def warming_of(
    motions: Sequence[Motion],
    found: Sequence[tuple[Pass, SteadyWindow]],
    groups: Sequence[Sequence[Pass]],
    temperature_degc: Floats,
) -> Warming | None:
    """Return the curve's warming, or None where a recording has no temperature.

    Parameters
    ----------
    motions : sequence of Motion
        The recordings.
    found : sequence of tuple
        All passes with their windows.
    groups : sequence of sequence of Pass
        The passes of each point of the curve, n of them.
    temperature_degc : ndarray, shape (n,)
        As recorded at each point.
    """
    sensed = [m.signals.gearbox_temperature_degc for m in motions]
    known = [t[np.isfinite(t)] for t in sensed if t is not None]
    if len(known) < len(motions) or not all(t.size for t in known):
        return None
    if not np.isfinite(temperature_degc).all():
        return None
    work = [_work_done(motion) for motion in motions]
    done = {id(p): float(np.mean(work[w.recording][w.start : w.stop])) for p, w in found}
    share = np.array([np.mean([done[id(p)] for p in group]) for group in groups])
    return Warming(temperature_degc + max(_resolution_k(t) for t in known) * share)


def beside_warming(
    fit: FrictionModelFit, law: FrictionLaw, speed_rad_s: Floats, root: Floats, warming: Warming
) -> FrictionModelFit:
    """Return a law's fit with intervals that hold what warming may have made of it.

    Parameters
    ----------
    fit, law : FrictionModelFit, FrictionLaw
    speed_rad_s, root : ndarray, shape (n,)
        The curve's speeds, and the square roots of their weights.
    warming : Warming
    """
    names = [name for name, p in fit.parameters.items() if p.ci95 is not None]
    values = {name: p.value for name, p in fit.parameters.items()}
    viscous = values.get("viscous_nm_s_per_rad", 0.0)
    if not names or not viscous > 0.0 or any(not values[n] > 0.0 for n in law.nonlinear):
        return fit
    part = viscous * speed_rad_s
    mean = np.average(warming.rise_k, weights=(root * part) ** 2)  # the warmth that viscous is of
    thinned = -_THINNING_PER_K * (warming.rise_k - mean) * part
    columns = sensitivity(law, values)(speed_rad_s)[:, [law.parameters.index(n) for n in names]]
    weighted = columns * root[:, np.newaxis]
    size = np.sqrt(np.sum(weighted**2, axis=0))
    size[size == 0.0] = 1.0
    moved = np.linalg.lstsq(weighted / size, thinned * root)[0] / size
    parameters = dict(fit.parameters)
    for name, by in zip(names, moved.tolist(), strict=True):
        parameters[name] = _reaching(parameters[name], -by)
    return replace(fit, parameters=parameters)


def temperature_of(group: Sequence[Pass]) -> float:
    """Return a speed's mean temperature, degC; NaN where none was recorded."""
    known = [p for p in group if np.isfinite(p.temperature_degc)]
    if not known:
        return float("nan")
    sizes = [p.torque_nm.size for p in known]
    return float(np.average([p.temperature_degc for p in known], weights=sizes))


def uneven_warmth(temperature_degc: Floats) -> list[str]:
    """Return a note where slow and fast speeds, shape (n,) with rising speed, differ in warmth.

    Warm oil is thinner, which bends the curve as if friction itself bent.
    """
    known = temperature_degc[np.isfinite(temperature_degc)]
    if known.size < _FEWEST_SPEEDS:
        return []
    third = max(known.size // 3, 1)
    slow, fast = float(np.mean(known[:third])), float(np.mean(known[-third:]))
    if abs(fast - slow) < _WARMER_DEGC:
        return []
    return [
        f"the slow speeds were passed at {slow:.1f} degC and the fast ones at {fast:.1f}: oil that "
        "thins meanwhile bends the curve, and the friction law's intervals are as wide. Warm the "
        "gearbox up before, or pass the speeds up and down again; stribeck thermal tells speed and "
        "temperature apart from recordings at several temperatures"
    ]


def _work_done(motion: Motion) -> Floats:
    """Return the share of the whole work that was done at each sample, shape (n,)."""
    power = np.nan_to_num(motion.signals.torque_nm * motion.own_velocity_rad_s())
    work = np.maximum.accumulate(np.cumsum(power))
    return np.asarray(work / work[-1] if work[-1] > 0.0 else np.zeros(work.size))


def _resolution_k(temperature_degc: Floats) -> float:
    """Return the sensor's step, as far as its readings show it; never less than a tenth."""
    steps = np.diff(np.unique(temperature_degc))
    return max(float(steps.min()), _TENTH_K) if steps.size else _TENTH_K


def _reaching(parameter: Parameter, by: float) -> Parameter:
    """Return a parameter whose interval holds it where it is and moved."""
    assert parameter.ci95 is not None
    low, high = parameter.ci95
    return replace(parameter, ci95=(low + min(by, 0.0), high + max(by, 0.0)))
