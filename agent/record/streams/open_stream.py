"""The file of a stream that is being written: made and locked, grown by whole batches, ended."""

from __future__ import annotations

import contextlib
import os
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

from agent.errors import StorageError
from agent.record.atomic import storage_error, sync, sync_folder, write_all
from agent.record.lock import try_lock
from agent.record.streams.stream_file import END_OF_STREAM

if TYPE_CHECKING:
    import pyarrow as pa


class OpenStream:
    """A new Arrow stream file, locked against `recover` for as long as it is open.

    Parameters
    ----------
    path : Path
        Must not exist.
    header : Buffer
        The stream's schema message; it is fsynced.
    sync : bool
        Whether every batch waits until the disk has it.

    Raises
    ------
    StorageError
        When the name is taken or the file cannot be begun; nothing is left of it then.
    """

    def __init__(self, path: Path, header: pa.Buffer, *, sync: bool) -> None:
        self.path = path
        self._sync = sync
        self._header_bytes = self._good_bytes = len(header)
        self._descriptor: int | None = self._begin(header)

    @property
    def closed(self) -> bool:
        """Return whether the file was let go."""
        return self._descriptor is None

    @property
    def empty(self) -> bool:
        """Return whether nothing but the header was written."""
        return self._good_bytes == self._header_bytes

    def put(self, content: pa.Buffer, done: Callable[[], None] = lambda: None) -> None:
        """Write one whole message and call `done`, or leave the file as it was.

        That holds for an interrupt, too: after Ctrl-C what was to be written can be written again.

        Raises
        ------
        OSError
            When the disk fails.
        ValueError
            When the file is closed.
        """
        if self._descriptor is None:
            raise ValueError(f"{self.path}: the writer is closed")
        try:
            write_all(self._descriptor, content)
            if self._sync:
                sync(self._descriptor)
            done()
            self._good_bytes += len(content)
        except BaseException:
            with contextlib.suppress(OSError):  # what cannot be cut now is cut by the reader
                os.ftruncate(self._descriptor, self._good_bytes)
            raise

    def end(self) -> None:
        """Mark the stream as ended and wait for the disk, as far as the disk allows."""
        if self._descriptor is None:
            return
        with contextlib.suppress(OSError):  # without the mark it reads as killed, no worse
            if os.fstat(self._descriptor).st_size == self._good_bytes:  # else: passes for a batch
                write_all(self._descriptor, END_OF_STREAM)
            sync(self._descriptor)

    def close(self) -> None:
        """Let go of the file and its lock; may be repeated."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)

    def _begin(self, header: pa.Buffer) -> int:
        """Make the file, lock it, write its header; return the descriptor."""
        flags = os.O_RDWR | os.O_APPEND | os.O_CREAT | os.O_EXCL | getattr(os, "O_BINARY", 0)
        try:
            descriptor = os.open(self.path, flags, 0o666)
        except FileExistsError as error:
            raise StorageError(
                f"{self.path} is the unfinished stream of another run.",
                "Finish it with `stribeck recover`, or choose another name.",
            ) from error
        except OSError as error:
            raise storage_error(error, f"{self.path} cannot be made") from error
        try:
            if not try_lock(descriptor):
                raise StorageError(f"{self.path} is locked by another process.", "Try again.")
            write_all(descriptor, header)
            sync(descriptor)
            sync_folder(self.path.parent)
        except BaseException as error:
            os.close(descriptor)
            with contextlib.suppress(OSError):  # the error that is raised says more
                self.path.unlink(missing_ok=True)
            if isinstance(error, OSError):
                raise storage_error(error, f"{self.path} cannot be written") from error
            raise
        return descriptor
