"""The figures of the 2023 paper, and what follows from them.

    python -m benchmarks papers [DEVICES]

Tables 1 to 3, 5 and 6 of V. Avrutov, D. Pozniak, Calibration of the inertial
measurement unit in critical conditions, 2023, as printed; they lie beside the project
and are not part of it. Table 4 is a copy of table 1. Then what the papers leave to
others: a base that sways, DEVICES simulated ones a row (`sway`).
"""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np

from benchmarks._words import how_many
from benchmarks.injected.recorded import REAL
from benchmarks.joint import OFFSET, SIGMA, G, bound, observed
from benchmarks.papers.sway import through_sway
from fieldcal.core.positions import FIVE_POSITIONS, TWO_POSITIONS
from fieldcal.core.samples import Array
from fieldcal.solve.closed_form import two_position
from fieldcal.solve.five_position import axis_estimates

TABLES = REAL.parent / "paper" / "tables.toml"
ONE_DEG = np.deg2rad(1.0)
SIX = ("dUx0", "dUy0", "dUz0", "dK11", "dK22", "dK33")
ANGLES = {
    "dalpha01_deg": ("x", "alpha0_deg"), "dalpha02_deg": ("y", "alpha0_deg"),
    "dalpha03_deg": ("z", "alpha0_deg"), "dbeta01_deg": ("y", "beta0_deg"),
    "dbeta02_deg": ("z", "beta0_deg"),
}  # fmt: skip
"""What table 3 calls the angles, and which axis (23), (28), (29), (32), (33) find."""

DIGIT = 1e-4 / 12**0.5
"""Standard deviation of rounding to the last digit of tables 5 and 6, rad/s."""

DOUBTED = -0.0416
"""Of table 1, U_y0 after 30 s: a misprint or an outlier, as the errata say."""

Tables = Mapping[str, Any]


def tilted() -> Array:
    """What two positions as of a level base make of zeros one degree off, (6,).

    On the device of the experiment, which reads +g on y at home.
    """
    a, b = np.array([[p.alpha, p.beta] for p in TWO_POSITIONS]).T + ONE_DEG
    force = G * np.array(
        [-np.sin(a), np.cos(a) * np.cos(b), -np.cos(a) * np.sin(b)]
    )  # (15)
    # the axes of that device stand the other way: its y and z are turned over
    found = two_position(observed(TWO_POSITIONS, force.T * [1, -1, -1]))
    sign = np.array([1, -1, -1, 1, 1, 1])
    errors: Array = (found.values - [0, 0, 0, 1, 1, 1]) * sign
    return errors


def printed_sigma() -> dict[str, float]:
    """What (20), (26)-(33) make of 1 mm/s^2 in each mean, deg, by table 3's names."""
    means, _ = OFFSET.means(FIVE_POSITIONS)
    each = axis_estimates(observed(FIVE_POSITIONS, means))
    spread = SIGMA * np.sqrt((np.asarray(each.gain) ** 2).sum(axis=(1, 2)))
    by_name = dict(zip(each.names, spread.tolist(), strict=True))
    return {key: by_name[f"{axis}.{name}"] for key, (axis, name) in ANGLES.items()}


def apart(until_s: Array, means: Array) -> tuple[Array, Array, Array]:
    """Means over 0 to T for several T as means of the stretches between.

    Returns
    -------
    middle : (n,) s
    mean : (n,)
    sigma : (n,) by the rounding of both

    """
    start = np.concatenate([[0.0], until_s[:-1]])
    total, lasts = until_s * means, until_s - start
    mean = np.diff(total, prepend=0.0) / lasts
    sigma = DIGIT * np.hypot(until_s, start) / lasts
    return (start + until_s) / 2, mean, sigma


def left(columns: Array, mean: Array, sigma: Array) -> float:
    """chi2 that a weighted fit of some columns (n, k) leaves."""
    white = columns / sigma[:, None]
    found = np.linalg.lstsq(white, mean / sigma, rcond=None)[0]
    rest = mean / sigma - white @ found
    return float(rest @ rest)


def warming(middle: Array, mean: Array, sigma: Array) -> tuple[float, float]:
    """chi2 that the best exponential leaves, and its time constant, s."""
    every = [
        (left(np.column_stack([middle**0, np.exp(-middle / tau)]), mean, sigma), tau)
        for tau in np.geomspace(5, 500, 60).tolist()
    ]
    return min(every)


