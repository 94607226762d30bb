"""One row for each folder, and which rows are of the same recording.

Two programs that stored a folder at the same time on a server, one of them without its
serial number, made two rows of it. The newest result is kept, and whether one of them
was accepted.
"""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "recordings"
down_revision = "sessions"

KEPT = (
    "SELECT coalesce(max(CASE WHEN result IS NOT NULL THEN id END), max(id)) AS id"
    " FROM session GROUP BY folder"
)

ONE_ROW_A_FOLDER = (
    "UPDATE session SET accepted = true WHERE folder IN"
    " (SELECT folder FROM session WHERE accepted)",
    *(
        f"DELETE FROM {table} WHERE session NOT IN ({KEPT})"
        for table in ("parameter", "reduced")
    ),
    f"DELETE FROM session WHERE id NOT IN ({KEPT})",
)


def upgrade() -> None:
    """Delete rows of the same folder, and add the columns."""
    for statement in ONE_ROW_A_FOLDER:
        op.execute(statement)
    op.drop_index("session_folder", "session")
    op.create_index("session_of_folder", "session", ["folder"], unique=True)
    op.add_column("session", sa.Column("recording", sa.String))
    for name in ("part_start", "part_end"):
        op.add_column("session", sa.Column(name, sa.Float))
    no = sa.false()
    op.add_column(
        "session",
        sa.Column("superseded", sa.Boolean, nullable=False, server_default=no),
    )
    op.create_index("session_recording", "session", ["recording"])
