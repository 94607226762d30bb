"""Directions of gravity in the device, and the largest gap between them.

A device that is held in any attitude is calibrated where gravity has been. The force
that a calibration gives along a direction u is uncertain by

    sigma^2(u) = sum_i (1, g u_i) C_i (1, g u_i)^T / k_i^2                         (1)

with C_i the covariance of bias and scale factor of axis i. The sphere is drawn as
azimuth and sine of elevation, by which equal areas stay equal (Lambert's cylinder).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.calibration import Calibration
from fieldcal.core.samples import Array
from fieldcal.report.blocks import Figure, Paragraph, Section
from fieldcal.report.blocks import ReportBlock as ReportBlock
from fieldcal.report.charts import Axis, Chart, Series
from fieldcal.report.gather import ReportMaterial
from fieldcal.report.gravity_norm import calibrated_forces, missing_coupling

GRID = 4000
"""Directions that are looked at: 3 degrees apart."""


@dataclass(frozen=True, slots=True)
class Coverage:
    """Directions of gravity in a session, in device axes.

    Attributes
    ----------
    seen : (n, 3) unit vectors of the force
    farthest : (3,) the direction that is farthest from all of them
    gap_deg : how far
    sigma : of the force there and, at best, in any direction, m/s^2

    """

    seen: Array
    farthest: Array
    gap_deg: float
    sigma: tuple[float, float]

    @classmethod
    def of(cls, forces: Array, found: Calibration, gravity: float) -> Coverage:
        """Of forces (n, 3) at rest, whose calibration has bias and scale factors."""
        seen = forces / np.linalg.norm(forces, axis=1, keepdims=True)
        everywhere = sphere_directions(GRID)
        nearest = (everywhere @ seen.T).max(axis=1)
        worst = int(np.argmin(nearest))
        sigma = force_sigma(found, gravity * everywhere)
        gap = float(np.rad2deg(np.arccos(np.clip(nearest[worst], -1.0, 1.0))))
        ends = (float(sigma[worst]), float(sigma.min()))
        return cls(seen, everywhere[worst], gap, ends)


def sphere_directions(count: int) -> Array:
    """Unit vectors evenly over the sphere, (count, 3), along a spiral of golden angle.

    >>> float(np.abs(sphere_directions(500).mean(axis=0)).max()) < 0.01
    True
    """
    k = np.arange(count) + 0.5
    up = 1 - 2 * k / count
    turn, level = np.pi * (1 + 5**0.5) * k, np.sqrt(1 - up**2)
    return np.column_stack([level * np.cos(turn), level * np.sin(turn), up])


def force_sigma(found: Calibration, force: Array) -> Array:
    """Sigma of calibrated forces (n, 3), (n,) m/s^2, by bias and scale factors, (1)."""
    variance = np.zeros(len(force))
    for i, axis in enumerate("xyz"):
        at = [found.names.index(f"acc_{kind}.{axis}") for kind in ("bias", "scale")]
        rows = np.column_stack([np.ones(len(force)), force[:, i]])
        told = found.covariance[np.ix_(at, at)] / found.values[at[1]] ** 2
        variance += np.einsum("ni,ij,nj->n", rows, told, rows)  # (1)
    sigma: Array = np.sqrt(variance)
    return sigma


def coverage_section(material: ReportMaterial) -> Section | None:
    """A map of the directions; None if all positions have known angles."""
    found, known = material.calibration, material.session.about.positions
    if found is None or all(p.oriented for p in known):
        return None
    wanted = {f"acc_{kind}.{axis}" for kind in ("bias", "scale") for axis in "xyz"}
    seen = calibrated_forces(material)
    if seen is None or not wanted <= set(found.names) or not np.isfinite(seen[0]).all():
        return None
    forces, gravity = seen
    there = Coverage.of(forces, found, gravity)
    where = " ".join(f"{v:+.2f}" for v in there.farthest)
    said = (
        f"the direction that is farthest from all positions, ({where}) in device axes,"
        f" is {there.gap_deg:.0f}° away from the nearest"
    )
    series = (
        Series("positions", *_on_map(there.seen), 1),
        Series("farthest", *_on_map(there.farthest[None]), 6),
    )
    chart = Chart(
        "coverage",
        "Where gravity pointed in the device",
        f"{len(forces)} positions; {said}.",
        Axis("azimuth from x towards y", "°"),
        Axis("sine of the elevation towards z"),
        series,
    )
    worst, best = there.sigma
    blocks: tuple[ReportBlock, ...] = (
        Paragraph(
            f"{said[0].upper()}{said[1:]}. There the calibrated force is known to"
            f" ± {worst:.2g} m/s², at best in any direction to ± {best:.2g} m/s²."
        ),
        *missing_coupling(found),
        Figure(chart, "Equal areas of the sphere are equal here."),
    )
    return Section("coverage", "What the positions cover", blocks)


def _on_map(directions: Array) -> tuple[Array, Array]:
    """Azimuth, deg, and sine of the elevation."""
    azimuth: Array = np.rad2deg(np.arctan2(directions[:, 1], directions[:, 0]))
    return azimuth, directions[:, 2]
