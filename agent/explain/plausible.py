"""Whether recordings can be a joint's at all, and whether the numbers found can be this joint's."""

from __future__ import annotations

import cmath
import math
from collections.abc import Mapping, Sequence

import numpy as np

from agent.explain.numbers.wrong import WrongNumber
from agent.explain.rows.refit import refit
from agent.explain.rows.run import SIMULATED, Run, are_simulated
from agent.explain.rows.table import BASE, Table
from agent.identify.diagnosis import no_joint_records, too_fast
from agent.identify.rigid.alike import mixed_units, shown_by
from agent.identify.signals.preprocess import read_motion
from agent.identify.signals.wrapped import counted_on
from agent.numbers import significant
from agent.physics.twin import Twin
from agent.samples import usable

_CARRIES = 0.5  # of the torque's energy: with less, signs of what a plain joint asks for are chance
_FAR = 5.0  # times the twin's number, or a part of it
_LIKE = 0.15  # of the gear ratio, or of a unit: so close a factor is that
_AS_STRONG = 0.05  # of gravity: so close is no payload
_TURNED_DEG = 10.0
_MILLI = 1e-3
_SAID = {
    "inertia_extra_kg_m2": ("inertia_kg_m2", "inertia"),
    "coulomb_extra_nm": ("coulomb_nm", "Coulomb friction"),
    "viscous_extra_nm_s_per_rad": ("viscous_nm_s_per_rad", "viscous friction"),
}


def contradiction(runs: Sequence[Run]) -> str:
    """Return what no joint can have recorded: a frozen torque, two units; nothing where all may be.

    Nor can a recorded simulation be the same throughout, or hold no number.

    Parameters
    ----------
    runs : sequence of Run
        To learn from, and held out.
    """
    return no_joint_records([run.signals for run in runs]) or _no_simulation(runs)


def loses_the_weight(twin: Twin, runs: Sequence[Run]) -> str:
    """Return that where the arm stands is lost, though it has a weight; nothing where it is known.

    Parameters
    ----------
    twin : Twin
    runs : sequence of Run
        To learn from, and held out.
    """
    if not (twin.gravity_sin_nm or twin.gravity_cos_nm):
        return ""
    for run in runs:
        if counted_on(run.signals).loses_the_arm:
            return (
                f"{run.signals.name}: the position begins anew with every turn, so that nobody "
                "knows where the arm stands, which has a weight: record a position that counts its "
                "turns"
            )
    return ""


