"""The arm behind a spring or a gap, simulated at full rate behind the measured motor motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from agent.explain.forms.arm_encoder import twist_of
from agent.explain.forms.crossings import likeliest_arms, likely_gaps
from agent.explain.forms.downhill import downhill
from agent.explain.forms.form import Form, Point, Proportional, stack
from agent.explain.forms.hidden_arm import HiddenArm, inertia_of, mean_extra_rad_s2
from agent.explain.forms.twin_law import best_entry, coulomb_nm
from agent.explain.rows.scene import Scene, log_grid
from agent.identify.result import Floats
from agent.physics.twin import TwinError

ARM_REACHES = (3e-5, 3e-4)  # rad of the arm: how far its own friction gives way before it slips
_WIDEST_ARM_GAP = 2e-3  # rad of the arm, half of a worn planetary gear's
_RUBBING_TRIALS = 36
_OTHER_REACHES = (0.4, 0.6, 0.8, 1.25, 1.6, 2.5)  # than an arm's own friction gives way by
_GAPS, _GAPS_WITH_FILM = 3, 1
_EACH_GAP = 14
_ARMS, _RUBBED, _OIL = (0.4, 0.6, 0.8), (0.3, 0.5), 0.3  # of the joint's, behind a gap that shows
_CONTACTS = ((1.0, 0.4), (1.6, 0.8))  # cutoffs, damping: hard and soft ones
_WIDER, _WIDER_IN_FILM = (1.2, 1.6), (0.4, 0.7, 1.0)  # than the likeliest gaps of hard teeth
_SPRUNG = 0.55  # of the inertia, behind a gap in a spring
_PARTS = ((0.08, 1.05), (0.15, 1.15), (0.4, 1.4))  # of a spring's hardest twist: the gap; swings
_RUBS, _GAP_TRIALS = (0.05, 0.35), 40
_HARD, _SWINGS = 1.3, 0.4  # cutoffs, damping: a contact to begin anew with
_ELSEWHERE = (0.6, 0.75, 0.87, 0.94, 1.0, 1.06, 1.15, 1.33, 1.6)
_LITTLE_WIDER = (1.0, 1.25)  # than such a gap of hard teeth
_GAP_WIDTHS = (0.93, 1.0, 1.07)  # of one gap: a gear's is not the same all the way round
_STIFFEST = 3.0  # cutoffs: a spring whose swing is faster is as good as rigid in the band
_DAMPED = 1.0  # of critical: gears swing, they do not creep
_FILM_STEP, _THICKEST = 0.3, 500.0  # share, 1/s: an arm dragged faster than that follows at once
_HARDEST_SHARE = 0.99  # of the samples are gentler
_MOST_WOUND_UP = 0.1  # rad of the arm, under its weight: belts and soft gears give way by 0.02
_LEAST_OF_TWIST = 0.12  # of what the contact gives way by: a narrower gap is a soft gear
_LEAST_OF_SWING = 0.04  # the same where the arm is seen to ring: how it rings tells the gap
_ALL_FRICTION = 1.2  # the arm's share of what the refitted twin has, which may be a little low

_SWING_TRIALS, _DAMPED_AT_FIRST = 14, 0.05
_SAYS_MUCH = 0.1  # of what is left
_LITTLE = 0.1  # of the joint's friction, the arm's

_RESTS_ON_YIELD = "known only for how far it gives way, which is not told beside a gap"

_RUBBING = ("antiresonance_hz", "damping_ratio", "friction_share", "friction_reach_rad")

Limits = Sequence[tuple[float, float]]

_LIKELY: WeakKeyDictionary[Scene, tuple[Point, ...]] = WeakKeyDictionary()


def _swing_grid(scene: Scene) -> Sequence[Point]:
    highest = 1.5 * scene.table.cutoff_hz
    frequencies = log_grid(max(1.0, highest / 15.0), highest, 8)
    return tuple((f, d) for f in frequencies for d in (0.03, 0.1, 0.3))


def swing_limits(scene: Scene) -> Limits:
    """Return between which a swing's frequency, Hz, and its damping ratio are looked for."""
    return ((0.1, _STIFFEST * scene.table.cutoff_hz), (1e-3, _DAMPED))


