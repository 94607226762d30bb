"""Tables of the store: sessions with their results, parameters, reduced rows.

`migrations` makes them; a change here is a new file there.
"""

from __future__ import annotations

from sqlalchemy import (
    Boolean,
    Column,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    String,
    Table,
    Text,
    UniqueConstraint,
)

METADATA = MetaData()

SESSION = Table(
    "session",
    METADATA,
    Column("id", Integer, primary_key=True),
    Column("serial", String, nullable=False),
    Column("folder", String, nullable=False),
    Column("taken_at", String),
    Column("go", Boolean),
    Column("good", Boolean),
    Column("accepted", Boolean, nullable=False),
    Column("model", String),
    Column("lot", String),
    Column("station", String),
    Column("operator", String),
    Column("temperature", Float),
    Column("latitude_deg", Float),
    Column("height_m", Float),
    Column("software", String, nullable=False),
    Column("fingerprint", String),
    Column("error", Text),
    Column("result", Text),
    Column("diagnosis", Text),
    UniqueConstraint("serial", "folder", name="session_once"),
    Index("session_folder", "folder"),
)
"""One row a recorded session.

`serial` is empty where nobody knows it; `go` is null where nobody judged; `fingerprint`
tells whether the folder has changed; `error` says why there is no newer result;
`result` and `diagnosis` are the documents of those names.
"""

PARAMETER = Table(
    "parameter",
    METADATA,
    Column("session", ForeignKey("session.id", ondelete="CASCADE"), primary_key=True),
    Column("name", String, primary_key=True),
    Column("value", Float, nullable=False),
    Column("sigma", Float, nullable=False),
    Column("unit", String, nullable=False),
    Index("parameter_name", "name"),
)
"""Values of a calibration with their standard uncertainties."""

REDUCED = Table(
    "reduced",
    METADATA,
    Column("session", ForeignKey("session.id", ondelete="CASCADE"), primary_key=True),
    Column("data", LargeBinary, nullable=False),
)
"""What a session says of effects that it may share with others."""
