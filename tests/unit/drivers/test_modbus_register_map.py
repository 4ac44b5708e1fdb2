"""A register map is read whole or refused whole, and asks for no address that is not in it."""

from __future__ import annotations

from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivers.modbus.map_file import RegisterMapError, load_map, parse_map, shipped_maps
from drivers.modbus.register_map import MOST_REGISTERS, RegisterMap

HEAD = 'schema = "stribeck.registers/1"\ndevice = "d"\nsource = "s"\nconfirmed = "own"\n'
GOOD = HEAD + '[[register]]\nname = "a"\naddress = 1\n'


def test_every_mistake_is_named_at_once() -> None:
    text = HEAD.replace('"own"', '"yes"') + (
        'word_oder = "low-first"\n[[register]]\nname = "A b"\naddress = -1\ntype = "u17"\n'
        '[[register]]\nname = "b"\naddress = 1\nscale = 0.0\n'
    )
    with pytest.raises(RegisterMapError) as caught:
        parse_map(text, "map.toml")
    message = str(caught.value)
    assert message.startswith("map.toml has 6 mistakes:")
    for piece in (
        "confirmed",
        "word_oder: unknown key",
        "register[1].name",
        "register[1].address",
        "register[1].type",
        "register[2]: scale must not be 0",
    ):
        assert piece in message


@pytest.mark.parametrize(
    ("more", "says"),
    [
        ('[[register]]\nname = "a"\naddress = 2\n', "two registers are called a"),
        ('quality = { register = "x", good = [0] }\n', "there is no register 'x'"),
        ("sentinels = [70000]\n", "can never be read as u16"),
        ("range = [3.0, 1.0]\n", "range must be"),
        ('type = "bit"\n', "goes with function 1 or 2"),
        ("function = 4\nwritable = true\n", "writable"),
        ("function = 5\n", "function"),
        ('[[register]]\nname = "z"\naddress = 65535\ntype = "i32"\n', "outside of 0 to 65535"),
        ("scale = nan\n", "scale"),
    ],
)
def test_each_mistake_has_its_sentence(more: str, says: str) -> None:
    parse_map(GOOD)
    with pytest.raises(RegisterMapError, match="mistake") as caught:
        parse_map(GOOD + more)
    assert says in str(caught.value)


def test_not_toml_not_there_and_empty(tmp_path: Path) -> None:
    with pytest.raises(RegisterMapError, match="is not TOML"):
        parse_map("= 1")
    with pytest.raises(RegisterMapError, match="Shipped maps: abb-ach580"):
        load_map("missing.toml", tmp_path)
    with pytest.raises(RegisterMapError, match="register: is missing"):
        parse_map(HEAD)


@pytest.mark.parametrize("name", shipped_maps())
def test_each_shipped_map_is_valid_and_says_who_says_so(name: str) -> None:
    found = load_map(name)
    assert found.source
    assert all(r.unit or r.note for r in found.registers), "a bare number explains nothing"
    assert all(r.range for r in found.registers if r.unit == "degC")


def test_the_adam_4015_scale_gives_the_known_pair() -> None:
    channel = load_map("advantech-adam-4015")["channel_1"]
    assert channel.physical(26874) == pytest.approx(32.01, abs=0.005)
    assert channel.raw(32.01) == pytest.approx(26874, abs=2)


def test_an_address_base_is_taken_off_once() -> None:
    found = load_map("modmux-pm6rtd")
    assert found.wire_address(found["channel_1"]) == 1
    assert load_map("abb-ach580").wire_address(load_map("abb-ach580")["parameter_01_01"]) == 256


@given(
    st.lists(
        st.tuples(st.sampled_from((3, 4)), st.integers(0, 400), st.sampled_from(("u16", "f32"))),
        min_size=1,
        max_size=40,
        unique_by=lambda r: r[:2],
    ),
    st.booleans(),
)
def test_requests_cover_what_is_asked_for_and_nothing_else(
    places: list[tuple[int, int, str]], one_per_request: bool
) -> None:
    registers = [
        {"name": f"r{k}", "function": f, "address": a, "type": t}
        for k, (f, a, t) in enumerate(places)
    ]
    found = RegisterMap.model_validate(
        {
            "schema": "stribeck.registers/1",
            "device": "d",
            "source": "s",
            "confirmed": "own",
            "one_per_request": one_per_request,
            "register": registers,
        }
    )
    blocks = found.blocks(r.name for r in found.registers)
    asked = {(b.function, b.address + k) for b in blocks for k in range(b.size)}
    wanted = {(r.function, r.address + k) for r in found.registers for k in range(r.size)}
    assert asked == wanted
    assert all(1 <= b.size <= MOST_REGISTERS for b in blocks)
    assert sorted(n for b in blocks for n in b.names) == sorted(r.name for r in found.registers)
    if one_per_request:
        assert len(blocks) == len(registers)
