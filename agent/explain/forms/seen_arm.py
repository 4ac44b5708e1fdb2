"""An arm that its own encoder shows: nothing is simulated, its motion is measured.

An arm that bounces between its teeth is thrown to one side or the other by next to nothing, and
no simulation follows it for long; nor one of a spring whose law nobody knows. Where the arm has an
encoder, its acceleration is known, and with it what the gear carries. How far the two encoders
come apart says what it is:

- a spring's twist grows with the shaft's torque, less and less where it stiffens;
- a gap adds half of itself to the side on which the teeth bear, and jumps where that torque changes
  sides.

The shaft's torque follows from the measured arm, but for the arm's part of friction, which is
looked for.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from agent.explain.forms.form import Form, Point, ToTwin, stack
from agent.explain.forms.hidden_arm import inertia_of
from agent.explain.forms.orders import highest_order, strong_orders
from agent.explain.rows.orders import orders_of
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.identify.rigid.linear import solve_blocks
from agent.physics.derivative import bend_over
from agent.physics.effects import CARRIED
from agent.physics.seen_arm import SeenArm

SEEN = "the arm seen"
"""The forms' name."""

_SPRING, BACKLASH = CARRIED
_SHOWN = {BACKLASH: "half_gap_rad", _SPRING: "stiffness_nm_per_rad"}

_FRICTIONS = tuple(float(x) for x in np.linspace(0.0, 1.0, 11))  # of the joint's, behind the gear
_SOFT = (0.02, 0.05, 0.1, 0.2)  # of Coulomb friction: within that the teeth do not bear yet
_SOFTER = (0.4, 0.8, 1.6, 3.2)  # of it: a spring that is softer within that
_STIFFENS = (0.05, 0.1, 0.2, 0.4, 0.8, 1.6, 3.2)  # of it: where a spring that stiffens begins to
_LESS = 0.9  # of what a spring leaves of the difference: a gap that leaves more is none
_AS_LITTLE = 1.05  # times what any other spring leaves: the band blurs where teeth begin to bear
_TWISTS = 0.5  # of the difference: a spring that leaves more of it is none
_LEAST_SHARE = 0.05  # of the inertia
_HEAVIEST = 1.3  # times the joint's inertia, as it was found without the gap
_WAVES = 2
_WOBBLES = 0.1  # of the arm's own acceleration: a gear that wobbles has a name of its own
_PEAKS, _LEAST_ORDER = 3, 0.5  # an arm's encoder that is off its center has one over the ratio
_MOSTLY_WAVE = 0.5  # of what a spring leaves
_LATEST_S, _LATER_S = 0.02, 2e-4


@dataclass(frozen=True)
class Shown:
    """What the arm's encoder shows of the gear, on the motor side.

    Parameters
    ----------
    effect : str
        Which it is: backlash, or a joint's flexibility.
    size : float
        Half the gap, rad, or the spring's stiffness, N m/rad. The gap is somewhat too little where
        the band blurs its jumps: by 2 to 14 % in seven simulated joints.
    late_s : float
        By how much the arm's encoder seems to be later than the motor's.
    """

    effect: str
    size: float
    late_s: float


_KNOWN: WeakKeyDictionary[Scene, Shown | None] = WeakKeyDictionary()
_WAVES_OF: WeakKeyDictionary[Scene, tuple[float, ...]] = WeakKeyDictionary()


def shown_gear(scene: Scene) -> Shown | None:
    """Return what the arm's encoder shows; None for a stiff gear, or where there is no encoder.

    Parameters
    ----------
    scene : Scene
        Asked once: several forms ask.
    """
    if scene not in _KNOWN:
        _KNOWN[scene] = _shown(scene)
    return _KNOWN[scene]


