"""A table of means: one row for each position, in place of samples.

How well a mean is known, its scatter and the number of samples tell. Where nobody wrote
them down, it is what remains of

    |M a - b| = g                                                                  (1)

with bias, scale factor and coupling free (M upper triangular), over the degrees of
freedom left; and of the gyroscopes, whose outputs at rest are the bias whichever way up
they are, the deviation from row to row.
"""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.errors import InputError
from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import Array, Index, concat
from fieldcal.importing.recording import MeanScatter, Recording
from fieldcal.importing.tables.table_speeds import table_speeds, turned_rows
from fieldcal.importing.units.gravity_size import estimate_gravity

COUPLED_PARAMETERS, PLAIN_PARAMETERS = 9, 6
"""Parameters of (1) with coupling and without."""

REPEATS = 5
"""Times that the scatter is measured and the fit repeated with it."""

OUTLIER_SIGMAS = 6.0
"""Standard deviations beyond which a mean is none of the same scatter (2e-9)."""

SPARE = 3
"""Degrees of freedom that tell a scatter."""

MOST_STEPS = 50
"""Steps of a fit of (1): a sensor takes ten, what is none may take thousands."""

MOST_SCALE = 0.5
"""Part by which no scale factor is off."""

MOST_ROWS = 1000
"""Most rows that are taken for a position each: the search among causes grows with the
square of their number, and takes some minutes then."""

AS_CALM = 2.0
"""Ratio of what remains of (1) to the noise of a row within which (1) is all of it."""

ROUNDING_SHARE = 1e-9
"""Part of a mean below which a scatter is no noise of a sensor."""


class MeanUncertainty(NamedTuple):
    """Standard uncertainty of means.

    Attributes
    ----------
    sigma : (n, 6) m/s^2 and rad/s; nan where nothing tells
    why : where that is taken from; empty where the table says it

    """

    sigma: Array
    why: str


def estimate_mean_uncertainty(
    means: Array, scatter: Array, count: Array | None, gravity: float
) -> MeanUncertainty:
    """Estimate the standard uncertainty of means.

    Parameters
    ----------
    means : (n, 6) m/s^2 and rad/s
    scatter : (n, 6) standard deviation of the samples of each; nan where not written
    count : (n,) samples of each, where that is written
    gravity : m/s^2

    """
    # values that never change have the rounding of a computer for a scatter
    scatter = np.where(scatter > ROUNDING_SHARE * np.abs(means), scatter, np.nan)
    told, there = np.isfinite(scatter), np.isfinite(means)
    if count is not None:
        scatter = scatter / np.sqrt(np.maximum(count, 1.0))[:, None]
        if told.any() and told[there].all():
            return MeanUncertainty(scatter, "")
    shown = np.concatenate(
        [[_sphere_residual(means[:, :3], gravity)] * 3, _from_row_to_row(means[:, 3:])]
    )
    sigma = np.broadcast_to(shown, means.shape)
    why = "what remains of |a| = g and of steady rates"
    if told.any():
        at_most = np.fmin(sigma, scatter) if count is None else scatter
        sigma = np.where(told, at_most, sigma)
        limit = "their scatter at most" if count is None else "their scatter"
        why = f"{limit}, and {why}"
    sigma = np.where(there, sigma, np.nan)
    size = np.median(sigma[:, 0])
    return MeanUncertainty(
        sigma, f"{size:.2g} m/s^2: {why}" if np.isfinite(size) else ""
    )


def row_scatter(acc: Array, gravity: float) -> float | None:
    """Standard deviation of rows (n, 3), m/s^2, if (1) holds of all of them; else None.

    So it is of a device that turns so slowly that it feels gravity alone, and of a few
    readings in each position. What remains of (1) is then no more than rows that follow
    each other differ by, less a turn that goes on.
    """
    if not COUPLED_PARAMETERS + SPARE <= len(acc) <= MOST_ROWS:
        return None
    shown = estimate_gravity(acc, means=True)
    if shown is None or not shown.round:
        return None
    left = _residual(acc, COUPLED_PARAMETERS, gravity)
    bends = np.abs(np.diff(acc, n=2, axis=0)) / np.sqrt(6)
    noise = MAD_TO_SIGMA * np.median(bends, axis=0).max()
    return left if left < AS_CALM * noise else None


