"""Noise of each window, and vibration at single frequencies in some windows.

An engine or a machine vibrates at a few frequencies. Such a sine does not average out
over a second, and it is no property of the sensors. In windows with more noise than
usual the significant lines are therefore fitted, a + b cos(2 pi f t) + c sin(2 pi f t)
in all outputs, and subtracted before rows are averaged. The strength of the vibration
in each window is measured before that.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from fieldcal.core.once import once_per_block
from fieldcal.core.samples import Array, Block, Index, Mask
from fieldcal.model import detections, tolerances
from fieldcal.model.rows.noise import noise_of, rounding_noise
from fieldcal.windows.noise import (
    ChannelNoise,
    converter_noise,
    short_lag_noise,
)


@dataclass(frozen=True, slots=True)
class WindowNoise:
    """Noise of the windows of a recording.

    Attributes
    ----------
    noise : (6,) usual standard deviation of one sample
    levels : (w, 6) standard deviation of one sample that applies to each window's means
    variance : (w, 3) of the accelerometers' samples in each window, squares of outputs
    block : the samples without the vibration lines of single windows

    """

    noise: Array
    levels: Array
    variance: Array
    block: Block


def measure_window_noise(block: Block, windows: Index, rate_hz: float) -> WindowNoise:
    """Measure the noise of every window.

    The usual noise is that of the quiet windows. In others, the smaller of two levels
    applies: the excess noise of samples, or the noise of means over a second.
    """
    found, more, loud = _compare_windows(block, windows, rate_hz)
    noise = found.white
    levels = np.sqrt(noise**2 + more)
    variance = levels[:, :3] ** 2
    six = block.six if loud.any() else np.empty((0, 6))
    for i in np.flatnonzero(loud).tolist():
        a, b = windows[i]
        measured = np.isfinite(block.acc[a:b]).any(axis=0)
        variance[i] = 0.0
        variance[i, measured] = np.nanvar(block.acc[a:b, measured], axis=0)
        six[a:b] = without_lines(six[a:b], rate_hz)
    if loud.any():
        block = block.with_six(six)
    for i in np.flatnonzero(loud).tolist():
        alone = noise_of(block, windows[i : i + 1], rate_hz).white
        levels[i] = np.fmax(noise, np.fmin(levels[i], alone))
    return WindowNoise(noise, levels, variance, block)


def quiet_window_noise(block: Block, windows: Index, rate_hz: float) -> ChannelNoise:
    """Noise of one sample in the quiet windows, (6,)."""
    return _compare_windows(block, windows, rate_hz)[0]


@once_per_block
def _compare_windows(
    block: Block, windows: Index, rate_hz: float
) -> tuple[ChannelNoise, Array, Mask]:
    """Usual noise (6,), excess variance of windows (w, 6), and loud windows (w,)."""
    out = np.empty((len(windows), 6))
    for i, (a, b) in enumerate(windows):
        out[i] = np.concatenate(
            [short_lag_noise(t[a:b]) for t in (block.acc, block.gyr)]
        )
    seen = np.isfinite(out).any(axis=0)
    grain = rounding_noise(block, windows)
    # outputs may stay on one step all through some
    stands = _never_changes(out, grain)
    out[stands] = np.nan
    finest = grain.min(axis=0)
    coarser = grain**2 - finest**2  # what rounding adds in some windows only
    own = np.sqrt(np.maximum(out**2 - coarser, 0.0))
    known = np.maximum(np.isfinite(own).sum(axis=0), 1)
    first = np.sort(own, axis=0)[(known - 1) // 4, np.arange(6)]  # nan comes last
    usual = np.fmax(first, finest)
    low = np.sqrt(usual**2 + coarser)
    margin = detections.NOISIER_SIGMAS / np.sqrt(
        np.maximum(np.diff(windows, axis=1), 2)
    )
    louder = out > low * np.exp(margin)
    loud: Mask = np.any(louder, axis=1)
    quiet = ~loud & ~stands.any(axis=1)
    quiet = quiet if quiet.any() else ~loud if not loud.all() else loud
    fine = quiet & (coarser == 0).all(axis=1)
    quiet = fine if fine.any() else quiet
    noise = noise_of(block, windows[quiet], rate_hz)
    white, quick = (
        np.where(seen & (finest > 0), np.fmax(n, finest), n)
        for n in (noise.white, noise.quick)
    )
    # of samples that were computed; of a value that is repeated nothing is known
    least = converter_noise(block)
    white, quick = (np.where(n > 0, np.maximum(n, least), n) for n in (white, quick))
    more = np.maximum(np.where(louder, out**2 - low**2, 0.0), 0.0) + coarser
    for found in (white, quick, more, loud):
        found.setflags(write=False)
    return ChannelNoise(white, quick), more, loud


def _never_changes(levels: Array, grain: Array) -> Mask:
    """Windows in which an output never changes although its noise exceeds a step.

    The output is stuck or saturated there, and has no information on the noise.

    Parameters
    ----------
    levels : (w, 6) deviation of one sample in each window
    grain : (w, 6) deviation within a step of the grid that outputs lie on

    """
    still: Mask = levels == 0
    usual = [np.median(c[c > 0]) if (c > 0).any() else 0.0 for c in levels.T]
    return still & (np.array(usual) > grain)


def without_lines(piece: Array, rate_hz: float) -> Array:
    """Samples (n, c) of a window less the lines that stand out of it.

    >>> t = np.arange(400) / 100
    >>> piece = np.sin(2 * np.pi * 17.3 * t)[:, None] + 9.8
    >>> bool(np.ptp(without_lines(piece, 100.0)) < 1e-6)
    True
    """
    known: Mask = np.all(np.isfinite(piece), axis=1)
    t = np.arange(len(piece)) / rate_hz
    out = piece.copy()
    if (
        known.sum() < detections.MIN_LINE_SAMPLES
        or len(piece) > tolerances.SAMPLES_AT_ONCE
    ):
        return out
    for _ in range(tolerances.MAX_LINES_OF_WINDOW):
        hz = _strongest_line_hz(out[known], rate_hz)
        if hz is None:
            break
        out = out - _fit_line(t, out, known, hz)
    return out


def _strongest_line_hz(y: Array, rate_hz: float) -> float | None:
    """Frequency of the strongest significant line, Hz; None if there is none."""
    n = 4 << (len(y) - 1).bit_length()
    taper = np.hanning(len(y))[:, None]
    power = np.abs(np.fft.rfft((y - y.mean(axis=0)) * taper, n, axis=0)) ** 2
    hz = np.fft.rfftfreq(n, 1 / rate_hz)
    power = power[hz >= detections.LOWEST_VIBRATION_HZ]
    if not len(power):
        return None
    level = np.maximum(np.median(power, axis=0), 1e-300)
    total = (power / level).max(axis=1)
    at = int(np.argmax(total))
    return (
        float(hz[hz >= detections.LOWEST_VIBRATION_HZ][at])
        if total[at] > detections.LINE_POWER_RATIO
        else None
    )


def _fit_line(t: Array, y: Array, known: Mask, hz: float) -> Array:
    """The line near a frequency, (n, c), its frequency fitted to all outputs.

    Each counts by its own noise, which is what the fit leaves of it.
    """
    for _ in range(tolerances.FREQUENCY_STEPS):
        design, amplitude = _fitted_waves(t, y, known, hz)
        left = (y - design @ amplitude)[known]
        rise = np.column_stack([-design[:, 2], design[:, 1]]) @ amplitude[1:]
        slope = (2 * np.pi * t[:, None] * rise)[known]
        slope -= design[known] @ np.linalg.lstsq(design[known], slope, rcond=None)[0]
        noise = np.sqrt(np.maximum((left**2).mean(axis=0), 1e-300))
        slope, left = slope / noise, left / noise
        step = float((slope * left).sum() / max(float((slope**2).sum()), 1e-300))
        hz += float(np.clip(step, -1 / t[-1], 1 / t[-1]))
    design, amplitude = _fitted_waves(t, y, known, hz)
    return design[:, 1:] @ amplitude[1:]


def _fitted_waves(t: Array, y: Array, known: Mask, hz: float) -> tuple[Array, Array]:
    """A constant, a cosine and a sine, (n, 3), and their amplitudes, (3, c)."""
    turned = 2 * np.pi * hz * t
    waves = np.column_stack([np.ones_like(t), np.cos(turned), np.sin(turned)])
    return waves, np.linalg.lstsq(waves[known], y[known], rcond=None)[0]