def _shown(scene: Scene) -> Shown | None:
    table = scene.table
    if not (scene.has("position_rad") and scene.has("position_arm_rad")):
        return None
    apart = table.band(-_ahead_rad(scene))
    rows = table.used & np.isfinite(apart)
    if not rows.any():
        return None
    own, target = _but_for_twist(scene, rows), apart[rows]
    coulomb = max(float(scene.theta[2]), 1e-12)
    unit = np.linalg.qr(own / np.sqrt(np.mean(own**2, axis=0)).clip(1e-300))[0]

    def left(*columns: Floats) -> float:
        both = np.stack((target, *columns), axis=-1)
        both -= unit @ (unit.T @ both)
        twist = np.linalg.qr(both[:, 1:])[0]
        return float(np.sum(both[:, 0] ** 2) - np.sum((twist.T @ both[:, 0]) ** 2))

    springs, stiffening, gaps = [], [], []
    for friction in _FRICTIONS:
        shaft = _shaft_nm(scene, friction)[rows]
        springs.append((left(shaft), friction))
        stiffening += [left(twist) for twist in _stiffening(shaft / coulomb)]
        stiffening += [left(shaft, _bearing(shaft, soft * coulomb)) for soft in _SOFTER]
        gaps += [(left(shaft, _bearing(shaft, soft * coulomb)), friction, soft) for soft in _SOFT]
    spring, rubs = min(springs)
    gap, friction, soft = min(gaps)
    loose = gap < min(_LESS**2 * spring, _AS_LITTLE * min(stiffening))
    if not loose and not min(spring, *stiffening) < _TWISTS * left():
        return None
    shaft = _shaft_nm(scene, friction if loose else rubs)[rows]
    last = (shaft, _bearing(shaft, soft * coulomb)) if loose else (shaft,)
    columns = np.column_stack((own, *last))
    try:
        fit = solve_blocks(columns, columns, target, table.block[rows])
    except ValueError:
        return None
    if not fit.ci95[-1][0] > 0.0:
        return None
    found = float(fit.theta[-1])
    late_s = float(fit.theta[0])
    return Shown(BACKLASH, found, late_s) if loose else Shown(_SPRING, 1.0 / found, late_s)


def _bearing(shaft_nm: Floats, within_nm: float) -> Floats:
    """Return on which side the teeth bear, -1 to 1, that do so within a torque, shape (r,)."""
    return np.clip(shaft_nm / within_nm, -1.0, 1.0)


def _stiffening(shaft: Floats) -> Iterator[Floats]:
    """Yield the twists, shape (r,), of springs that stiffen with their twist's square.

    Where ``y + y^3 = torque``, by how large a torque is in which they do.
    """
    for torque in _STIFFENS:
        half = 0.5 * np.abs(shaft) / torque
        root = np.sqrt(half**2 + 1.0 / 27.0)
        yield np.sign(shaft) * (np.cbrt(half + root) + np.cbrt(half - root))


def _ahead_rad(scene: Scene) -> Floats:
    """Return by how far the arm is ahead of a stiff gear's, seen from the motor, shape (N,)."""
    return scene.table.gear_ratio * scene.full("position_arm_rad") - scene.full("position_rad")


def _but_for_twist(scene: Scene, rows: NDArray[np.bool_]) -> Floats:
    """Return what else the difference of the encoders may consist of, shape (r, p).

    The first column, the velocity, is a skew between the encoders' clocks; then where they begin,
    a gear ratio that is a little off, and a gear that wobbles.
    """
    table = scene.table
    run, angle = table.run[rows], table.rows["position_rad"][rows]
    columns = [table.base[rows, 1], *((run == k).astype(np.float64) for k in np.unique(run)), angle]
    for order in strong_orders(scene, "inertia")[:_WAVES]:
        columns += [np.cos(order * angle), np.sin(order * angle)]
    return np.stack(columns, axis=-1)


def _arm_rad_s2(scene: Scene) -> Floats:
    """Return the arm's acceleration as its encoder has it, seen from the motor, at the rows."""
    return np.asarray(scene.table.base[:, 0] + scene.table.band(_extra_rad_s2(scene, 0.0)))


