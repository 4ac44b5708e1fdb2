"""The recorder: rows from the control tick into a stream that survives the agent's death.

Every half second of the rows' own time (there is no clock here) the rows become one Arrow batch
and go to the operating system in one write. After a kill every batch that was written can be
read, and at most the last half second is gone.

Nothing is fsynced while the joint moves, because one fsync can cost many ticks: against a power
cut the stream is only as old as the system's own write-back (some 30 s on Linux), unless
`sync_every_flush` is asked for. Header, abandoned stream and finished recording are fsynced.
"""

from __future__ import annotations

import contextlib
import math
import os
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from agent.errors import StorageError
from agent.record.atomic import storage_error, sync_folder, write_all
from agent.record.lock import try_lock
from agent.record.metadata import KEY, Metadata
from agent.record.rows import Kind, RowBuffer
from agent.record.stream_file import END_OF_STREAM, SUFFIX, read_stream
from agent.record.writing import write_table

if TYPE_CHECKING:
    import pyarrow as pa

FLUSH_PERIOD_S = 0.5


class StreamWriter:
    """Writes one run's rows to ``NAME.arrows`` and finishes them to ``NAME.parquet``.

    Not thread-safe: called from the control tick alone. As a context manager it abandons the
    stream, flushed and closed, unless it was finished.

    Parameters
    ----------
    folder : Path
        Where the recording shall stand; it must exist.
    name : str
        The file's name without suffix.
    metadata : Metadata
        Written with the header, so that whoever finds the stream can finish it.
    columns : sequence of str
        Names in the order of a row's values, `time_s` and `torque_nm` among them.
    kinds : mapping of str to str, optional
        "float" (default), "integer", "boolean" or "text" (default for `phase`).
    sync_every_flush : bool
        Whether every flush waits until the disk has it.

    Raises
    ------
    StorageError
        When the name is taken or the stream cannot be begun.
    ValueError
        When names or kinds cannot make a recording.
    """

    def __init__(
        self,
        folder: str | Path,
        name: str,
        metadata: Metadata,
        columns: Sequence[str],
        *,
        kinds: Mapping[str, Kind] | None = None,
        sync_every_flush: bool = False,
    ) -> None:
        if not name or name != Path(name).name:
            raise ValueError(f"expected a file name without folder or suffix, got {name!r}")
        self.path = Path(folder) / f"{name}{SUFFIX}"
        self.recording_path = Path(folder) / f"{name}.parquet"
        self._metadata = metadata
        self._rows = RowBuffer(columns, kinds or {})
        self._time_at = list(columns).index("time_s")
        self._sync_every_flush = sync_every_flush
        # The first row is flushed at once: a disk that takes nothing is known on the first tick.
        self._flush_at_s = -math.inf
        self._samples_saved = 0
        self._samples_unsaved = 0
        self._failed = False
        self._header_bytes = 0
        self._good_bytes = 0
        self._descriptor: int | None = self._begin()

    @property
    def samples(self) -> int:
        """Return how many rows are saved or wait for the next flush."""
        return self._samples_saved + len(self._rows)

    @property
    def samples_unsaved(self) -> int:
        """Return how many rows came that no disk took."""
        return self._samples_unsaved

    def append(self, row: Sequence[Any]) -> None:
        """Take one row; once in half a second of `time_s`, write what has come together.

        Raises
        ------
        StorageError
            Once, when the disk fails, saying what was saved. Rows that come after it (of the
            joint being stopped) are counted as unsaved and raise nothing.
        ValueError
            When the row does not fit the columns, or the writer is closed.
        """
        if self._failed or self._descriptor is None:
            self._refuse()
            return
        self._rows.append(row)
        time_s = row[self._time_at]
        if self._flush_at_s <= time_s < math.inf:
            self._flush_at_s = time_s + FLUSH_PERIOD_S
            self.flush()
        elif self._rows.full:
            self.flush()

    def flush(self) -> None:
        """Hand the rows that have come together to the operating system, as one batch.

        Raises
        ------
        StorageError
            As `append`.
        """
        count = len(self._rows)
        if not count or self._failed:
            return
        try:
            self._write(self._rows.batch().serialize())
        except OSError as error:
            self._failed = True
            self._rows.clear()
            self._samples_unsaved += count
            raise storage_error(
                error,
                f"{self.path} cannot be written any further, {self._samples_saved} samples are "
                "saved in it",
            ) from error
        self._samples_saved += count

    def finish(
        self,
        samples_lost: int | None = None,
        extra_metadata: Mapping[str, Any] | None = None,
    ) -> Path:
        """Turn the stream into the finished Parquet file, and return its path.

        Parameters
        ----------
        samples_lost : int or None
            Samples that are known not to have arrived; rows that no disk took are added.
        extra_metadata : mapping, optional
            Keys of the metadata, known or not, to be set at the end of the run.

        Raises
        ------
        StorageError
            When the disk fails; the stream is kept, and `recover` can finish it.
        ValueError
            When the metadata cannot be used (the stream is kept), or the writer is closed.
        """
        if self._descriptor is None:
            raise ValueError(f"{self.path}: the writer is closed")
        try:  # the lock is held to the end, or a `recover` next door could be faster
            metadata = self._final_metadata(samples_lost, dict(extra_metadata or {}))
            self.flush()
            self._end()
            self._publish(metadata)
        finally:
            self._close()
        self.path.unlink(missing_ok=True)
        return self.recording_path

    def abandon(self) -> None:
        """Keep the stream, flushed and closed, for `recover`; a stream without rows is removed.

        May be repeated, and does nothing after `finish`.

        Raises
        ------
        StorageError
            When the last rows cannot be written and the disk had not failed before.
        """
        if self._descriptor is None:
            return
        try:
            self.flush()
        finally:
            self._end()
            self._close()
            if self._good_bytes == self._header_bytes:
                self.path.unlink(missing_ok=True)

    def __enter__(self) -> Self:
        """Return the writer."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Abandon the stream unless it was finished."""
        self.abandon()

    def _begin(self) -> int:
        """Make the stream's file, lock it, write its header; return the descriptor."""
        if self.recording_path.exists():
            raise StorageError(
                f"{self.recording_path} exists already and is not overwritten.",
                "Choose another name.",
            )
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
            header = self._rows.schema.with_metadata({KEY: self._metadata.dumps()}).serialize()
            write_all(descriptor, header)
            os.fsync(descriptor)
            sync_folder(self.path.parent)
        except BaseException as error:
            os.close(descriptor)
            with contextlib.suppress(OSError):
                self.path.unlink(missing_ok=True)
            if isinstance(error, OSError):
                raise storage_error(error, f"{self.path} cannot be written") from error
            raise
        self._good_bytes = self._header_bytes = len(header)
        return descriptor

    def _write(self, content: pa.Buffer) -> None:
        """Write the rows as one whole message, or leave stream and rows as they were.

        That holds for an interrupt, too: after Ctrl-C the rows are still there to be flushed.
        """
        if self._descriptor is None:
            raise ValueError(f"{self.path}: the writer is closed")
        try:
            write_all(self._descriptor, content)
            if self._sync_every_flush:
                os.fsync(self._descriptor)
            self._rows.clear()
            self._good_bytes += len(content)
        except BaseException:
            with contextlib.suppress(OSError):  # what cannot be cut now is cut by the reader
                os.ftruncate(self._descriptor, self._good_bytes)
            raise

    def _refuse(self) -> None:
        """Count a row that cannot be taken; a closed writer takes none at all."""
        if self._descriptor is None:
            raise ValueError(f"{self.path}: the writer is closed")
        self._samples_unsaved += 1

    def _final_metadata(self, samples_lost: int | None, changes: dict[str, Any]) -> Metadata:
        """Return the metadata of the finished recording."""
        if samples_lost is not None or self._samples_unsaved:
            changes["samples_lost"] = (samples_lost or 0) + self._samples_unsaved
        metadata = self._metadata.updated(changes)
        if self._samples_unsaved:
            metadata = metadata.noted(
                f"The disk failed while recording: the last {self._samples_unsaved} samples could "
                "not be saved."
            )
        return metadata

    def _publish(self, metadata: Metadata) -> None:
        """Write the Parquet file from the stream, or say where the samples are kept."""
        table = read_stream(self.path).table.replace_schema_metadata({KEY: metadata.dumps()})
        try:
            if table.num_rows < self._samples_saved:
                raise StorageError(
                    f"{self.path}: the disk gives back {table.num_rows} of the "
                    f"{self._samples_saved} samples that it took."
                )
            write_table(table, self.recording_path)
        except StorageError as error:
            raise StorageError(
                f"{error.what} The {table.num_rows} samples are kept in {self.path}.",
                f"{error.do} Finish it later with `stribeck recover`.".strip(),
            ) from error

    def _end(self) -> None:
        """Mark the stream as ended and wait for the disk, as far as the disk allows."""
        if self._descriptor is None:
            return
        with contextlib.suppress(OSError):  # without the mark it reads as killed, no worse
            if os.fstat(self._descriptor).st_size == self._good_bytes:  # else: passes for a batch
                write_all(self._descriptor, END_OF_STREAM)
            os.fsync(self._descriptor)

    def _close(self) -> None:
        """Let go of the file and its lock."""
        descriptor, self._descriptor = self._descriptor, None
        if descriptor is not None:
            os.close(descriptor)
