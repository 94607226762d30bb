"""Carries out migrations in the transaction that asks for them."""

from __future__ import annotations

from alembic import context

from fieldcal.history.tables import METADATA

if config := getattr(context, "config", None):  # only while alembic runs this
    connection = config.attributes["connection"]
    context.configure(connection=connection, target_metadata=METADATA)
    with context.begin_transaction():
        context.run_migrations()
