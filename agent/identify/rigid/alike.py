"""Whether recordings are of one joint in one unit: what each shows by itself, beside the others."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from agent.identify.result import Floats
from agent.identify.rigid.carried import left_out
from agent.identify.rigid.regression import rows_of
from agent.identify.signals.arrays import Signals
from agent.identify.signals.preprocess import Motion, read_motion, shared_cutoff
from agent.numbers import scale_for, significant
from agent.physics.rigid_body import PARAMETERS

_UNIT = 8.0  # times what the others show: pounds and inches are 8.9, kilopond and degrees more
_FEWEST = 60  # rows of a recording
_CLEARLY = 0.1  # of a recording's energy may stay beside a plain joint's own numbers
_FELT = 0.02  # of it, or what stays: less of friction or inertia is not compared
_BETTER = 4.0  # times less than in the unit that it should be in
_NOTHING = 1e-300


@dataclass(frozen=True)
class Shown:
    """What one recording shows of a joint by itself.

    Parameters
    ----------
    name : str
        The recording's.
    speed_rad_s : float
        Its middle speed.
    felt : mapping of str to float
        `friction` at that speed, N m, and `inertia`, kg m2; without what hardly shows.
    """

    name: str
    speed_rad_s: float
    felt: Mapping[str, float]


def shown_by(
    name: str, columns: Floats, torque_nm: Floats, velocity_rad_s: Floats, names: Sequence[str]
) -> Shown | None:
    """Return what a recording shows by itself; nothing where a plain joint carries too little.

    Parameters
    ----------
    name : str
        The recording's.
    columns : ndarray, shape (n, k)
        Filtered columns of the plain joint, of sliding rows.
    torque_nm, velocity_rad_s : ndarray, shape (n,)
        Filtered alike.
    names : sequence of str
        What the columns are, in the words of `PARAMETERS`.
    """
    if torque_nm.shape[0] < _FEWEST:
        return None
    size = np.sqrt(np.mean(columns**2, axis=0))
    size = np.where(size > 0.0, size, 1.0)
    found = np.linalg.lstsq(columns / size, torque_nm, rcond=1e-9)[0]
    energy = float(torque_nm @ torque_nm)
    left = torque_nm - columns / size @ found
    if float(left @ left) > _CLEARLY * energy:
        return None
    number = dict(zip(names, found / size, strict=True))
    speed = float(np.median(np.abs(velocity_rad_s)))
    if speed == 0.0:
        return None
    friction = number.get("coulomb_nm", 0.0) + speed * number.get("viscous_nm_s_per_rad", 0.0)
    inertia = number.get("inertia_kg_m2", 0.0)
    accelerates = size[names.index("inertia_kg_m2")] if "inertia_kg_m2" in names else 0.0
    made = {"friction": (friction, friction**2), "inertia": (inertia, (accelerates * inertia) ** 2)}
    least = max(_FELT * energy, float(left @ left)) / torque_nm.shape[0]
    return Shown(name, speed, {kind: v for kind, (v, power) in made.items() if power > least})


def mixed_units(motions: Sequence[Motion], recordings: Sequence[Shown | None] = ()) -> str:
    """Return which recording has another unit, sign or side of the gear than the rest; or nothing.

    Friction and inertia of each recording by itself are held against the median of all. What a
    joint does from day to day is a tenth, or a half, a cold start a factor of four; a unit is a
    factor of eight and more. Friction may grow with speed, at most in proportion to it. One that
    is as the others once its motion is read in a known unit is told as that, also where it shows
    nothing by itself: in degrees, gravity turns with nothing, and an inertia is hardly felt.

    Parameters
    ----------
    motions : sequence of Motion
        All recordings of the axis.
    recordings : sequence of Shown
        What each shows, in the same order, None for one that shows nothing by itself; taken from
        each in its own band without it: one in other units would have chosen that of all.
    """
    if len(motions) < 2:
        return ""
    shown = list(recordings) or [_shown(motion) for motion in motions]
    odd = _odd(shown)
    felt = [i for i, s in enumerate(shown) if s and "inertia" in s.felt]
    for i in sorted({*odd, *range(len(motions))} - (set(felt) - set(odd))):
        usual = [j for j in felt if j != i and j not in odd] or [j for j in felt if j != i]
        if 2 * len(usual) >= len(motions) - 1 and (usual or odd):
            words = _known_unit(motions[i].signals, [motions[j] for j in usual])
            if words:
                name = motions[i].signals.name
                return f"{name} is as the others if its motion is {words}: convert it first"
    return next(iter(odd.values()), "")


def _odd(recordings: Sequence[Shown | None]) -> dict[int, str]:
    """Return those that show another friction or inertia than the rest, the farthest off first."""
    for kind, unit in (("friction", "N m"), ("inertia", "kg m2")):
        shown = {i: s for i, s in enumerate(recordings) if s and kind in s.felt}
        value = {i: s.felt[kind] for i, s in shown.items()}
        said: dict[int, tuple[float, str]] = {}
        for i, own in shown.items():
            usual = _usual(value, i)
            grows = own.speed_rad_s / shown[usual].speed_rad_s if kind == "friction" else 1.0
            ratio = value[i] / value[usual]
            if min(grows, 1.0) / _UNIT < ratio < _UNIT * max(grows, 1.0):
                continue
            scale = scale_for(unit, (value[i], value[usual]))
            here, there = (significant(value[k] * scale.factor, 2) for k in (i, usual))
            said[i] = (
                abs(math.log(max(abs(ratio), 1e-9))),
                f"{own.name} shows {kind} of {here} {scale.unit} where the others show "
                f"{there}: one of them is in other units, of another sign, of the arm's side of "
                "the gear or of another joint",
            )
        if said:
            return {i: said[i][1] for i in sorted(said, key=lambda i: -said[i][0])}
    return {}


def _known_unit(signals: Signals, usual: Sequence[Motion]) -> str:
    """Return in which unit a recording's motion agrees with the usual ones' numbers; or nothing."""
    if not usual:
        return ""
    cutoff = shared_cutoff(usual)
    rows = rows_of(usual, cutoff.frequency_hz, cutoff.noise_share)
    kept = [i for i, name in enumerate(PARAMETERS) if name not in left_out(rows)]
    number = np.linalg.lstsq(rows.some(kept), rows.torque_nm, rcond=1e-9)[0]
    best, words = _CLEARLY, ""
    for scaled, said in ((signals, ""), *_in_units(signals)):
        seen = rows_of([read_motion(scaled)], cutoff.frequency_hz)
        left = seen.torque_nm - seen.some(kept) @ number
        share = float(left @ left) / max(float(seen.torque_nm @ seen.torque_nm), _NOTHING)
        if seen.torque_nm.shape[0] >= _FEWEST and share < best:
            best, words = share / _BETTER, said
    return words


def _in_units(signals: Signals) -> list[tuple[Signals, str]]:
    """Return a recording as it is if its motion was written in another unit, and in which."""
    gear = signals.gear_ratio
    known = [
        (np.pi / 180.0, 1.0, "in degrees"),
        (np.pi / 30.0, 1.0, "in revolutions a minute"),
        (gear, 1.0, "the arm's, and not the motor's"),
        (gear, 1.0 / gear, "the arm's, and not the motor's"),
    ]
    position, velocity = signals.position_rad, signals.velocity_rad_s
    return [
        (
            replace(
                signals,
                position_rad=None if position is None else position * motion,
                velocity_rad_s=None if velocity is None else velocity * motion,
                torque_nm=signals.torque_nm * torque,
            ),
            words,
        )
        for motion, torque, words in known
    ]


def _shown(motion: Motion) -> Shown | None:
    cutoff = shared_cutoff([motion])
    rows = rows_of([motion], cutoff.frequency_hz, cutoff.noise_share)
    names = [name for name in PARAMETERS if name not in left_out(rows)]
    kept = [PARAMETERS.index(name) for name in names]
    velocity = rows.columns[:, PARAMETERS.index("viscous_nm_s_per_rad")]
    return shown_by(motion.signals.name, rows.some(kept), rows.torque_nm, velocity, names)


def _usual(shown: Mapping[int, float], own: int) -> int:
    """Return the recording that shows what is usual, the middle of all; of two, the other one."""
    if len(shown) == 2:
        return sum(shown) - own
    return sorted(shown, key=lambda i: shown[i])[len(shown) // 2]
