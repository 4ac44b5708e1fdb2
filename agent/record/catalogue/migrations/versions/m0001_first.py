"""Make the catalogue: recordings, estimates, verdicts, events."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "0001"
down_revision = None
branch_labels = None
depends_on = None


def upgrade() -> None:
    """Make the tables."""
    _recordings()
    _estimates()
    _verdicts()
    _events()


def downgrade() -> None:
    """Drop the tables; the files that they were made from stay."""
    for table in ("events", "verdicts", "estimates", "recordings"):
        op.drop_table(table)


def _key() -> list[sa.Column[str]]:
    return [
        sa.Column("folder", sa.Text, primary_key=True),
        sa.Column("path", sa.Text, primary_key=True),
    ]


def _recordings() -> None:
    op.create_table(
        "recordings",
        *_key(),
        sa.Column("sha256", sa.Text, nullable=False),
        sa.Column("size_bytes", sa.BigInteger, nullable=False),
        sa.Column("robot", sa.Text, nullable=False),
        sa.Column("axis", sa.Integer, nullable=False),
        sa.Column("gear_ratio", sa.Float(53), nullable=False),
        sa.Column("started_at", sa.Text, nullable=False),
        sa.Column("duration_s", sa.Float(53), nullable=False),
        sa.Column("samples", sa.Integer, nullable=False),
        sa.Column("samples_lost", sa.Integer),
        sa.Column("trajectory", sa.Text, nullable=False),
        sa.Column("payload_kg", sa.Float(53)),
        sa.Column("gearbox_serial", sa.Text, nullable=False),
        sa.Column("gearbox_temperature_degc", sa.Float(53)),
        sa.Column("stopped_because", sa.Text, nullable=False),
        sa.Column("software", sa.Text, nullable=False),
    )
    op.create_index("ix_recordings_sha256", "recordings", ["sha256"])
    op.create_index("ix_recordings_started_at", "recordings", ["started_at"])


def _estimates() -> None:
    op.create_table(
        "estimates",
        *_key(),
        sa.Column("recording_sha256", sa.Text, nullable=False),
        sa.Column("robot", sa.Text, nullable=False),
        sa.Column("axis", sa.Integer, nullable=False),
        sa.Column("started_at", sa.Text, nullable=False),
        sa.Column("decidable", sa.Boolean, nullable=False),
        sa.Column("sentence", sa.Text, nullable=False),
        sa.Column("coulomb_nm", sa.Float(53)),
        sa.Column("coulomb_low_nm", sa.Float(53)),
        sa.Column("coulomb_high_nm", sa.Float(53)),
        sa.Column("viscous_nm_s_per_rad", sa.Float(53)),
        sa.Column("viscous_low_nm_s_per_rad", sa.Float(53)),
        sa.Column("viscous_high_nm_s_per_rad", sa.Float(53)),
        sa.Column("rmse_nm", sa.Float(53)),
    )
    op.create_index("ix_estimates_recording_sha256", "estimates", ["recording_sha256"])


def _verdicts() -> None:
    op.create_table(
        "verdicts",
        *_key(),
        sa.Column("recording_sha256", sa.Text, nullable=False),
        sa.Column("robot", sa.Text, nullable=False),
        sa.Column("axis", sa.Integer, nullable=False),
        sa.Column("started_at", sa.Text, nullable=False),
        sa.Column("made_at", sa.Text, nullable=False),
        sa.Column("version", sa.Text, nullable=False),
        sa.Column("decidable", sa.Boolean, nullable=False),
        sa.Column("alarm", sa.Boolean, nullable=False),
        sa.Column("state", sa.Text, nullable=False),
        sa.Column("sentence", sa.Text, nullable=False),
    )
    op.create_index("ix_verdicts_recording_sha256", "verdicts", ["recording_sha256"])


def _events() -> None:
    op.create_table(
        "events",
        *_key(),
        sa.Column("line", sa.Integer, primary_key=True),
        sa.Column("at", sa.Text, nullable=False),
        sa.Column("kind", sa.Text, nullable=False),
        sa.Column("robot", sa.Text, nullable=False),
        sa.Column("axis", sa.Integer),
        sa.Column("text", sa.Text, nullable=False),
        sa.Column("recording", sa.Text, nullable=False),
        sa.Column("by", sa.Text, nullable=False),
        sa.Column("details", sa.Text, nullable=False),
    )
    op.create_index("ix_events_at", "events", ["at"])
