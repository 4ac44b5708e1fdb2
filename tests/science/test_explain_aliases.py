"""Which effects a recording cannot tell apart: computed from its motion, not listed."""

from __future__ import annotations

import numpy as np

from agent.explain.answer.names import NAMES
from agent.explain.choosing.aliases import ALIKE, aliases, copied, told_apart_by
from agent.identify.result import Floats
from tests.science.explain_joint import Conditions, library_of, record, stair
from trajectories import SetPoints

SPEEDS = (2.0, 5.0, 12.0, 30.0, 70.0)
WARM_UP = (Conditions(25.0, 0.0), Conditions(33.0, 1500.0))
COOLED = Conditions(26.0, 6000.0)


def bump_of(points: SetPoints, at: Conditions) -> Floats:
    """Return something to be found, so that the residual is not only noise."""
    del at
    return np.asarray(0.1 * np.exp(-0.5 * ((points.position_rad - 20.0) / 2.0) ** 2))


def wave(points: SetPoints, at: Conditions) -> Floats:
    del at
    return np.asarray(0.1 * np.cos(3.0 * points.position_rad))


def test_a_warm_up_cannot_tell_temperature_from_time() -> None:
    trajectory = stair(SPEEDS)
    runs = [record(trajectory, bump_of, at, seed) for seed, at in enumerate(WARM_UP)]
    found = aliases(library_of(runs))
    assert ("friction-drift", "temperature-dependent-friction") in found
    runs.append(record(trajectory, bump_of, COOLED, 9))
    cooled = aliases(library_of(runs))
    assert not any("friction-drift" in group for group in cooled)


def test_an_offset_and_one_sided_coulomb_friction_are_a_pair_in_every_cycle() -> None:
    library = library_of([record(stair(SPEEDS), bump_of, COOLED, 1)])
    assert ("direction-asymmetry", "torque-offset") in aliases(library)
    one_way = ("torque-offset", "constant"), ("direction-asymmetry", "Coulomb")
    assert copied(library)[one_way] > 0.99
    other = ("torque-offset", "constant"), ("direction-asymmetry", "viscous")
    assert copied(library)[other] < 0.5


def test_one_speed_cannot_tell_ripple_from_a_wobbling_gear_and_several_can() -> None:
    one = aliases(library_of([record(stair((20.0,)), wave, COOLED, 1)]))
    assert any({"torque-ripple", "kinematic-error"} <= set(group) for group in one)
    many = aliases(library_of([record(stair((5.0, 9.0, 14.0)), wave, COOLED, 1)]))
    assert not any({"torque-ripple", "kinematic-error"} <= set(group) for group in many)


def test_every_two_of_a_set_copy_each_other_and_no_set_is_part_of_another() -> None:
    library = library_of([record(stair((30.0, 40.0)), bump_of, at, 1) for at in WARM_UP])
    sets = [set(group) for group in aliases(library)]
    shares = copied(library)
    for group in sets:
        for first in group:
            for second in group - {first}:
                assert any(
                    a[0] == first and b[0] == second and min(share, shares[b, a]) > ALIKE
                    for (a, b), share in shares.items()
                )
        assert not any(group < other for other in sets)


def test_every_two_effects_have_a_measurement_that_tells_them_apart() -> None:
    assert "heating and while cooling" in told_apart_by(
        "friction-drift", "temperature-dependent-friction"
    )
    assert told_apart_by("stribeck", "torque-ripple").endswith(".")
    assert all(told_apart_by("stribeck", other) for other in NAMES if other != "stribeck")
