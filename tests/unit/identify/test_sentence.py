"""What a technician reads first: no amount of what is not known, and all the doubt there is."""

from __future__ import annotations

import numpy as np
import pytest

from agent.identify.result import FrictionModelFit, Parameter, RigidBodyFit
from agent.identify.sentence import missing_samples, percent, verdict
from agent.identify.signals.arrays import Signals

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


def test_an_interval_that_is_askew_is_written_with_both_ends() -> None:
    askew = Parameter(2.39e-3, (1.88e-3, 2.52e-3))
    nearly = Parameter(0.604, (0.594, 0.6155))
    numbers = {"coulomb_nm": askew, "viscous_nm_s_per_rad": VISCOUS}
    law = FrictionModelFit("coulomb-viscous", True, 1e-5, 99.97, 0.0, numbers)
    sentence = verdict((law,), None)
    assert sentence.startswith("Friction is 2.39 mN m (1.88 to 2.52) Coulomb + 10.70 ±0.10 mN m")
    assert "explains over 99.9 % of the steady torque (10 µN m rms is left)" in sentence
    numbers["coulomb_nm"] = nearly
    assert "0.604 ±0.011 N m" in verdict((law,), None)


@pytest.mark.parametrize(
    ("fit", "said"), [(99.949, "99.9 %"), (99.951, "over 99.9 %"), (100.0, "100.0 %")]
)
def test_all_is_said_of_all_only(fit: float, said: str) -> None:
    assert percent(fit) == said


def lacking(rows: list[slice], channel: str = "torque_nm", lost: int = 0) -> tuple[str, ...]:
    """Return what is said of 20 000 samples in 40 s without numbers in some rows."""
    columns = {
        name: np.ones(20_000) for name in ("torque_nm", "velocity_rad_s", "position_rad")
    } | {"time_s": np.arange(20_000) / 500.0}
    for own in rows:
        columns[channel][own] = np.nan
    return missing_samples(Signals.from_columns(columns, 1.0, name="a", samples_lost=lost))


def test_missing_samples_are_counted_named_and_placed() -> None:
    assert lacking([slice(5000, 5400)]) == (
        "a: in 400 of 20\u202f000 samples (2 %) torque is not a number (10 to 10.8 s); "
        "they were left out",
    )
    (two,) = lacking([slice(0, 100), slice(19_900, 20_000)], "position_rad")
    assert "position is not a number (0 to 0.198 s, 39.8 to 40 s)" in two
    (many,) = lacking([slice(k, k + 1) for k in range(100, 20_000, 100)])
    assert "torque is not a number (in 199 places between 0.2 and 39.8 s)" in many
    (lost,) = lacking([], lost=1000)
    assert lost == "a: 1\u202f000 of 21\u202f000 samples (4.8 %) were lost while recording"
    assert not lacking([slice(7, 26)], lost=19)
