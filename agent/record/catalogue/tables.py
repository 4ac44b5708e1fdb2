"""The catalogue's tables, as SQLAlchemy has them; `migrations` brings a database to this form.

Every row comes from one file (or one line of it), whose name is its key, so that a catalogue that
is made again from the folder is the same one. `folder` tells several cells in one database apart.
Paths are relative to the folder, with forward slashes; times are ISO 8601 in UTC, which sorts.
"""

from __future__ import annotations

from sqlalchemy import BigInteger, Boolean, Column, Float, Integer, MetaData, Table, Text

METADATA = MetaData()

RECORDINGS = Table(
    "recordings",
    METADATA,
    Column("folder", Text, primary_key=True),
    Column("path", Text, primary_key=True),
    Column("sha256", Text, nullable=False, index=True),
    Column("size_bytes", BigInteger, nullable=False),
    Column("robot", Text, nullable=False),
    Column("axis", Integer, nullable=False),
    Column("gear_ratio", Float(53), nullable=False),
    Column("started_at", Text, nullable=False, index=True),
    Column("duration_s", Float(53), nullable=False),
    Column("samples", Integer, nullable=False),
    Column("samples_lost", Integer),
    Column("trajectory", Text, nullable=False),
    Column("payload_kg", Float(53)),
    Column("gearbox_serial", Text, nullable=False),
    Column("gearbox_temperature_degc", Float(53)),
    Column("stopped_because", Text, nullable=False),
    Column("software", Text, nullable=False),
)

ESTIMATES = Table(
    "estimates",
    METADATA,
    Column("folder", Text, primary_key=True),
    Column("path", Text, primary_key=True),
    Column("recording_sha256", Text, nullable=False, index=True),
    Column("robot", Text, nullable=False),
    Column("axis", Integer, nullable=False),
    Column("started_at", Text, nullable=False),
    Column("decidable", Boolean, nullable=False),
    Column("sentence", Text, nullable=False),
    Column("coulomb_nm", Float(53)),
    Column("coulomb_low_nm", Float(53)),
    Column("coulomb_high_nm", Float(53)),
    Column("viscous_nm_s_per_rad", Float(53)),
    Column("viscous_low_nm_s_per_rad", Float(53)),
    Column("viscous_high_nm_s_per_rad", Float(53)),
    Column("rmse_nm", Float(53)),
)

VERDICTS = Table(
    "verdicts",
    METADATA,
    Column("folder", Text, primary_key=True),
    Column("path", Text, primary_key=True),
    Column("recording_sha256", Text, nullable=False, index=True),
    Column("robot", Text, nullable=False),
    Column("axis", Integer, nullable=False),
    Column("started_at", Text, nullable=False),
    Column("made_at", Text, nullable=False),
    Column("version", Text, nullable=False),
    Column("decidable", Boolean, nullable=False),
    Column("alarm", Boolean, nullable=False),
    Column("state", Text, nullable=False),
    Column("sentence", Text, nullable=False),
)

EVENTS = Table(
    "events",
    METADATA,
    Column("folder", Text, primary_key=True),
    Column("path", Text, primary_key=True),
    Column("line", Integer, primary_key=True),
    Column("at", Text, nullable=False, index=True),
    Column("kind", Text, nullable=False),
    Column("robot", Text, nullable=False),
    Column("axis", Integer),
    Column("text", Text, nullable=False),
    Column("recording", Text, nullable=False),
    Column("by", Text, nullable=False),
    Column("details", Text, nullable=False),
)

HEAD = "0001"
"""The newest migration: what a database of this version is at."""
