"""Our generic EDS: read by canopen and by the fake, to the same end."""

from __future__ import annotations

from importlib import resources

import canopen
import pytest

from fakes.object_dictionary import ObjectDictionary, SdoAbortError, load_entries


@pytest.fixture(scope="module")
def foreign() -> canopen.ObjectDictionary:
    with resources.as_file(resources.files("fakes") / "generic-drive.eds") as path:
        return canopen.import_od(str(path), node_id=5)


def test_canopen_reads_every_entry_as_the_fake_does(foreign: canopen.ObjectDictionary) -> None:
    entries = load_entries(5)
    assert len(entries) > 130
    for entry in entries:
        variable = foreign.get_variable(entry.index, entry.subindex)
        assert variable is not None, f"0x{entry.index:04X}:{entry.subindex}"
        assert variable.name == entry.name
        assert variable.data_type == entry.data_type
        assert variable.access_type == entry.access
        assert variable.pdo_mappable == entry.pdo_mappable
        if isinstance(entry.default, int):
            assert variable.default == entry.default, entry.name
            assert entry.low <= entry.default <= entry.high
        else:
            assert str(variable.default or "").encode() == entry.default
    listed = sum(1 if hasattr(o, "data_type") else len(o) for o in foreign.values())
    assert listed == len(entries)


def test_sub_index_zero_counts_what_is_there() -> None:
    entries = load_entries(1)
    for index in {e.index for e in entries if e.subindex}:
        first = next(e for e in entries if e.index == index and e.subindex == 0)
        highest = max(e.subindex for e in entries if e.index == index)
        if first.access == "const":
            assert first.default == highest, f"0x{index:04X}"


@pytest.mark.parametrize("node_id", [1, 42, 127])
def test_node_id_is_added_to_the_cob_ids(node_id: int) -> None:
    od = ObjectDictionary(node_id)
    assert od.number(0x1400, 1) == 0x200 + node_id
    assert od.number(0x1800, 1) == 0x40000180 + node_id
    assert od.number(0x1801, 1) == 0xC0000280 + node_id
    assert od.number(0x1014) == 0x80 + node_id


def test_the_factory_state_is_as_dangerous_as_a_real_drives() -> None:
    od = ObjectDictionary(1)
    assert od.number(0x1016, 1) == 0
    assert od.number(0x1017) == 0
    assert od.number(0x1A00, 0) == 1
    assert od.number(0x1A00, 1) == 0x60410010
    assert od.number(0x6502) == 1 << 2


def test_reset_keeps_what_the_factory_set() -> None:
    od = ObjectDictionary(1)
    od.set_factory(0x6076, 0, 4321)
    od.set(0x6076, 0, 1)
    od.set(0x1017, 0, 50)
    od.reset(0x1000, 0x1FFF)
    assert (od.number(0x1017), od.number(0x6076)) == (0, 1)
    od.reset(0x1000, 0x9FFF)
    assert od.number(0x6076) == 4321


def test_unknown_objects_have_their_own_codes() -> None:
    od = ObjectDictionary(1)
    with pytest.raises(SdoAbortError, match="06020000"):
        od.entry(0x5555)
    with pytest.raises(SdoAbortError, match="06090011"):
        od.entry(0x1018, 9)