def noise_left(until_s: Array, errors: Array) -> float:
    """What white noise leaves in the last of some means from the start.

    Of the means of the stretches between, d s long and m of them, N^2 is the mean of
    d (mean - whole)^2, and N / sqrt(T) is left after T.
    """
    _, each, _ = apart(until_s, errors)
    lasts = np.diff(until_s, prepend=0.0)
    whole = float(each @ lasts) / until_s[-1]
    density = float(lasts @ (each - whole) ** 2) / (len(each) - 1)
    return float(np.sqrt(density / until_s[-1]))


def over_time(table: Mapping[str, Any]) -> dict[str, tuple[float, float, float]]:
    """Errors of each parameter after the shortest and the longest time, and noise then.

    Figures 4, 7 and 8 draw tables 1 and 3. The value that the errata doubt is left out.
    """
    until, out = np.array(table["averaging_s"], dtype=float), {}
    for name, values in table.items():
        if not name.startswith("d"):
            continue
        errors = np.array(values)
        kept = ~np.isclose(errors, DOUBTED)
        left = noise_left(until[kept], errors[kept])
        out[name] = float(errors[0]), float(errors[-1]), left
    return out


def figures(tables: Tables) -> None:
    """Figures 4, 7 and 8: the error after the longest time, and what of it is noise."""
    print("\nfigures 4 (table 1), 7 and 8 (table 3): error after the shortest and the"
          " longest time, and noise left then")  # fmt: skip
    for table in ("table1", "table3"):
        for name, (first, last, left_by) in over_time(tables[table]).items():
            print(f"{table} {name:14}{first:10.5f}{last:10.5f}{left_by:10.5f}")


def two_positions(tables: Tables) -> None:
    """Table 2 less table 1, 60 s, beside one degree of (15)."""
    print("table 2 - table 1, 60 s   measured  one degree, as (15) adds it")
    for key, expected in zip(SIX, tilted(), strict=True):
        seen = tables["table2"][key][2] - tables["table1"][key][2]
        print(f"{key:24} {seen:9.4f} {expected:9.4f}")


def five_positions(tables: Tables) -> None:
    """Table 3: errors of the angles, and the noise that would make them."""
    seconds, sigma = tables["table3"]["averaging_s"], printed_sigma()
    limit = dict(zip(("alpha", "beta"), bound(OFFSET, FIVE_POSITIONS)[6:], strict=True))
    print("\ntable 3, deg; sigma for 1 mm/s^2 in each mean")
    heading = "".join(f"{s:>8} s" for s in seconds)
    print(f"{'':14}{heading}  printed solution  bound of one joint fit")
    for key, one in sigma.items():
        errors = "".join(f"{e:10.3f}" for e in tables["table3"][key])
        print(f"{key:14}{errors}{one:15.3f}{limit[key[1:].split('0')[0]]:18.3f}")


def starts(tables: Tables) -> None:
    """Tables 5 and 6: what the biases of the gyroscopes did in two minutes."""
    print("\ntables 5 and 6, 1e-4 rad/s: means of 0-15, 15-30, 30-60, 60-120 s")
    print(f"{'':10}{'':36}  chi2: constant   ramp   exponential (time constant)")
    for table in ("table5", "table6"):
        until = np.array(tables[table]["averaging_s"], dtype=float)
        for axis in ("Bx", "By", "Bz"):
            middle, mean, sigma = apart(until, np.array(tables[table][axis]))
            constant = left(middle[:, None] ** 0, mean, sigma)
            ramp = left(np.column_stack([middle**0, middle]), mean, sigma)
            fades, tau = warming(middle, mean, sigma)
            seen = "".join(f"{1e4 * m:9.1f}" for m in mean)
            print(f"{table} {axis} {seen}  {constant:14.1f} {ramp:6.1f} {fades:9.1f}"
                  f"  ({tau:.0f} s)")  # fmt: skip


def main() -> None:
    """Print the tables."""
    if TABLES.is_file():
        tables = tomllib.loads(TABLES.read_text(encoding="utf-8"))
        two_positions(tables)
        five_positions(tables)
        figures(tables)
        starts(tables)
    else:
        print(f"the paper's tables are not here: {'/'.join(TABLES.parts[-3:])}")
    through_sway(how_many(2))
