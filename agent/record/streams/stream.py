"""The recorder: rows from the control tick into a stream that survives the agent's death.

After a kill every batch that was written can be read, and at most the last half second of the rows'
own time (there is no clock here) is gone. There are two ways to keep that promise:

* in real time (`background`) the tick packs a row and, ten times a second, hands what has come
  together to a thread that makes an Arrow batch of it and writes it. A disk that takes its time
  delays nothing; rows that wait for it for half a second are an error, told at the next row.
* otherwise (simulated time, imports) the rows are written where they come, every half second.

Nothing is fsynced while the joint moves, because one fsync can cost many ticks: against a power
cut the stream is only as old as the system's own write-back (some 30 s on Linux), unless
`sync_every_flush` is asked for. Header, abandoned stream and finished recording are fsynced.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from types import TracebackType
from typing import Any, Self

from agent.errors import StorageError
from agent.record.atomic import storage_error
from agent.record.metadata import KEY, Metadata
from agent.record.rows import Kind, PackedRows, RowBuffer
from agent.record.streams.background import BackgroundSaver
from agent.record.streams.finishing import final_metadata, publish_stream
from agent.record.streams.open_stream import OpenStream
from agent.record.streams.stream_file import SUFFIX

FLUSH_PERIOD_S = 0.5
"""No row waits for longer than this, or the writer says that it failed."""

HAND_OVER_PERIOD_S = 0.1
"""In the background; the rest of `FLUSH_PERIOD_S` is the disk's."""


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
    background : bool
        Whether a thread writes; rows must then come in real time.

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
        background: bool = False,
    ) -> None:
        if not name or name != Path(name).name:
            raise ValueError(f"expected a file name without folder or suffix, got {name!r}")
        self.path = Path(folder) / f"{name}{SUFFIX}"
        self.recording_path = Path(folder) / f"{name}.parquet"
        self._metadata = metadata
        self._rows = RowBuffer(columns, kinds or {})
        self._time_at = list(columns).index("time_s")
        # The first row is flushed at once: a disk that takes nothing is known on the first tick.
        self._flush_at_s = -math.inf
        self._period_s = HAND_OVER_PERIOD_S if background else FLUSH_PERIOD_S
        self._first_s = math.nan  # time of the first row since the last flush
        self._samples_taken = 0
        self._samples_saved = 0
        self._failed = False
        self._hurried = background
        if self.recording_path.exists():
            raise StorageError(
                f"{self.recording_path} exists already and is not overwritten.",
                "Choose another name.",
            )
        header = self._rows.schema.with_metadata({KEY: metadata.dumps()}).serialize()
        self._file = OpenStream(self.path, header, sync=sync_every_flush)
        self._saver = BackgroundSaver(self._save, f"recorder {name}") if background else None

    @property
    def samples(self) -> int:
        """Return how many rows are saved or wait for the next flush."""
        return self._samples_saved if self._failed else self._samples_taken

    @property
    def samples_unsaved(self) -> int:
        """Return how many rows came that no disk took."""
        return self._samples_taken - self._samples_saved if self._failed else 0

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
        if self._file.closed:
            raise ValueError(f"{self.path}: the writer is closed")
        if self._failed:
            self._samples_taken += 1
            return
        self._rows.append(row)
        self._samples_taken += 1
        time_s = row[self._time_at]
        if len(self._rows) == 1:
            self._first_s = time_s
        if self._saver is not None:
            self._look_after(self._saver, time_s)
        if self._flush_at_s <= time_s < math.inf:
            self._flush_at_s = time_s + self._period_s
            self.flush()
        elif self._rows.full:
            self.flush()

    def wait_for_disk(self) -> None:
        """From now on let the disk take its time: no control tick is waiting, as after a stop.

        What came while a joint was stopped comes at once, and its times say nothing of the disk.
        """
        self._hurried = False

    def flush(self) -> None:
        """Have the rows that have come together written, as one batch.

        Raises
        ------
        StorageError
            As `append`.
        """
        if not len(self._rows) or self._failed:
            return
        packed = self._rows.packed(self._first_s)
        if self._saver is not None:
            self._rows.clear()
            self._saver.hand(packed)
            return
        try:
            self._file.put(self._rows.batch(packed).serialize(), self._rows.clear)
        except OSError as error:
            raise self._failure(error) from error
        self._samples_saved += packed.rows

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
        if self._file.closed:
            raise ValueError(f"{self.path}: the writer is closed")
        try:  # the lock is held to the end, or a `recover` next door could be faster
            self._flush_all()
            metadata = final_metadata(
                self._metadata, samples_lost, self.samples_unsaved, extra_metadata or {}
            )
            self._file.end()
            publish_stream(self.path, self.recording_path, metadata, self._samples_saved)
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
        if self._file.closed:
            return
        try:
            self._flush_all()
        finally:
            self._file.end()
            self._close()
            if self._file.empty:
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

    def _save(self, packed: PackedRows) -> None:
        """Write packed rows; the background thread's work."""
        self._file.put(self._rows.batch(packed).serialize())
        self._samples_saved += packed.rows

    def _look_after(self, saver: BackgroundSaver, now_s: float) -> None:
        """Raise what has gone wrong in the background, or is about to: rows that wait too long."""
        if saver.failure is not None:
            raise self._failure(saver.failure) from saver.failure
        if not self._hurried:
            return
        oldest_s = saver.oldest_s
        waits_s = now_s - oldest_s if oldest_s is not None else 0.0
        if waits_s > FLUSH_PERIOD_S - HAND_OVER_PERIOD_S or saver.full:
            self._failed = True
            self._rows.clear()
            raise StorageError(
                f"{self.path} is not written as fast as samples come: {self._samples_saved} of "
                f"{self._samples_taken} are saved, the oldest of the others waits for "
                f"{waits_s:.2f} s.",
                "Look for what keeps the disk busy, or record to another one.",
            )

    def _failure(self, error: BaseException) -> StorageError:
        """Give up writing; return the error to raise."""
        self._failed = True
        self._rows.clear()
        saved = f"{self._samples_saved} samples are saved in it"
        if isinstance(error, OSError):
            return storage_error(error, f"{self.path} cannot be written any further, {saved}")
        return StorageError(
            f"{self.path} is not written any further, {saved}: its thread has ended ({error!r})."
        )

    def _flush_all(self) -> None:
        """Have every row written and wait for it.

        Raises
        ------
        StorageError
            When that fails, and nobody was told of a failure before.
        """
        self.flush()
        if self._saver is None:
            return
        self._saver.finish()
        if self._saver.failure is not None and not self._failed:
            raise self._failure(self._saver.failure) from self._saver.failure

    def _close(self) -> None:
        """End the thread and let go of the file and its lock."""
        if self._saver is not None:
            self._saver.finish()
        self._file.close()
