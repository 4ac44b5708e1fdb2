"""What is said of findings: how many numbers are wrong, which way a load is off, what wear does."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from agent.explain.answer.located import Region, Ringing
from agent.explain.answer.number_sentences import number_sentence
from agent.explain.answer.own_effect import own_effect_sentence
from agent.explain.answer.places import place_in_words
from agent.explain.answer.sentences import (
    counted_from,
    finding_sentence,
    only_heard,
)
from agent.identify.result import Parameter


@pytest.mark.parametrize(
    ("given", "found", "said"),
    [
        ((0.0, 0.0), (0.3, 0.1), "does not know all of the load"),
        ((3.0, 0.4), (3.45, 0.46), "does not know all of the load"),
        ((6.48, 0.54), (6.0, 0.5), "has too much of the load"),
        ((0.8, 0.0), (-0.8, 0.0), "has the load on another side"),
    ],
)
def test_a_load_is_too_little_too_much_or_on_another_side(
    given: tuple[float, float], found: tuple[float, float], said: str
) -> None:
    names = "gravity's sine part", "gravity's cosine part"
    changes = {n: (g, f, "N m") for n, g, f in zip(names, given, found, strict=True)}
    assert number_sentence("gravity-imbalance", changes, 0.9).lead.startswith(
        f"The simulation {said}: "
    )


def test_two_numbers_are_numbers() -> None:
    coulomb, viscous = (0.5, 0.6, "N m"), (0.01, 0.008, "N m s/rad")
    one = number_sentence("wrong-number", {"Coulomb friction": coulomb}, 0.9).lead
    two = {"Coulomb friction": coulomb, "viscous friction": viscous}
    assert one == "A number of the simulation is wrong: Coulomb friction is 0.600, not 0.500 N m."
    assert number_sentence("wrong-number", two, 0.9).lead.startswith(
        "Numbers of the simulation are wrong: "
    )
    constant = {"the factor": (1.0, 1.012, "")}
    assert number_sentence("torque-constant-error", constant, 0.9, doubtful=True).lead == (
        "The torque constant may be wrong: the real torque would be the reported one times a "
        "factor of 1.012."
    )


def test_wear_is_told_with_its_rate_and_its_sign() -> None:
    runs = (Region("recording", 0.0, 6.0),)
    rates = {"coulomb_nm_per_h": Parameter(-0.025, (-0.026, -0.024))}
    said = finding_sentence("friction-drift", runs, (-0.015, 0.015), 0.9, rates).lead
    assert "time or use (Coulomb friction falls by 25 mN m an hour) explains 90 %" in said


@pytest.mark.parametrize(
    ("more", "said"),
    [
        (0.032, "falls by 33 mN m an hour instead of 65 mN m"),
        (0.070, "grows by 5.0 mN m an hour instead of falling by 65 mN m"),
    ],
)
def test_wear_beside_a_simulation_that_wears_is_told_in_all(more: float, said: str) -> None:
    """A run-in went on more slowly than the simulation had it, and "grew"."""
    found = {"coulomb_nm_per_h": Parameter(more, None, identified=True)}
    runs, beside = (Region("recording", 0.0, 6.0),), {"coulomb_nm_per_h": -0.065}
    told = finding_sentence("friction-drift", runs, (-0.01, 0.01), 0.9, found, beside=beside)
    assert f"Coulomb friction {said}" in told.lead


def test_a_simulations_own_rate_is_told_in_its_unit() -> None:
    """The wear of a simulation was "not the joint's", without a number."""
    found = {"coulomb_nm_per_h": Parameter(1.19e-4, (1.18e-4, 1.20e-4))}
    said = own_effect_sentence("friction-drift", {"coulomb_nm_per_h": 7.98e-5}, found, 1.0, 1.0)
    assert said.lead.endswith("Coulomb friction's change 0.119, not 0.0798 mN m/h.")


def test_a_place_that_is_a_point_is_told_as_one() -> None:
    """It had been from 33 to 33."""
    warm = Region("gearbox_temperature_degc", 32.96, 33.04)
    assert place_in_words(warm, "") == "at gearbox temperatures around 33 °C"
    assert place_in_words(replace(warm, upper=35.0), "").endswith("from 33 to 35 °C")


def test_a_place_that_rubs_less_than_a_level_that_is_higher_is_no_place_below_the_simulation() -> (
    None
):
    """A brake that dragged on one half of the stroke sent a technician to the other."""
    where = (Region("arm_position_rad", 0.0, 1.0, 2.0, 0.9),)
    plain = finding_sentence("position-dependent-friction", where, (-0.25, 0.0), 0.9, {})
    told = counted_from(plain, 0.24, first=True)
    assert "less friction torque than elsewhere" in told.lead
    assert told.lead.endswith("Elsewhere it needs 0.24 N m more than the simulation.")
    second = counted_from(plain, 0.24, first=False)
    assert "Elsewhere" not in second.lead
    assert second.caveat == "Elsewhere it needs 0.24 N m more than the simulation."


@pytest.mark.parametrize(
    ("near", "of_time", "said"),
    [
        (0.48, 0.03, "48 % of what is left lies within 0.1 s of that, in 3 % of the motion"),
        (0.1, 0.03, "in the torque that is compared it does not show"),
        (0.5, 0.4, "in the torque that is compared it does not show"),  # nearly all of the motion
    ],
)
def test_blows_say_where_what_is_left_lies(near: float, of_time: float, said: str) -> None:
    """Half of what was left lay in a thirtieth of the time, and was said not to show."""
    none = np.zeros(1)
    heard = Ringing(none, none, none, none, 0.0, 23, 57.8, 9.0)
    assert only_heard(heard, near, of_time).endswith(said)
