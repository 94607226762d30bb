"""Accelerations of one magnitude: a direction is recorded instead of a specific force.

An attitude filter puts out the direction of gravity, often times 9.80665. All samples
have the same magnitude but for the rounding of their components to steps q,

    s = q / sqrt(12)                                                               (1)

Accelerometers have noise in every direction, and their biases and scale factors give
another magnitude in each position. A simulation without errors has none of them, and so
no noise across the direction either. Noise is that of fifth differences, as a sway is
smooth.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block
from fieldcal.physics.recording import grids_of

ROUNDED = 2.0
"""Largest scatter of the magnitude, in units of (1)."""

EXACT, LEAST = 1e-6, 1e-7
"""Largest scatter where values lie on no grid, and least noise across the direction, as
parts of the magnitude: numbers of single precision have 6e-8."""

ACROSS = 4.0
"""Least noise across the direction, in units of the scatter of the magnitude."""

ORDER, VARIANCE = 5, 252
"""Order of the differences, and their variance for white noise of unit variance."""


def refuse_direction_alone(
    block: Block, windows: Sequence[tuple[float, float] | None]
) -> None:
    """Refuse accelerations that are a direction times a constant.

    Raises
    ------
    InputError
        Naming the magnitude.

    """
    held = [block.between(*span).acc for span in windows if span is not None]
    said = direction_alone_text(held, float(grids_of(block)[:3].max()))
    if said:
        raise InputError(f"{said}; record its raw accelerations")


def direction_alone_text(held: Sequence[Array], step: float) -> str:
    """Sentence if accelerations are a direction; empty if they measure a force.

    Parameters
    ----------
    held : samples (n, 3) in each rest, m/s^2
    step : of the grid on which they lie, m/s^2; 0 without one

    """
    held = [acc for acc in held if len(acc) > ORDER]
    sizes = [np.linalg.norm(acc, axis=1) for acc in held]
    size = np.concatenate([np.zeros(0), *(own[np.isfinite(own)] for own in sizes)])
    if not len(size):
        return ""
    scatter, usual = float(size.std()), float(np.median(size, overwrite_input=True))
    rounded = ROUNDED * step / np.sqrt(12)  # (1)
    if not 0 < usual or scatter > max(rounded, EXACT * usual):
        return ""
    across = float(np.median([_noise_across(acc) for acc in held]))
    if across <= max(ACROSS * scatter, LEAST * usual):
        return ""
    return (
        f"all accelerations at rest have the magnitude {usual:.6g} m/s² within"
        f" {max(scatter, step):.1g} m/s², although they scatter by {across:.1g} m/s²"
        " across it: they are the direction of gravity, from a filter of the device,"
        " without bias and scale factor"
    )


def _noise_across(acc: Array) -> float:
    """Noise of a sample across the mean of a window, (n, 3) m/s^2; 0 if unknown."""
    mean = np.nanmean(acc, axis=0) if np.isfinite(acc).any() else acc[0]
    off = np.diff(acc, ORDER, axis=0)
    along = mean / np.linalg.norm(mean)
    across = np.linalg.norm(off - (off @ along)[:, None] * along, axis=1)
    across = across[np.isfinite(across)]
    usual = np.sqrt(2 * np.log(2) * VARIANCE)  # median size of two components
    return float(np.median(across) / usual) if len(across) else 0.0
