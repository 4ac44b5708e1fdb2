"""What the page remembers in SQLite: users, invitations, chosen baselines.

Three small tables that nobody but the page asks: the standard library's driver does, and the page's
process stays 13 MB smaller than with the catalogue's SQLAlchemy (docs/decisions/0021).
"""

from __future__ import annotations

import contextlib
import sqlite3
import threading
from collections.abc import Iterator
from pathlib import Path

from agent.errors import StorageError
from agent.record.atomic import make_folder, storage_error

NAME = "page.sqlite"
_BUSY_S = 5.0

_TABLES = """
CREATE TABLE IF NOT EXISTS users (
    name VARCHAR(64) NOT NULL PRIMARY KEY,
    role INTEGER NOT NULL,
    password VARCHAR(512) NOT NULL,
    disabled BOOLEAN NOT NULL DEFAULT 0,
    since VARCHAR(40) NOT NULL
);
-- of a token its SHA-256 alone; an empty name: whoever comes first chooses one
CREATE TABLE IF NOT EXISTS invitations (
    token VARCHAR(64) NOT NULL PRIMARY KEY,
    name VARCHAR(64) NOT NULL,
    role INTEGER NOT NULL,
    expires VARCHAR(40) NOT NULL
);
CREATE TABLE IF NOT EXISTS baselines (
    axis INTEGER NOT NULL PRIMARY KEY,
    recording VARCHAR(200) NOT NULL,
    who VARCHAR(64) NOT NULL,
    at VARCHAR(40) NOT NULL
);
"""


class Store:
    """The page's database. Many threads may use it, one at a time.

    Parameters
    ----------
    state : pathlib.Path
        Its folder; made where it is missing. Only its user may read folder and file.

    Raises
    ------
    agent.errors.StorageError
        The folder or the file cannot be used.
    """

    def __init__(self, state: Path) -> None:
        self._path = state / NAME
        self._lock = threading.Lock()
        try:
            make_folder(state, mode=0o700)
            self._path.touch(mode=0o600)
            self._connection = sqlite3.connect(
                self._path, timeout=_BUSY_S, isolation_level=None, check_same_thread=False
            )
        except (OSError, sqlite3.Error) as error:
            raise self._unusable(error) from error
        self._connection.row_factory = sqlite3.Row
        try:
            # readers do not wait for writers, and a writer's word survives a power cut
            self._connection.execute("PRAGMA journal_mode=WAL")
            self._connection.execute("PRAGMA synchronous=FULL")
            self._connection.executescript(_TABLES)
        except sqlite3.Error as error:
            self._connection.close()
            raise self._unusable(error) from error

    @contextlib.contextmanager
    def reading(self) -> Iterator[sqlite3.Connection]:
        """Yield the connection; each statement sees what was last written.

        Raises
        ------
        agent.errors.StorageError
            The file cannot be read.
        """
        with self._lock:
            try:
                yield self._connection
            except sqlite3.Error as error:
                raise self._unusable(error) from error

    @contextlib.contextmanager
    def writing(self) -> Iterator[sqlite3.Connection]:
        """Yield the connection in a transaction of its own: all of it, or after an error nothing.

        Raises
        ------
        agent.errors.StorageError
            The file cannot be written, or others have held it for seconds.
        """
        with self.reading() as connection:
            connection.execute("BEGIN IMMEDIATE")
            try:
                yield connection
            except BaseException:
                connection.execute("ROLLBACK")
                raise
            connection.execute("COMMIT")

    def close(self) -> None:
        """Close the file; may be repeated."""
        with self._lock:
            self._connection.close()

    def _unusable(self, error: Exception) -> StorageError:
        if isinstance(error, OSError):
            return storage_error(error, f"The page's database {self._path} cannot be made")
        return StorageError(f"The page's database {self._path} cannot be used: {error}.")