def _no_simulation(runs: Sequence[Run]) -> str:
    """Return which recorded simulation is none; nothing where all may be, or none is recorded."""
    if not are_simulated(runs):
        return ""
    for run in runs:
        simulated_nm = run.columns[SIMULATED]
        told = simulated_nm[usable(simulated_nm)]
        if not told.size:
            return f"{run.signals.name}: {SIMULATED} holds no number"
        if float(np.ptp(told)) == 0.0:
            return (
                f"{run.signals.name}: {SIMULATED} is {significant(float(told[0]), 3)} N m all "
                "along, which is no simulation of a joint that moves: leave that column out, and "
                "twin.toml is questioned"
            )
    return ""


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

    Parameters
    ----------
    table : Table
    """
    names = [BASE[i] for i in np.flatnonzero(table.carried)]
    indices = sorted({piece.run for piece in table.pieces})
    shown = []
    for index in indices:
        rows = table.sliding & (table.rows["run"] == index)
        columns, torque = table.base[np.ix_(rows, table.carried)], table.measured_nm[rows]
        velocity = table.rows["velocity_rad_s"][rows]
        shown.append(shown_by(table.runs[index].name, columns, torque, velocity, names))
    motions = [read_motion(table.runs[index].signals) for index in indices]
    return mixed_units(motions, shown)


def far_off(wrong: Sequence[WrongNumber], twin: Twin) -> str:
    """Return that numbers are so far from the twin's that it may be another joint's; or nothing.

    A user's simulation is a tenth off, or a half. A factor of five is a unit, the wrong side of
    the gear, or another joint.
    """
    far = _far(wrong, twin)
    if not far:
        return _other_torque(wrong)
    told = " and ".join(f"{factor:.3g} times the {said}" for said, factor in far.items())
    likely = _in_another_unit(far, twin.gear_ratio)
    return (
        f"the recordings ask for {told} that the simulation has{likely}: before anything else make "
        "sure that the twin is of this joint and gear, and that positions, velocities and torques "
        "are the motor's, in rad, rad/s and N m"
    )


def below_zero_said(impossible: Sequence[WrongNumber], twin: Twin) -> str:
    """Return which numbers no joint can have as these recordings ask for them; or nothing."""
    names = [
        _SAID[extra][1]
        for number in impossible
        for extra, found in number.parameters.items()
        if extra in _SAID and float(getattr(twin, _SAID[extra][0])) + found.value < 0.0
    ]
    if not names:
        return ""
    return (
        f"refitted, the simulation's {' and '.join(names)} comes out below zero, which no joint "
        "has: what has no name bends its numbers, none of which is said to be wrong; twin.toml "
        "has zero there"
    )


def another_joint(wrong: Sequence[WrongNumber], twin: Twin) -> str:
    """Return the same as a sentence that stands before all else; nothing where none need.

    Numbers that are off by a unit, or that are another joint's, are none to be put right; nor is a
    torque that no motor's constant makes. Friction alone may be so far off in a simulation.
    """
    said, far = far_off(wrong, twin), _far(wrong, twin)
    friction_alone = len(far) == 1 and "inertia" not in far
    if not said or (friction_alone and not _in_another_unit(far, twin.gear_ratio)):
        return ""
    return f"{said[:1].upper()}{said[1:]}."


def _far(wrong: Sequence[WrongNumber], twin: Twin) -> dict[str, float]:
    """Return which numbers are far from the twin's, by what they are called, and by what factor."""
    factors = {}
    for number in wrong:
        for name, extra in number.parameters.items():
            own, said = _SAID.get(name, ("", ""))
            given = float(getattr(twin, own)) if own else 0.0
            if given > 0.0 and extra.identified:
                factors[said] = 1.0 + extra.value / given
    return {said: f for said, f in factors.items() if not 1.0 / _FAR < f < _FAR}


def in_degrees(table: Table, twin: Twin) -> str:
    """Return that a motion must be one of degrees; nothing where it may be of radians.

    Some motor would turn as none does, and the torque asks for another inertia than the twin's: a
    torque constant and bumps would make up for numbers that are a 57th.

    Parameters
    ----------
    table : Table
    twin : Twin
        As given.
    """
    said = (too_fast(read_motion(run.signals)) for run in table.runs)
    fast = next((text for text in said if text), "")
    if not fast:
        return ""
    shown = twin.inertia_kg_m2 + float(refit(table)[0][BASE.index("inertia_kg_m2")])
    return "" if 1.0 / _FAR < shown / max(twin.inertia_kg_m2, 1e-300) < _FAR else fast


def _other_torque(wrong: Sequence[WrongNumber]) -> str:
    """Return that a torque constant is so far off that it is another unit; or nothing."""
    known = (w.parameters["factor"] for w in wrong if "factor" in w.parameters)
    factor = next((p.value for p in known if p.identified), 1.0)
    if 1.0 / _FAR < factor < _FAR:
        return ""
    likely = ", as if the torque were in mN m" if abs(factor / _MILLI - 1.0) < _LIKE else ""
    return (
        f"no motor's torque constant is off by a factor of {significant(factor, 3)}{likely}: "
        "before anything else make sure that the torque is the motor's, in N m, and not in percent "
        "of the rated one, in ampere or on the arm's side of the gear"
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


def _in_another_unit(far: Mapping[str, float], gear_ratio: float) -> str:
    """Return what numbers that are off by a factor look like: a unit, the arm's side; or "".

    The inertia tells where it is known; where speeds change too seldom to show it, viscous friction
    does.
    """
    told = "inertia" if "inertia" in far else "viscous friction"
    factor = far.get(told, math.nan)
    # Of an angle that is counted so many times too large, and of time in thousandths of a second.
    looks = (
        (gear_ratio, "positions and velocities were the arm's, and not the motor's"),
        (math.pi / 180.0, "positions and velocities were in degrees"),
        (1e6 if told == "inertia" else 1e3, "time were in milliseconds"),
    )
    return next((f" (as if {s})" for f, s in looks if math.isclose(factor, f, rel_tol=_LIKE)), "")
