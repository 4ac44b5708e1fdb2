"""Drive profiles: shipped ones are whole, a wrong one is refused whole, the cell's word wins."""

from __future__ import annotations

import tomllib
from dataclasses import replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import pytest
import tomli_w

from agent.cell.cell import parse_cell
from agent.cycle.plan import plan_cycle
from agent.errors import InputError
from agent.wire.drive import CATCHING_UP, LONGEST_BRAKING_S, drive_config, ramping_with
from drivers.cia402.config import Cia402Config
from drivers.profiles.drive_profile import (
    DRIVES,
    DriveProfileError,
    load_profile,
    parse_profile,
    shipped_profiles,
)
from fakes.impersonation import DRIVES as PLAYED

EXAMPLE = files("agent.examples").joinpath("cell.toml").read_text(encoding="utf-8")


def config_with(**drive: Any) -> Cia402Config:
    """Return the drivers' description of the example's axis with these keys in [axis.drive]."""
    document = tomllib.loads(EXAMPLE)
    document["axis"][0]["drive"].pop("velocity_unit", None)
    document["axis"][0]["drive"] |= drive
    cell = parse_cell(tomli_w.dumps(document))
    return drive_config(cell, cell.axis[0])


def test_a_drive_ramps_as_steeply_as_what_it_is_sent_and_no_steeper_than_its_axis() -> None:
    # A steeper ramp is at each set-point too early and waits there: the velocity goes up in steps.
    document = tomllib.loads(EXAMPLE)
    for asked, limit, ramp in ((300.0, 600.0, 300.0 * CATCHING_UP), (300.0, 301.0, 301.0)):
        document["axis"][0]["stair"]["motor_acceleration_rad_s2"] = asked
        document["axis"][0]["limits"]["motor_acceleration_max_rad_s2"] = limit
        cell = parse_cell(tomli_w.dumps(document))
        plan = plan_cycle(cell, cell.axis[0])
        config = ramping_with(plan, drive_config(cell, cell.axis[0]))
        assert config.acceleration_rad_s2 == pytest.approx(ramp)
        assert config.deceleration_rad_s2 == pytest.approx(ramp, rel=0.02)  # half a second to rest
        quick = document["axis"][0]["limits"]["stopping_deceleration_rad_s2"]
        assert config.quick_stop_deceleration_rad_s2 == quick


@pytest.mark.parametrize("has_deceleration", [True, False])
def test_a_gentle_cycle_leaves_a_drive_that_ignores_a_quick_stop_its_brakes(
    has_deceleration: bool,
) -> None:
    document = tomllib.loads(EXAMPLE)
    document["axis"][0]["stair"]["motor_acceleration_rad_s2"] = 200.0
    cell = parse_cell(tomli_w.dumps(document))
    plan = plan_cycle(cell, cell.axis[0])
    able = replace(drive_config(cell, cell.axis[0]), has_deceleration=has_deceleration)
    config = ramping_with(plan, able)
    fastest = max(abs(segment.velocity_end_rad_s) for segment in plan.trajectory.segments)
    brakes = config.deceleration_rad_s2 if has_deceleration else config.acceleration_rad_s2
    assert brakes == pytest.approx(min(fastest / LONGEST_BRAKING_S, able.deceleration_rad_s2))
    assert brakes > 1.4 * CATCHING_UP * 200.0


def test_every_shipped_profile_is_whole_and_can_be_played() -> None:
    assert set(shipped_profiles()) == set(PLAYED)
    for name in shipped_profiles():
        assert load_profile(name).modes.offered.value, name


def test_every_value_says_where_it_is_known_from() -> None:
    """Take any provenance away: the profile is refused, naming the place."""
    text = files(DRIVES).joinpath("maxon-epos4.toml").read_text(encoding="utf-8")
    marks = text.count('from = "')
    assert marks >= 8
    for number in range(marks):
        parts = text.split('from = "')
        without = (
            'from = "'.join(parts[: number + 1])
            + 'origin = "'
            + 'from = "'.join(parts[number + 1 :])
        )
        with pytest.raises(DriveProfileError, match=r"from: is missing"):
            parse_profile(without)


def test_all_mistakes_are_reported_at_once() -> None:
    text = files(DRIVES).joinpath("elmo-gold.toml").read_text(encoding="utf-8")
    wrong = (
        text.replace('"csv"', '"tq"')
        .replace('"0x22A2:00"', '"22A2"')
        .replace("[position]", "[positions]")
        .replace('value = "zero"', 'value = "nought"')
    )
    with pytest.raises(DriveProfileError) as caught:
        parse_profile(wrong, "mine.toml")
    message = str(caught.value)
    assert message.startswith("mine.toml has 5 mistakes:")
    for piece in ("modes.offered", "temperature[1].object", "positions: unknown key", "nought"):
        assert piece in message


def test_a_cell_takes_its_profile_and_its_own_word_wins() -> None:
    plain = config_with()
    assert plain.offered_modes is None
    assert plain.scaling.velocity_unit == "counts_per_s"
    schunk = config_with(profile="schunk-lwa4p")
    assert schunk.offered_modes == ("vl", "ip", "pp")
    assert schunk.abort_connection_option is None
    assert not schunk.has_quick_stop_deceleration
    assert plain.has_quick_stop_deceleration
    assert schunk.heartbeat_consumer_subindex == 1
    assert config_with(profile="ingenia-eve-xcr-c").heartbeat_consumer_subindex is None
    assert config_with(profile="maxon-epos4").scaling.velocity_unit == "rpm"
    own = config_with(profile="maxon-epos4", velocity_unit="counts_per_s", abort_connection=False)
    assert own.scaling.velocity_unit == "counts_per_s"
    assert own.abort_connection_option is None
    assert config_with(software_limits=False).software_limits_rad is None


def test_a_profile_that_is_not_there_is_a_mistake_of_the_cell(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"axis\[1\].drive.profile.*Shipped profiles: elmo-gold"):
        config_with(profile="elmo-golden")
    (tmp_path / "mine.toml").write_text('schema = "stribeck.drive-profile/1"\n')
    document = tomllib.loads(EXAMPLE)
    document["axis"][0]["drive"]["profile"] = "mine.toml"
    with pytest.raises(InputError, match="modes: is missing"):
        parse_cell(tomli_w.dumps(document), folder=tmp_path)