def _stated_uncertainty(said: str, means: Array) -> Array:
    """Standard uncertainty of means (n, 6) that the user states."""
    try:
        two = [float(one) for one in said.split(",")]
    except ValueError:
        two = []
    if not 1 <= len(two) <= 2 or min(two) <= 0:
        raise InputError(
            f"--sigma {said} cannot be: write one or two numbers above 0, such as"
            " 0.005,0.0005 (m/s^2, rad/s)"
        )
    row = np.repeat([two[0], two[-1] if len(two) > 1 else np.nan], 3)
    return np.where(np.isfinite(means), row, np.nan)


def _from_row_to_row(gyr: Array) -> Array:
    """Deviation of outputs at rest (n, 3) from their mean, rad/s."""
    shown = np.full(3, np.nan)
    for c, column in enumerate(gyr.T):
        known = column[np.isfinite(column)]
        if len(known) > SPARE:
            spread = float(known.std(ddof=1))
            rounded = ROUNDING_SHARE * float(np.abs(known).max())
            shown[c] = spread if spread > rounded else np.nan
    return shown


def _sphere_residual(acc: Array, gravity: float) -> float:
    """Residual of (1), m/s^2; nan if there are too few rows."""
    acc = acc[np.isfinite(acc).all(axis=1)]
    for free in (COUPLED_PARAMETERS, PLAIN_PARAMETERS):
        if len(acc) < free + SPARE:
            continue
        return _residual(acc[_consistent_rows(acc, free, gravity)], free, gravity)
    return float("nan")


def _residual(acc: Array, free: int, gravity: float) -> float:
    """What remains of (1), m/s^2; nan if it holds of no sensor, as M = 0 has it."""
    x, left = _fit(acc, free, gravity)
    return left if np.abs(x[3:6]).max() < MOST_SCALE else float("nan")


def _fit(acc: Array, free: int, gravity: float) -> tuple[Array, float]:
    """Parameters of (1), and the standard deviation that remains, m/s^2."""
    from scipy.optimize import least_squares

    found = least_squares(
        _misfit, np.zeros(free), args=(acc, gravity), max_nfev=MOST_STEPS
    )
    return found.x, float(np.sqrt(2 * found.cost / (len(acc) - free)))


def _consistent_rows(acc: Array, free: int, gravity: float) -> NDArray[np.bool_]:
    """Rows without outliers, such as a position in which the device was moved.

    Rows are rejected only if there are at least twice as many rows as parameters.
    """
    from scipy.optimize import least_squares

    # from what fits all, narrower step by step: far off, every row is one by itself
    x, size = _fit(acc, free, gravity)
    few = np.sqrt(len(acc) / (len(acc) - free))
    for _ in range(REPEATS):
        x = least_squares(
            _misfit, x, args=(acc, gravity), loss="cauchy", f_scale=size or 1.0
        ).x
        left = np.abs(_misfit(x, acc, gravity))
        size = MAD_TO_SIGMA * few * float(np.median(left))
    all_of_them = np.ones(len(acc), dtype=bool)
    near = left <= OUTLIER_SIGMAS * size
    for _ in range(REPEATS):
        if near.sum() < max(2 * free, len(acc) / 2):
            return all_of_them
        # the narrow fit leaves out some that the scatter of those that agree brings
        x, size = _fit(acc[near], free, gravity)
        near = np.abs(_misfit(x, acc, gravity)) <= OUTLIER_SIGMAS * size
    return near


def _misfit(free: Array, acc: Array, gravity: float) -> Array:
    matrix = np.diag(1 + free[3:6])
    matrix[np.triu_indices(3, 1)] = free[6:] if len(free) == COUPLED_PARAMETERS else 0.0
    left: Array = np.linalg.norm((acc - free[:3]) @ matrix.T, axis=1) - gravity  # (1)
    return left


def _list_of(sigma: Array) -> list[float | str]:
    """Standard uncertainties (6,) as they are written, up to the last known one.

    >>> _list_of(np.array([0.01, 0.02, 0.03, np.nan, 1e-4, np.nan]))
    [0.01, 0.02, 0.03, 'unknown', 0.0001]
    """
    known = np.isfinite(sigma)
    last = int(np.flatnonzero(known)[-1]) if known.any() else len(sigma) - 1
    return [
        float(f"{one:.4g}") if there else "unknown"
        for one, there in zip(sigma[: last + 1], known, strict=False)
    ]


