"""Months that are complete, packed: millions of small files become thousands of large ones.

::

    LAKE/packed/month=2026-11/pack-5e3f0d1a9b7c2468.zip
    LAKE/packed/index/2026-11-0a1b2c3d4e5f6789.parquet

A pack is a ZIP file that compresses nothing, and each member is a recording, byte for byte, under
its own path with the hash of its content: `unzip -d LAKE PACK` puts them back. The index says where
in which pack each one lies, so that one is read without its neighbours.

A recording is deleted only when its bytes were read back from a pack that an index names. Whatever
ends the packing before that leaves the recording where it was (at worst beside its copy, which
counts as one), and packing again goes on from there.
"""

from __future__ import annotations

import hashlib
import io
import zipfile
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass

from agent.errors import InputError
from agent.fleet.entry import UNKNOWN, digest_of, entry_of
from agent.fleet.index import packed, packed_months, put_index
from agent.fleet.lake import Lake
from agent.fleet.listing import Loose, listed

PACK_BYTES = 64 << 20
_MANY = 1000  # paths that are deleted at a time
_Row = tuple[str, int, str, int]


@dataclass(frozen=True)
class Packed:
    """What one run of packing did.

    Parameters
    ----------
    months : tuple of str
        That there was something to pack in.
    recordings : int
        That lie in packs now, and no longer by themselves.
    unusable : tuple of str
        Whose content is not what was pushed, with the reason: they are left where they were.
    """

    months: tuple[str, ...]
    recordings: int
    unusable: tuple[str, ...]


def pack_all(
    lake: Lake,
    before: str,
    progress: Callable[[int, int], None] | None = None,
    pack_bytes: int = PACK_BYTES,
) -> Packed:
    """Pack every month before one.

    Parameters
    ----------
    lake : Lake
    before : str
        ``2026-11``: a month that still grows is better left. Recordings that do not say when they
        were made stay as they are.
    progress : callable, optional
        Told how many recordings of how many have been seen to.
    pack_bytes : int
        About how large a pack may grow; so much memory is taken, twice.

    Raises
    ------
    agent.errors.StorageError
        The store does not answer, or does not take the packs; nothing is lost then.
    """
    loose = {m: f for m, f in listed(lake).loose.items() if m < before and m != UNKNOWN}
    total, seen, done = sum(len(f.paths) for f in loose.values()), 0, 0
    unusable: list[str] = []
    for month, files in sorted(loose.items()):
        there = _rows(lake, month)
        refused: list[str] = []
        fresh = []
        for row in _into_packs(lake, month, files, set(there), pack_bytes, refused):
            fresh.append(row)
            if progress is not None:
                progress(min(seen + len(fresh), total), total)
        if fresh:
            put_index(lake, month, fresh)
        there |= {row[0]: row for row in fresh}
        done += _unburden(lake, [there[p] for p in files.paths if p in there])
        seen += len(files.paths)
        unusable += refused
    return Packed(tuple(sorted(loose)), done, tuple(sorted(unusable)))


def _into_packs(
    lake: Lake, month: str, files: Loose, there: set[str], pack_bytes: int, refused: list[str]
) -> Iterator[_Row]:
    """Write what is not in a pack yet into new ones, in order; yield what the index shall say."""
    pack = _Pack()
    for path, size in sorted(zip(files.paths, files.sizes, strict=True)):
        if path in there:
            continue
        entry = entry_of(path, size)
        assert entry is not None
        try:
            content = lake.content(entry)
        except InputError as error:
            refused.append(str(error))
            continue
        if pack.rows and pack.size + len(content) > pack_bytes:
            yield from pack.put(lake, month)
            pack = _Pack()
        pack.add(path, content)
    if pack.rows:
        yield from pack.put(lake, month)


class _Pack:
    """One pack while it is filled: the same recordings make the same bytes and the same name."""

    def __init__(self) -> None:
        self._bytes = io.BytesIO()
        self._zip = zipfile.ZipFile(self._bytes, "w", zipfile.ZIP_STORED)
        self.rows: list[tuple[str, int, int]] = []

    @property
    def size(self) -> int:
        return self._bytes.tell()

    def add(self, path: str, content: bytes) -> None:
        member = zipfile.ZipInfo(path)
        member.external_attr = 0o644 << 16  # else nobody may read what is unpacked
        self._zip.writestr(member, content)
        self.rows.append((path, len(content), self._bytes.tell() - len(content)))

    def put(self, lake: Lake, month: str) -> list[_Row]:
        self._zip.close()
        content = self._bytes.getvalue()
        name = f"packed/month={month}/pack-{hashlib.sha256(content).hexdigest()[:16]}.zip"
        lake.put(name, content)
        return [(path, size, name, offset) for path, size, offset in self.rows]


def _unburden(lake: Lake, rows: Sequence[_Row]) -> int:
    """Delete the recordings that come back whole from their packs; return how many."""
    by_pack: dict[str, list[_Row]] = {}
    for row in rows:
        by_pack.setdefault(row[2], []).append(row)
    sound: list[str] = []
    for pack, members in by_pack.items():
        content = lake.get(pack)
        for path, size, _, offset in members:
            entry = entry_of(path, size)
            if entry is not None and digest_of(content[offset : offset + size]) == entry.digest:
                sound.append(path)
    for start in range(0, len(sound), _MANY):
        lake.delete(sound[start : start + _MANY])
    return len(sound)


def _rows(lake: Lake, month: str) -> dict[str, _Row]:
    """Return what is in a month's packs already."""
    table = packed(lake, packed_months(lake).get(month, ()))
    columns = [column.to_pylist() for column in table.columns]
    return {row[0]: row for row in zip(*columns, strict=True)}
