"""Where a fleet's recordings lie: one folder or object store, a path that says whose each one is.

::

    LAKE/recordings/site=S/robot=R/axis=N/month=2026-11/20261121T221742Z-9f86d081884c7d65.parquet

The name ends with the first 16 digits of the content's SHA-256: what is delivered twice has the
same name and is there once, and a file that was changed on its way is known by its name. A file
gets that name only when it is whole; until then it has one that no reader looks at. Nothing is
ever written again. Site and robot are percent-encoded, so that any name is one path element.
"""

from __future__ import annotations

import datetime
import hashlib
import re
import tempfile
import uuid
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any
from urllib.parse import quote, unquote

from agent.errors import InputError, StorageError
from agent.record.reading import read
from agent.record.recording import Recording

RECORDINGS, UNFINISHED = "recordings", "unfinished"
_DIGITS = 16  # of the content hash in a name: 64 bits, no two of a billion files alike
_NAME = re.compile(
    r"recordings/site=(?P<site>[^/]+)/robot=(?P<robot>[^/]+)/axis=(?P<axis>-?\d+)"
    r"/month=(?P<month>\d{4}-\d{2}|unknown)/(?P<started>[0-9TZ]+|unknown)"
    rf"-(?P<digest>[0-9a-f]{{{_DIGITS}}})\.parquet$"
)


@dataclass(frozen=True, order=True)
class Entry:
    """One recording in the lake, as its path tells it.

    Parameters
    ----------
    site, robot : str
        Whose it is.
    axis : int
    started : str
        ISO 8601 basic form, UTC; ``unknown`` where the recording does not say.
    digest : str
        The first 16 digits of its content's SHA-256.
    path : str
        Below the lake's root.
    size_bytes : int
    """

    site: str
    robot: str
    axis: int
    started: str
    digest: str
    path: str
    size_bytes: int = field(compare=False)

    @property
    def joint(self) -> tuple[str, str, int]:
        """Return whose joint it is: site, robot, axis."""
        return self.site, self.robot, self.axis


