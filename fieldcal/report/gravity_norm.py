"""The norm of the specific force less gravity, before and after the calibration.

At rest |f| = g wherever the device points, so that nobody needs to know its angles:

    before = |(<U> - b_0) / k_0| - g,   after = |M^-1 (<U> - b)| - g              (1)

with b_0, k_0 the calibration that it came with. m/s^2.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array, Block
from fieldcal.evaluation.observations import build_observations
from fieldcal.evaluation.usable_windows import UsableWindows
from fieldcal.model import thresholds
from fieldcal.report.blocks import Figure, Paragraph, Section
from fieldcal.report.blocks import ReportBlock as ReportBlock
from fieldcal.report.charts import Axis, Chart, Series
from fieldcal.report.gather import ReportMaterial
from fieldcal.solve.observations import Observations


@dataclass(frozen=True, slots=True)
class NormErrors:
    """Norms less gravity of the windows at rest.

    Attributes
    ----------
    rows : (n,) number of each window's position
    before, after : (n,) m/s^2
    sigma : (n,) standard error of each, of the window's mean

    """

    rows: tuple[int, ...]
    before: Array
    after: Array
    sigma: Array

    @property
    def rms(self) -> tuple[float, float]:
        """Root mean squares of before and after, m/s^2."""
        before, after = np.sqrt([np.mean(self.before**2), np.mean(self.after**2)])
        return float(before), float(after)


def calibrated_forces(material: ReportMaterial) -> tuple[Array, float] | None:
    """Calibrated forces of the windows at rest, (n, 3), and gravity, m/s^2."""
    held = _windows_with_calibration(material)
    if held is None or material.calibration is None:
        return None
    _, seen = held
    recorded = Block.of(seen.time, seen.mean[:, :3], seen.mean[:, 3:])
    return material.calibration.apply(recorded, seen.nominal).acc, seen.gravity


def _windows_with_calibration(
    material: ReportMaterial,
) -> tuple[UsableWindows, Observations] | None:
    """The windows at rest; None without accelerometers or their calibration."""
    found = material.calibration
    if found is None or material.windows is None or "acc_bias" not in found.groups:
        return None
    still = material.windows.at_rest(material.session)
    seen = build_observations(
        material.session.about, still.averages, still.position_numbers
    )
    return (still, seen) if seen.has_acc and len(seen) else None


def norm_errors(material: ReportMaterial) -> NormErrors | None:
    """Norms less gravity; None without accelerometers or a calibration."""
    held, forces = _windows_with_calibration(material), calibrated_forces(material)
    if held is None or forces is None:
        return None
    (still, seen), (true, _) = held, forces
    nominal = (seen.mean[:, :3] - seen.nominal.acc_bias) / seen.nominal.acc_scale
    along = true / np.linalg.norm(true, axis=1, keepdims=True)
    spread = np.einsum("ni,nij,nj->n", along, seen.covariance[:, :3, :3], along)
    before, after = (
        np.linalg.norm(f, axis=1) - seen.gravity for f in (nominal, true)
    )  # (1)
    return NormErrors(still.position_numbers, before, after, np.sqrt(spread))


def missing_coupling(found: Calibration | None) -> tuple[Paragraph, ...]:
    """Remark if a result has no cross-coupling although its recording shows some.

    The fit of bias and scale factor took it into account, so their residuals and
    uncertainties do not show it; what is calibrated with them alone still has it.
    """
    if found is None or any(n.startswith("cross_coupling.") for n in found.names):
        return ()
    causes = found.info.get("carried", {}).get("causes", {})
    if causes.get("cross_coupling", 0.0) < thresholds.NAMED:
        return ()
    return (
        Paragraph(
            "The recording shows cross-coupling, and this result has no coefficients"
            " of it: a force calibrated with bias and scale factor alone is off by it,"
            " which no ± here includes. fieldcal solve --cross adds them."
        ),
    )


def gravity_norm_section(material: ReportMaterial) -> Section | None:
    """Chart of the norm less gravity, before and after calibration, by position."""
    errors = norm_errors(material)
    if errors is None or not np.isfinite([*errors.before, *errors.after]).all():
        return None
    x = np.arange(len(errors.rows), dtype=float)
    series = tuple(
        Series(name, x + place, values, colour, low=values - errors.sigma,
               high=values + errors.sigma)
        for name, place, values, colour in (
            ("before", -0.12, errors.before, 6), ("after", 0.12, errors.after, 1)
        )
    )  # fmt: skip
    before, after = errors.rms
    said = f"rms {before:.2g} m/s² before, {after:.2g} m/s² after"
    chart = Chart(
        "norm",
        "|a| − g before and after",
        f"The norm of the specific force misses gravity by {said}.",
        Axis("position", names=tuple(str(r + 1) for r in errors.rows)),
        Axis("|a| − g", "m/s²"),
        series,
    )
    blocks: tuple[ReportBlock, ...] = (
        Paragraph(
            "At rest the accelerometers feel gravity and nothing else, wherever they"
            f" point. Their norm misses it by {said}."
        ),
        *missing_coupling(material.calibration),
        Figure(chart, "± is one standard error of the window's mean."),
    )
    return Section("gravity", "Gravity, before and after", blocks)
