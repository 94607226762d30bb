"""Sessions, judged or not, in the place of runs; what runs there are is taken over."""

from __future__ import annotations

import sqlalchemy as sa
from alembic import op

revision = "sessions"
down_revision = None

TAKEN_OVER = (
    "INSERT INTO session (id, serial, folder, taken_at, go, good, accepted,"
    " temperature, latitude_deg, height_m, software, result) SELECT id, serial,"
    " session, taken_at, go, go, accepted, temperature, latitude_deg, height_m,"
    " software, result FROM run",
    "INSERT INTO parameter (session, name, value, sigma, unit)"
    " SELECT run, name, value, sigma, unit FROM run_parameter",
)


def upgrade() -> None:
    """Make the tables; those of a history without stations and lots are filled in."""
    earlier = sa.inspect(op.get_bind()).has_table("run")
    if earlier:
        op.rename_table("parameter", "run_parameter")
    _make()
    if earlier:
        for statement in TAKEN_OVER:
            op.execute(statement)
        op.drop_table("run_parameter")
        op.drop_table("run")


def _make() -> None:
    words = ("taken_at", "model", "lot", "station", "operator", "fingerprint")
    numbers = ("temperature", "latitude_deg", "height_m")
    op.create_table(
        "session",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("serial", sa.String, nullable=False),
        sa.Column("folder", sa.String, nullable=False),
        sa.Column("software", sa.String, nullable=False),
        *(sa.Column(name, sa.String) for name in words),
        sa.Column("go", sa.Boolean),
        sa.Column("good", sa.Boolean),
        sa.Column("accepted", sa.Boolean, nullable=False),
        *(sa.Column(name, sa.Float) for name in numbers),
        *(sa.Column(name, sa.Text) for name in ("error", "result", "diagnosis")),
        sa.UniqueConstraint("serial", "folder", name="session_once"),
    )
    op.create_index("session_folder", "session", ["folder"])
    op.create_table(
        "parameter",
        sa.Column(
            "session",
            sa.Integer,
            sa.ForeignKey("session.id", ondelete="CASCADE"),
            primary_key=True,
        ),
        sa.Column("name", sa.String, primary_key=True),
        sa.Column("value", sa.Float, nullable=False),
        sa.Column("sigma", sa.Float, nullable=False),
        sa.Column("unit", sa.String, nullable=False),
    )
    op.create_index("parameter_name", "parameter", ["name"])
    op.create_table(
        "reduced",
        sa.Column(
            "session",
            sa.Integer,
            sa.ForeignKey("session.id", ondelete="CASCADE"),
            primary_key=True,
        ),
        sa.Column("data", sa.LargeBinary, nullable=False),
    )
