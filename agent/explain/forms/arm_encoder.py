"""What an encoder on the arm says of the gear: how far motor and arm move apart, and with what.

The difference of the two angles, on the motor side, is taken apart by least squares: a skew between
the two encoders' clocks grows with the velocity, a spring's twist with the arm's acceleration, a
clearance follows the sign of the torque, and a wobbling gear repeats with the angle. A skew `d`
alone would pass for a spring of ``-d^2/2`` per acceleration; that much is taken off.

Runs in which the arm had no encoder say nothing of it; the others speak for the joint.

What the difference does not show is refuted: no law is named that would move the arm by more. A
wave in it may be the gear's or the motor's resolver's. Both shake the arm, but a resolver's error
shakes the motor with it: the ripple in torque over the wave is the arm's inertia, or the whole.
Whatever spring is between them, a wobble's is no more than the arm's.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from agent.explain.forms.form import Form
from agent.explain.forms.orders import strong_orders
from agent.explain.forms.seen_arm import shown_gear
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.identify.rigid.linear import LinearFit, solve_blocks
from agent.physics.periodic import wave_rates

_WAVES = 2
_SOFTENS = 0.15  # of the cutoff's square over the swing's: less of a spring does not show
_CROSSED = 0.1  # of a cutoff's period, squared: a gap that is crossed faster leaves no trace
_HARDEST_SHARE = 0.99  # of the samples are gentler
_NARROW = 0.08  # of a spring's twist there: a gap that is not wider is none
_UNSEEN = 0.3  # of the residual's root mean square: less ripple is not what is looked for
_WHOLE = 0.9  # of the inertia: the motor, which a resolver's error shakes as well, has the rest

Bound = tuple[float, float]
_ANY: Bound = (-math.inf, math.inf)


class Wave(NamedTuple):
    """A wave in the difference, with 95 % intervals.

    Parameters
    ----------
    order : float
        Per revolution of the motor.
    most_rad : float
        Its highest amplitude.
    share : tuple of float
        Of the inertia, which is behind the wave.
    """

    order: float
    most_rad: float
    share: Bound


@dataclass(frozen=True)
class Twist:
    """The difference between motor and arm, on the motor side, with 95 % intervals.

    Parameters
    ----------
    skew_s : tuple of float
        By which the arm's encoder is late.
    swing_s2 : tuple of float
        Twist per acceleration, the skew's part taken off: one over the squared locked frequency.
    lost_rad : float
        The most that the angles differ by with the torque's or the motion's sign.
    waves : tuple of Wave
    """

    skew_s: Bound
    swing_s2: Bound
    lost_rad: float
    waves: tuple[Wave, ...]


def twist_of(scene: Scene) -> Twist | None:
    """Return what the arm's encoder shows; None where it is missing or the data do not bear it.

    Parameters
    ----------
    scene : Scene
    """
    table = scene.table
    if not scene.has("position_rad"):
        return None
    apart = scene.full("position_rad") - table.gear_ratio * scene.full("position_arm_rad")
    target = table.band(apart)
    rows = table.sliding & np.isfinite(target)
    if not rows.any():
        return None
    target = target[rows]
    orders = strong_orders(scene, "inertia")[:_WAVES]
    names, columns = _columns(scene, rows, orders)
    try:
        fit = solve_blocks(columns, columns, target, table.block[rows])
    except ValueError:
        return None
    at = {name: k for k, name in enumerate(names)}
    skew = _ends(fit, at["velocity"])
    behind = 0.5 * float(fit.theta[at["velocity"]]) ** 2
    swing = tuple(end + behind for end in _ends(fit, at["acceleration"]))
    lost = sum(max(abs(end) for end in _ends(fit, at[name])) for name in ("direction", "side"))
    waves = tuple(_wave(scene, fit, order, at[f"wave {order}"]) for order in orders)
    return Twist(skew, (swing[0], swing[1]), lost, waves)


def _columns(
    scene: Scene, rows: NDArray[np.bool_], orders: Sequence[float]
) -> tuple[list[str], Floats]:
    """Return what the difference may consist of at some rows, by name, shape (r, p)."""
    table = scene.table
    base, run = table.base[rows], table.run[rows]
    coulomb = max(float(scene.theta[2]), 1e-12)
    load = base[:, 0] * scene.theta[0] + base[:, 3:5] @ scene.theta[3:5]
    parts: list[tuple[str, Floats]] = [
        (f"run {k}", (run == k).astype(np.float64)) for k in np.unique(run)
    ]
    parts += [
        ("scale", table.rows["position_rad"][rows]),
        ("velocity", base[:, 1]),
        ("acceleration", base[:, 0]),
        ("direction", base[:, 2]),
        ("side", np.clip(load / (0.2 * coulomb), -1.0, 1.0)),
    ]
    weight = base[:, 3:5] @ scene.theta[3:5]
    if np.ptp(weight) > 0.0:
        parts.append(("weight", weight))
    for order in orders:
        angle = order * table.rows["position_rad"][rows]
        parts += [(f"wave {order}", np.cos(angle)), (f"wave's sine {order}", np.sin(angle))]
    return [name for name, _ in parts], np.stack([column for _, column in parts], axis=-1)


def _ends(fit: LinearFit, index: int) -> Bound:
    low, high = (float(x) for x in fit.ci95[index])
    return low, high


def _wave(scene: Scene, fit: LinearFit, order: float, at: int) -> Wave:
    """Return an order's highest amplitude, and what share of the inertia it shakes."""
    found = fit.theta[at : at + 2]
    half = 0.5 * float(np.max(np.diff(fit.ci95[at : at + 2], axis=1)))
    size = float(np.hypot(*found))
    table, inertia = scene.table, max(float(scene.theta[0]), 1e-12)
    angle = order * scene.full("position_rad")
    motion = scene.full("velocity_rad_s"), scene.full("acceleration_rad_s2")
    shaken = np.stack(wave_rates(order, np.cos(angle), np.sin(angle), *motion), axis=-1)
    rows = table.sliding
    columns = np.concatenate((inertia * table.band(shaken)[rows], table.base[rows]), axis=1)
    used = np.any(columns != 0.0, axis=0)
    columns = columns[:, used]
    try:
        torque = solve_blocks(columns, columns, scene.residual_nm[rows], table.block[rows])
    except ValueError:
        return Wave(order, size + half, _ANY)
    ripple = torque.theta[:2]
    error = 0.5 * float(np.max(np.diff(torque.ci95[:2], axis=1)))
    if size <= 2.0 * half:
        return Wave(order, size + half, _ANY)
    share = -float(ripple @ found) / size**2
    spread = math.hypot(error / size, share * half / size)
    return Wave(order, size + half, (share - spread, share + spread))


