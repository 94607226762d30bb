"""Tables of the store: sessions with their results, parameters, reduced rows.

`migrations` creates them; each change here needs a new file there.
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
    Column("recording", String),
    Column("part_start", Float),
    Column("part_end", Float),
    Column("samples", Integer),
    Column("run_id", String),
    Column("superseded", Boolean, nullable=False),
    Column("error", Text),
    Column("result", Text),
    Column("diagnosis", Text),
    UniqueConstraint("serial", "folder", name="session_once"),
    Index("session_of_folder", "folder", unique=True),
    Index("session_recording", "recording"),
    Index("session_run", "run_id"),
)
"""One row for each session folder.

`serial` is empty if unknown. `go` is null without a decision. `fingerprint` shows
whether the files in the folder have changed. `recording`, `part_start` and `part_end`
are the samples that the session uses, of the `samples` of its recording, made by the
run `run_id`; null if unknown. `superseded` is true if another row has a result of the
same samples that counts instead. `error` states why there is no
newer result. `result` and `diagnosis` are the JSON documents.
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

REDUCED_ROWS = Table(
    "reduced",
    METADATA,
    Column("session", ForeignKey("session.id", ondelete="CASCADE"), primary_key=True),
    Column("data", LargeBinary, nullable=False),
)
"""Reduced rows of a session, for effects that it may share with other sessions."""