def _shaft_nm(scene: Scene, friction: float) -> Floats:
    """Return the torque in the gear at the rows, shape (n,), by the arm's share of dry friction."""
    arm = arm_inertia(scene) * _arm_rad_s2(scene) + scene.weight_rows()
    return np.asarray(arm + friction * float(scene.theta[2]) * scene.table.base[:, 2])


def _carried_by(scene: Scene, torque_nm: Floats) -> float:
    """Return the arm's inertia by which its own motion carries a torque at the rows, (n,), best.

    Beside what a gear that wobbles makes of the shaft's torque.
    """
    table, rows = scene.table, scene.table.used
    base = table.base[np.ix_(rows, table.carried)]
    bent = [table.band(column)[rows] for column in _bent_by_waves(scene)]
    base = np.column_stack((base, *bent))
    unit = np.linalg.qr(base / np.sqrt(np.mean(base**2, axis=0)))[0]
    column = table.band(_extra_rad_s2(scene, 0.0))[rows]
    beside = column - unit @ (unit.T @ column)
    energy = float(beside @ beside)
    return float(beside @ torque_nm[rows]) / energy if energy > 0.0 else 0.0


def _extra_rad_s2(scene: Scene, late_s: float) -> Floats:
    """Return the arm's acceleration less a stiff gear's, seen from the motor, shape (N,).

    None where nobody has seen it: on a motion that is only proposed the arm follows the motor.
    """
    law = SeenArm(1.0, late_s)
    arm = scene.table.gear_ratio * scene.full("position_arm_rad")
    motor = scene.full("position_rad")
    if not np.isfinite(arm).any():
        return np.zeros_like(motor)
    return _by_piece(scene, lambda time, at: law.extra_nm(time, arm[at], motor[at]))


def _grid_of(effect: str) -> Callable[[Scene], Sequence[Point]]:
    def grid(scene: Scene) -> Sequence[Point]:
        """Return encoders that keep time, and that are as late as they seem; or nothing."""
        shown = shown_gear(scene)
        if shown is None or shown.effect != effect or _wobbles(scene):
            return ()
        return ((0.0,), (float(np.clip(shown.late_s, *_latest(scene)[0])),))

    return grid


def _wobbles(scene: Scene) -> bool:
    """Return whether a wave along the motor's turn is in what the arm does by itself."""
    table, orders = scene.table, strong_orders(scene, "inertia")[:_WAVES]
    rows = table.used
    extra = table.band(_extra_rad_s2(scene, 0.0))[rows]
    waves = [_bends(scene, scene.wave(order)[:, k]) for order in orders for k in (0, 1)]
    if not waves:
        return False
    unit = np.linalg.qr(np.stack([table.band(wave)[rows] for wave in waves], axis=-1))[0]
    return float(np.sum((unit.T @ extra) ** 2)) > _WOBBLES * float(extra @ extra)


def _bent_by_waves(scene: Scene) -> Iterator[Floats]:
    """Yield what the slopes of waves between the encoders make of weight and arm, each (N,)."""
    for order in waves_apart(scene):
        for slope in scene.wave(order).T:
            yield slope * scene.weight_nm
            yield slope * _arm_full_rad_s2(scene)


def waves_apart(scene: Scene) -> tuple[float, ...]:
    """Return the orders per motor turn that are most of what a spring leaves of the difference.

    Near the arm's resonance it swings as the wave shakes it, in another phase at every speed: there
    the acceleration has no wave, and the angle between the encoders still has it.

    Parameters
    ----------
    scene : Scene
    """
    if scene not in _WAVES_OF:
        _WAVES_OF[scene] = _waves_of(scene)
    return _WAVES_OF[scene]


