"""Packing and putting together lose nothing, wherever they are killed, and again is harmless."""

from __future__ import annotations

import shutil
import zipfile
from collections.abc import Iterable
from pathlib import Path

import pytest

from agent.errors import InputError
from agent.fleet import results as results_module
from agent.fleet.entry import Entry, path_of
from agent.fleet.index import packed_entry
from agent.fleet.lake import Lake
from agent.fleet.listing import listed
from agent.fleet.packs import pack_all
from agent.fleet.results import Results
from agent.record.recording import Metadata

BEFORE = "2026-11"


class KilledError(BaseException):
    """The process is gone: nothing may catch this."""


class Mortal(Lake):
    """A lake whose user is killed at one of its writes or deletions."""

    def __init__(self, url: str, dies_at: int) -> None:
        super().__init__(url)
        self.left = dies_at

    def _live(self) -> None:
        self.left -= 1
        if self.left < 0:
            raise KilledError

    def put(self, path: str, content: bytes) -> None:
        self._live()
        super().put(path, content)

    def delete(self, paths: Iterable[str]) -> None:
        for path in paths:  # one by one, so that it can be killed between two
            self._live()
            super().delete([path])


def filled(lake: Lake, months: tuple[str, ...] = ("2026-09", "2026-10", "2026-11")) -> set[str]:
    """Put three contents of a joint into each month; return their paths."""
    paths = set()
    for month in months:
        for day in (1, 2, 3):
            start = f"{month}-0{day}T02:00:00+00:00"
            content = f"what was recorded at {start}".encode()
            known = Metadata(robot="r", axis=1, gear_ratio=1.0, started_at=start)
            path = path_of("plant", known, content)
            lake.put(path, content)
            paths.add(path)
    return paths


def contents(lake: Lake) -> dict[str, bytes]:
    """Read every recording that is listed; each is checked against its name."""
    there = listed(lake)
    entries = [entry for month in there.months for entry in there.entries(month)]
    assert len(entries) == len({e.path for e in entries})
    return {entry.path: lake.content(entry) for entry in entries}


def loose(lake: Lake) -> set[str]:
    return {path for month in listed(lake).loose.values() for path in month.paths}


def test_packed_recordings_are_the_same_bytes_and_anybody_can_unpack_them(tmp_path: Path) -> None:
    lake = Lake(str(tmp_path / "lake"))
    paths = filled(lake)
    before = contents(lake)
    (damaged,) = [p for p in paths if "20261002" in p]
    lake.put(damaged, b"half")
    done = pack_all(lake, BEFORE)
    assert (done.months, done.recordings) == (("2026-09", "2026-10"), 5)
    assert [damaged in reason for reason in done.unusable] == [True]
    assert loose(lake) == {p for p in paths if "2026-11" in p} | {damaged}

    first = min(paths)
    entry = packed_entry(lake, first)
    assert entry is not None
    assert lake.content(entry) == before[first]
    listed_loose = Entry(*entry.joint, entry.started, entry.digest, first, entry.size_bytes)
    assert lake.content(listed_loose) == before[first]  # packed since it was listed
    with zipfile.ZipFile(tmp_path / "lake" / entry.pack) as pack:
        assert pack.testzip() is None
        pack.extractall(tmp_path / "unpacked")
    assert (tmp_path / "unpacked" / first).read_bytes() == before[first]

    shutil.copytree(tmp_path / "unpacked", lake.root, dirs_exist_ok=True)  # delivered again
    late = filled(lake, ("2026-08",))
    again = pack_all(lake, BEFORE)
    assert (again.months, again.recordings) == (("2026-08", "2026-09", "2026-10"), 6)
    lake.put(damaged, before[damaged])  # pushed again, as the list of what is unusable asks for
    assert pack_all(lake, BEFORE).recordings == 1
    assert contents(lake).items() >= before.items()
    assert set(contents(lake)) == paths | late


def test_a_byte_that_changes_in_a_pack_is_seen(tmp_path: Path) -> None:
    lake = Lake(str(tmp_path / "lake"))
    path = min(filled(lake))
    pack_all(lake, BEFORE)
    entry = packed_entry(lake, path)
    assert entry is not None
    pack = tmp_path / "lake" / entry.pack
    content = bytearray(pack.read_bytes())
    content[entry.offset + 3] ^= 1
    pack.write_bytes(content)
    with pytest.raises(InputError, match="not what was pushed"):
        lake.content(entry)


def test_packing_that_is_killed_anywhere_loses_nothing_and_goes_on(tmp_path: Path) -> None:
    source = tmp_path / "source"
    filled(Lake(str(source)))
    before = contents(Lake(str(source)))
    deaths = 0
    for dies_at in range(100):
        folder = tmp_path / f"lake-{dies_at}"
        shutil.copytree(source, folder)
        lake = Lake(str(folder))
        try:
            pack_all(Mortal(str(folder), dies_at), BEFORE, pack_bytes=300)
        except KilledError:
            deaths += 1
            assert contents(lake) == before
            pack_all(lake, BEFORE, pack_bytes=300)
        assert contents(lake) == before
        assert loose(lake) == {p for p in before if "2026-11" in p}
        if deaths <= dies_at:
            break
    assert deaths == 2 * (2 + 1 + 3)  # two months of two packs, one index, three deletions


def test_results_put_together_are_the_same_rows_wherever_that_is_killed(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(results_module, "WHOLE_ROWS", 2)
    source = tmp_path / "source"

    def of(lake: Lake) -> Results:
        return Results(lake, "estimate", "1", {"value": "double"}, part_rows=2)

    first = of(Lake(str(source)))
    for number in (4, 0, 3, 1, 2, 3):  # one of them computed twice
        first.add("2026-10", {"key": f"k{number}", "value": float(number)})
    first.flush()
    before = [{"key": f"k{n}", "value": float(n)} for n in range(5)]
    deaths = 0
    for dies_at in range(100):
        folder = tmp_path / f"lake-{dies_at}"
        shutil.copytree(source, folder)
        results = of(Lake(str(folder)))
        try:
            of(Mortal(str(folder), dies_at)).tidy("2026-10", most_parts=0)
        except KilledError:
            deaths += 1
            assert list(results.rows()) == before
            results.tidy("2026-10", most_parts=0)
        assert list(results.rows()) == before
        if deaths <= dies_at:
            break
    assert deaths == 3 + 3  # three whole files, three parts to delete
    (files,) = results.months().values()
    assert len(files) == 3
    assert all("/whole-" in path for path in files)
