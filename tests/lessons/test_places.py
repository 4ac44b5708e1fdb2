"""What sits at one place of the arm, narrow or wide, pushing or rubbing; and what pulls at it."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from agent.explain.choosing.choice import choose
from agent.explain.choosing.rivals import Term
from agent.explain.choosing.search import Library
from agent.explain.forms import cable as forms_cable
from agent.explain.forms import place as forms_place
from agent.explain.forms import reversal as forms_reversal
from agent.explain.forms.form import Form
from agent.explain.forms.spots import strong_places
from agent.explain.location.regions import axis_values, regions_of
from agent.explain.numbers.model import predicted
from agent.explain.rows.evidence import weigh
from agent.explain.rows.refit import refit
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import BASE, tabulate
from agent.identify.result import Floats, Parameter
from agent.physics.twin import Effect
from tests.science.explain_joint import (
    GEAR_RATIO,
    NOISE_NM,
    TWIN,
    Conditions,
    Missing,
    record,
    stair,
)
from trajectories import SetPoints, Trajectory

STROKE_RAD = 120.0
CENTER_ARM_RAD = 0.23
HEIGHT_NM = 0.25


@cache
def cycle(scale: float) -> Trajectory:
    return stair([scale * v for v in (6.0, 17.0, 40.0, 75.0)], STROKE_RAD)


@cache
def long_stroke(scale: float) -> Trajectory:
    """Along a short stroke a weight that is fitted to a hose does as well."""
    return stair([scale * v for v in (40.0, 75.0)], 400.0, duration_s=40.0)


@cache
def round_and_round(scale: float) -> Trajectory:
    """Three turns of the arm there and back."""
    return stair([scale * v for v in (120.0, 200.0)], 1900.0, duration_s=80.0)


def scene_with(width: float, *, rubs: bool, seed: int = 3) -> Scene:
    """Return two recordings with a raised cosine at one place; `width` is of the stroke."""
    half = width * STROKE_RAD / GEAR_RATIO

    def spot(points: SetPoints, at: Conditions) -> Floats:
        del at
        away = points.position_rad / GEAR_RATIO - CENTER_ARM_RAD
        bump = np.where(np.abs(away) < half, 0.5 + 0.5 * np.cos(math.pi * away / half), 0.0)
        return HEIGHT_NM * bump * (np.sign(points.velocity_rad_s) if rubs else 1.0)

    return scene_of(spot, seed)


def scene_of(
    missing: Missing, seed: int = 3, driven: Callable[[float], Trajectory] = cycle
) -> Scene:
    """Return two recordings of a joint with something more than its twin has."""
    runs = [
        record(driven(scale), missing, Conditions(), seed + k, name=f"run {k}")
        for k, scale in enumerate((1.0, 0.9))
    ]
    table = tabulate(TWIN, runs)
    delta, left = refit(table)
    theta = np.array([getattr(TWIN, name) for name in BASE]) + delta
    return Scene(table, theta, np.where(table.used, left, 0.0))


def named(scene: Scene, forms: tuple[Form, ...] = forms_place.FORMS) -> tuple[Term, ...]:
    library = Library.of(scene, weigh(scene.table, scene.residual_nm), forms)
    return choose(library).terms


@pytest.mark.parametrize(
    ("width", "rubs", "effect", "form"),
    [
        (0.03, True, "local-fault", "rubbing"),
        (0.03, False, "local-fault", "bump"),
        (0.18, True, "position-dependent-friction", "tight spot"),
    ],
)
def test_one_place_is_named_by_its_width_and_by_its_sign(
    width: float, rubs: bool, effect: str, form: str
) -> None:
    (term,) = named(scene_with(width, rubs=rubs))
    assert (term.scored.form.effect, term.scored.form.name) == (effect, form)
    values = term.scored.values()
    assert values["center_arm_rad"] == pytest.approx(CENTER_ARM_RAD, abs=0.01)
    # A raised cosine's bell of the same second moment.
    half = width * STROKE_RAD / GEAR_RATIO
    bell = half * math.sqrt(1.0 / 3.0 - 2.0 / math.pi**2)
    assert values["width_arm_rad"] == pytest.approx(bell, rel=0.25)
    assert term.scored.coefficients[0] == pytest.approx(HEIGHT_NM, rel=0.2)


@pytest.mark.parametrize(
    ("width", "first", "other"),
    [
        (0.08, "local-fault", "position-dependent-friction"),
        (0.11, "position-dependent-friction", "local-fault"),
    ],
)
def test_neither_narrow_nor_wide_is_a_tie_whose_nearer_name_comes_first(
    width: float, first: str, other: str
) -> None:
    (term,) = named(scene_with(width, rubs=True))
    assert term.scored.form.effect == first
    assert other in {rival.scored.form.effect for rival in term.rivals}


def test_the_strongest_place_is_where_the_spot_is() -> None:
    scene = scene_with(0.03, rubs=True)
    (center, _), *_ = strong_places(scene, (0.014,), friction=True)
    assert center == pytest.approx(CENTER_ARM_RAD, abs=0.01)


@pytest.mark.parametrize(
    ("stiffness", "cubic", "form"),
    [
        (0.1, 0.1, "spring that stiffens"),
        (0.1, 0.0, "spring"),
        (0.0, 0.2, "slack spring that stiffens"),
    ],
)
def test_a_hose_is_said_to_stiffen_only_where_it_does(
    stiffness: float, cubic: float, form: str
) -> None:
    def hose(points: SetPoints, at: Conditions) -> Floats:
        del at
        away = points.position_rad / GEAR_RATIO - (0.1 if cubic else 0.0)
        return np.asarray((stiffness + cubic * away**2) * away)

    (term,) = named(scene_of(hose, driven=long_stroke), forms_cable.FORMS)
    assert term.scored.form.name == form
    values = term.scored.values()
    assert values.get("stiffness_nm_per_arm_rad", 0.0) == pytest.approx(stiffness, abs=0.03)
    if cubic:
        assert values["cubic_nm_per_arm_rad3"] == pytest.approx(cubic, rel=0.1)
        assert values["neutral_arm_rad"] == pytest.approx(0.1, abs=0.02)


@pytest.mark.parametrize("side", ["below", "above"])
def test_a_hose_may_hang_free_to_one_side(side: str) -> None:
    """It is drawn taut beyond an angle; a bump there, or a cube, copies most of it."""

    def hose(points: SetPoints, at: Conditions) -> Floats:
        del at
        away = points.position_rad / GEAR_RATIO - 0.4
        drawn = np.maximum(away, 0.0) if side == "below" else np.minimum(away, 0.0)
        return np.asarray(0.2 * drawn)

    scene = scene_of(hose, driven=long_stroke)
    (term,) = named(scene, (*forms_cable.FORMS, *forms_place.FORMS))
    assert term.scored.form.name == f"spring that hangs free {side} an angle"
    values = term.scored.values()
    assert values["stiffness_nm_per_arm_rad"] == pytest.approx(0.2, rel=0.05)
    assert values["neutral_arm_rad"] == pytest.approx(0.4, abs=0.03)
    table, said = scene.table, said_by_twin(scene, term)
    column = 0.2 * table.band(term.scored.form.columns(scene, (0.4,))[:, 0])
    assert np.std((said - column)[table.used]) < 0.05 * np.std(column[table.used])


def said_by_twin(scene: Scene, term: Term) -> Floats:
    """Return the torque of a law once it is written into a twin, shape (n,)."""
    form = term.scored.form
    (entry,) = form.to_twin(scene, term.scored.values())
    twin = replace(TWIN, effects=(Effect(form.effect, dict(entry)),))
    return predicted(scene.table, twin) - predicted(scene.table, TWIN)


def settled(arm_rad: Floats, travel_rad: float) -> Floats:
    """Return inner friction that has settled over a travel, of one newton metre."""
    lag = np.zeros_like(arm_rad)
    for k, moved in enumerate(np.diff(arm_rad)):
        toward = np.sign(moved)
        lag[k + 1] = toward + (lag[k] - toward) * math.exp(-abs(moved) / travel_rad)
    return lag


@pytest.mark.parametrize("lossy_nm", [0.0, 0.08])
def test_a_hose_may_hang_free_between_two_angles(lossy_nm: float) -> None:
    """Gravity and a spring, or a cube, copy it with torques that take each other back."""

    def hose(points: SetPoints, at: Conditions) -> Floats:
        del at
        arm = points.position_rad / GEAR_RATIO
        away = arm - 0.1
        return np.asarray(0.4 * (away - np.clip(away, -0.45, 0.45)) + lossy_nm * settled(arm, 0.1))

    scene = scene_of(hose, driven=long_stroke)
    (term,) = named(scene, (*forms_cable.FORMS, *forms_reversal.FORMS))
    name = "spring that hangs free between two angles"
    assert term.scored.form.name == name + ", with inner friction" * bool(lossy_nm)
    values = term.scored.values()
    assert values["stiffness_nm_per_arm_rad"] == pytest.approx(0.4, rel=0.1)
    assert values["neutral_arm_rad"] == pytest.approx(0.1, abs=0.03)
    assert values["slack_arm_rad"] == pytest.approx(0.45, abs=0.03)
    if lossy_nm:
        assert values["hysteresis_nm"] == pytest.approx(lossy_nm, rel=0.1)
    said = said_by_twin(scene, term)[scene.table.used]
    base, left = scene.table.base[scene.table.used], scene.residual_nm[scene.table.used] - said
    left = left - base @ np.linalg.lstsq(base, left, rcond=None)[0]  # its mean level is friction
    assert np.std(left) < 0.7 * NOISE_NM < 0.5 * np.std(said)


@pytest.mark.parametrize("rubs", [True, False])
def test_a_damaged_tooth_comes_again_with_every_turn(rubs: bool) -> None:
    """Of an arm that goes round three times: narrow places everywhere are one."""

    def tooth(points: SetPoints, at: Conditions) -> Floats:
        del at
        away = points.position_rad / GEAR_RATIO - 1.1
        away = away - 2.0 * math.pi * np.round(away / (2.0 * math.pi))
        bell = 0.3 * np.exp(-0.5 * (away / 0.05) ** 2)
        return np.asarray(bell * (np.sign(points.velocity_rad_s) if rubs else 1.0))

    scene = scene_of(tooth, driven=round_and_round)
    (term,) = named(scene, forms_place.FORMS)
    assert term.scored.form.name == f"{'rubbing' if rubs else 'bump'}, every turn"
    values = term.scored.values()
    assert values["center_arm_rad"] == pytest.approx(1.1, abs=0.01)
    assert values["width_arm_rad"] == pytest.approx(0.05, rel=0.1)
    said = said_by_twin(scene, term)
    used = scene.table.used
    base, left = scene.table.base[used], (scene.residual_nm - said)[used]
    left = left - base @ np.linalg.lstsq(base, left, rcond=None)[0]  # its mean level is friction
    assert np.std(left) < 0.7 * NOISE_NM < 0.5 * np.std(said[used])


@pytest.mark.parametrize(
    ("cubic", "form"),
    [
        (0.0, "spring with inner friction"),
        (0.1, "spring that stiffens, with inner friction"),
    ],
)
def test_what_a_hose_loses_is_told_as_its_own_and_not_as_friction_that_yields(
    cubic: float, form: str
) -> None:
    """A tenth of the Coulomb friction, settled over 9 degrees of the arm, integrated apart."""
    lost_nm, travel_rad = 0.05, 0.15

    def hose(points: SetPoints, at: Conditions) -> Floats:
        del at
        arm = points.position_rad / GEAR_RATIO
        away = arm - 0.3
        return np.asarray((0.1 + cubic * away**2) * away + lost_nm * settled(arm, travel_rad))

    forms = (*forms_cable.FORMS, *forms_reversal.FORMS)
    (term,) = named(scene_of(hose, driven=long_stroke), forms)
    assert term.scored.form.name == form
    values = term.scored.values()
    assert values["stiffness_nm_per_arm_rad"] == pytest.approx(0.1, abs=0.01)
    assert values.get("cubic_nm_per_arm_rad3", 0.0) == pytest.approx(cubic, abs=0.01)
    assert values["hysteresis_nm"] == pytest.approx(lost_nm, rel=0.05)
    assert values["hysteresis_travel_arm_rad"] == pytest.approx(travel_rad, rel=0.1)


def test_the_time_after_a_reversal_is_by_the_clock() -> None:
    scene = scene_of(lambda points, _: np.zeros(points.position_rad.shape))
    rows, used = scene.table.rows, scene.table.used
    turned = np.flatnonzero(np.diff(np.sign(rows["velocity_rad_s"])) != 0.0)
    last = np.searchsorted(turned, np.arange(used.shape[0])) - 1
    known = used & (last >= 0) & (scene.table.run == 0)
    since_s = rows["time_s"] - rows["time_s"][turned[last]]
    away_s = np.abs(axis_values(scene, "after_reversal_s") - since_s)[known & (since_s > 0.5)]
    assert away_s.size > 500
    assert np.quantile(away_s, 0.9) < 0.2


@pytest.mark.parametrize("effect", ["load-dependent-friction", "backlash"])
def test_a_load_is_what_the_arm_bears_that_the_form_has_found(effect: str) -> None:
    scene = scene_of(lambda points, _: np.zeros(points.position_rad.shape))
    scene = replace(scene, theta=np.array([*scene.theta[:3], 0.0, 0.0]))
    rows = np.flatnonzero(scene.table.used)

    def reach_nm(arm_share: float) -> float:
        shares = {"arm_share": arm_share, "arm_friction_share": 0.0}
        found = {name: Parameter(share, None) for name, share in shares.items()}
        where = regions_of(scene, rows, effect, "", np.ones(rows.shape[0]), found)
        assert {region.variable for region in where} == {"load_torque_nm"}
        return max(r.upper for r in where) - min(r.lower for r in where)

    assert reach_nm(0.3) == pytest.approx(0.3 * reach_nm(1.0), rel=0.01)