class Lake:
    """A folder, or whatever else fsspec reaches (``s3://bucket/prefix``).

    Parameters
    ----------
    url : str
        Where it is. A folder need not be there yet.
    options : mapping, optional
        For fsspec: an S3-compatible store's ``endpoint_url``, ``key``, ``secret``.

    Raises
    ------
    InputError
        The address is of no store that is known, or its library is not installed.
    """

    def __init__(self, url: str, options: dict[str, Any] | None = None) -> None:
        import fsspec

        self.url, self.options = url, dict(options or {})
        try:
            self._store, root = fsspec.core.url_to_fs(url, **self.options)
        except (ImportError, ValueError, TypeError) as error:
            raise InputError(
                f"{url}: cannot be used as a lake ({error}).",
                "Name a folder, or s3://bucket/prefix with the extra stribeck[s3] installed.",
            ) from error
        self.root = str(root).rstrip("/")

    @property
    def is_folder(self) -> bool:
        """Tell whether it lies on this machine's own file system."""
        return "file" in _protocols(self._store)

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
            raise InputError("The site needs a name.", "Add --site NAME.")
        if recording.suffix.lower() != ".parquet":
            raise InputError(
                f"{recording}: a lake takes Parquet recordings.",
                "Turn it into one with `stribeck export`, or record to Parquet.",
            )
        metadata = read(recording).metadata
        content = recording.read_bytes()
        path = _path(site, metadata.robot, metadata.axis, metadata.started_at, content)
        entry = entry_of(path, len(content))
        assert entry is not None
        with self._told("written to"):
            if self._there(entry):
                return entry, False
            self.put(path, content)
        return entry, True

    def put(self, path: str, content: bytes) -> None:
        """Write one file below the root, whole or not at all."""
        final = f"{self.root}/{path}"
        if not self.is_folder:  # an object is there when all of it is
            self._store.pipe_file(final, content)
            return
        part = f"{self.root}/{UNFINISHED}/{uuid.uuid4().hex}"
        self._store.makedirs(part.rpartition("/")[0], exist_ok=True)
        self._store.makedirs(final.rpartition("/")[0], exist_ok=True)
        try:
            self._store.pipe_file(part, content)
            Path(part).replace(final)
        finally:
            Path(part).unlink(missing_ok=True)

    def entries(self) -> tuple[tuple[Entry, ...], tuple[str, ...]]:
        """Return the recordings in order of joint and time, and the paths that are none.

        Raises
        ------
        StorageError
            The store does not answer.
        """
        with self._told("read"):
            found = self._listed(RECORDINGS)
        entries, others = [], []
        for path, size in found:
            entry = entry_of(path, size)
            if entry is None:
                others.append(path)
            else:
                entries.append(entry)
        return tuple(sorted(entries)), tuple(sorted(others))

    def files(self, folder: str) -> tuple[str, ...]:
        """Return the paths, below the root, of the files in one of its folders."""
        with self._told("read"):
            return tuple(sorted(path for path, _ in self._listed(folder)))

    def files_here(self) -> tuple[str, ...]:
        """Return the names of the files that lie in the root itself."""
        with self._told("read"):
            self._store.invalidate_cache()
            try:
                found = self._store.ls(self.root, detail=True)
            except FileNotFoundError:
                return ()
        return tuple(str(i["name"]).rpartition("/")[2] for i in found if i["type"] == "file")

    def get(self, path: str) -> bytes:
        """Return one file's content."""
        with self._told("read"):
            content: bytes = self._store.cat_file(f"{self.root}/{path}")
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

    @contextmanager
    def _local(self, entry: Entry) -> Iterator[Path]:
        content = self.get(entry.path)
        if _digest(content) != entry.digest:
            raise InputError(
                f"{entry.path}: its content is not what was pushed ({len(content)} bytes).",
                "Push the recording again from its cell, and delete this one.",
            )
        if self.is_folder:
            yield Path(self.root) / entry.path
            return
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder) / entry.path.rpartition("/")[2]
            path.write_bytes(content)
            yield path

    def _there(self, entry: Entry) -> bool:
        try:
            return bool(self._store.size(f"{self.root}/{entry.path}") == entry.size_bytes)
        except FileNotFoundError:
            return False

    def _listed(self, folder: str) -> list[tuple[str, int]]:
        self._store.invalidate_cache()
        try:
            found = self._store.find(f"{self.root}/{folder}", detail=True)
        except FileNotFoundError:
            return []
        start = len(self.root.lstrip("/")) + 1
        return [(n.lstrip("/")[start:], int(i["size"] or 0)) for n, i in found.items()]

    @contextmanager
    def _told(self, what: str) -> Iterator[None]:
        try:
            yield
        except OSError as error:  # what fsspec's stores raise, S3's included
            raise StorageError(
                f"{self.url}: the lake cannot be {what} ({error}).",
                "Check the address, the rights and the connection, then start again; what is "
                "there already is not done twice.",
            ) from error


def entry_of(path: str, size_bytes: int) -> Entry | None:
    """Return what a path below the root says, or None where it is not one of a recording."""
    match = _NAME.fullmatch(path)
    if match is None:
        return None
    return Entry(
        site=unquote(match["site"]),
        robot=unquote(match["robot"]),
        axis=int(match["axis"]),
        started=match["started"],
        digest=match["digest"],
        path=path,
        size_bytes=size_bytes,
    )


def _path(site: str, robot: str, axis: int, started_at: str, content: bytes) -> str:
    try:
        start = datetime.datetime.fromisoformat(started_at).astimezone(datetime.UTC)
        month, started = f"{start:%Y-%m}", f"{start:%Y%m%dT%H%M%S}Z"
    except ValueError:
        month = started = "unknown"
    return (
        f"{RECORDINGS}/site={_element(site)}/robot={_element(robot)}/axis={axis}/month={month}/"
        f"{started}-{_digest(content)}.parquet"
    )


def _element(name: str) -> str:
    """Return a name as one path element, also where it is `..` or has a slash in it."""
    return quote(name, safe="").replace(".", "%2E") if set(name) <= {"."} else quote(name, safe="")


def _digest(content: bytes) -> str:
    return hashlib.sha256(content).hexdigest()[:_DIGITS]


def _protocols(store: Any) -> tuple[str, ...]:
    protocol = store.protocol
    return (protocol,) if isinstance(protocol, str) else tuple(protocol)
