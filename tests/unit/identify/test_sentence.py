"""A technician's sentence says which part of friction is not known, and never an amount for it."""

from __future__ import annotations

import pytest

from agent.identify.result import Parameter, RigidBodyFit
from agent.identify.sentence import verdict

OPEN = Parameter.not_identified("one speed only", 0.3)
COULOMB = Parameter(0.604, (0.602, 0.606))
VISCOUS = Parameter(0.0107, (0.0106, 0.0108))


@pytest.mark.parametrize(
    ("coulomb", "viscous", "said"),
    [
        (
            COULOMB,
            VISCOUS,
            "Friction is 0.6040 ±0.0020 N m Coulomb + 10.70 ±0.10 mN m s/rad viscous",
        ),
        (COULOMB, OPEN, "0.6040 ±0.0020 N m Coulomb; how much of it is viscous is not identified"),
        (
            OPEN,
            VISCOUS,
            "10.70 ±0.10 mN m s/rad viscous; how much of it is Coulomb is not identified",
        ),
        (OPEN, OPEN, "How much of the friction is Coulomb and how much viscous is not identified"),
    ],
)
def test_what_is_not_identified_is_said_and_has_no_amount(
    coulomb: Parameter, viscous: Parameter, said: str
) -> None:
    numbers = {"coulomb_nm": coulomb, "viscous_nm_s_per_rad": viscous}
    sentence = verdict((), RigidBodyFit(numbers, 10.0, 0.01, 97.7))
    assert said in sentence
    assert "0.3" not in sentence
    assert "97.7 %" in sentence