def likely_spring(scene: Scene) -> tuple[Point, ...]:
    """Return frequency, Hz, and damping ratio of the likeliest swing, one point.

    Nothing where no spring alone says much of what is left: searches that begin here are dear.
    """
    if scene not in _LIKELY:
        highest = 1.5 * scene.table.cutoff_hz
        frequencies = log_grid(max(1.0, highest / 15.0), highest, 16)
        coarse = [(hertz, _DAMPED_AT_FIRST) for hertz in frequencies]
        search = coarse, swing_limits(scene), _SWING_TRIALS
        _LIKELY[scene] = downhill(scene, _flexible, *search, worth=_SAYS_MUCH)[:1]
    return _LIKELY[scene]


def _flexible(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm behind a spring, over its inertia, shape (N, 1)."""
    return stack(HiddenArm(*point).extra_rad_s2(scene))


def _rubbing_grid(scene: Scene) -> Sequence[Point]:
    highest = 1.5 * scene.table.cutoff_hz
    frequencies = log_grid(max(1.0, highest / 15.0), highest, 7)
    reaches = [arm * scene.table.gear_ratio for arm in ARM_REACHES]
    coarse: list[Point] = [
        (f, (0.06, 0.2)[(i + j + k) % 2], s, r)
        for i, f in enumerate(frequencies)
        for j, s in enumerate((0.4, 1.0))
        for k, r in enumerate(reaches)
    ]
    coarse += [(*spring, _LITTLE, reaches[0]) for spring in likely_spring(scene)]
    # A soft arm's resonance is narrower than the grid, and its four numbers hang together.
    limits = _rubbing_limits(scene)
    return (*coarse, *downhill(scene, _rubbing, coarse, limits, _RUBBING_TRIALS))


def _rubbing_limits(scene: Scene) -> Limits:
    return (*swing_limits(scene), *friction_limits(scene))


def friction_limits(scene: Scene) -> Limits:
    """Return between which an arm's share of the friction and its reach, rad, are looked for."""
    widest = 100.0 * ARM_REACHES[-1] * scene.table.gear_ratio
    return ((0.0, _ALL_FRICTION), (1e-9, widest))


def _rubbing(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm with dry friction behind a spring, over its inertia, (N, 1)."""
    frequency_hz, damping, share, reach = point
    arm = HiddenArm(frequency_hz, damping, share * slowing_rad_s2(scene), reach)
    return stack(arm.extra_rad_s2(scene))


def other_reaches(scene: Scene, point: Point, far: bool) -> Sequence[Point]:
    """Return the same arm with friction that gives way by less, and by more.

    An arm that swings sticks once more or less as that changes: the error has several valleys.
    """
    del scene, far
    *arm, reach = point
    return tuple((*arm, factor * reach) for factor in _OTHER_REACHES)


def slowing_rad_s2(scene: Scene) -> float:
    """Return how fast dry friction alone would slow the joint, rad/s2."""
    return max(float(scene.theta[2]), 0.0) / inertia_of(scene)


def _oiled(scene: Scene) -> float:
    """Return how fast viscous friction alone would slow the joint, over its speed, 1/s."""
    return max(float(scene.theta[1]), 0.0) / inertia_of(scene)


def _same_friction(before: Scene, now: Scene, point: Point) -> Point:
    """Return the point at which an arm has the friction that it had beside other numbers."""
    return (*point[:2], same_friction(before, now, point[2]), *point[3:])


def same_friction(before: Scene, now: Scene, share: float) -> float:
    """Return the share of the joint's friction that a share was beside other numbers."""
    ratio = slowing_rad_s2(before) / max(slowing_rad_s2(now), 1e-300)
    return min(ratio * share, _ALL_FRICTION)


def _same_gap(before: Scene, now: Scene, point: Point) -> Point:
    """Return the point at which an arm behind a gap has the friction that it had before."""
    *same, oil = _same_friction(before, now, point)
    return (*same, min(oil * _oiled(before) / max(_oiled(now), 1e-300), _ALL_FRICTION))


def _flexible_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    inertia = values["arm_inertia_kg_m2"]
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    return (spring,)


def _rubbing_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    inertia = values["arm_inertia_kg_m2"]
    spring = spring_entry(inertia, values["antiresonance_hz"], values["damping_ratio"])
    stiffer_than_weight(scene, spring)
    point = tuple(values[name] for name in _RUBBING)
    says = inertia * _rubbing(scene, point)[:, 0]
    rubs = {**spring, **friction_entry(scene, values)}
    return best_entry(scene, "joint-flexibility", [rubs, spring], says)


def friction_entry(scene: Scene, values: Mapping[str, float]) -> dict[str, float]:
    """Return the friction of an arm behind a spring as the twin names it."""
    share = max(values["friction_share"], 0.0) * values["arm_inertia_kg_m2"] / inertia_of(scene)
    return {
        "arm_coulomb_nm": share * coulomb_nm(scene),
        "arm_yield_rad": values["friction_reach_rad"],
    }


def spring_entry(inertia: float, frequency_hz: float, damping: float) -> dict[str, float]:
    """Return a spring's numbers as the twin names them."""
    omega = 2.0 * math.pi * frequency_hz
    return {
        "arm_inertia_kg_m2": inertia,
        "stiffness_nm_per_rad": inertia * omega**2,
        "damping_nm_s_per_rad": 2.0 * damping * inertia * omega,
    }


def stiffer_than_weight(scene: Scene, spring: Mapping[str, float]) -> None:
    """Refuse a spring that the arm's weight would wind up by what no gear gives way.

    What swings so softly is another axis that its own drive holds, or a tool; the arm, with all of
    its weight on such a spring, would hang at another angle than the recordings say.
    """
    twist_arm_rad = _wound_up_arm_rad(scene, spring["stiffness_nm_per_rad"])
    if not twist_arm_rad < _MOST_WOUND_UP:
        raise TwinError(f"a spring that the arm's weight winds up by {twist_arm_rad:.2g} rad")


def _wound_up_arm_rad(scene: Scene, stiffness_nm_per_rad: float) -> float:
    """Return by how much the arm's weight would wind up a spring, rad of the arm."""
    weight_nm = float(np.hypot(*scene.theta[3:5]))
    return weight_nm / max(stiffness_nm_per_rad, 1e-300) / scene.table.gear_ratio


def bears_the_weight(scene: Scene, point: Point, coefficients: Floats) -> bool:
    """Return whether a spring is one that the arm's weight may hang on, its inertia (1,)."""
    stiffness = float(coefficients[0]) * (2.0 * math.pi * point[0]) ** 2
    return _wound_up_arm_rad(scene, stiffness) < _MOST_WOUND_UP


def _gap_grid(scene: Scene) -> Sequence[Point]:
    """Return the likeliest gaps with hard and well damped contacts.

    What a search that starts from soft contacts takes for twist is a part of the gap; and any
    contact that gives way needs a wider gap than teeth that meet at once, of which these are made.
    Where a film drags the arm along, it is such teeth that ask for a wider gap. And a gap as wide
    as an encoder on the arm shows, before arms that are heavy and light.
    """
    cutoff = scene.table.cutoff_hz
    found = likely_gaps(scene, *_gaps_seen(scene), _GAPS, with_film=_GAPS_WITH_FILM)
    hertz, damping = _CONTACTS[-1]
    shown = tuple(
        (gap, share, friction, hertz * cutoff, damping, 0.0, _OIL)
        for gap in _gaps_shown(scene)
        for share in _ARMS
        for friction in _RUBBED
    )
    return (
        shown
        + _gaps_in_springs(scene)
        + tuple(
            (wider * gap, share, friction, hertz * cutoff, damping, film, oil)
            for gap, share, friction, film, oil in found
            for wider in (_WIDER_IN_FILM if film else _WIDER)
            for hertz, damping in (_CONTACTS[:1] if film else _CONTACTS)
        )
    )


def _gaps_in_springs(scene: Scene) -> tuple[Point, ...]:
    """Return gaps before the spring that a joint seems to have: both are one that stiffens.

    The spring is harder then than it seems, as a part of its twist is none.
    """
    hardest = float(np.quantile(np.abs(scene.stiff_rad_s2), _HARDEST_SHARE))
    coarse = [
        (
            part * hardest / (2.0 * math.pi * hertz) ** 2,
            _SPRUNG,
            rubs,
            harder * hertz,
            swings,
            0.0,
            _OIL,
        )
        for hertz, swings in likely_spring(scene)
        for part, harder in _PARTS
        for rubs in _RUBS
    ]
    return (*coarse, *downhill(scene, _gap, coarse, _gap_limits(scene), _GAP_TRIALS))


def _other_gaps(scene: Scene, point: Point, far: bool) -> Sequence[Point]:
    """Return gaps that are wider and narrower, of the same arm and of likely ones, without a film.

    With the same contact, and with a hard one that swings: a contact that is soft or creeps, or a
    film, is how a search makes up for a gap that is too wide or too narrow. A wide gap behind
    little friction is crossed nearly when a narrow one behind more is: every gap has its own arm.
    """
    half_gap, inertia_share, friction_share, hertz, damping, _, oil = point
    near = tuple(wider * half_gap for wider in _ELSEWHERE)
    hard = _HARD * scene.table.cutoff_hz, _SWINGS
    arms = likeliest_arms(scene, near, inertia_share, friction_share, oil)
    if far:
        arms += likeliest_arms(scene, log_grid(*_gaps_seen(scene), _EACH_GAP))
    same = [(gap, inertia_share, friction_share, hertz, damping, 0.0, oil) for gap in near]
    likely = [
        (wider * gap, share, friction, *hard, film, of_oil)
        for gap, share, friction, film, of_oil in arms
        for wider in _LITTLE_WIDER
    ]
    anew = [(gap, inertia_share, friction_share, *hard, 0.0, oil) for gap in near]
    return (*same, *likely, *anew)


def _gaps_shown(scene: Scene) -> Sequence[float]:
    """Return half the gap that an encoder on the arm shows, rad of the motor; nothing for none."""
    narrowest, widest = _gaps_seen(scene)
    twist = twist_of(scene) if scene.has("position_arm_rad") else None
    shows = twist is not None and narrowest < twist.half_gap_rad < widest
    return (twist.half_gap_rad,) if shows and twist is not None else ()


def _gaps_seen(scene: Scene) -> tuple[float, float]:
    """Return the narrowest half gap that leaves a trace, and the widest of worn gears, rad.

    A gap that is crossed faster than the band can follow leaves none.
    """
    narrowest = 0.1 * slowing_rad_s2(scene) / (2.0 * math.pi * scene.table.cutoff_hz) ** 2
    return narrowest, _WIDEST_ARM_GAP * scene.table.gear_ratio


def _gap_step(scene: Scene) -> Point:
    del scene
    # A gap without a film is kept without: a thin one makes up for whatever else is not right.
    steps = Proportional(0.2), Proportional(0.08), 0.04, Proportional(0.5), 0.3
    return (*steps, Proportional(_FILM_STEP), 0.04)


def _gap_limits(scene: Scene) -> Limits:
    widest = 2.0 * _WIDEST_ARM_GAP * scene.table.gear_ratio
    shares = (0.01, 1.0), (0.0, _ALL_FRICTION)
    return ((0.0, widest), *shares, *swing_limits(scene), (0.0, _THICKEST), (0.0, _ALL_FRICTION))


def _gap(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm behind a gap, less that of a tight gear, over its inertia.

    The mean over gaps that differ a little: an arm that bounces is thrown to one side or the other
    by next to nothing, so that one path is no prediction, and the best of many paths is luck.
    """
    half_gap, inertia_share, friction_share, hz, damping, film, oil_share = point
    oil = max(oil_share, 0.0) * _oiled(scene) / inertia_share
    friction = max(friction_share, 0.0) * slowing_rad_s2(scene) / inertia_share
    reach = _gap_yields_rad(scene)
    arm = HiddenArm(hz, damping, friction, reach, half_gap, inertia_share, film, oil)
    return stack(mean_extra_rad_s2(arm, [width * half_gap for width in _GAP_WIDTHS], scene))


def _gap_yields_rad(scene: Scene) -> float:
    """Return how far the friction of an arm in a gap gives way: as far as the joint's was found to.

    Or little, where that was not found.
    """
    return max(ARM_REACHES[0] * scene.table.gear_ratio, scene.yields_rad)


def _gap_twin(scene: Scene, values: Mapping[str, float]) -> Sequence[Mapping[str, Any]]:
    if scene.blows is None:
        _wider_than_twist(scene, values["half_gap_rad"], values["contact_hz"])
    inertia = values["arm_share"] * inertia_of(scene)
    spring = spring_entry(inertia, values["contact_hz"], values["damping_ratio"])
    gap = {
        "half_gap_rad": values["half_gap_rad"],
        "arm_coulomb_nm": max(values["arm_friction_share"], 0.0) * coulomb_nm(scene),
        "arm_yield_rad": _gap_yields_rad(scene),
        "film_damping_nm_s_per_rad": values["film_per_s"] * inertia,
        "arm_viscous_nm_s_per_rad": max(values["arm_viscous_share"] * float(scene.theta[1]), 0.0),
    }
    uneven = {**gap, **spring, "half_gap_spread": _GAP_WIDTHS[-1] - 1.0}
    # What one path of the arm makes better is better in the mean of three, which takes as long.
    helps = best_entry(scene, "backlash", [{**gap, **spring}])
    return (uneven,) if helps else best_entry(scene, "backlash", [uneven])


def _wider_than_twist(scene: Scene, half_gap_rad: float, contact_hz: float) -> None:
    """Refuse a gap that is lost in the twist of its own contact: that is a spring, and no play.

    What is left of such a form beside its spring is how a search among bouncing arms fits noise;
    where blows are heard, the teeth have play.
    """
    hardest = float(np.quantile(np.abs(scene.full("acceleration_rad_s2")), _HARDEST_SHARE))
    twist_rad = hardest / (2.0 * math.pi * contact_hz) ** 2
    rings = contact_hz < scene.table.cutoff_hz
    if half_gap_rad < (_LEAST_OF_SWING if rings else _LEAST_OF_TWIST) * twist_rad:
        raise TwinError(
            f"half a gap of {half_gap_rad:.3g} rad is lost in a contact that gives way by "
            f"{twist_rad:.3g} rad"
        )


FORMS: tuple[Form, ...] = (
    Form(
        "joint-flexibility",
        "one spring",
        ("arm_inertia_kg_m2",),
        _flexible,
        ("antiresonance_hz", "damping_ratio"),
        _swing_grid,
        (1,),
        at_edges=True,
        to_twin=_flexible_twin,
        borne=bears_the_weight,
        limits=swing_limits,
    ),
    Form(
        "joint-flexibility",
        "one spring, and an arm with friction",
        ("arm_inertia_kg_m2",),
        _rubbing,
        _RUBBING,
        _rubbing_grid,
        (1,),
        at_edges=True,
        to_twin=_rubbing_twin,
        borne=bears_the_weight,
        limits=_rubbing_limits,
        rests_on_numbers=True,
        same_beside=_same_friction,
        elsewhere=other_reaches,
    ),
    Form(
        "backlash",
        "gap",
        ("arm_inertia_kg_m2",),
        _gap,
        (
            "half_gap_rad",
            "arm_share",
            "arm_friction_share",
            "contact_hz",
            "damping_ratio",
            "film_per_s",
            "arm_viscous_share",
        ),
        _gap_grid,
        (1,),
        needs=("position_rad",),
        at_edges=True,
        step=_gap_step,
        to_twin=_gap_twin,
        limits=_gap_limits,
        rests_on_numbers=True,
        same_beside=_same_gap,
        elsewhere=_other_gaps,
        uneven={"half_gap_rad": _GAP_WIDTHS[-1] - 1.0},
        assumes={"arm_friction_share": _RESTS_ON_YIELD},
        from_residual=True,
    ),
)
