"""Origin of the numbers: versions, site, events, and files with hashes."""

from __future__ import annotations

import hashlib
import platform
from collections.abc import Mapping
from datetime import UTC, datetime
from importlib.metadata import version
from pathlib import Path
from typing import Any

from fieldcal.core.file_names import storable_text
from fieldcal.core.version import __version__
from fieldcal.report.blocks import (
    Collapsible,
    FileText,
    NameValues,
    ReportBlock,
    Section,
    WarningBox,
    table,
)
from fieldcal.report.gather import ReportMaterial
from fieldcal.session.description import Description
from fieldcal.session.folder import DESCRIPTION

OWN = ("report.html", "report.png", "report.pdf")
"""Files that the report itself makes."""

MOST_EVENTS = 500
"""Largest number of events that is listed, from the first."""


def provenance_section(material: ReportMaterial, made: datetime) -> Section:
    """Versions, configuration, events, and SHA-256 of every file."""
    session, found = material.session, material.calibration
    about = session.about
    by = str(found.info.get("software", "")) if found is not None else ""
    facts = [
        ("report made", made.astimezone(UTC).strftime("%Y-%m-%d %H:%M UTC")),
        ("software", f"fieldcal {__version__}"),
        *([("calibrated by", by)] if by else []),
        ("libraries", _libraries()),
        ("latitude, height", f"{_latitude(about)}, {about.height_m:g} m"),
        ("gravity", f"{about.gravity:.5f} m/s²"),
        ("mounting", ", ".join(about.axes)),
        ("grade", about.grade),
    ]
    blocks: list[ReportBlock] = [WarningBox(w) for w in session.warnings]
    blocks += [NameValues(tuple(facts)), _files(session.folder)]
    if material.marks:
        blocks.append(Collapsible("What happened", (_events(material.marks),)))
    text = (session.folder / DESCRIPTION).read_text(encoding="utf-8")
    blocks.append(Collapsible(DESCRIPTION, (FileText(text),)))
    return Section("provenance", "Provenance", tuple(blocks))


def _latitude(about: Description) -> str:
    return "not stated" if about.latitude_deg is None else f"{about.latitude_deg:g}°"


def _libraries() -> str:
    names = ", ".join(f"{n} {version(n)}" for n in ("numpy", "scipy", "pyarrow"))
    return f"{names}, Python {platform.python_version()}"


def _files(folder: Path) -> ReportBlock:
    rows = []
    for path in sorted(folder.iterdir()):
        if path.is_file() and path.name not in OWN and not path.name.startswith("."):
            with path.open("rb") as file:
                digest = hashlib.file_digest(file, "sha256").hexdigest()
            rows.append([storable_text(path.name), f"{path.stat().st_size:,}", digest])
    return table("Files of the session", ("file", ">bytes", "SHA-256"), rows)


def _events(marks: tuple[Mapping[str, Any], ...]) -> ReportBlock:
    rows = []
    for mark in marks[:MOST_EVENTS]:
        rest = {k: v for k, v in mark.items() if k not in ("event", "host_s")}
        said = ", ".join(f"{k} {v}" for k, v in rest.items())
        rows.append([_clock(mark.get("host_s")), str(mark.get("event", "")), said])
    return table("Events by the host's clock, UTC", ("time", "event", "details"), rows)


def _clock(host: object) -> str:
    if not isinstance(host, int | float) or not 0 <= host < 1e11:
        return ""
    return datetime.fromtimestamp(host, UTC).strftime("%H:%M:%S")
