"""A non-linear number's profile: where it is followed, and where an interval is known already."""

from __future__ import annotations

import math

import pytest

from agent.explain.forms import speed
from agent.explain.forms.warmth import FORMS
from agent.explain.numbers.intervals import only_together
from agent.explain.numbers.profile import _crossing
from agent.identify.result import Parameter

EVERYWHERE = (-math.inf, math.inf)


def bowl(at: float) -> float:
    return (at - 2.0) ** 2


@pytest.mark.parametrize("side", [-1.0, 1.0])
@pytest.mark.parametrize("known", [0.0, 0.004, 0.1, 0.3])
def test_the_profile_goes_on_where_the_known_interval_ends_too_early(
    side: float, known: float
) -> None:
    end = _crossing(bowl, 2.0, side, 0.5**2, 2.0 + side * known, EVERYWHERE)
    assert end == pytest.approx(2.0 + side * 0.5, abs=0.05)


@pytest.mark.parametrize("side", [-1.0, 1.0])
def test_a_known_end_that_reaches_further_costs_one_trial(side: float) -> None:
    tried: list[float] = []

    def counted(at: float) -> float:
        tried.append(at)
        return bowl(at)

    end = _crossing(counted, 2.0, side, 0.5**2, 2.0 + side * 0.7, EVERYWHERE)
    assert end == 2.0 + side * 0.7
    assert len(tried) == 1


def test_beyond_what_a_form_can_be_nothing_is_tried() -> None:
    tried: list[float] = []

    def flat(at: float) -> float:
        tried.append(at)
        return 0.0

    assert math.isnan(_crossing(flat, 2.0, 1.0, 1.0, 2.0, (0.5, 3.0)))
    assert max(tried) <= 3.0


@pytest.mark.parametrize(
    ("decay", "low", "identified"),
    [
        (Parameter.not_identified("flat", 900.0), -0.6, False),
        (Parameter.not_identified("flat", 900.0), 0.05, True),
        (Parameter(40.0, (30.0, 60.0)), -0.6, True),
    ],
)
def test_what_only_a_product_carries_has_no_interval_that_holds_zero(
    decay: Parameter, low: float, identified: bool
) -> None:
    """Friction that falls evenly with warmth had been told as 70 (-620 to 1170), identified."""
    (viscosity,) = (form for form in FORMS if form.name == "viscosity")
    (size,) = viscosity.linear
    told = only_together(viscosity, {size: Parameter(0.07, (low, 1.2)), "decay_k": decay})
    assert told[size].identified is identified
    assert told[size].value == 0.07


@pytest.mark.parametrize(("low", "identified"), [(-0.7, False), (0.05, True)])
def test_friction_under_a_load_without_a_scale_has_no_coefficient(
    low: float, identified: bool
) -> None:
    """Without a weight it had been told as 0.15 (-0.70 to 1.00), 35 to 76 % off."""
    load = next(form for form in speed.FORMS if form.name == "proportional")
    numbers = {"load_coefficient": Parameter(0.15, (low, 1.0))}
    numbers |= {name: Parameter(0.5, (0.0, 1.2)) for name in load.nonlinear}
    told = only_together(load, numbers)
    assert told["load_coefficient"].identified is identified
    assert all(told[name].identified for name in load.nonlinear)
