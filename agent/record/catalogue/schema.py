"""Where a catalogue is, how it is opened, and how an older one becomes one of this version."""

from __future__ import annotations

import contextlib
import os
import sqlite3
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import sqlalchemy as sa

from agent.errors import AgentError, InputError, StorageError
from agent.record.catalogue.tables import HEAD
from drivers.clock import MonotonicClock

VARIABLE = "STRIBECK_CATALOGUE"
FILE = "catalogue.sqlite"
_PATIENCE_S = 20.0
_AGAIN_S = 0.02
_WRITES = {"stribeck_writes": True}
_LOCK_NUMBER = 0x57121BEC  # of PostgreSQL's advisory lock: SQLite has one writer by itself


def catalogue_url(folder: Path, given: str | None = None) -> sa.URL:
    """Return where the catalogue of a folder is.

    Parameters
    ----------
    folder : pathlib.Path
        Of the recordings.
    given : str, optional
        A URL; else the environment's ``STRIBECK_CATALOGUE``, else SQLite in the folder itself.

    Raises
    ------
    agent.errors.InputError
        No URL of SQLite or PostgreSQL.
    """
    text = given or os.environ.get(VARIABLE) or ""
    if not text:
        return sa.URL.create("sqlite", database=str(folder.resolve() / FILE))
    try:
        url = sa.make_url(text)
    except (sa.exc.ArgumentError, ValueError) as error:
        raise InputError(
            "The catalogue's URL cannot be read.",
            "Expected sqlite:///FILE or postgresql://USER@HOST/DATABASE.",
        ) from error
    kind = url.get_backend_name()
    if kind not in ("sqlite", "postgresql"):
        raise InputError(f"A catalogue is in SQLite or PostgreSQL, not in {kind}.")
    return url.set(drivername="postgresql+psycopg") if kind == "postgresql" else url


def shown(url: sa.URL) -> str:
    """Return a URL for people: without its password."""
    return url.database or "" if is_sqlite(url) else url.render_as_string(hide_password=True)


def is_sqlite(url: sa.URL) -> bool:
    """Tell whether the catalogue is a file of SQLite."""
    return url.get_backend_name() == "sqlite"


def is_there(url: sa.URL) -> bool:
    """Tell whether there is something to open; a server is asked when it is."""
    return not is_sqlite(url) or url.database is None or Path(url.database).exists()


def open_engine(url: sa.URL) -> sa.Engine:
    """Return an engine whose transactions are what SQLite (in WAL) and PostgreSQL both mean.

    Raises
    ------
    agent.errors.InputError
        PostgreSQL's driver is not installed.
    """
    try:
        if is_sqlite(url):
            engine = sa.create_engine(url, connect_args={"timeout": _PATIENCE_S})
            sa.event.listen(engine, "connect", _on_connect)
            sa.event.listen(engine, "begin", _on_begin)
            return engine
        return sa.create_engine(
            url, pool_pre_ping=True, connect_args={"connect_timeout": int(_PATIENCE_S)}
        )
    except ImportError as error:
        raise InputError(
            "PostgreSQL's driver is not installed.", "Install stribeck[postgres]."
        ) from error


def _on_connect(connection: Any, _record: object) -> None:
    connection.isolation_level = None  # transactions are begun by `_on_begin`, not guessed
    _write_ahead(connection)
    for pragma in ("synchronous = NORMAL", "foreign_keys = ON"):
        connection.execute(f"PRAGMA {pragma}").close()


def _write_ahead(connection: Any) -> None:
    """Have a new file write ahead; SQLite itself does not wait for others who ask the same."""
    clock = MonotonicClock()
    until_s = clock.now() + _PATIENCE_S
    while True:
        try:
            connection.execute("PRAGMA journal_mode = WAL").close()
        except sqlite3.OperationalError:
            if clock.now() > until_s:
                raise
            clock.sleep_until(clock.now() + _AGAIN_S)
        else:
            return


def _on_begin(connection: sa.Connection) -> None:
    writes = connection.get_execution_options().get("stribeck_writes", False)
    # IMMEDIATE: a writer waits for the one before it here, and cannot fail half-way
    connection.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


@contextlib.contextmanager
def told(url: sa.URL) -> Iterator[None]:
    """Say in a sentence what a database says in its own words.

    Raises
    ------
    agent.errors.InputError
        It is not there, or is no catalogue.
    agent.errors.StorageError
        It cannot be written.
    """
    try:
        yield
    except AgentError:
        raise
    except sa.exc.OperationalError as error:
        raise StorageError(
            f"The catalogue {shown(url)} cannot be used: {_reason(error)}.",
            "The recordings are not affected; `stribeck catalogue rebuild` makes it again.",
        ) from error
    except sa.exc.SQLAlchemyError as error:
        raise InputError(
            f"{shown(url)} is no catalogue: {_reason(error)}.",
            "Remove it and let `stribeck catalogue rebuild` make it again.",
        ) from error


def _reason(error: sa.exc.SQLAlchemyError) -> str:
    original = getattr(error, "orig", None) or error
    return " ".join(str(original).split())[:160].rstrip(".")


@contextlib.contextmanager
def writing(engine: sa.Engine) -> Iterator[sa.Connection]:
    """Yield a connection in one transaction that writes; one at a time, on both databases."""
    with engine.connect().execution_options(**_WRITES) as connection, connection.begin():
        if engine.dialect.name == "postgresql":
            connection.execute(sa.select(sa.func.pg_advisory_xact_lock(_LOCK_NUMBER)))
        yield connection


def version_of(connection: sa.Connection) -> str | None:
    """Return the migration that a database is at; None where it holds no catalogue yet."""
    if not sa.inspect(connection).has_table("alembic_version"):
        return None
    found: str | None = connection.execute(
        sa.text("SELECT version_num FROM alembic_version")
    ).scalar()
    return found


def upgrade(engine: sa.Engine) -> tuple[str | None, str]:
    """Bring a database to this version's tables; return the version before and now.

    Raises
    ------
    agent.errors.InputError
        It is of a newer version of this product.
    """
    with engine.connect() as connection:
        before = version_of(connection)
    if before == HEAD:
        return before, HEAD
    with writing(engine) as connection:
        before = version_of(connection)  # another process may have done it meanwhile
        _migrate(connection, before)
    return before, HEAD


def _migrate(connection: sa.Connection, before: str | None) -> None:
    from alembic import command  # 0.2 s that a catalogue of this version need not wait for
    from alembic.config import Config
    from alembic.script import ScriptDirectory

    config = Config()
    config.set_main_option("script_location", "agent.record.catalogue:migrations")
    config.set_main_option("path_separator", "os")
    config.attributes["connection"] = connection
    known = {s.revision for s in ScriptDirectory.from_config(config).walk_revisions()}
    if before is not None and before not in known:
        raise InputError(
            f"The catalogue is of a newer version ({before}; this one knows {HEAD}).",
            "Use that version, or let this one make its own with --catalogue.",
        )
    command.upgrade(config, "head")