def refuted(scene: Scene, twist: Twist) -> dict[str, str]:
    """Return the effects that the arm's encoder rules out, and what it shows, in a sentence.

    Parameters
    ----------
    scene : Scene
    twist : Twist
    """
    table = scene.table
    cutoff = 2.0 * math.pi * table.cutoff_hz
    out: dict[str, str] = {}
    if twist.swing_s2[1] * cutoff**2 < _SOFTENS:
        out["joint-flexibility"] = "the arm's encoder shows no twist that grows with acceleration"
    inertia = max(float(scene.theta[0]), 1e-12)
    slowing = max(float(scene.theta[2]), 0.0) / inertia
    if twist.lost_rad < _CROSSED * slowing / cutoff**2:
        out["backlash"] = "the arm's encoder shows no lost motion where the torque changes sides"
    hardest = float(np.quantile(np.abs(scene.stiff_rad_s2), _HARDEST_SHARE))
    shown = shown_gear(scene)
    is_spring = shown is not None and shown.effect == "joint-flexibility"
    if is_spring and twist.lost_rad < _NARROW * twist.swing_s2[0] * hardest:
        out["backlash"] = "the arm's encoder shows a spring's twist, and next to no lost motion"
    waves = twist.waves
    unseen = _UNSEEN * float(np.sqrt(np.mean(scene.residual_nm[table.sliding] ** 2)))
    ripples = [inertia * (w.order * scene.fastest) ** 2 * w.most_rad for w in waves]
    if waves and max(ripples) < unseen:
        for effect in ("kinematic-error", "resolver-error"):
            out[effect] = "the arm's encoder follows the motor's without a wave"
    elif waves and waves[0].share[1] < _WHOLE:
        out["resolver-error"] = (
            "the arm's encoder shows a wave that shakes the arm alone, not the motor with it"
        )
    elif waves and waves[0].share[0] > _WHOLE:
        out["kinematic-error"] = (
            "the arm's encoder shows a wave that shakes the motor with the arm, not the arm alone"
        )
    return out


def seen_by_the_arm(
    scene: Scene, forms: Sequence[Form], not_judged: dict[str, str]
) -> tuple[tuple[Form, ...], dict[str, str]]:
    """Leave out the forms that the arm's encoder refutes, and say why."""
    twist = twist_of(scene)
    if twist is None:
        return tuple(forms), not_judged
    why = refuted(scene, twist)
    kept = tuple(form for form in forms if form.effect not in why)
    return kept, {**not_judged, **{e: f"{w}, so it is not {e}" for e, w in why.items()}}
