"""The description of a fake: frozen, loadable, strict."""

from __future__ import annotations

import json
from dataclasses import asdict, replace
from pathlib import Path

import pytest
import tomli_w

from fakes.friction import FrictionParameters
from fakes.joint import JointParameters
from fakes.specification import FakeSpecification
from fakes.thermal import ThermalParameters

OTHER = FakeSpecification(
    joint=JointParameters(gravity_sin_nm=0.3, friction=FrictionParameters(coulomb_nm=0.5)),
    thermal=ThermalParameters(has_sensor=False),
)


@pytest.mark.parametrize("specification", [FakeSpecification(), OTHER], ids=["default", "other"])
def test_files_give_back_the_same_value(specification: FakeSpecification, tmp_path: Path) -> None:
    toml, plain = tmp_path / "fake.toml", tmp_path / "fake.json"
    toml.write_text(tomli_w.dumps(asdict(specification)), encoding="utf-8")
    plain.write_text(json.dumps(asdict(specification)), encoding="utf-8")
    assert FakeSpecification.load(toml) == specification
    assert FakeSpecification.load(plain) == specification


def test_what_is_left_out_has_its_default() -> None:
    built = FakeSpecification.from_mapping({"joint": {"gravity_sin_nm": 1}})
    assert built == replace(FakeSpecification(), joint=JointParameters(gravity_sin_nm=1.0))
    assert isinstance(built.joint.gravity_sin_nm, float)


@pytest.mark.parametrize(
    ("data", "message"),
    [
        ({"joints": {}}, r"fake: expected keys among .*joints"),
        ({"joint": {"mass_kg": 1.0}}, r"fake\.joint: .*mass_kg"),
        ({"joint": 3}, r"fake\.joint: expected a table"),
        ({"joint": {"friction": {"coulomb_nm": "much"}}}, r"fake\.joint\.friction\.coulomb_nm"),
        ({"joint": {"friction": {"coulomb_nm": -1.0}}}, r"fake\.joint\.friction\.coulomb_nm"),
        ({"servo": {"encoder_counts_per_rev": 1.5}}, r"encoder_counts_per_rev: expected int"),
        ({"drive": {"rated_torque_mnm": True}}, r"rated_torque_mnm: expected int"),
        ({"drive": {"rated_torque_mnm": 0}}, r"fake\.drive\.rated_torque_mnm"),
        ({"drive": {"abort_connection_option": 4}}, "0 to 3"),
    ],
)
def test_a_mistake_is_refused_with_its_path(data: dict[str, object], message: str) -> None:
    with pytest.raises(ValueError, match=message):
        FakeSpecification.from_mapping(data)
