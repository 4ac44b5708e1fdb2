"""A form's numbers as the twin holds them, and where the twin's law holds none."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace

import numpy as np
import pytest

from agent.explain.forms.form import Form
from agent.explain.forms.quantities import as_in_twin
from agent.explain.rows.scene import Scene
from agent.explain.rows.table import tabulate
from agent.identify.result import Parameter
from agent.physics.twin import TwinError
from tests.unit.explain.test_alignment import TWIN, run

OWN = {"height_nm": Parameter(0.2, (0.1, 0.3)), "reach_rad": Parameter(0.01, (0.008, 0.012))}


@pytest.fixture(scope="module")
def scene() -> Scene:
    table = tabulate(TWIN, [run(0.01, with_position=True, seed=1)])
    return Scene(table, np.zeros(5), np.zeros(table.used.shape[0]))


def form(*, at_edges: bool, entries: int) -> Form:
    def to_twin(_: Scene, values: object) -> list[dict[str, float]]:
        assert isinstance(values, dict)
        return [{"travel_rad": 2.0 * values["reach_rad"]}] * entries

    return Form(
        "presliding-hysteresis",
        "test",
        ("height_nm",),
        lambda of, _: np.zeros((of.direction.shape[0], 1)),
        ("reach_rad",),
        at_edges=at_edges,
        to_twin=to_twin,
    )


def test_what_the_twin_calls_otherwise_is_converted_with_its_interval(scene: Scene) -> None:
    (name, found), *others = as_in_twin(form(at_edges=True, entries=1), scene, OWN).items()
    assert not others
    assert name == "travel_rad"
    assert found.value == pytest.approx(0.02)
    assert found.ci95 == pytest.approx((0.016, 0.024))


def test_a_hidden_state_that_its_law_does_not_bear_out_is_not_measured(scene: Scene) -> None:
    found = as_in_twin(form(at_edges=True, entries=0), scene, OWN)
    assert [p.value for p in found.values()] == [0.2, 0.01]
    assert not any(p.identified or p.ci95 for p in found.values())


def test_what_no_joint_can_have_is_no_number_either(scene: Scene) -> None:
    """An arm of less than no inertia, which a hidden state that nothing bears out may fit."""
    signed = replace(form(at_edges=True, entries=0), signs=(1,))
    found = as_in_twin(signed, scene, OWN | {"height_nm": Parameter(-0.2, (-0.3, -0.1))})
    assert np.isnan(found["height_nm"].value)
    assert found["reach_rad"].value == 0.01


def test_a_law_that_has_no_place_in_a_twin_keeps_its_numbers(scene: Scene) -> None:
    assert as_in_twin(form(at_edges=False, entries=0), scene, OWN) == OWN


def test_an_interval_that_reaches_numbers_that_no_twin_takes_is_no_measurement(
    scene: Scene,
) -> None:
    def to_twin(_: Scene, values: Mapping[str, float]) -> list[dict[str, float]]:
        if values["reach_rad"] <= 0.0:
            raise TwinError("expected a number above 0")
        return [{"travel_rad": 2.0 * values["reach_rad"]}]

    own = OWN | {"reach_rad": Parameter(0.01, (-0.008, 0.028))}
    law = replace(form(at_edges=True, entries=1), to_twin=to_twin)
    (found,) = as_in_twin(law, scene, own).values()
    assert found.value == pytest.approx(0.02)
    assert not found.identified
