"""From sections to one HTML page that needs nothing else.

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

from fieldcal.report.against import against
from fieldcal.report.agreement import agreement, correlation
from fieldcal.report.blocks import Section
from fieldcal.report.coverage import coverage
from fieldcal.report.diagnosis import diagnosis
from fieldcal.report.gather import Material
from fieldcal.report.gravity_norm import gravity_norm
from fieldcal.report.history import history
from fieldcal.report.noise import noise
from fieldcal.report.overview import Head, calibration, head
from fieldcal.report.places import places
from fieldcal.report.provenance import provenance
from fieldcal.report.recording import recording
from fieldcal.report.stillness import stillness

SCRIPTS = ("unpack.js", "draw.js", "cursor.js", "zoom.js", "start.js")

REPORT = "report.html"


def render(material: Material, made: datetime | None = None) -> str:
    """The report as HTML.

    Parameters
    ----------
    material : what `gather` read
    made : when the report is made; now by default

    """
    return rendered(head(material), sections(material, made or datetime.now(UTC)))


def rendered(top: Head, parts: Sequence[Section]) -> str:
    """The page of some sections, with what stands on top of it."""
    import jinja2

    environment = jinja2.Environment(
        loader=jinja2.FunctionLoader(_part),
        autoescape=True,
        trim_blocks=True,
        lstrip_blocks=True,
        undefined=jinja2.StrictUndefined,
    )
    script = "\n".join(_part(name) for name in SCRIPTS)
    content: dict[str, Any] = {
        "head": top,
        "sections": parts,
        "style": _part("page.css"),
        "script": script,
        "policy": _policy(script),
    }
    return environment.get_template("page.html").render(content)


def sections(material: Material, made: datetime) -> list[Section]:
    """All sections that the session has something to say for."""
    found = [
        calibration(material),
        gravity_norm(material),
        coverage(material),
        diagnosis(material),
        against(material),
        places(material),
        recording(material),
        agreement(material),
        correlation(material),
        stillness(material),
        noise(material),
        history(material),
        provenance(material, made),
    ]
    return [section for section in found if section is not None]


def _part(name: str) -> str:
    return files("fieldcal.report").joinpath("page", name).read_text("utf-8")


def _policy(script: str) -> str:
    digest = base64.b64encode(hashlib.sha256(script.encode()).digest()).decode()
    return (
        f"default-src 'none'; script-src 'sha256-{digest}'; style-src 'unsafe-inline';"
        " base-uri 'none'; form-action 'none'"
    )
