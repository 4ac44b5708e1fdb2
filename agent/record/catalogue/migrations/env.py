"""Run the migrations on the connection that `agent.record.catalogue.schema` hands over."""

from __future__ import annotations

from alembic import context

connection = context.config.attributes["connection"]
# One transaction, begun by whoever holds the catalogue's lock: half a migration is none.
context.configure(connection=connection, transactional_ddl=True)
with context.begin_transaction():
    context.run_migrations()
