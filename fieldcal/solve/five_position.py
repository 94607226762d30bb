"""Accelerometers and the offset of the joints from five or more known positions.

The outputs are expanded in known functions of the angles, (17) (24); their
coefficients come from least squares, (20) (26), and the parameters from them, per axis.
With a = alpha, b = beta, g gravity, S and C for sine and cosine:

joint offset (15):  f = g (-S(a+a0), -C(a+a0) C(b+b0), +C(a+a0) S(b+b0))

    Ux = C0 + C1 Sa + C2 Ca               C1 = -k11 g Ca0,       C2 = -k11 g Sa0    (17)
    Uy = C0 + C1 CaCb + C2 CaSb + C3 SaCb + C4 SaSb                                 (24)
              C1 = -k22 g Ca0 Cb0, C2 = k22 g Ca0 Sb0, C3 = k22 g Sa0 Cb0, C4 = ...
    Uz = the same functions
              C1 = k33 g Ca0 Sb0,  C2 = k33 g Ca0 Cb0, C4 = -k33 g Sa0 Cb0, C3 = ...
    a0 = atan(C2x / C1x), -atan(C3y / C1y), -atan(C4z / C2z)             (23) (29) (33)
    b0 = -atan(C2y / C1y), atan(C1z / C2z)                                    (28) (32)
    k g = sqrt(sum C^2) with the sign of the leading coefficient         (22) (30) (34)

The three values of a0 and two of b0 are combined by their covariance. Print and what
holds: (17) both coefficients need the minus; (22), (30), (34) lose the sign of k; (23)
is inverted; (24) is missing, and with (5) the signs of z. U in m/s^2, procedure axes
inside, device axes outside. Source: Avrutov and Pozniak 2023.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from fieldcal.core.errors import NotObservable
from fieldcal.core.samples import ACC, Array
from fieldcal.model import tolerances
from fieldcal.solve.closed_form import ClosedFormEstimate
from fieldcal.solve.observations import Observations
from fieldcal.solve.rank import determined_parameters

Found = dict[str, Array]

RAD = np.pi / 180


@dataclass(frozen=True, slots=True)
class AxisEstimates:
    """Estimates from each procedure axis alone.

    Attributes
    ----------
    names : (q,) such as ``"x.bias"``, ``"y.alpha0_deg"``
    values : (q,) m/s^2, 1, degrees
    gain : (q, n, 3) derivative by the means in procedure axes
    covariance : (q, q)

    """

    names: tuple[str, ...]
    values: Array
    gain: Array
    covariance: Array


def axis_estimates(
    observations: Observations, as_printed: bool = False
) -> AxisEstimates:
    """Bias, scale factor and offset from each axis, (20)-(23), (26)-(34).

    Parameters
    ----------
    observations : n positions with known angles
    as_printed : take (22), (23), (30), (34) as printed, to compare

    Raises
    ------
    NotObservable
        If no axis is determined.

    """
    p = observations.mounting
    outputs = observations.mean[:, ACC] @ p.T
    noise = p @ observations.covariance[:, ACC, ACC] @ p.T
    tables = expansion(observations)
    usable = [bool(determined_parameters(f)[0].all()) for f in tables]
    if not any(usable):
        raise NotObservable(
            f"{len(observations)} positions separate bias, scale factor and tilt on "
            "no axis: take at least three different α, or assume a level base"
        )
    # all coefficients in a row, and their gain by the outputs (20) (26)
    rows = [np.zeros((0, *outputs.shape))] * 3
    for axis in range(3):
        if usable[axis]:
            rows[axis] = np.linalg.pinv(tables[axis])[:, :, None] * np.eye(3)[axis]
    by_output = np.concatenate(rows)
    coefficients = np.einsum("knc,nc->k", by_output, outputs)
    limits = np.cumsum([0, *(len(r) for r in rows)])
    names, values, slope = _parameters_with_derivatives(
        coefficients, limits, observations.gravity, as_printed
    )
    gain = np.tensordot(slope, by_output, axes=1)
    covariance = np.einsum("pnc,ncd,qnd->pq", gain, noise, gain)
    return AxisEstimates(names, values, gain, covariance)


def five_position(
    observations: Observations, as_printed: bool = False
) -> ClosedFormEstimate:
    """Bias, scale factor and offset of the joints from five positions or more.

    Parameters and errors as of `axis_estimates`.
    """
    each = axis_estimates(observations, as_printed)
    pick, names = _parameter_rows(each, observations.mounting)
    return ClosedFormEstimate(
        names, pick @ each.values, pick @ each.covariance @ pick.T
    )


def expansion(observations: Observations) -> tuple[Array, Array, Array]:
    """Functions of the angles for the expansion of each axis, (n, 3 or 5) each."""
    a, b = observations.angles
    sa, ca, sb, cb = np.sin(a), np.cos(a), np.sin(b), np.cos(b)
    ones = np.ones_like(a)
    x = np.stack([ones, sa, ca], axis=1)  # (17)
    yz = np.stack([ones, ca * cb, ca * sb, sa * cb, sa * sb], axis=1)  # (24)
    return x, yz, yz


def _parameters_with_derivatives(
    c: Array, limits: Array, g: float, as_printed: bool
) -> tuple[tuple[str, ...], Array, Array]:
    """Parameters from all coefficients, and their derivatives by them."""
    stepped = np.vstack([c + 0j, c + 1j * tolerances.IMAGINARY_STEP * np.eye(len(c))]).T
    x, y, z = (stepped[i:j] for i, j in pairwise(limits))
    parameters = _parameters_of_axes(x, y, z, g, as_printed)
    table = np.stack(list(parameters.values()))
    return (
        tuple(parameters),
        table[:, 0].real,
        table[:, 1:].imag / tolerances.IMAGINARY_STEP,
    )


def _parameters_of_axes(
    x: Array, y: Array, z: Array, g: float, as_printed: bool
) -> Found:
    """(21)-(23), (27)-(34); coefficients (k, ...) of each axis, none if not usable."""
    out: Found = {}
    if len(x):
        a0 = x[1] / x[2] if as_printed else x[2] / x[1]  # (23)
        out |= _bias_and_scale("x", x, -x[1], g, as_printed)
        out["x.alpha0_deg"] = np.arctan(a0) / RAD
    if len(y):
        out |= _bias_and_scale("y", y, -y[1], g, as_printed)
        out["y.alpha0_deg"] = -np.arctan(y[3] / y[1]) / RAD  # (29)
        out["y.beta0_deg"] = -np.arctan(y[2] / y[1]) / RAD  # (28)
    if len(z):
        out |= _bias_and_scale("z", z, z[2], g, as_printed)
        out["z.alpha0_deg"] = -np.arctan(z[4] / z[2]) / RAD  # (33)
        out["z.beta0_deg"] = np.arctan(z[1] / z[2]) / RAD  # (32)
    return out


def _bias_and_scale(
    axis: str, c: Array, lead: Array, g: float, as_printed: bool
) -> Found:
    """Bias (21) (27) (31) and scale factor (22) (30) (34) of an axis."""
    sign = 1.0 if as_printed else np.sign(lead[0].real)
    norm = np.sqrt((c[1:] ** 2).sum(axis=0))
    return {f"{axis}.bias": c[0], f"{axis}.scale": sign * norm / g}


def _parameter_rows(
    each: AxisEstimates, mounting: Array
) -> tuple[Array, tuple[str, ...]]:
    """Rows that turn the axes' estimates into parameters of the device, (p, q).

    A device axis that points against a procedure axis has its bias reversed there; the
    scale factor is the same. Angles that several axes give are weighted by covariance.
    """
    picked: dict[str, Array] = {}
    units = np.eye(len(each.names))
    for group in ("bias", "scale"):
        for device in range(3):
            axis = int(np.abs(mounting[:, device]).argmax())
            name = f"{'xyz'[axis]}.{group}"
            if name in each.names:
                sign = mounting[axis, device] if group == "bias" else 1.0
                full = f"acc_{group}.{'xyz'[device]}"
                picked[full] = sign * units[each.names.index(name)]
    for part in ("alpha0_deg", "beta0_deg"):
        rows = [i for i, n in enumerate(each.names) if n.endswith(part)]
        if rows:
            weight = np.linalg.solve(
                each.covariance[np.ix_(rows, rows)], np.ones(len(rows))
            )
            picked[f"angle_offset.{part}"] = weight @ units[rows] / weight.sum()
    return np.array(list(picked.values())), tuple(picked)
