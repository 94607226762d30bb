"""Several IMUs with the same motion, compared with each other and with g.

    |a_k| = R in every rest k                                                       (1)

a_k is the mean of the accelerometers in rest k, m/s^2. If the rests of an IMU point in
all directions, R is the radius of a sphere through its a_k, in which the bias cancels.
Otherwise R is the median of |a_k|. An IMU whose R is far from that of the others is
marked as out; of two IMUs, the one with R farther from g.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from fieldcal.core.samples import Array

USUAL_ERROR, USUAL_ERROR_WITH_BIAS = 0.01, 0.03
"""Usual error of a sensor as delivered, as a part of g, without and with its bias."""

MIN_OUTLIER_RATIO = 4.0
"""Least difference of an IMU that is out, over the median difference of the others."""

MIN_RESTS = 6
"""Fewest rests to which a sphere is fitted."""

ROUND = 1e-2
"""Smallest singular value, relative to the largest, of rests in all directions."""


class Instance(NamedTuple):
    """Size of the specific force that one IMU measures at rest.

    Attributes
    ----------
    name : of the instance
    length : R of (1), m/s^2
    sigma : its standard uncertainty, m/s^2; nan with a single rest
    every_way : whether the rests point in all directions, so that bias cancels
    rests : number of rests
    of_g : R / g - 1
    of_others : R over the median R of the other IMUs, less 1; nan without others
    out : whether it differs too much from the others

    """

    name: str
    length: float
    sigma: float
    every_way: bool
    rests: int
    of_g: float
    of_others: float
    out: bool

    def document(self) -> dict[str, object]:
        """As one JSON object; what is not known is null."""
        known = {k: v for k, v in self._asdict().items() if v == v}
        return dict.fromkeys(self._fields) | known

    def sentence(self) -> str:
        """One sentence with the numbers."""
        error = f" ± {self.sigma:.1g}" if np.isfinite(self.sigma) else ""
        many = "a single rest" if self.rests == 1 else f"{self.rests} rests"
        text = (
            f"{self.name}: |a| at rest is {self.length:.4f}{error} m/s² in {many}"
            f"{'' if self.every_way else ', bias included'},"
            f" {100 * self.of_g:+.2f} % of g"
        )
        if np.isfinite(self.of_others):
            text += f", {100 * self.of_others:+.2f} % of the others"
        if self.out:
            text += ": it is out; calibrate it before it is used, or check its range"
        return text


def compare_instances(rests: Mapping[str, Array], gravity: float) -> list[Instance]:
    """Compare IMUs with each other and with g; those without rests are left out.

    Parameters
    ----------
    rests : (m, 3) means of the accelerometers in each rest, m/s^2, by instance
    gravity : m/s^2

    """
    known = {n: means[np.isfinite(means).all(axis=1)] for n, means in rests.items()}
    found = {name: _rest_length(means) for name, means in known.items() if len(means)}
    sizes = {name: size for name, (size, _, _) in found.items()}
    out = []
    for name, (size, sigma, every_way) in found.items():
        others = np.array([s for n, s in sizes.items() if n != name])
        of_others = size / float(np.median(others)) - 1 if len(others) else np.nan
        usual = USUAL_ERROR if every_way else USUAL_ERROR_WITH_BIAS
        is_out = _is_out(size, others, gravity, usual)
        of_g, many = size / gravity - 1, len(known[name])
        out.append(
            Instance(name, size, sigma, every_way, many, of_g, of_others, is_out)
        )
    return out


def _is_out(size: float, others: Array, gravity: float, usual: float) -> bool:
    """Whether one differs from others that agree; of two, the one farther from g."""
    if not len(others):
        return False
    middle = float(np.median(others))
    difference = abs(size / middle - 1)
    if difference < usual or abs(size - gravity) < abs(middle - gravity):
        return False
    of_others = float(np.median(np.abs(others / middle - 1)))
    return len(others) == 1 or difference > MIN_OUTLIER_RATIO * of_others


def _rest_length(means: Array) -> tuple[float, float, bool]:
    """R of (1), its standard uncertainty, and whether it is a sphere's."""
    lengths = np.linalg.norm(means, axis=1)
    if len(means) >= MIN_RESTS:
        left = np.column_stack([2 * means, np.ones(len(means))])
        scaled = left / np.linalg.norm(left, axis=0)
        singular = np.linalg.svd(scaled, compute_uv=False)
        if singular[-1] > ROUND * singular[0]:
            center = np.linalg.lstsq(left, lengths**2, rcond=None)[0]
            radius = float(np.sqrt(center[3] + center[:3] @ center[:3]))
            residual = np.linalg.norm(means - center[:3], axis=1) - radius
            spare = len(means) - len(center)
            variance = (residual @ residual) / spare / len(means)
            return radius, float(np.sqrt(variance)), True
    sigma = lengths.std(ddof=1) / np.sqrt(len(lengths)) if len(lengths) > 1 else np.nan
    return float(np.median(lengths)), float(sigma), False
