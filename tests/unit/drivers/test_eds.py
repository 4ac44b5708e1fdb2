"""The EDS reader: real files' dirt is survived, named by its line, and changes nothing else.

Only our own generic EDS is used; the dirt is made.
"""

from __future__ import annotations

import json
from importlib import resources
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from typer.testing import CliRunner

from agent.cli.app import app
from drivers.cia402.eds import decide, read_eds
from fakes.object_dictionary import load_entries

TEXT = (resources.files("fakes") / "generic-drive.eds").read_text(encoding="utf-8")
LINES = TEXT.split("\n")
CLEAN = read_eds(TEXT.encode())


def line_of(start: str) -> int:
    """Return the number of the first line that begins so."""
    return next(n for n, line in enumerate(LINES, start=1) if line.startswith(start))


def test_our_own_file_is_read_whole_without_a_warning() -> None:
    assert CLEAN.warnings == ()
    entries = load_entries(0)
    assert set(CLEAN.objects) == {(e.index, e.subindex) for e in entries}
    for entry in entries:
        found = CLEAN.objects[entry.index, entry.subindex]
        assert (found.name, found.data_type, found.access) == (
            entry.name,
            entry.data_type,
            entry.access,
        )
        assert found.mappable == entry.pdo_mappable
        if isinstance(entry.default, int) and found.default is not None:
            assert found.default == entry.default, found.key


def test_what_it_decides() -> None:
    decided = decide(CLEAN)
    assert decided.modes == ("pv",)
    assert (decided.abort_connection, decided.heartbeat_consumer) == (1, 0)
    assert decided.rated_torque == 5000
    assert decided.software_limits
    assert "0x2100:01" in {entry.key for entry in decided.temperatures}
    assert any("0x1016 ships as 0" in text for text in decided.warnings)


@pytest.mark.parametrize(
    ("bad", "at", "says"),
    [
        ("this is nothing", "[6041]", "neither a section nor a value"),
        ("[6041", "[6041]", "opens no section"),
        ("DataType=0x00zz", "ParameterName=Statusword", "DataType is no number: '0x00zz'"),
    ],
)
def test_a_bad_line_is_named_by_its_number(bad: str, at: str, says: str) -> None:
    number = line_of(at)
    dirty = [*LINES[:number], bad, *LINES[number:]]
    if bad.startswith("DataType"):
        del dirty[number + 2]  # the good one, which would win
    eds = read_eds("\n".join(dirty).encode())
    assert [w.line for w in eds.warnings if says in w.text] == [number + 1]
    assert len(eds.objects) >= len(CLEAN.objects) - 1


def test_windows_text_is_read_and_said() -> None:
    dirty = TEXT.replace("Statusword", "Zustand für Öl °C", 1).encode("cp1252")
    eds = read_eds(dirty)
    entry = eds.get(0x6041)
    assert entry is not None
    assert entry.name == "Zustand für Öl °C"
    assert [w.line for w in eds.warnings] == [line_of("ParameterName=Statusword")]
    assert "Windows-1252" in eds.warnings[0].text


def test_what_comes_twice_is_taken_late_and_said_with_both_lines() -> None:
    again = "\n[6007]\nDefaultValue=2\n"
    eds = read_eds((TEXT + again).encode())
    assert decide(eds).abort_connection == 2
    texts = [str(w) for w in eds.warnings]
    assert len(texts) == 2
    assert f"as in line {line_of('[6007]')}" in texts[0]
    assert "the later one is taken" in texts[1]


def test_comments_after_values_are_left_out_and_said_in_one_sentence() -> None:
    dirty = TEXT.replace("DefaultValue=0x00000004", "DefaultValue=0x4 ; pv only")
    dirty = dirty.replace("AccessType=ro", "AccessType=ro ; never written")
    eds = read_eds(dirty.encode())
    assert (eds.objects, decide(eds)) == (CLEAN.objects, decide(CLEAN))
    (warned,) = eds.warnings
    lines = [n for n, line in enumerate(dirty.split("\n"), start=1) if " ; " in line]
    others = ", ".join(str(line) for line in lines[1:8])
    assert str(warned) == (
        f"line {lines[0]}: a comment after the value is left out; so in {others} "
        f"and {len(lines) - 8} more"
    )


