"""Rendering of sections into one self-contained HTML page.

Style and script stand in the page. A content security policy lets only this script run,
by its hash, and nothing be loaded, so that a text of the session could not act even if
it were not escaped.
"""

from __future__ import annotations

import base64
import hashlib
from collections.abc import Sequence
from datetime import UTC, datetime
from importlib.resources import files
from typing import Any

from fieldcal.report.against import against_section
from fieldcal.report.agreement import agreement_section, correlation_section
from fieldcal.report.blocks import Section
from fieldcal.report.coverage import coverage_section
from fieldcal.report.diagnosis import diagnosis_section
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.gravity_norm import gravity_norm_section
from fieldcal.report.history import history_section
from fieldcal.report.noise import noise_section
from fieldcal.report.overview import PageHeader, calibration_section, page_header
from fieldcal.report.places import positions_section
from fieldcal.report.provenance import provenance_section
from fieldcal.report.recording import recording_section
from fieldcal.report.stillness import stillness_section

SCRIPTS = ("unpack.js", "draw.js", "cursor.js", "zoom.js", "start.js")

REPORT = "report.html"


def render(material: ReportMaterial, made: datetime | None = None) -> str:
    """Render a report as HTML.

    Parameters
    ----------
    material : what `gather` read
    made : when the report is made; now by default

    """
    return render_page(
        page_header(material), sections(material, made or datetime.now(UTC))
    )


def render_page(top: PageHeader, parts: Sequence[Section]) -> str:
    """Render sections and the header above them as HTML."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_page_file),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    script = "\n".join(_page_file(name) for name in SCRIPTS)
    content: dict[str, Any] = {
        "head": top,
        "sections": parts,
        "style": _page_file("page.css"),
        "script": script,
        "policy": _policy(script),
    }
    return environment.get_template("page.html").render(content)


def sections(material: ReportMaterial, made: datetime) -> list[Section]:
    """All sections for which the session has data."""
    found = [
        calibration_section(material),
        gravity_norm_section(material),
        coverage_section(material),
        diagnosis_section(material),
        against_section(material),
        positions_section(material),
        recording_section(material),
        agreement_section(material),
        correlation_section(material),
        stillness_section(material),
        noise_section(material),
        history_section(material),
        provenance_section(material, made),
    ]
    return [section for section in found if section is not None]


def _page_file(name: str) -> str:
    return files("fieldcal.report").joinpath("page", name).read_text("utf-8")


def _policy(script: str) -> str:
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline';"
        " base-uri 'none'; form-action 'none'"
    )
