"""What the page remembers in SQLite: users, invitations, chosen baselines."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import (
    Boolean,
    Column,
    Engine,
    Integer,
    MetaData,
    String,
    Table,
    create_engine,
    event,
)
from sqlalchemy.engine.interfaces import DBAPIConnection
from sqlalchemy.exc import SQLAlchemyError

from agent.errors import StorageError

NAME = "page.sqlite"

metadata = MetaData()
users = Table(
    "users",
    metadata,
    Column("name", String(64), primary_key=True),
    Column("role", Integer, nullable=False),
    Column("password", String(512), nullable=False),
    Column("disabled", Boolean, nullable=False, default=False),
    Column("since", String(40), nullable=False),
)
invitations = Table(
    "invitations",
    metadata,
    Column("token", String(64), primary_key=True),  # its SHA-256, never the token itself
    Column("name", String(64), nullable=False),  # empty: whoever comes first chooses one
    Column("role", Integer, nullable=False),
    Column("expires", String(40), nullable=False),
)
baselines = Table(
    "baselines",
    metadata,
    Column("axis", Integer, primary_key=True),
    Column("recording", String(200), nullable=False),
    Column("who", String(64), nullable=False),
    Column("at", String(40), nullable=False),
)


def open_store(state: Path) -> Engine:
    """Open, or make, the page's database; only its user may read it.

    Raises
    ------
    agent.errors.StorageError
        The folder or the file cannot be used.
    """
    path = state / NAME
    try:
        state.mkdir(parents=True, exist_ok=True, mode=0o700)
        path.touch(mode=0o600)
        engine = create_engine(f"sqlite:///{path}")
        event.listen(engine, "connect", _set_up)
        metadata.create_all(engine)
    except (OSError, SQLAlchemyError) as error:
        raise StorageError(f"The page's database {path} cannot be used: {error}.") from error
    return engine


def _set_up(connection: DBAPIConnection, _record: object) -> None:
    """Readers do not wait for writers; a writer waits for another; keys are held."""
    cursor = connection.cursor()
    for pragma in ("journal_mode=WAL", "busy_timeout=5000", "foreign_keys=ON", "synchronous=FULL"):
        cursor.execute(f"PRAGMA {pragma}")
    cursor.close()
