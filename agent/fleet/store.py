"""Where a lake lies: one folder, or whatever else fsspec reaches; files whole or not at all."""

from __future__ import annotations

import os
import uuid
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from agent.errors import InputError, StorageError
from agent.record.atomic import sync, sync_folder

UNFINISHED = "unfinished"


class Store:
    """A folder, or an object store (``s3://bucket/prefix``); paths are below its root.

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
    StorageError
        From every method: the store does not answer, or does not take what is written.
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
        protocol = self._store.protocol
        return "file" in ((protocol,) if isinstance(protocol, str) else protocol)

    def put(self, path: str, content: bytes) -> None:
        """Write one file, whole or not at all; in a folder, a power cut does not take it back."""
        final = f"{self.root}/{path}"
        with self._told("written to"):
            if not self.is_folder:  # an object is there when all of it is
                self._store.pipe_file(final, content)
                return
            part = Path(f"{self.root}/{UNFINISHED}/{uuid.uuid4().hex}")
            part.parent.mkdir(parents=True, exist_ok=True)
            Path(final).parent.mkdir(parents=True, exist_ok=True)
            try:
                with part.open("wb") as file:
                    file.write(content)
                    file.flush()
                    sync(file.fileno())
                part.replace(final)
            finally:
                part.unlink(missing_ok=True)
            sync_folder(Path(final).parent)

    def get(self, path: str) -> bytes:
        """Return one file's content."""
        with self._told("read"):
            content: bytes = self._store.cat_file(f"{self.root}/{path}")
        return content

    def get_part(self, path: str, offset: int, size: int) -> bytes:
        """Return `size` bytes of a file, from `offset` on."""
        with self._told("read"):
            part: bytes = self._store.cat_file(
                f"{self.root}/{path}", start=offset, end=offset + size
            )
        return part

    @contextmanager
    def opened(self, path: str) -> Iterator[Any]:
        """Yield a file to read parts of, from wherever it lies."""
        with self._told("read"), self._store.open(f"{self.root}/{path}", "rb") as file:
            yield file

    def delete(self, paths: Iterable[str]) -> None:
        """Delete files; one that is gone already is no error."""
        full = [f"{self.root}/{p}" for p in paths]
        with self._told("written to"):
            if self.is_folder:
                for path in full:
                    Path(path).unlink(missing_ok=True)
            elif full:
                self._store.rm(full)

    def has(self, path: str, size_bytes: int) -> bool:
        """Tell whether a file of that size is there."""
        with self._told("read"):
            try:
                return bool(self._store.size(f"{self.root}/{path}") == size_bytes)
            except FileNotFoundError:
                return False

    def files(self, folder: str) -> tuple[str, ...]:
        """Return the paths of the files below one of its folders."""
        return tuple(sorted(path for path, _ in self.walk(folder)))

    def files_here(self) -> tuple[str, ...]:
        """Return the names of the files that lie in the root itself."""
        with self._told("read"):
            return tuple(path for path, size in self._children("") if size is not None)

    def walk(self, folder: str, depth: int = 0) -> Iterator[tuple[str, int]]:
        """Yield path and size of every file below a folder, in no order.

        Parameters
        ----------
        folder : str
        depth : int
            So many levels of an object store are listed one by one; what lies below each is then
            asked for at once, so that only one such answer is held at a time.
        """
        with self._told("read"):
            if self.is_folder:
                yield from self._scanned(folder)
            elif depth == 0:
                yield from self._found(folder)
            else:
                for path, size in self._children(folder):
                    if size is None:
                        yield from self.walk(path, depth - 1)
                    else:
                        yield path, size

    def _scanned(self, folder: str) -> Iterator[tuple[str, int]]:
        """Walk a folder of this machine: fsspec keeps a dictionary of every file's particulars."""
        waiting = [f"{self.root}/{folder}"]
        start = len(self.root) + 1
        while waiting:
            try:
                with os.scandir(waiting.pop()) as found:
                    for entry in found:
                        if entry.is_dir():
                            waiting.append(entry.path)
                        else:
                            yield entry.path[start:], entry.stat().st_size
            except FileNotFoundError:  # not there yet, or packed and deleted meanwhile
                continue

    def _found(self, folder: str) -> Iterator[tuple[str, int]]:
        self._store.invalidate_cache()
        try:
            found = self._store.find(f"{self.root}/{folder}", detail=True)
        except FileNotFoundError:
            return
        finally:
            self._store.invalidate_cache()  # or it keeps what it found
        for name, particulars in found.items():
            yield self._below(name), int(particulars["size"] or 0)

    def _children(self, folder: str) -> list[tuple[str, int | None]]:
        """Return what lies directly in a folder: path, and size of what is a file."""
        self._store.invalidate_cache()
        try:
            found = self._store.ls(f"{self.root}/{folder}".rstrip("/"), detail=True)
        except FileNotFoundError:
            return []
        return [
            (self._below(str(i["name"])), int(i["size"] or 0) if i["type"] == "file" else None)
            for i in found
        ]

    def _below(self, name: str) -> str:
        return name.strip("/")[len(self.root.strip("/")) + 1 :]

    @contextmanager
    def _told(self, what: str) -> Iterator[None]:
        try:
            yield
        except Exception as error:
            # what fsspec's stores raise, S3's included but for credentials that are not there
            if not isinstance(error, OSError) and not type(error).__module__.startswith("botocore"):
                raise
            raise StorageError(
                f"{self.url}: the lake cannot be {what} ({error}).",
                "Check the address, the rights and the connection, then start again; what is "
                "there already is not done twice.",
            ) from error
