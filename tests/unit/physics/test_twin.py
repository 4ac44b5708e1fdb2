"""The twin as text: round trip, unknown keys, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from agent.physics.rigid_body import PARAMETERS, regressor
from agent.physics.twin import Effect, Twin, TwinError, format_twin, parse_twin

TEXT = """
schema = "stribeck.twin/1"
robot = "cell7"
axis = 1
gear_ratio = 224
maker = "somebody"

[rigid_body]
inertia_kg_m2 = 0.0184
gravity_sin_nm = 0.2
gravity_cos_nm = -0.1
payload_kg = 3.0

[friction]
coulomb_nm = 0.6042
viscous_nm_s_per_rad = 0.0107

[[effects]]
id = "stribeck"
parameters = { static_extra_nm = 0.12, exponent = 1.3 }
since = "2026"
"""


def test_unknown_keys_survive_the_round_trip() -> None:
    twin = parse_twin(TEXT)
    again = parse_twin(format_twin(twin))
    assert again == twin
    assert twin.extra == {"maker": "somebody", "rigid_body": {"payload_kg": 3.0}}
    assert twin.effects == (
        Effect("stribeck", {"static_extra_nm": 0.12, "exponent": 1.3}, {"since": "2026"}),
    )


def test_a_table_of_unknown_keys_does_not_shadow_a_known_one() -> None:
    text = format_twin(parse_twin(TEXT))
    assert "payload_kg" in text
    assert text.count("[rigid_body]") == 1


@pytest.mark.parametrize(
    ("old", "new", "named"),
    [
        ("stribeck.twin/1", "stribeck.twin/9", "schema"),
        ('robot = "cell7"', "robot = 7", "robot"),
        ("axis = 1", "axis = true", "axis"),
        ("gear_ratio = 224", "gear_ratio = -1", "gear_ratio"),
        ("gear_ratio = 224", 'gear_ratio = "big"', "gear_ratio"),
        ("inertia_kg_m2 = 0.0184", "inertia_kg_m2 = nan", "rigid_body.inertia_kg_m2"),
        ("coulomb_nm = 0.6042", "coulomb_nm = -0.6", "friction.coulomb_nm"),
        ("viscous_nm_s_per_rad = 0.0107", "", "friction.viscous_nm_s_per_rad"),
        ('id = "stribeck"', "id = 3", r"effects\[0\]"),
        ("schema =", "schema", "not TOML"),
    ],
)
def test_bad_text_is_refused_by_name(old: str, new: str, named: str) -> None:
    assert old in TEXT
    with pytest.raises(TwinError, match=named):
        parse_twin(TEXT.replace(old, new))


def test_gravity_defaults_to_none() -> None:
    text = TEXT.replace("gravity_sin_nm = 0.2", "").replace("gravity_cos_nm = -0.1", "")
    twin = parse_twin(text)
    assert (twin.gravity_sin_nm, twin.gravity_cos_nm) == (0.0, 0.0)


def test_prediction_by_hand() -> None:
    twin = Twin("r", 1, 2.0, 0.5, 1.0, 0.1, gravity_sin_nm=3.0, gravity_cos_nm=4.0)
    torque = twin.predict_torque(np.array([np.pi]), np.array([-2.0]), np.array([6.0]))
    # Arm angle pi/2: sine 1, cosine 0.
    assert torque == pytest.approx([0.5 * 6.0 - 1.0 - 0.2 + 3.0])
    filtered = twin.predict_torque(
        np.array([np.pi]), np.array([-2.0]), np.array([6.0]), np.array([-0.25])
    )
    assert filtered == pytest.approx([3.0 - 0.25 - 0.2 + 3.0])


def test_prediction_refuses_what_it_does_not_hold() -> None:
    one = np.ones(1)
    with pytest.raises(TwinError, match=r"stribeck: stribeck_velocity_rad_s"):
        parse_twin(TEXT).predict_torque(one, one, one)
    with pytest.raises(TwinError, match="position"):
        Twin("r", 1, 1.0, 0.5, 1.0, 0.1, gravity_sin_nm=3.0).predict_torque(None, one, one)


def test_regressor_columns_are_in_the_order_of_the_parameters() -> None:
    columns = regressor(np.array([3.0]), np.array([5.0]), np.array([7.0]), np.array([1.0]), 2.0)
    expected = {
        "inertia_kg_m2": 7.0,
        "viscous_nm_s_per_rad": 5.0,
        "coulomb_nm": 1.0,
        "gravity_sin_nm": np.sin(1.5),
        "gravity_cos_nm": np.cos(1.5),
        "torque_offset_nm": 1.0,
    }
    assert dict(zip(PARAMETERS, columns[0], strict=True)) == pytest.approx(expected)