@pytest.mark.parametrize(
    "value",
    ["0x00 00 01 84", "388", "0x184 ; pp, csp, csv", "0X184 // modes", "$NODEID+0x184", " 0x184  "],
)
def test_numbers_are_read_as_files_write_them(value: str) -> None:
    eds = read_eds(TEXT.replace("DefaultValue=0x00000004", f"DefaultValue={value}").encode())
    entry = eds.get(0x6502)
    assert entry is not None
    assert entry.default == 0x184
    assert decide(eds).modes == ("pv", "csv", "csp")


@pytest.mark.parametrize(
    ("index", "says"),
    [
        ("6007", "0x6007 is missing"),
        ("1016", "0x1016 is missing"),
        ("6076", "0x6076 is missing or 0"),
        ("6077", "the drive gives no torque"),
        ("6502", "0x6502 is missing"),
    ],
)
def test_a_missing_object_is_said_with_what_it_means(index: str, says: str) -> None:
    kept: list[str] = []
    skips = False
    for line in LINES:
        if line.startswith("["):
            skips = line.startswith(f"[{index}")
        if not skips:
            kept.append(line)
    assert any(says in text for text in decide(read_eds("\n".join(kept).encode())).warnings)


DIRT = st.sampled_from(
    [
        "",
        ";",
        "[",
        "]",
        "=",
        "[]",
        "[6502]",
        "[6502sub]",
        "DefaultValue=",
        "DefaultValue=0x",
        "DataType=9999999999999999999999999",
        "\x00\x00",
        "ParameterName",
        "=5",
        "\t",
        "[ 6041 ] ; x",
        "SubNumber=x",
        "\ufeff",
        "DefaultValue=1e400",
        "PDOMapping=yes",
        "a" * 12_000,
    ]
) | st.text(max_size=40)


@settings(max_examples=10, deadline=None)
@given(st.lists(st.tuples(st.integers(0, len(LINES)), DIRT), min_size=1, max_size=8))
def test_dirt_anywhere_is_survived(dirt: list[tuple[int, str]]) -> None:
    dirty = list(LINES)
    for at, line in sorted(dirt, reverse=True):
        dirty.insert(at, line)
    data = "\n".join(dirty).encode("utf-8", errors="surrogatepass")
    eds = read_eds(data)
    decide(eds)
    total = data.decode("utf-8", errors="replace").count("\n") + data.count(b"\r") + 2
    assert all(0 <= warned.line <= total for warned in eds.warnings)


@settings(max_examples=40, deadline=None)
@given(st.binary(max_size=400))
def test_any_bytes_are_survived(data: bytes) -> None:
    decide(read_eds(data))
    decide(read_eds(TEXT.encode()[:3000] + data))


def test_the_command_prints_what_is_decided_and_the_bad_lines(tmp_path: Path) -> None:
    path = tmp_path / "drive.eds"
    path.write_text(TEXT.replace("[6041]", "nonsense\n[6041]"), encoding="utf-8")
    result = CliRunner().invoke(app, ["eds", str(path)])
    assert result.exit_code == 0
    for piece in ("pv", "ships as 1", "5000 mN m", "0x2100:01"):
        assert piece in result.output
    assert f"line {line_of('[6041]')}: 'nonsense'" in result.output
    document = json.loads(CliRunner().invoke(app, ["eds", str(path), "--json"]).stdout)
    assert document["modes"] == ["pv"]
    assert [bad["line"] for bad in document["bad_lines"]] == [line_of("[6041]")]
    path.write_text("hello", encoding="utf-8")
    assert CliRunner().invoke(app, ["eds", str(path)]).exit_code == 1
