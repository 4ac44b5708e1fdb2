"""Whether recordings can be a joint's at all, and whether the numbers found can be this joint's."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence

import numpy as np

from agent.explain.numbers.wrong import WrongNumber
from agent.explain.rows.run import Run
from agent.explain.rows.table import BASE, Table
from agent.identify.diagnosis import no_joint_records
from agent.numbers import scale_for, significant
from agent.physics.twin import Twin

_CARRIES = 0.5  # of the torque's energy: with less, signs of what a plain joint asks for are chance
_FAR = 5.0  # times the twin's number, or a part of it
_LIKE = 0.15  # of the gear ratio: so close a factor is the gear's
_AS_STRONG = 0.05  # of gravity: so close is no payload
_TURNED_DEG = 10.0
_UNIT = 8.0  # times what the others show: pounds and inches are 8.9, kilopond and degrees more
_FEWEST = 60  # rows of a recording
_CLEARLY = 0.1  # of a recording's energy may stay beside a plain joint's own numbers
_FELT = 0.02  # of it, or what stays: less of friction or inertia is not compared
_SAID = {
    "inertia_extra_kg_m2": ("inertia_kg_m2", "inertia"),
    "coulomb_extra_nm": ("coulomb_nm", "Coulomb friction"),
    "viscous_extra_nm_s_per_rad": ("viscous_nm_s_per_rad", "viscous friction"),
}


def contradiction(runs: Sequence[Run]) -> str:
    """Return what no joint can have recorded: a frozen torque, two units; nothing where all may be.

    Parameters
    ----------
    runs : sequence of Run
        To learn from, and held out.
    """
    return no_joint_records([run.signals for run in runs])


def runs_backwards(table: Table) -> bool:
    """Return whether the torque has the wrong sign: inertia and friction come out negative.

    Neither is possible, and missing physics does not turn both. The recorded torque is asked, and
    not the twin.
    """
    rows, inertia = table.sliding, BASE.index("inertia_kg_m2")
    carried = np.flatnonzero(table.carried)
    base, torque = table.base[np.ix_(rows, carried)], table.measured_nm[rows]
    size = np.sqrt(np.mean(base**2, axis=0))
    found = np.linalg.lstsq(base / size, torque, rcond=1e-9)[0]
    left = torque - base / size @ found
    if float(left @ left) > (1.0 - _CARRIES) * float(torque @ torque):
        return False
    numbers = np.zeros(len(BASE))
    numbers[carried] = found / size
    speed = float(np.median(np.abs(table.rows["velocity_rad_s"][rows])))
    friction = (
        numbers[BASE.index("coulomb_nm")] + speed * numbers[BASE.index("viscous_nm_s_per_rad")]
    )
    return bool(friction < 0.0 and (numbers[inertia] < 0.0 or not table.carried[inertia]))


def of_two_units(table: Table) -> str:
    """Return which recording has another unit, sign or side of the gear than the rest; or nothing.

    Friction and inertia of each recording by itself are held against the median of all. What a
    joint does from day to day is a tenth, or a half, a cold start a factor of four; a unit is a
    factor of eight and more. Friction may grow with speed, at most in proportion to it.

    Parameters
    ----------
    table : Table
    """
    own = {
        index: found
        for index in sorted({piece.run for piece in table.pieces})
        if (found := _shown_by(table, index)) is not None
    }
    for kind, unit in (("friction", "N m"), ("inertia", "kg m2")):
        shown = {index: found[kind] for index, found in own.items() if kind in found}
        usual = {i: _usual(shown, i) for i in shown}
        faster = {
            i: own[i]["speed"] / own[u]["speed"] if kind == "friction" else 1.0
            for i, u in usual.items()
        }
        odd = {
            i: shown[u]
            for i, u in usual.items()
            if not min(faster[i], 1.0) / _UNIT < shown[i] / shown[u] < _UNIT * max(faster[i], 1.0)
        }
        if odd:
            at = max(odd, key=lambda i: abs(math.log(max(abs(shown[i] / odd[i]), 1e-9))))
            scale = scale_for(unit, (shown[at], odd[at]))
            here, there = (significant(v * scale.factor, 2) for v in (shown[at], odd[at]))
            return (
                f"{table.runs[at].name} shows {kind} of {here} {scale.unit} where the others show "
                f"{there}: one of them is in other units, of another sign, of the arm's side of "
                "the gear or of another joint"
            )
    return ""


def _usual(shown: Mapping[int, float], own: int) -> int:
    """Return the recording that shows what is usual, the middle of all; of two, the other one."""
    if len(shown) == 2:
        return sum(shown) - own
    return sorted(shown, key=lambda i: shown[i])[len(shown) // 2]


def _shown_by(table: Table, run: int) -> dict[str, float] | None:
    """Return the middle speed, friction there and inertia that a recording shows by itself.

    Nothing where the plain structure carries too little of it, and no inertia where hardly anything
    accelerates.
    """
    rows = table.sliding & (table.rows["run"] == run)
    base, torque = table.base[np.ix_(rows, table.carried)], table.measured_nm[rows]
    if torque.shape[0] < _FEWEST:
        return None
    size = np.sqrt(np.mean(base**2, axis=0))
    size = np.where(size > 0.0, size, 1.0)
    found = np.linalg.lstsq(base / size, torque, rcond=1e-9)[0]
    energy = float(torque @ torque)
    left = torque - base / size @ found
    if float(left @ left) > _CLEARLY * energy:
        return None
    numbers = dict(zip((BASE[i] for i in np.flatnonzero(table.carried)), found / size, strict=True))
    speed = float(np.median(np.abs(table.rows["velocity_rad_s"][rows])))
    parts = {
        "friction": numbers.get("coulomb_nm", 0.0)
        + speed * numbers.get("viscous_nm_s_per_rad", 0.0),
        "inertia": numbers.get("inertia_kg_m2", 0.0),
    }
    made = {
        "friction": parts["friction"] ** 2,
        "inertia": float(np.mean(base[:, 0] ** 2)) * parts["inertia"] ** 2
        if table.carried[0]
        else 0.0,
    }
    least = max(_FELT * energy, float(left @ left)) / torque.shape[0]
    felt = {kind: value for kind, value in parts.items() if made[kind] > least}
    return {"speed": speed, **felt}


def far_off(wrong: Sequence[WrongNumber], twin: Twin) -> str:
    """Return that numbers are so far from the twin's that it may be another joint's; or nothing.

    A user's simulation is a tenth off, or a half. A factor of five is a unit, the wrong side of
    the gear, or another joint.
    """
    factors = {}
    for number in wrong:
        for name, extra in number.parameters.items():
            own, said = _SAID.get(name, ("", ""))
            given = float(getattr(twin, own)) if own else 0.0
            if given > 0.0 and extra.identified:
                factors[said] = 1.0 + extra.value / given
    far = {said: f for said, f in factors.items() if not 1.0 / _FAR < f < _FAR}
    if not far:
        return ""
    told = " and ".join(f"{factor:.3g} times the {said}" for said, factor in far.items())
    likely = (
        " (as if positions and velocities were the arm's, and not the motor's)"
        if _is_the_gear(far.get("inertia", math.nan), twin.gear_ratio)
        else ""
    )
    return (
        f"the recordings ask for {told} that the simulation has{likely}: before anything else make "
        "sure that the twin is of this joint and gear, and that positions, velocities and torques "
        "are the motor's, in rad, rad/s and N m"
    )


def turned_gravity(wrong: Sequence[WrongNumber], twin: Twin) -> str:
    """Return that gravity is as strong as the twin says and only turned; or nothing.

    A payload makes it stronger or weaker. The same amount at another angle is a position that
    counts from elsewhere, half a turn of it a sign.

    Parameters
    ----------
    wrong : sequence of WrongNumber
    twin : Twin
    """
    extra = next((w.parameters for w in wrong if w.effect == "gravity-imbalance"), None)
    given = complex(twin.gravity_sin_nm, twin.gravity_cos_nm)
    parts = [] if extra is None else [extra.get("gravity_sin_nm"), extra.get("gravity_cos_nm")]
    if abs(given) == 0.0 or not parts or any(p is None or not p.identified for p in parts):
        return ""
    true = given + complex(*(p.value for p in parts if p is not None))
    turn = math.degrees(cmath.phase(true / given)) if true else 0.0
    if abs(abs(true / given) - 1.0) > _AS_STRONG or abs(turn) < _TURNED_DEG:
        return ""
    if abs(turn) > 180.0 - _TURNED_DEG:
        return (
            "gravity is as strong as the simulation says, with the opposite sign: see which way "
            "its torque, or the position, counts"
        )
    return (
        f"gravity is as strong as the simulation says, and turned by {abs(turn):.0f}° of the arm's "
        "angle: see from where the position counts, before a payload is looked for"
    )


def _is_the_gear(factor: float, gear_ratio: float) -> bool:
    """Return whether an inertia is off by the gear ratio: the motor's torque, the arm's motion."""
    return math.isclose(factor, gear_ratio, rel_tol=_LIKE)
