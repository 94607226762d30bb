"""The head of the page and the table of parameters."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.calibration.gauge import in_sample_units
from fieldcal.calibration.names import ParameterName
from fieldcal.calibration.wording import (
    UNCHECKED,
    format_unit,
    format_with_sigma,
    parameter_title,
)
from fieldcal.core.probability import chi2_tail
from fieldcal.core.samples import Array
from fieldcal.core.samples import Block as SampleBlock
from fieldcal.importing.session.stream_facts import StreamFacts
from fieldcal.model import thresholds
from fieldcal.report.blocks import (
    Cell,
    NameValues,
    Paragraph,
    ReportBlock,
    Section,
    Table,
    Tone,
    WarningBox,
    table,
)
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.gravity_norm import norm_errors
from fieldcal.report.loose import list_at, objects_at, table_at

WIDEST = 30.0
"""Change in standard uncertainties that fills its bar."""


@dataclass(frozen=True, slots=True)
class PageHeader:
    """Header of the page."""

    name: str
    subtitle: str
    verdict: str
    tone: Tone
    advice: str
    facts: NameValues
    kind: str = "IMU calibration report"


def page_header(material: ReportMaterial) -> PageHeader:
    """Name of the device, verdict and main facts."""
    about, found = material.session.about, material.calibration
    folder = material.session.folder.resolve().name
    name = str(about.device.get("name") or folder)
    serial = about.device.get("serial")
    under = [folder] if folder != name else []
    under += [f"serial {serial}"] if serial else []
    verdict, tone, says = _verdict(found, "nominal" in about.raw, about.nominal)
    if material.outdated:  # whatever was decided then
        verdict, tone, says = "outdated", "bad", f"{material.outdated}."
    return PageHeader(name, " · ".join(under), verdict, tone, says, _facts(material))


def _verdict(
    found: Calibration | None, known: bool, nominal: Mapping[str, Array]
) -> tuple[str, Tone, str]:
    """Verdict, its tone, and advice; a decision by limits takes precedence.

    `known` says that `nominal` is the calibration in use, and not that of any device.
    """
    if found is None:
        return "not solved", "warn", "fieldcal solve has not been run yet."
    decision = table_at(found.info, "decision")
    reasons = "; ".join(str(r).rstrip(".") for r in list_at(decision, "reasons"))
    if decision.get("go") is False:
        remedy = str(table_at(decision, "remedy").get("says", ""))
        do = f"{remedy[:1].upper()}{remedy[1:]}." if remedy else "Do not apply it."
        return "no-go", "bad", f"{do} {reasons or 'A limit is not kept'}."
    if not found.good:
        return "bad", "bad", "Do not use these numbers."
    if not found.is_checked and decision.get("go") is not True:
        return "not checked", "warn", f"{UNCHECKED[:1].upper()}{UNCHECKED[1:]}."
    says = "Apply it: the numbers hold within their ±."
    if known:
        says = _advice_on_calibration_in_use(found, nominal)
    return "go" if decision.get("go") is True else "good", "good", says


def _advice_on_calibration_in_use(
    found: Calibration, nominal: Mapping[str, Array]
) -> str:
    """Advice whether to change the calibration in use, with the largest change."""
    names = [n for n in found.names if ParameterName.of(n).group in nominal]
    at = [found.names.index(n) for n in names]
    old = [nominal[p.group][p.axis] for p in map(ParameterName.of, names)]
    change, cov = found.values[at] - np.array(old), found.covariance[np.ix_(at, at)]
    chi2 = float(change @ np.linalg.lstsq(cov, change, rcond=None)[0])
    if chi2_tail(chi2, len(names)) >= thresholds.BEYOND_NOISE:
        return (
            "No change is needed: the calibration in use agrees with this one within"
            f" the ± (χ² = {chi2:.0f} of {len(names)} parameters)."
        )
    sigma = np.sqrt(np.diag(cov))
    # what has no uncertainty was given and not measured, and tells of no change
    known = np.flatnonzero(sigma > 0)
    most = int(known[np.argmax(np.abs(change[known]) / sigma[known])])
    unit = format_unit(found.units[at[most]])
    value, error = format_with_sigma(float(change[most]), float(sigma[most]))
    return (
        f"Apply it: {parameter_title(names[most])} differs from the calibration in use"
        f" by {value} ± {error}{' ' + unit if unit else ''}, the most of all."
    )


def _facts(material: ReportMaterial) -> NameValues:
    block, found = material.block, material.calibration
    span = float(block.t[-1] - block.t[0])
    facts = [
        ("recorded", f"{_duration(span)}, {len(block):,} samples"),
        ("rate", _rate(block)),
    ]
    if material.windows is not None:
        taken, of = (
            len(material.windows.position_numbers),
            len(material.session.positions),
        )
        facts.append(("positions", f"{taken} of {of}" if taken < of else f"{of}"))
    warm = block.temperature[np.isfinite(block.temperature)]
    if warm.size:
        facts.append(("temperature", f"{warm.min():.1f} to {warm.max():.1f} °C"))
    if found is not None:
        facts.append(("method", found.method.replace("_", " ")))
    if found is not None and np.isfinite(found.chi2) and found.dof > 0:
        facts.append(("χ² / degrees of freedom", f"{found.chi2:.1f} / {found.dof}"))
    if found is not None and np.isfinite(found.rms):
        facts.append(("rms residual", f"{found.rms:.2g} m/s²"))
    if (norm := norm_errors(material)) is not None:
        before, after = norm.rms
        facts.append(("|a| − g, before → after", f"{before:.2g} → {after:.2g} m/s²"))
    if material.diagnosis is not None:
        said = str(material.diagnosis.get("verdict", "")).replace("_", " ")
        facts.append(("diagnosis", said))
    return NameValues(tuple(facts))


def _duration(seconds: float) -> str:
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{seconds:.1f} s"


def _rate(block: SampleBlock) -> str:
    found = StreamFacts()
    found.add(block)
    if not np.isfinite(found.rate_hz):
        return "a single sample"
    many = f"{found.gaps} gap{'s' * (found.gaps > 1)}" if found.gaps else "no gap"
    return f"{found.rate_hz:.4g} Hz, {many}"


def calibration_section(material: ReportMaterial) -> Section | None:
    """The parameters with their uncertainties, and warnings."""
    found = material.calibration
    if found is None:
        return None
    blocks: list[ReportBlock] = [_parameters(found, material.session.about.nominal)]
    if found.warnings:
        blocks += [WarningBox(w) for w in found.warnings]
    blocks += _checks(found)
    left = _missing_calibration_blocks(found)
    if left:
        blocks.append(Paragraph(left))
    return Section("calibration", "Calibration", tuple(blocks))


def _parameters(found: Calibration, nominal: Mapping[str, Array]) -> Table:
    rows: list[list[str | Cell]] = []
    shown = in_sample_units(found)
    for i, (name, value, sigma, unit) in enumerate(
        zip(shown.names, shown.values, shown.sigma, shown.units, strict=True)
    ):
        parameter = ParameterName.of(name)
        group = parameter.group
        change: str | Cell = ""
        if group in nominal and sigma > 0:
            z = (found.values[i] - nominal[group][parameter.axis]) / found.sigma[i]
            change = Cell(f"{z:+.1f} σ", bar=float(min(1.0, abs(z) / WIDEST)))
        rows.append(
            [
                parameter_title(name),
                *format_with_sigma(value, sigma),
                format_unit(unit),
                change,
            ]
        )
    columns: tuple[str, ...] = ("parameter", ">value", ">± 1σ", "unit")
    caption = "Device axes; ± is one standard uncertainty"
    if any(row[-1] for row in rows):
        columns += (">change from nominal",)
    else:
        rows = [row[:-1] for row in rows]
    return table(caption, columns, rows)


def _checks(found: Calibration) -> list[ReportBlock]:
    """Checks of a decision by limits; none without a decision."""
    marks: dict[object, Cell] = {
        True: Cell("kept", "good"),
        False: Cell("not kept", "bad"),
    }
    checks = objects_at(table_at(found.info, "decision"), "checks")
    rows: list[list[str | Cell]] = [
        [
            str(c.get("name", "")).replace("_", " "),
            marks.get(c.get("ok"), Cell("not checked", "warn")),
            str(c.get("says", "")),
        ]
        for c in checks
        if not isinstance(c.get("ok"), list | dict)
    ]
    return [table("Limits", ("limit", "", "found"), rows)] if rows else []


def _missing_calibration_blocks(found: Calibration) -> str:
    """Blocks that explain why there is no calibration."""
    missing = [g for g in ("acc_scale", "gyr_scale") if g not in found.groups]
    if not missing:
        return ""
    names = " and ".join(parameter_title(g) for g in missing)
    return f"Not determined by this recording, and not filled in: {names}."
