"""The arm behind a gap of its gear, simulated at full rate behind the measured motor motion."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from types import MappingProxyType
from typing import Any

import numpy as np

from agent.explain.forms.arm import (
    ALL_FRICTION,
    ARM_REACHES,
    Limits,
    likely_spring,
    same_friction,
    slowing_rad_s2,
    spring_entry,
    swing_limits,
)
from agent.explain.forms.crossings import likeliest_arms, likely_gaps
from agent.explain.forms.downhill import downhill
from agent.explain.forms.form import Form, Point, Proportional, stack
from agent.explain.forms.grid import log_grid
from agent.explain.forms.hidden_arm import HiddenArm, inertia_of, mean_extra_rad_s2
from agent.explain.forms.seen_arm import BACKLASH, shown_gear
from agent.explain.forms.twin_law import best_entry, coulomb_nm
from agent.explain.rows.scene import Scene
from agent.identify.result import Floats
from agent.physics.twin import TwinError

_WIDEST_ARM_GAP = 2e-3  # rad of the arm, half of a worn planetary gear's
_GAPS, _GAPS_WITH_FILM = 3, 1
_EACH_GAP = 14
_ARMS, _RUBBED, _OIL = (0.4, 0.6, 0.8), (0.3, 0.5), 0.3  # of the joint's, behind a gap that shows
_CONTACTS = ((1.0, 0.4), (1.6, 0.8))  # cutoffs, damping: hard and soft ones
_WIDER, _WIDER_IN_FILM = (1.2, 1.6), (0.4, 0.7, 1.0)  # than the likeliest gaps of hard teeth
_SPRUNG = 0.55  # of the inertia, behind a gap in a spring
_PARTS = ((0.08, 1.05), (0.15, 1.15), (0.4, 1.4))  # of a spring's hardest twist: the gap; swings
_RUBS, _GAP_TRIALS = (0.05, 0.35), 40
_HARD, _SOFT, _SWINGS = 1.3, 0.6, 0.4  # cutoffs, damping: contacts to begin anew with
_ELSEWHERE = (0.6, 0.75, 0.87, 0.94, 1.0, 1.06, 1.15, 1.33, 1.6)
_LITTLE_WIDER = (1.0, 1.25)  # than such a gap of hard teeth
_SPREAD = 0.07  # share by which one gap differs: a gear's is not the same all the way round
_UNEVEN = (_SPREAD, 0.0)  # and teeth that only push
_HEARD_UP_TO = 1.5  # cutoffs: contacts that ring faster came out up to four times too soft
_AT_THE_END = 0.95  # of the fastest that is looked for
_TOO_FAST = "the teeth ring faster than what is compared"
_NEARLY_EVEN, _EVEN = 0.04, 0.01  # the same of gaps that are looked for once the joint is known
_AROUND = tuple(float(x) for x in np.geomspace(0.86, 1.16, 9))
_ALL_HZ, _ALL_RINGS = log_grid(0.4, 2.5, 6), (0.15, 0.35)
_NEAR = (0.97, 0.98, 0.99, 1.0, 1.01, 1.02, 1.03)
_NEAR_HZ, _NEAR_RINGS = (0.9, 1.0, 1.1, 1.5), (0.6, 0.8, 1.0)
_FILM_STEP, _THICKEST = 0.3, 500.0  # share, 1/s: an arm dragged faster than that follows at once
_HARDEST_SHARE = 0.99  # of the samples are gentler
_LEAST_OF_TWIST = 0.12  # of what the contact gives way by: a narrower gap is a soft gear
_LEAST_OF_SWING = 0.04  # the same where the arm is seen to ring: how it rings tells the gap
_RESTS_ON_YIELD = "known only for how far it gives way, which is not told beside a gap"


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
        (gap, share, friction, hertz * cutoff, damping, 0.0, _OIL, *_UNEVEN)
        for gap in _gaps_shown(scene)
        for share in _ARMS
        for friction in _RUBBED
    )
    return (
        shown
        + _gaps_in_springs(scene)
        + tuple(
            (wider * gap, share, friction, hertz * cutoff, damping, film, oil, *_UNEVEN)
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
    near = len(coarse[0]) if coarse else 0
    found = downhill(
        scene,
        lambda there, point: _gap(there, (*point, *_UNEVEN)),
        coarse,
        _gap_limits(scene)[:near],
        _GAP_TRIALS,
    )
    return tuple((*point, *_UNEVEN) for point in (*coarse, *found))


def _other_gaps(scene: Scene, point: Point, far: bool) -> Sequence[Point]:
    """Return gaps that are wider and narrower, of the same arm and of likely ones, without a film.

    With the same contact, and with a hard one that swings: a contact that is soft or creeps, or a
    film, is how a search makes up for a gap that is too wide or too narrow. Far from where it ended
    a soft one is looked for as well: some are. A wide gap behind little friction is crossed nearly
    when a narrow one behind more is: every gap has its own arm.
    """
    half_gap, inertia_share, friction_share, hertz, damping, _, oil, *kind = point
    near = tuple(wider * half_gap for wider in _ELSEWHERE)
    hard = _HARD * scene.table.cutoff_hz, _SWINGS
    arms = likeliest_arms(scene, near, inertia_share, friction_share, oil)
    if far:
        arms += likeliest_arms(scene, log_grid(*_gaps_seen(scene), _EACH_GAP))
    same = [(gap, inertia_share, friction_share, hertz, damping, 0.0, oil, *kind) for gap in near]
    likely = [
        (wider * gap, share, friction, *hard, film, of_oil, *kind)
        for gap, share, friction, film, of_oil in arms
        for wider in _LITTLE_WIDER
    ]
    contacts = (hard, (_SOFT * scene.table.cutoff_hz, _SWINGS)) if far else (hard,)
    anew = [
        (gap, inertia_share, friction_share, *c, 0.0, oil, *kind) for c in contacts for gap in near
    ]
    return (*same, *likely, *anew)


def _even_gaps(scene: Scene, point: Point) -> Sequence[Point]:
    """Return gaps that are nearly the same all the way round, around one that is less so.

    Near paths of an arm that bounces go apart, so that their mean is smoother than any of them, and
    its contact duller than the joint's. Once the twin's numbers are known, one path says more: the
    teeth may push alone, or have a damper that pulls as well. First all contacts, and gaps that
    differ by less; then near the best of these one that hardly does.
    """
    half_gap, share, friction, hertz, damping, film, oil, spread, _ = point
    gaps: Sequence[float] = _NEAR
    evener = _EVEN
    contacts = [(h * hertz, z * damping) for h in _NEAR_HZ for z in _NEAR_RINGS]
    if spread > _NEARLY_EVEN:
        gaps, evener = _AROUND, _NEARLY_EVEN
        contacts += [(h * scene.table.cutoff_hz, z) for h in _ALL_HZ for z in _ALL_RINGS]
    dragged = sorted({(0.0, 0.0), (friction, oil)})
    return [
        (wider * half_gap, share, rubs, *contact, film, oiled, evener, parting)
        for wider in gaps
        for contact in contacts
        for rubs, oiled in dragged
        for parting in (0.0, 1.0)
    ]


def _gaps_shown(scene: Scene) -> Sequence[float]:
    """Return half the gap that an encoder on the arm shows, rad of the motor; nothing for none."""
    narrowest, widest = _gaps_seen(scene)
    shown = shown_gear(scene)
    if shown is None or shown.effect != BACKLASH or not narrowest < shown.size < widest:
        return ()
    return (shown.size,)


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
    # Which kind of contact it is, is tried and not moved.
    return (*steps, Proportional(_FILM_STEP), 0.04, 0.0, 0.0)


def _gap_limits(scene: Scene) -> Limits:
    widest = 2.0 * _WIDEST_ARM_GAP * scene.table.gear_ratio
    shares = (0.01, 1.0), (0.0, ALL_FRICTION)
    dragged = (0.0, _THICKEST), (0.0, ALL_FRICTION)
    return ((0.0, widest), *shares, *swing_limits(scene), *dragged, (0.0, 1.0), (0.0, 1.0))


def _gap(scene: Scene, point: Point) -> Floats:
    """Return the torque of an arm behind a gap, less that of a tight gear, over its inertia.

    The mean over gaps that differ a little: an arm that bounces is thrown to one side or the other
    by next to nothing, so that one path is no prediction, and the best of many paths is luck.
    """
    half_gap, inertia_share, friction_share, hz, damping, film, oil_share, spread, parts = point
    oil = max(oil_share, 0.0) * _oiled(scene) / inertia_share
    friction = max(friction_share, 0.0) * slowing_rad_s2(scene) / inertia_share
    reach = _gap_yields_rad(scene)
    arm = HiddenArm(
        hz, damping, friction, reach, half_gap, inertia_share, film, oil, parting_share=parts
    )
    widths = (1.0 - spread, 1.0, 1.0 + spread) if spread else (1.0,)
    return stack(mean_extra_rad_s2(arm, [width * half_gap for width in widths], scene))


def _oiled(scene: Scene) -> float:
    """Return how fast viscous friction alone would slow the joint, over its speed, 1/s."""
    return max(float(scene.theta[1]), 0.0) / inertia_of(scene)


def _gap_yields_rad(scene: Scene) -> float:
    """Return how far the friction of an arm in a gap gives way: as far as the joint's was found to.

    Or little, where that was not found.
    """
    return max(ARM_REACHES[0] * scene.table.gear_ratio, scene.yields_rad)


def _same_gap(before: Scene, now: Scene, point: Point) -> Point:
    """Return the point at which an arm behind a gap is the arm that it was before.

    As heavy, and with the same friction: an arm a hundredth heavier is let go and met elsewhere.
    """
    half_gap, share, friction, *contact, oil, spread, parting = point
    lighter = min(inertia_of(before) / inertia_of(now), 1.0 / share)
    friction = same_friction(before, now, friction) * lighter
    oil = min(oil * lighter * _oiled(before) / max(_oiled(now), 1e-300), ALL_FRICTION)
    return (half_gap, share * lighter, friction, *contact, oil, spread, parting)


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
    if values["parting_damping_share"]:
        gap["parting_damping_share"] = min(values["parting_damping_share"], 1.0)
    if not values["half_gap_spread"]:
        return best_entry(scene, "backlash", [{**gap, **spring}])
    uneven = {**gap, **spring, "half_gap_spread": values["half_gap_spread"]}
    # What one path of the arm makes better is better in the mean of three, which takes as long.
    helps = best_entry(scene, "backlash", [{**gap, **spring}])
    return (uneven,) if helps else best_entry(scene, "backlash", [uneven])


def _wider_than_twist(scene: Scene, half_gap_rad: float, contact_hz: float) -> None:
    """Refuse a gap that is lost in the twist of its own contact: that is a spring, and no play.

    What is left of such a form beside its spring is how a search among bouncing arms fits noise;
    where blows are heard, the teeth have play.
    """
    least = _LEAST_OF_SWING if contact_hz < scene.table.cutoff_hz else _LEAST_OF_TWIST
    twist_rad = _twist_rad(scene, contact_hz)
    if half_gap_rad < least * twist_rad:
        raise TwinError(
            f"half a gap of {half_gap_rad:.3g} rad is lost in a contact that gives way by "
            f"{twist_rad:.3g} rad"
        )


def _is_uneven(point: Point) -> bool:
    """Return whether it is the mean over gaps that differ by more than the least that is tried."""
    return point[-2] > _EVEN


def _too_fast(scene: Scene, point: Point) -> Mapping[str, str]:
    """Return what rings above what is compared, and at the end of the search what pays for it.

    That blows happened is seen there, and how much; not how hard teeth are that ring faster.
    """
    _, _, _, contact_hz, *_ = point
    cutoff_hz = scene.table.cutoff_hz
    if contact_hz <= _HEARD_UP_TO * cutoff_hz:
        return {}
    numbers = ["contact_hz", "damping_ratio"]
    if contact_hz > _AT_THE_END * swing_limits(scene)[0][1]:
        numbers += ["arm_share", "arm_inertia_kg_m2"]
    return dict.fromkeys(numbers, _TOO_FAST)


def is_a_spring(scene: Scene, form: Form, point: Point) -> bool:
    """Return whether it is a gap of next to nothing beside what its own contact gives way by."""
    if form not in FORMS:
        return False
    half_gap_rad, _, _, contact_hz, *_ = point
    return half_gap_rad < _LEAST_OF_SWING * _twist_rad(scene, contact_hz)


def _twist_rad(scene: Scene, contact_hz: float) -> float:
    """Return what a contact gives way by under the hardest acceleration, rad of the motor."""
    hardest = float(np.quantile(np.abs(scene.full("acceleration_rad_s2")), _HARDEST_SHARE))
    return hardest / (2.0 * math.pi * contact_hz) ** 2


FORMS: tuple[Form, ...] = (
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
            "half_gap_spread",
            "parting_damping_share",
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
        once_known=_even_gaps,
        uneven={"half_gap_rad": "half_gap_spread"},
        is_a_mean=_is_uneven,
        roughly=MappingProxyType({"contact_hz": 0.02, "damping_ratio": 0.08}),
        beyond=_too_fast,
        kinds=("half_gap_spread", "parting_damping_share"),
        assumes={"arm_friction_share": _RESTS_ON_YIELD},
        from_residual=True,
    ),
)
