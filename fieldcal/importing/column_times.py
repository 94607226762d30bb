"""Questions about the times of a recording in columns, with what it says itself."""

from __future__ import annotations

from shlex import quote

import numpy as np

from fieldcal.core.samples import Array
from fieldcal.importing.columns import SKIP
from fieldcal.importing.gravity_size import gravity_in
from fieldcal.importing.rate_size import rate_in
from fieldcal.importing.recording import TIME_UNITS, ReadOptions
from fieldcal.importing.time_units import CoarseClock, time_units

SLOWEST, USUAL, FASTEST = 5.0, 100.0, 8000.0
"""Rates of logs, Hz."""


def coarse_question(wanted: ReadOptions, coarse: CoarseClock, t: Array) -> str:
    """Ask for the rate where many rows share one of the times (n,)."""
    unit = wanted.time_unit or next(iter(time_units(t)), "s")
    rate = coarse.rows / (coarse.step * TIME_UNITS[unit])
    named = [c for c in wanted.columns if not c.startswith("t=")]
    names = [SKIP if name == "t" else name for name in named]
    return (
        f"its times step by {coarse.step:g} {unit}, with about {coarse.rows:.0f} rows"
        " in each, so they do not say when a row was taken: add --columns"
        f" {quote(','.join(names))} --rate {rate:.3g}"
    )


def rates_of_turns(wanted: ReadOptions, table: Array) -> dict[str, float]:
    """Rates, Hz, at which the turns are those that gravity shows, by unit."""
    at = {c.partition("=")[0]: i for i, c in enumerate(wanted.columns)}
    if not {"ax", "ay", "az", "gx", "gy", "gz"} <= set(at) or (
        table.shape[1] != len(wanted.columns)
    ):
        return {}
    acc, gyr = (table[:, [at[kind + axis] for axis in "xyz"]] for kind in "ag")
    gravity = gravity_in(acc)
    if gravity is None:
        return {}
    reads = rate_in(np.arange(len(table)) / 100.0, acc, gyr, gravity)
    if reads is None:
        return {}
    fits = {"rad/s": 1.0, "deg/s": float(np.rad2deg(1.0)), "mrad/s": 1e3}
    if wanted.gyr_unit:
        fits = {wanted.gyr_unit: 1 / wanted.gyr_scale}
    rates = {unit: 100 * reads / one for unit, one in fits.items()}
    sane = {u: rate for u, rate in rates.items() if SLOWEST <= rate <= FASTEST}
    return dict(sorted(sane.items(), key=lambda one: abs(np.log(one[1] / USUAL))))