def _rows_in_table(means: Array, table: Array) -> Index:
    """Rows of a table (m, 6) that became means (n, 6), in order, signs aside.

    Rows that cannot be read are in the table alone.
    """
    if len(means) == len(table):
        return np.arange(len(means))
    found, at = [], -1
    for row in np.abs(means):
        same = (
            i
            for i in range(at + 1, len(table))
            if np.allclose(np.abs(table[i]), row, rtol=1e-9, atol=0, equal_nan=True)
        )
        at = next(same, at)
        found.append(at)
    return np.array(found, dtype=np.intp)


def tables_of_means(
    recording: Recording,
    stream: str,
    scatter: MeanScatter,
    gravity: float,
    said: str = "",
) -> dict[str, Any]:
    """Tables of session.toml for a table of means: [means], [[position]], [guessed].

    Parameters
    ----------
    recording, stream, scatter : the table
    gravity : m/s^2
    said : by the user, "0.005,0.0005": sigma of accelerations and of rates, SI

    Raises
    ------
    InputError
        If nothing tells how well the means are known.

    """
    block = concat(recording.alone(stream).blocks(stream))
    if len(block) > MOST_ROWS:
        raise InputError(
            f"{recording.path}: has {len(block)} rows, and --sigma says that each is a"
            f" position: no more than {MOST_ROWS} are taken; leave it out if they are"
            " samples, or write every tenth row or so"
        )
    scale = np.repeat([recording.wanted.acc_scale, recording.wanted.gyr_scale], 3)
    rows = _rows_in_table(block.six, scatter.means * scale)
    # rows without any value are no positions
    told = np.isfinite(block.six).any(axis=1)
    block, rows = block[np.flatnonzero(told)], rows[told]
    many = None if scatter.many is None else scatter.many[rows]
    if said:
        found = MeanUncertainty(_stated_uncertainty(said, block.six), "")
    else:
        found = estimate_mean_uncertainty(
            block.six, scatter.values[rows] * scale, many, gravity
        )
    speeds = _speeds(recording, scatter, rows, block.gyr, found.sigma)
    if not np.isfinite(found.sigma[:, :3])[np.isfinite(block.acc)].all():
        raise InputError(
            f"{recording.path}: nothing says how well its {len(block)} means are known:"
            " add --sigma 0.005,0.0005 (of accelerations in m/s^2, of rates in rad/s),"
            f" or take {PLAIN_PARAMETERS + SPARE} positions or more, which tell it"
        )
    half = (float(np.diff(block.t).min()) if len(block) > 1 else 1.0) / 4
    positions = [
        {
            "start_s": round(float(t) - half, 6),
            "end_s": round(float(t) + half, 6),
            "sigma": _list_of(row),
            **({"speed_deg_s": round(float(speed), 9)} if speed > 0 else {}),
        }
        for t, row, speed in zip(block.t, found.sigma, speeds, strict=True)
    ]
    guessed = {"guessed": {"sigma": found.why}} if found.why else {}
    return {"means": {"timed": scatter.timed}, "position": positions, **guessed}


def _speeds(
    recording: Recording, scatter: MeanScatter, rows: Index, gyr: Array, sigma: Array
) -> Array:
    """Rates of the table (n,) that turned the device, deg/s; 0 where it rested.

    Where nothing says the rate of rows that turned, their rates are unknown in `sigma`
    (n, 6), as they are no biases: it is said.
    """
    if scatter.speeds is not None:
        said = scatter.speeds[rows]
        speeds = table_speeds(said, scatter.speed_unit, gyr, str(recording.path))
        return np.nan_to_num(np.rad2deg(speeds))
    turned = turned_rows(gyr)
    if turned.any():
        fastest = float(np.rad2deg(np.nanmax(np.abs(gyr[turned]))))
        odd = (
            f"{int(turned.sum())} of its rows turned, at up to {fastest:.3g} deg/s, and"
            " no column says the rate of the table: "
        )
        if not np.isfinite(sigma[turned, :3]).any():
            raise InputError(
                f"{recording.path}: {odd}write it into one, such as rate (deg/s)"
            )
        sigma[turned, 3:] = np.nan
        recording.says.append(
            f"{odd}their rates are not used; write it into one, such as rate (deg/s)"
        )
    return np.zeros(len(gyr))
