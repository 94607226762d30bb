"""Reduces the samples of a recording in motion to rows beside a reference.

A row is the mean of some samples of a stretch without gaps. Units: s, m/s^2, rad/s;
axes of the device.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
from scipy.fft import prev_fast_len

from fieldcal.core.samples import Array, Block, Index, Mask
from fieldcal.model import detections, resolutions, tolerances
from fieldcal.model.rows.motion import Alignment, MotionRows
from fieldcal.model.rows.reference import Reference
from fieldcal.model.rows.reference_noise import ReferenceNoise
from fieldcal.model.rows.response import Response
from fieldcal.model.rows.thermometer import Thermometer


def common_samples(block: Block, reference: Reference) -> Block:
    """Samples in which all channels have a value, if most have not.

    Where one triad is read more often than the other, every row would have a gap.
    """
    six = block.six[:, _compared_channels(block, reference)]
    whole = np.flatnonzero(np.isfinite(six).all(axis=1))
    if len(whole) < 2 or np.median(np.diff(whole)) == 1:
        return block
    kept, read = block[whole], np.isfinite(block.temperature)
    if read.any():  # perhaps in the other samples
        degrees = np.interp(kept.t, block.t[read], block.temperature[read])
        kept = replace(kept, temperature=degrees)
    return kept


def _compared_channels(block: Block, reference: Reference) -> Mask:
    """Measured channels of the triads of which the reference has any, (6,)."""
    told = np.repeat(reference.observed.reshape(2, 3).any(axis=1), 3)
    measured = np.isfinite(block.six).sum(axis=0) >= detections.MIN_SAMPLES
    compared: Mask = told & measured
    return compared


def rows_in_motion(
    block: Block,
    reference: Reference,
    alignment: Alignment,
    per_row: int,
    stretch_s: float,
    margin: float,
) -> MotionRows:
    """Reduce samples to rows, where the reference covers them.

    Parameters
    ----------
    block : the recording; a triad that the reference lacks altogether is left aside
    reference, alignment : of the motion
    per_row : samples of a row
    stretch_s : about how long a stretch is, s
    margin : s at both ends of the reference that are left out

    """
    six = block.six
    six[:, np.repeat(~reference.observed.reshape(2, 3).any(axis=1), 3)] = np.nan
    good = np.isfinite(six[:, _compared_channels(block, reference)]).all(axis=1)
    good &= reference.covers(alignment.reference_time(block.t), margin)
    kept = np.flatnonzero(good)
    step = float(np.median(np.diff(block.t)))
    stretches, length = _stretches(block.t, kept, per_row, stretch_s)
    at = np.concatenate(stretches).reshape(-1, per_row)
    # a thermometer may be read less often than the other sensors
    thermometer = Thermometer.of(block)
    warming, heating = thermometer.at(block.t[at].mean(axis=1))
    if not thermometer.changes:
        warming = np.full(len(at), np.nan)  # its noise is no change
    noise = ReferenceNoise.of(reference)
    stamps, uneven = block.t[at], _stamp_errors(block.t, stretches).reshape(at.shape)
    taken = stamps
    between = step * per_row / resolutions.KNOTS_PER_ROW
    if not uneven.any() and reference.step <= between:
        lasts = step * (1 + alignment.drift)  # by the clock of the reference, (1)
        offsets = lasts * _centred(per_row)
        reference = reference.averaged_over(offsets, between)
        noise = replace(noise, hidden=noise.hidden.averaged_over(offsets, between))
        taken, uneven = stamps.mean(axis=1, keepdims=True), np.zeros((len(at), 1))
    ideal = Response.of(reference)
    return MotionRows(
        stamps, taken, uneven, six[at].mean(axis=1), warming, heating, length,
        step * per_row, reference, noise, alignment, ideal, ideal,
    )  # fmt: skip


def _stretches(
    t: Array, kept: Index, per_row: int, length_s: float
) -> tuple[list[Index], int]:
    """Samples of the stretches without gaps, of whole rows, and rows of each.

    Parameters
    ----------
    t : (n,) s, of all samples
    kept : those that may be used
    per_row : samples of a row
    length_s : about how long a stretch is, s

    """
    step = float(np.median(np.diff(t)))
    broken = (np.diff(t[kept]) > detections.PAUSE_INTERVALS * step) | (
        np.diff(kept) > 1
    )
    length = max(int(length_s / step / per_row), 1)
    length = prev_fast_len(length, real=True)  # a prime one costs five times as much
    stretches = [
        run[: len(run) // (per_row * length) * per_row * length]
        for run in np.split(kept, np.flatnonzero(broken) + 1)
    ]
    return stretches, length


def _centred(count: int) -> Array:
    """Numbers of some samples, from their middle, (count,)."""
    return np.arange(count) - (count - 1) / 2


def _stamp_errors(t: Array, stretches: Sequence[Index]) -> Array:
    """By how much stamps are off a line through those of their stretch, (k,) s.

    Samples of a stretch are counted, so what was lost in it makes it uneven.
    """
    off = [np.empty(0)]
    for stretch in stretches:
        if len(stretch):
            count = _centred(len(stretch))
            stamps = t[stretch] - t[stretch].mean()
            off.append(stamps - count * (count @ stamps) / max(count @ count, 1.0))
    out: Array = np.concatenate(off)
    step = float(np.median(np.diff(t)))
    return np.where(np.abs(out) > tolerances.ACCUMULATED_ROUNDING * step, out, 0.0)
