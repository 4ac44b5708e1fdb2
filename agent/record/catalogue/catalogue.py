"""The catalogue: what recordings, estimates, verdicts and events a folder holds, to be asked.

Files are the truth: every row comes from a file or one line of it, and `rebuild` makes the same
catalogue again from the folder. SQLite in the folder itself, or PostgreSQL by URL for many cells.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from types import TracebackType
from typing import Any, Self, TypeVar

import sqlalchemy as sa

from agent.record.atomic import make_folder
from agent.record.catalogue import schema
from agent.record.catalogue.files import beside, everything
from agent.record.catalogue.rows import EstimateRow, EventRow, RecordingRow, VerdictRow
from agent.record.catalogue.tables import ESTIMATES, EVENTS, RECORDINGS, VERDICTS
from agent.record.events_file import NAME as EVENTS_FILE
from agent.record.events_file import Event, append_event, read_events
from agent.record.events_toml import NAME as WRITTEN_FILE
from agent.record.events_toml import read_written

__all__ = ["Catalogue", "EstimateRow", "EventRow", "Rebuilt", "RecordingRow", "VerdictRow"]

Row = TypeVar("Row", RecordingRow, EstimateRow, VerdictRow)


@dataclass(frozen=True)
class Rebuilt:
    """What a folder holds, and a sentence for every file that could not be taken."""

    recordings: int
    estimates: int
    verdicts: int
    events: int
    problems: tuple[str, ...] = ()


class Catalogue:
    """The catalogue of one folder of recordings. A context manager; may be used by many threads.

    Parameters
    ----------
    folder : pathlib.Path
        Of the recordings; made where it is missing.
    url : str, optional
        Where the catalogue is: `agent.record.catalogue.schema.catalogue_url`.

    Raises
    ------
    agent.errors.InputError
        No catalogue, or one of a newer version. An older one is brought to this version.
    agent.errors.StorageError
        It cannot be reached or written.
    """

    def __init__(self, folder: Path, url: str | None = None) -> None:
        make_folder(folder)
        self.folder = folder
        self.url = schema.catalogue_url(folder, url)
        # a catalogue inside its folder moves with it; elsewhere the folder's name is the key
        own = schema.is_sqlite(self.url) and not url
        self._key = "" if own else folder.resolve().as_posix()
        self._engine = schema.open_engine(self.url)
        try:
            with schema.told(self.url):
                self.upgraded = schema.upgrade(self._engine)
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Close every connection; may be repeated."""
        self._engine.dispose()

    def __enter__(self) -> Self:
        """Return the catalogue."""
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        """Close it."""
        self.close()

    # -- taking files ------------------------------------------------------------------------

    def add(self, recording: Path) -> RecordingRow:
        """Take a recording with its estimate and its verdict, where it has them.

        Raises
        ------
        agent.errors.InputError
            It is no recording, or not in this folder; an estimate or verdict cannot be read.
        """
        found = beside(recording, self.folder)
        with schema.told(self.url), schema.writing(self._engine) as connection:
            self._put(connection, RECORDINGS, [asdict(r) for r in found.recordings])
            self._put(connection, ESTIMATES, [asdict(e) for e in found.estimates])
            self._put(connection, VERDICTS, [asdict(v) for v in found.verdicts])
        return found.recordings[0]

    def record_event(self, event: Event) -> EventRow:
        """Append an event to the folder's file, then to the catalogue; the file comes first."""
        row = EventRow(EVENTS_FILE, append_event(self.folder, event), event)
        self._catch_up()
        return row

    def remove(self, path: str) -> None:
        """Forget a recording whose file is gone; its estimate and verdict stay."""
        gone = sa.delete(RECORDINGS).where(
            RECORDINGS.c.folder == self._key, RECORDINGS.c.path == path
        )
        with schema.told(self.url), schema.writing(self._engine) as connection:
            connection.execute(gone)

    def rebuild(self) -> Rebuilt:
        """Make the catalogue of this folder again from its files, in one transaction."""
        found = everything(self.folder)
        events, torn = read_events(self.folder)
        written, wrong = read_written(self.folder)
        lines = [
            *(EventRow(EVENTS_FILE, number, event).columns() for number, event in events),
            *(EventRow(WRITTEN_FILE, number, event).columns() for number, event in written),
        ]
        contents: Sequence[tuple[sa.Table, list[dict[str, Any]]]] = (
            (RECORDINGS, [asdict(r) for r in found.recordings]),
            (ESTIMATES, [asdict(e) for e in found.estimates]),
            (VERDICTS, [asdict(v) for v in found.verdicts]),
            (EVENTS, lines),
        )
        with schema.told(self.url), schema.writing(self._engine) as connection:
            for table, rows in contents:
                connection.execute(sa.delete(table).where(table.c.folder == self._key))
                self._insert(connection, table, rows)
        return Rebuilt(
            len(found.recordings),
            len(found.estimates),
            len(found.verdicts),
            len(lines),
            (*found.problems, *torn, *wrong),
        )

    # -- asking ------------------------------------------------------------------------------

    def recordings(
        self,
        *,
        robot: str | None = None,
        axis: int | None = None,
        since: str = "",
        newest: int | None = None,
    ) -> tuple[RecordingRow, ...]:
        """Return recordings in order of their start, oldest first.

        Parameters
        ----------
        robot, axis : optional
            Of this joint only.
        since : str
            Started at this time (ISO 8601, UTC) or later.
        newest : int, optional
            No more than so many, the newest.
        """
        return self._rows(RecordingRow, RECORDINGS, robot, axis, since, newest)

    def estimates(
        self,
        *,
        robot: str | None = None,
        axis: int | None = None,
        since: str = "",
        newest: int | None = None,
    ) -> tuple[EstimateRow, ...]:
        """Return estimates in order of their recordings' start; see `recordings`."""
        return self._rows(EstimateRow, ESTIMATES, robot, axis, since, newest)

    def verdicts(
        self,
        *,
        robot: str | None = None,
        axis: int | None = None,
        since: str = "",
        newest: int | None = None,
    ) -> tuple[VerdictRow, ...]:
        """Return verdicts in order of their recordings' start; see `recordings`."""
        return self._rows(VerdictRow, VERDICTS, robot, axis, since, newest)

    def recording(self, sha256: str) -> RecordingRow | None:
        """Return the recording with this content hash, or None; of several copies the first."""
        query = (
            sa.select(RECORDINGS)
            .where(RECORDINGS.c.folder == self._key, RECORDINGS.c.sha256 == sha256)
            .order_by(RECORDINGS.c.path)
            .limit(1)
        )
        rows = self._ask(query)
        return _as(RecordingRow, rows[0]) if rows else None

    def events(
        self,
        *,
        robot: str | None = None,
        axis: int | None = None,
        kinds: Iterable[str] = (),
        since: str = "",
        newest: int | None = None,
    ) -> tuple[EventRow, ...]:
        """Return events, oldest first; those of the whole robot count as every axis's.

        Those of no robot count as every robot's. What others have added to the folder's two files
        meanwhile is taken in first.
        """
        self._catch_up()
        query = sa.select(EVENTS).where(EVENTS.c.folder == self._key, EVENTS.c.at >= since)
        if robot is not None:
            query = query.where(EVENTS.c.robot.in_((robot, "")))
        if axis is not None:
            query = query.where(sa.or_(EVENTS.c.axis == axis, EVENTS.c.axis.is_(None)))
        if wanted := tuple(kinds):
            query = query.where(EVENTS.c.kind.in_(wanted))
        order = (EVENTS.c.at.desc(), EVENTS.c.path.desc(), EVENTS.c.line.desc())
        rows = self._ask(query.order_by(*order).limit(newest))
        return tuple(EventRow.from_columns(row) for row in reversed(rows))

    def _catch_up(self) -> None:
        """Take in the events that the folder's files have and the catalogue has not."""
        events = sa.select(EVENTS).where(EVENTS.c.folder == self._key)
        last = events.with_only_columns(sa.func.max(EVENTS.c.line)).where(
            EVENTS.c.path == EVENTS_FILE
        )
        of_toml = EVENTS.c.path == WRITTEN_FILE
        rows = [EventRow(EVENTS_FILE, n, e).columns() for n, e in read_events(self.folder)[0]]
        newest = rows[-1]["line"] if rows else 0
        written = [EventRow(WRITTEN_FILE, n, e).columns() for n, e in read_written(self.folder)[0]]

        def missing(connection: sa.Connection) -> tuple[list[dict[str, Any]], bool]:
            known = connection.execute(last).scalar() or 0
            query = events.where(of_toml).order_by(EVENTS.c.line)
            kept = [dict(row) for row in connection.execute(query).mappings()]
            same = [{"folder": self._key, **row} for row in written] == kept
            return [row for row in rows if row["line"] > known] if known < newest else [], same

        with schema.told(self.url):
            with self._engine.connect() as connection:
                if missing(connection) == ([], True):
                    return
            with schema.writing(self._engine) as connection:
                fresh, same = missing(connection)
                self._insert(connection, EVENTS, fresh)
                if not same:
                    connection.execute(
                        sa.delete(EVENTS).where(EVENTS.c.folder == self._key, of_toml)
                    )
                    self._insert(connection, EVENTS, written)

    # -- the database ------------------------------------------------------------------------

    def _put(
        self, connection: sa.Connection, table: sa.Table, rows: Sequence[dict[str, Any]]
    ) -> None:
        """Write rows, in the place of those with the same key."""
        keys = [column.name for column in table.primary_key]
        for row in rows:
            keyed = {"folder": self._key, **row}
            same = [table.c[name] == keyed[name] for name in keys]
            connection.execute(sa.delete(table).where(*same))
        self._insert(connection, table, rows)

    def _insert(
        self, connection: sa.Connection, table: sa.Table, rows: Sequence[dict[str, Any]]
    ) -> None:
        if rows:
            keyed = [{"folder": self._key, **row} for row in rows]
            connection.execute(sa.insert(table), keyed)

    def _rows(
        self,
        kind: type[Row],
        table: sa.Table,
        robot: str | None,
        axis: int | None,
        since: str,
        newest: int | None,
    ) -> tuple[Row, ...]:
        query = sa.select(table).where(table.c.folder == self._key, table.c.started_at >= since)
        if robot is not None:
            query = query.where(table.c.robot == robot)
        if axis is not None:
            query = query.where(table.c.axis == axis)
        query = query.order_by(table.c.started_at.desc(), table.c.path.desc()).limit(newest)
        return tuple(_as(kind, row) for row in reversed(self._ask(query)))

    def _ask(self, query: sa.Select[Any]) -> list[dict[str, Any]]:
        with schema.told(self.url), self._engine.connect() as connection:
            return [dict(row) for row in connection.execute(query).mappings()]


def _as(kind: type[Row], row: dict[str, Any]) -> Row:
    return kind(**{field.name: row[field.name] for field in fields(kind)})
