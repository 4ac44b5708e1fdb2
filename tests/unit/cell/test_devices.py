"""The cell's sections for devices beside the drive: valid as the example shows them, or refused."""

from __future__ import annotations

import re
from importlib.resources import files
from pathlib import Path

import pytest

from agent.cell.cell import parse_cell, read_cell
from agent.cell.devices import Cia404Temperature, ModbusTemperature
from agent.errors import InputError
from drivers.modbus.map_file import load_map, shipped_maps

EXAMPLE = files("agent.examples").joinpath("cell.toml").read_text(encoding="utf-8")


def section(name: str) -> str:
    """Return a section of the example that is commented out, without its comment marks."""
    found = re.search(rf"^# \[{re.escape(name)}\]\n((?:# \w+ = .*\n)+)", EXAMPLE, re.MULTILINE)
    assert found is not None, name
    return found[0].replace("# [", "[").replace("\n# ", "\n")


def with_sections(*texts: str, without: str = "") -> str:
    text = EXAMPLE
    if without:
        text = re.sub(rf"^\[{re.escape(without)}\].*?(?=^\[)", "", text, flags=re.M | re.S)
    cell_level = "".join(t for t in texts if t.startswith("[release]"))
    axis_level = "".join(t for t in texts if not t.startswith("[release]"))
    return text.replace("[[axis]]", f"{cell_level}\n[[axis]]", 1) + "\n" + axis_level


def test_what_the_example_shows_is_valid() -> None:
    cell = parse_cell(with_sections(section("axis.temperature"), section("release")))
    temperature, release = cell.axis[0].temperature, cell.release
    assert isinstance(temperature, ModbusTemperature)
    assert temperature.register_name in [r.name for r in load_map(temperature.map).registers]
    assert release is not None
    assert cell.axis[0].has_gearbox_temperature
    job = parse_cell(with_sections(section("axis.job"), without="axis.drive"))
    assert job.axis[0].job is not None
    assert job.axis[0].job.map in shipped_maps()


def test_a_job_reckons_with_its_own_silence_in_every_stopping_distance() -> None:
    job = section("axis.job").replace("alive_timeout_s = 0.5", "alive_timeout_s = 1.5")
    cell = parse_cell(with_sections(job, without="axis.drive"))
    assert cell.axis[0].motor_limits.reaction_time_s == pytest.approx(1.65)


def test_a_cell_without_drives_needs_no_bus_and_says_so_when_asked() -> None:
    text = with_sections(section("axis.job"), without="axis.drive")
    cell = parse_cell(re.sub(r"^\[bus\].*?(?=^\[)", "", text, flags=re.M | re.S))
    with pytest.raises(InputError, match="has no CAN bus"):
        _ = cell.bus
    with pytest.raises(InputError, match="a controller runs it as a job"):
        _ = cell.axis[0].drive


@pytest.mark.parametrize(
    ("sections", "without", "says"),
    [
        ((section("axis.job"),), "", "either [axis.drive] or [axis.job]"),
        ((), "axis.drive", "either [axis.drive] or [axis.job]"),
        ((), "bus", "[bus] is missing"),
        ((section("axis.temperature") + 'rtu = "/dev/ttyS0"\n',), "", "either tcp"),
        ((section("axis.temperature").replace("3.0", "0.4"),), "", "at least period_s"),
        ((section("axis.temperature").replace('"modbus"', '"magic"'),), "", "magic"),
        ((section("axis.temperature") + "chanel = 2\n",), "", "chanel: unknown key"),
        ((section("release").replace(":502", ""),), "", "tcp"),
        (('[axis.temperature]\nkind = "cia404"\nnode_id = 0\n',), "", "node_id"),
    ],
)
def test_each_mistake_has_its_sentence(sections: tuple[str, ...], without: str, says: str) -> None:
    with pytest.raises(InputError, match="mistake") as caught:
        parse_cell(with_sections(*sections, without=without))
    assert says in str(caught.value)


CIA404 = '\n[axis.temperature]\nkind = "cia404"\nnode_id = 21\n'
CONTACT = '\n[release]\nkind = "can-input"\nnode_id = 31\n'


@pytest.mark.parametrize(
    ("sections", "says"),
    [
        (
            ('[axis.temperature]\nkind = "cia404"\nnode_id = 1\n',),
            "node 1 is one device, and the drive and temperature both claim it",
        ),
        (
            (
                '[release]\nkind = "can-input"\nnode_id = 31\n',
                '[axis.temperature]\nkind = "cia404"\nnode_id = 31\n',
            ),
            "node 31 is one device",
        ),
        (
            (
                '[release]\nkind = "modbus"\nrtu = "/dev/ttyS1"\n',
                '[axis.temperature]\nkind = "adam"\nport = "/dev/ttyS1"\n',
            ),
            "the serial port /dev/ttyS1 has one owner, and temperature and release both want it",
        ),
    ],
)
def test_two_devices_in_one_place_are_refused(sections: tuple[str, ...], says: str) -> None:
    with pytest.raises(InputError, match="mistake") as caught:
        parse_cell(with_sections(*sections))
    assert says in str(caught.value)


def second_axis(node: int) -> str:
    """Return the example's axis once more, with another number and node."""
    axis = EXAMPLE[EXAMPLE.index("[[axis]]") :]
    other = axis.replace("number = 1\n", "number = 2\n", 1)
    return other.replace("\nnode_id = 1\n", f"\nnode_id = {node}\n", 1)


@pytest.mark.parametrize(
    ("node", "section_", "says"),
    [
        (126, "agent_node_id = 126\n", "agent_node_id is 126, and so is the drive of axis 2"),
        (21, CIA404, "the temperature of axis 1 is node 21, and so is the drive of axis 2"),
        (31, CONTACT, "the release is node 31, and so is the drive of axis 2"),
        (2, CONTACT.replace("31", "127"), "agent_node_id is 127, and so is the release"),
        (2, CIA404.replace("21", "127"), "is 127, and so is the temperature of axis 1"),
        (2, CIA404 + CONTACT, ""),
    ],
)
def test_a_node_beside_the_axis_is_nobody_elses(node: int, section_: str, says: str) -> None:
    text = EXAMPLE.replace("agent_node_id = 127\n", section_) if "agent" in section_ else EXAMPLE
    text += "" if "agent" in section_ else section_
    text += second_axis(node)
    if not says:
        assert len(parse_cell(text).axis) == 2
        return
    with pytest.raises(InputError, match="mistake") as caught:
        parse_cell(text)
    assert says in str(caught.value)


def test_two_sources_of_one_temperature_are_refused() -> None:
    mapped = 'gearbox_temperature = { object = "0x2100:01", degc_per_count = 0.1 }\n'
    text = EXAMPLE.replace("[axis.limits]", f"{mapped}\n[axis.limits]")
    node = '\n[axis.temperature]\nkind = "cia404"\nnode_id = 21\n'
    assert isinstance(parse_cell(EXAMPLE + node).axis[0].temperature, Cia404Temperature)
    with pytest.raises(InputError, match="not from both"):
        parse_cell(text + node)


def test_a_map_is_looked_for_beside_the_cell(tmp_path: Path) -> None:
    own = section("axis.temperature").replace("modmux-pm6rtd", "maps/own.toml")
    (tmp_path / "CELL.toml").write_text(with_sections(own))
    temperature = read_cell(tmp_path / "CELL.toml").axis[0].temperature
    assert isinstance(temperature, ModbusTemperature)
    assert temperature.map == str(tmp_path / "maps" / "own.toml")
