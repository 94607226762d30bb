"""Which run made a recording, and how many samples it has."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "runs"
down_revision = "recordings"


def upgrade() -> None:
    """Add the columns; they are unknown of what is stored already."""
    op.add_column("session", sa.Column("samples", sa.Integer))
    op.add_column("session", sa.Column("run_id", sa.String))
    op.create_index("session_run", "session", ["run_id"])
