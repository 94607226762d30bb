"""Kalibr's imu.yaml, with its scale and misalignment model: true -> raw.

Kalibr predicts what the sensors say,

    U = M_a f + b_a                                                                (1)
    W = M_g C w + b_g,   C a rotation                                              (2)

like fieldcal, so M_a = M is written unchanged, even if it is full. Kalibr's M are lower
triangular: for the gyroscopes M = M_g C is split exactly into such an M_g and a
rotation C. Biases are written for information, since Kalibr estimates them anew.

The noise density is that of means over 1 s within the windows of the session,

    N^2 = <(y_k+1 - y_k)^2> / 2 * 1 s                                              (3)

of the noisiest axis of each triad, +- sqrt(3 / n) / 2 of it by n differences: each mean
is in two of them. The random walk needs hours at rest and is not
filled in. If the session has a noise.json, all four numbers are taken from it. Units:
m/s^2, rad/s. Source: Kalibr wiki, IMU noise model and yaml formats.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.samples import ACC, GYR, Array, Block
from fieldcal.exporters import ExportSource
from fieldcal.session.file_writing import write_atomically
from fieldcal.session.folder import Session
from fieldcal.session.noise_file import read_noise

WHAT = "Kalibr's imu.yaml (noise, M, C, bias)"
ENDING = "_imu.yaml"

MEAN_S = 1.0
"""Length of the means in (3), s."""


def split_rotation(matrix: Array) -> tuple[Array, Array]:
    """Lower triangular M_g and rotation C with M_g C = matrix, (2)."""
    q, r = np.linalg.qr(matrix.T)
    # a negative diagonal would be a reflection
    signs = np.diag(np.where(np.diag(r) < 0, -1.0, 1.0))
    return (signs @ r).T, (q @ signs).T


def window_noise_density(session: Session) -> tuple[Array, Array]:
    """Noise density of the six channels by (3), (6,), and its standard error.

    Both are nan if no window is long enough.
    """
    squares, many = np.zeros(6), np.zeros(6)
    block = session.block  # before its windows, which reading corrects
    for window in session.windows:
        if window is None:
            continue
        means = _means(block.between(*window))
        steps = np.diff(means, axis=0) ** 2
        squares += np.nansum(steps, axis=0)
        many += np.isfinite(steps).sum(axis=0)
    n = np.where(many > 0, many, np.nan)
    density = np.sqrt(squares / (2 * n) * MEAN_S)  # (3)
    return density, density * np.sqrt(3 / n) / 2


def _means(block: Block) -> Array:
    """Means over 1 s without the last, incomplete one, (k, 6)."""
    if not len(block):
        return np.empty((0, 6))
    cells = ((block.t - block.t[0]) / MEAN_S).astype(int)
    starts = np.searchsorted(cells, np.arange(cells[-1] + 1))
    whole = [part for part in np.split(block.six, starts[1:])[:-1] if len(part)]
    return np.array([part.mean(axis=0) for part in whole]).reshape(-1, 6)


def write(source: ExportSource, path: Path) -> list[str]:
    """Write the file; returns notices for the user."""
    says = list(source.matrix_notices)
    acc_bias, acc = source.linear("acc")
    gyr_bias, gyr = source.linear("gyr")
    lower, turn = split_rotation(gyr)
    lines = ["# fieldcal: raw = M true + bias (true -> raw), m/s^2 and rad/s"]
    lines += [f"# {kind} was not determined: 0" for kind in source.zero_couplings]
    found = read_noise(source.session.folder)
    lines += (
        _densities_of_windows(source.session, says)
        if found is None
        else _densities_of_noise_file(found)
    )
    rate = source.session.rate_hz
    lines += [
        "rostopic: /imu/raw",
        f"update_rate: {rate:.6g}" if np.isfinite(rate) else "# update_rate: unknown",
        "model: scale-misalignment",
        "accelerometers:",
        f"  M: {yaml_array(acc)}",
        f"  bias: {yaml_array(acc_bias)}",
        "gyroscopes:",
        f"  M: {yaml_array(lower)}",
        f"  C_gyro_i: {yaml_array(turn)}",
        "  A: [[0.0, 0.0, 0.0], [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]]",
        f"  bias: {yaml_array(gyr_bias)}",
    ]
    write_atomically(path, "\n".join(lines) + "\n")
    return says


def _densities_of_windows(session: Session, says: list[str]) -> list[str]:
    """Lines with the noise densities of the session's windows, (3)."""
    (noise, error), lines = window_noise_density(session), []
    six = session.block.six
    for name, part in (("accelerometer", ACC), ("gyroscope", GYR)):
        if np.isfinite(noise[part]).any():
            i = int(np.nanargmax(noise[part]))
            value = _yaml_number(float(f"{noise[part][i]:.6g}"))
            lines.append(f"{name}_noise_density: {value}  # +- {error[part][i]:.2g}")
        else:
            lines.append(f"# {name}_noise_density: not determined")
            why = "no window of the session lasts 2 s"
            if not np.isfinite(six[:, part]).any():
                why = f"the session has no {name}s"
            says.append(f"{name}_noise_density was not determined: {why}")
        lines.append(f"# {name}_random_walk: not determined")
    says.append(
        "the random walks are not determined by windows of seconds: run fieldcal noise "
        f"on hours at rest, and put its noise.json into {session.folder}"
    )
    return lines


def _densities_of_noise_file(found: Mapping[str, Any]) -> list[str]:
    """Lines with Kalibr's four noise parameters of a noise.json, with their ±."""
    lines = []
    for name, told in found["for"]["kalibr"].items():
        sigma = told.get("sigma")
        how = "not exceeded in 95 of 100" if sigma is None else f"+- {sigma:.2g}"
        lines.append(f"{name}: {_yaml_number(told['value'])}  # {how}")
    return lines


def yaml_array(array: Array) -> str:
    """An array as YAML, in which a number with an exponent needs a decimal point."""
    if array.ndim == 2:
        return "[" + ", ".join(yaml_array(row) for row in array) + "]"
    return "[" + ", ".join(_yaml_number(float(x)) for x in array) + "]"


def _yaml_number(value: float) -> str:
    text = f"{value:.12g}"
    mantissa, e, exponent = text.partition("e")
    return f"{mantissa}{'' if '.' in mantissa else '.0'}{e}{exponent}"