def _waves_of(scene: Scene) -> tuple[float, ...]:
    table = scene.table
    if not (scene.has("position_rad") and scene.has("position_arm_rad")):
        return ()
    apart = table.band(-_ahead_rad(scene))
    rows = table.used & np.isfinite(apart)
    if not rows.any():
        return ()
    run, angle = table.run[rows], table.rows["position_rad"][rows]
    each = ((run == k).astype(np.float64) for k in np.unique(run))
    weight, rubs = scene.weight_rows()[rows], table.base[rows, 2]
    plain = np.stack(
        (table.base[rows, 1], *each, angle, _arm_rad_s2(scene)[rows], weight, rubs), axis=-1
    )
    plain = plain[:, np.any(plain, axis=0)]
    unit = np.linalg.qr(plain / np.sqrt(np.mean(plain**2, axis=0)).clip(1e-300))[0]
    left = apart[rows] - unit @ (unit.T @ apart[rows])
    highest, ratio = highest_order(scene), table.gear_ratio
    found = orders_of(angle, left, np.ones_like(left), highest, ratio, _PEAKS, repeating=True)
    out = []
    for order in (order for order in found if order >= _LEAST_ORDER):
        wave = np.stack((np.cos(order * angle), np.sin(order * angle)), axis=-1)
        wave = np.linalg.qr(wave - unit @ (unit.T @ wave))[0]
        if float(np.sum((wave.T @ left) ** 2)) > _MOSTLY_WAVE * float(left @ left):
            out.append(float(order))
    return tuple(out)


def shaft_nm(scene: Scene) -> Floats:
    """Return the torque in the gear at full rate, shape (N,), but for the arm's dry friction."""
    return np.asarray(arm_inertia(scene) * _arm_full_rad_s2(scene) + scene.weight_nm)


def _arm_full_rad_s2(scene: Scene) -> Floats:
    """Return the arm's acceleration as its encoder has it, seen from the motor, shape (N,)."""
    return np.asarray(scene.table.full["acceleration_rad_s2"] + _extra_rad_s2(scene, 0.0))


def arm_inertia(scene: Scene) -> float:
    """Return the arm's inertia on the motor side, as its own motion carries all torque best."""
    target = np.where(scene.table.used, scene.table.target_nm, 0.0)
    return max(_carried_by(scene, target), _LEAST_SHARE * inertia_of(scene))


def _bends(scene: Scene, angle_rad: Floats) -> Floats:
    """Return the second time derivative of an angle at full rate, shape (N,)."""
    return _by_piece(scene, lambda time, at: bend_over(time, angle_rad[at]))


def _by_piece(scene: Scene, of: Callable[[Floats, slice], Floats]) -> Floats:
    """Return what is computed of each piece's time and place at full rate, shape (N,)."""
    out = np.zeros(scene.table.full["time_s"].shape[0])
    for at, period_s in scene.each_piece():
        out[at] = of(period_s * np.arange(at.stop - at.start, dtype=np.float64), at)
    return out


def _latest(scene: Scene) -> Sequence[tuple[float, float]]:
    del scene
    return ((-_LATEST_S, _LATEST_S),)


def _later(scene: Scene) -> Point:
    del scene
    return (_LATER_S,)


def _columns(scene: Scene, point: Point) -> Floats:
    return stack(_extra_rad_s2(scene, *point))


def _borne(scene: Scene, point: Point, coefficients: Floats) -> bool:
    del point
    return bool(coefficients[0] <= _HEAVIEST * inertia_of(scene))


def _twin_of(effect: str, told: str) -> ToTwin:
    def to_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
        shown = shown_gear(scene)
        if shown is None or shown.effect != effect:
            return ()
        return ({told: shown.size, **values},)

    return to_twin


def seen_beside(simulated: Sequence[Form]) -> tuple[Form, ...]:
    """Return the forms of an arm that is seen, which refine those that simulate it.

    Parameters
    ----------
    simulated : sequence of Form
    """
    return tuple(
        Form(
            effect,
            SEEN,
            ("arm_inertia_kg_m2",),
            _columns,
            ("encoder_late_s",),
            _grid_of(effect),
            (1,),
            needs=("position_rad", "position_arm_rad"),
            at_edges=True,
            step=_later,
            limits=_latest,
            borne=_borne,
            to_twin=_twin_of(effect, told),
            refines=tuple(form.name for form in simulated if form.effect == effect),
            only_clearly=True,
            from_residual=True,
        )
        for effect, told in _SHOWN.items()
    )
