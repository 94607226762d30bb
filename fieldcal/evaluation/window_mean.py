"""Average of one window of a recorded session.

A window that was not recorded by a live run may contain a disturbance. Its mean is then
that of its longest calm part, and a remark says so. On a rate table gravity rotates in
device axes, and the accelerometers are not used.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from fieldcal.core.errors import Moved, SessionError
from fieldcal.core.samples import Array, Block, Grain
from fieldcal.model.rows.orientation import gyro_readings
from fieldcal.model.rows.turntable import fit_rotating_earth_rate
from fieldcal.session.description import Description
from fieldcal.windows import Average, LearnedNoise, Window, average

MIN_CALM_S = 5.0
"""Shortest calm part of a disturbed window that is worth using, s."""


def average_window(
    block: Block,
    span: tuple[float, float] | None,
    noise: LearnedNoise | None,
    grain: Grain,
) -> tuple[Average, LearnedNoise | None, str]:
    """Average of a window, the noise learned from it, and a remark, "" if none.

    Parameters
    ----------
    block : the recording
    span : start and end of the window, s of device time; None where it has none
    noise : noise learned from earlier windows
    grain : step that the device rounds to

    Raises
    ------
    SessionError
        If it has no samples.
    Moved
        If no part of it was calm.

    """
    span = _known_span(span)
    part = block.between(*span)
    if len(part) < 2:
        raise SessionError(
            f"no samples lie between {span[0]:g} and {span[1]:g} s; the recording"
            f" spans {block.t[0]:g} to {block.t[-1]:g} s"
        )
    window = Window(noise=noise, grain=grain)
    window.add(part)
    try:
        return window.average(), window.noise and window.noise.spectrum_shape_only, ""
    except Moved as moved:
        calm = _average_calm_part(part, moved, noise, grain)
        if calm is None:
            raise
        remark = (
            f"{moved}; its mean is that of the calm part from {calm.start:.1f} to"
            f" {calm.end:.1f} s"
        )
        return calm, noise, remark


def _known_span(span: tuple[float, float] | None) -> tuple[float, float]:
    if span is None:
        raise SessionError("its window was not taken before the recording ended")
    return span


def table_rate(
    block: Block, span: tuple[float, float] | None, about: Description, row: int
) -> Array:
    """Rate of the table in a position by its number, in device axes, (3,) rad/s.

    If the axis is unknown, the rate is along the mean of the gyroscopes in the window.
    """
    part = (
        block.between(*_known_span(span)).gyr
        if about.positions[row].on_turning_table
        else None
    )
    if part is None or not len(part):
        return np.zeros(3)
    at = np.full(len(part), row, dtype=np.intp)
    found: Array = (
        gyro_readings(about, at, part).rates(about.mounting)[0] @ about.mounting
    )
    return found


def without_table_rotation(block: Block, rate: Array) -> tuple[Block, Array]:
    """A window without the part that rotates with a rate table, and its covariance.

    Gravity rotates, so the accelerometers are set to nan. The rotating part of the
    Earth's rate is subtracted; the covariance (3, 3) is that of the gyroscopes' mean.

    Parameters
    ----------
    block : samples of one window
    rate : (3,) of the table in device axes, rad/s

    """
    blind = replace(block, acc=np.full_like(block.acc, np.nan))
    if len(block) < 2 or not np.isfinite(block.gyr).any(axis=0).all():
        return blind, np.zeros((3, 3))
    noise = np.nanstd(np.diff(block.gyr, axis=0), axis=0) / np.sqrt(2)
    sd = np.broadcast_to(np.where(noise > 0, noise, np.nan), block.gyr.shape)
    found = fit_rotating_earth_rate(block.t, rate, block.gyr, sd, np.ones(3), 0.0)
    return replace(blind, gyr=block.gyr - found.values), found.covariance


def average_turntable_window(
    block: Block, span: tuple[float, float] | None, rate: Array, grain: Grain
) -> tuple[Average, str]:
    """Average while a table turns at some rate, (3,) rad/s in device axes.

    Otherwise as `average_window`.
    """
    span = _known_span(span)
    at_rest, by_rotation = without_table_rotation(block.between(*span), rate)
    mean, _, remark = average_window(at_rest, span, None, grain)
    covariance = mean.covariance.copy()
    covariance[3:, 3:] += by_rotation
    return replace(mean, covariance=covariance), remark


def _average_calm_part(
    block: Block, moved: Moved, noise: LearnedNoise | None, grain: Grain
) -> Average | None:
    """Average of the longest calm part; None if all are shorter than `MIN_CALM_S`."""
    sides = [
        block.between(-float("inf"), moved.at),
        block.between(moved.at, float("inf")),
    ]
    best: Average | None = None
    for side in sorted(sides, key=len, reverse=True):
        length = float(side.t[-1] - side.t[0]) if len(side) > 1 else 0.0
        if length < MIN_CALM_S or (best and length <= best.end - best.start):
            continue
        try:
            found: Average | None = average(side, noise=noise, grain=grain)
        except Moved as again:
            inside = side.t[0] < again.at < side.t[-1]
            # a disturbance lasts: the samples after its first instant are disturbed too
            shifted = again.at if inside else side.t[0] + 1.0
            found = _average_calm_part(
                side, Moved(str(again), shifted, again.axis), noise, grain
            )
        if found and (best is None or found.end - found.start > best.end - best.start):
            best = found
    return best
