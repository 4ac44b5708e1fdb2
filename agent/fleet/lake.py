"""Where a fleet's recordings lie: one folder or object store, a path that says whose each one is.

::

    LAKE/recordings/site=S/robot=R/axis=N/month=2026-11/20261121T221742Z-9f86d081884c7d65.parquet
    LAKE/packed/month=2026-11/pack-5e3f0d1a9b7c2468.zip       months that are complete (`packs`)
    LAKE/packed/index/2026-11-0a1b2c3d4e5f6789.parquet        what is in that month's packs

A file gets its name only when it is whole; until then it has one that no reader looks at. Nothing
is ever written again.
"""

from __future__ import annotations

import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from agent.errors import InputError, StorageError, UsageError
from agent.fleet.entry import Entry, digest_of, entry_of, path_of
from agent.fleet.index import packed_entry
from agent.fleet.store import Store
from agent.record.reading import read
from agent.record.recording import Recording


class Lake(Store):
    """A store with recordings in it; see `Store` for its address and errors."""

    def push(self, recording: Path, site: str) -> tuple[Entry, bool]:
        """Put a recording into the lake; return its entry, and whether it is new there.

        Raises
        ------
        InputError
            It is no whole recording; nothing is written then.
        StorageError
            The store does not take it.
        """
        if not site:
            raise UsageError("The site needs a name.", "Add --site NAME.")
        if recording.suffix.lower() != ".parquet":
            raise InputError(
                f"{recording}: a lake takes Parquet recordings.",
                "Turn it into one with `stribeck export`, or record to Parquet.",
            )
        metadata = read(recording).metadata
        content = recording.read_bytes()
        path = path_of(site, metadata, content)
        entry = entry_of(path, len(content))
        assert entry is not None
        if self.has(path, entry.size_bytes):
            return entry, False
        packed = packed_entry(self, path)
        if packed is not None:
            return packed, False
        self.put(path, content)
        return entry, True

    def content(self, entry: Entry) -> bytes:
        """Return a recording's bytes as they were pushed.

        Raises
        ------
        InputError
            They are not what was pushed.
        StorageError
            The store does not answer, or the recording is not there.
        """
        content = self._bytes(entry)
        if digest_of(content) != entry.digest:
            raise InputError(
                f"{entry.path}: its content is not what was pushed ({len(content)} bytes).",
                "Push the recording again from its cell, and delete this one.",
            )
        return content

    def recording(self, entry: Entry) -> Recording:
        """Read one recording and see that it is what its name says.

        Raises
        ------
        InputError
            Its content is not what was pushed, it is no recording, or one of another joint.
        StorageError
            The store does not answer.
        """
        with self._local(entry) as path:
            recording = read(path)
        metadata = recording.metadata
        if (metadata.robot, metadata.axis) != (entry.robot, entry.axis):
            raise InputError(
                f"{entry.path}: is of {metadata.robot} axis {metadata.axis}, not of the joint that "
                "its folder names."
            )
        return recording

    def _bytes(self, entry: Entry) -> bytes:
        if entry.pack:
            return self.get_part(entry.pack, entry.offset, entry.size_bytes)
        try:
            return self.get(entry.path)
        except StorageError:
            packed = packed_entry(self, entry.path)  # it may have been packed since it was listed
            if packed is None:
                raise
            return self.get_part(packed.pack, packed.offset, packed.size_bytes)

    @contextmanager
    def _local(self, entry: Entry) -> Iterator[Path]:
        content = self.content(entry)
        own = Path(self.root) / entry.path
        if self.is_folder and not entry.pack and own.exists():
            yield own
            return
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / own.name
            path.write_bytes(content)
            yield path
