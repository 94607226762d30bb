"""How the recording compares with a simulator, as against.json says."""

from __future__ import annotations

from collections.abc import Iterator

from fieldcal.calibration.wording import format_unit, format_with_sigma
from fieldcal.report.blocks import Paragraph, ReportBlock, Section, WarningBox, table
from fieldcal.report.diagnosis import verdict_box
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.loose import (
    Json,
    format_number,
    list_at,
    number_or_nan,
    objects_at,
    table_at,
)

DIRECTIONS = {
    "left_out": "left out by the simulator",
    "added": "added by the simulator",
    "resized": "in both, another size",
}

VERDICTS = {"left_out": "different"}
"""Names of verdicts that differ between a comparison and a diagnosis."""

COLUMNS = ("what", "", "parameter", ">real", ">simulator", ">real − simulator", "±", "")


def against_section(material: ReportMaterial) -> Section | None:
    """Verdict, differences and prediction; None where nothing was compared."""
    found = material.against
    if found is None:
        return None
    blocks: list[ReportBlock] = [verdict_box(found, VERDICTS)]
    blocks.append(Paragraph(f"Compared with {found.get('against', 'a simulator')}."))
    if said := str(found.get("says", "")):
        blocks.append(Paragraph(format_unit(said)))
    rows = [row for one in objects_at(found, "differences") for row in _rows(one)]
    if rows:
        blocks.append(table("What differs", COLUMNS, rows))
    blocks.append(_prediction(table_at(found, "prediction")))
    blocks += [WarningBox(str(w)) for w in list_at(found, "warnings")]
    return Section("against", "Against a simulator", tuple(blocks))


def _rows(one: Json) -> Iterator[tuple[str, ...]]:
    """A row for each parameter of a difference."""
    what = str(one.get("id", "")).replace("_", " ")
    direction = DIRECTIONS.get(str(one.get("direction")), "")
    parameters = table_at(one, "parameters")
    for name in parameters:
        pair = table_at(parameters, name)
        off = table_at(pair, "difference")
        value, sigma = number_or_nan(off.get("value")), number_or_nan(off.get("sigma"))
        shown = (
            format_with_sigma(value, sigma)
            if value == value
            else (str(off.get("value")), "")
        )
        sizes = [format_number(table_at(pair, side).get("value"), "{:.6g}")
                 for side in ("real", "simulator")]  # fmt: skip
        unit = str(off.get("unit", ""))
        yield (
            what,
            direction,
            name,
            *sizes,
            *shown,
            format_unit("" if unit == "1" else unit),
        )


def _prediction(found: Json) -> ReportBlock:
    """How the simulator predicts the recording, without and with the patch."""
    columns = ("", ">rms m/s²", ">rms rad/s", ">χ²/dof")
    rows = []
    for label, key in (("simulator", "before"), ("patched", "after")):
        one = table_at(found, key)
        names = ("rms_acc", "rms_gyr", "chi2_per_dof")
        rows.append((label, *(format_number(one.get(n), "{:.3g}") for n in names)))
    return table("What was not fitted, predicted", columns, rows)
