"""Whether a hand holds a device, and in which windows.

The gyroscopes show in which windows and about which axes a device trembles: the
integrated rate has about a straight line the variance

    a^2 + N^2 T / 15                                                               (1)

with a the rms angle of the tremor over T s, and N the density of the white noise, whose
integral is a random walk. The noise of the sensors is the same in all windows: over a
second, (1) without a hand varies by a few tenths, and a hand makes it some ten times as
large. The accelerometers show the slow part of a tremor, in all windows together: in a
hand the direction of the force varies beyond their noise, on a table it does not.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array, Block, Mask
from fieldcal.model import detections, thresholds
from fieldcal.model.rows.averages import Rows
from fieldcal.windows.noise import is_to_and_fro, quickest_noise


def trembling_windows(rows: Rows, pieces: list[Block], rate: float) -> Mask:
    """Windows in which a hand moves the device, while it rests in others, (k,).

    `pieces` are the samples of each, at `rate` Hz.
    """
    if len(pieces) < detections.MIN_HELD_WINDOWS:
        return np.zeros(len(pieces), dtype=bool)
    shown = np.array([_relative_tremor(piece.gyr, rate) for piece in pieces])
    known = np.isfinite(shown).all(axis=0) & (shown > 0).all(axis=0)
    if not known.any():
        return np.zeros(len(pieces), dtype=bool)
    sensors = np.quantile(shown[:, known], detections.QUIET_SHARE, axis=0)
    apart: Mask = (shown[:, known] / sensors).mean(
        axis=1
    ) > detections.LYING_NOISE_RATIO
    return apart


def _relative_tremor(rates: Array, rate: float) -> Array:
    """Variance (1) over a second, relative to that of white noise alone, (3,).

    nan for an axis without noise or without samples.
    """
    noise = _high_frequency_noise(rates)
    measured, unrest = np.isfinite(noise), np.full(3, np.nan)
    if not measured.any():
        return unrest
    many = min(len(rates), max(round(rate), 8))
    white = noise[measured] ** 2 / rate * (many / rate) / 15
    rates = rates if measured.all() else rates[:, measured]
    parts = len(rates) // many
    length, more = divmod(len(rates), parts)  # more of them have a sample more
    longer = more * (length + 1)
    turned = [
        tremor_rms(part.reshape(alike, -1, len(white)), n / rate, 0.0 * white) ** 2
        for part, alike, n in (
            (rates[:longer], more, length + 1),
            (rates[longer:], parts - more, length),
        )
        if alike
    ]
    # a hand does so all the time, and a bump in a second or two
    usual = np.median(np.concatenate(turned), axis=0)
    unrest[measured] = usual / np.where(white > 0, white, np.nan)
    return unrest


def _high_frequency_noise(rates: Array) -> Array:
    """Standard deviation of the high-frequency noise of one sample, (3,).

    nan for an axis without samples.
    """
    out = np.full(3, np.nan)
    known = np.isfinite(rates)
    measured = (known[4:] & known[3:-1] & known[2:-2] & known[1:-3] & known[:-4]).any(
        axis=0
    )
    if measured.any():
        out[measured] = quickest_noise([rates[:, measured]])
    return out


def noise_beside_tremor(rows: Rows, pieces: list[Block], least: Array) -> Array | None:
    """Noise of one sample without the tremor, (6,); None if there is no tremor.

    `pieces` are the samples of windows, `least` (6,) the noise of rounding.
    """
    free = ~rows.x.oriented.any() and len(pieces) >= detections.MIN_HELD_WINDOWS
    if not free or not is_to_and_fro([piece.gyr for piece in pieces]):
        return None
    # where a hand is quick, differences of samples show it as well
    each = np.ma.masked_invalid([_high_frequency_noise(piece.gyr) for piece in pieces])
    loud = (each / each.mean(axis=0)).mean(axis=1).filled(np.inf)
    quiet = np.argsort(loud)[: max(round(detections.QUIET_SHARE * len(pieces)), 1)]
    return np.fmax(quickest_noise([pieces[i].six for i in quiet]), least)


def tremor_rms(values: Array, length: float, white: Array) -> Array:
    """Rms of the integrated outputs, an angle or a speed, about a line, (..., k).

    Parameters
    ----------
    values : (..., n, k) outputs, nan where missing
    length : T, s
    white : (k,) deviation of the mean by white noise, N / sqrt(T)

    """
    known, n = np.isfinite(values), values.shape[-2]
    count = np.maximum(known.sum(axis=-2, keepdims=True), 1)
    mean = np.where(known, values, 0.0).sum(axis=-2, keepdims=True) / count
    total = np.cumsum(np.where(known, values - mean, 0.0), axis=-2) * (length / n)
    part = np.linspace(-1.0, 1.0, n)  # straight, and even about zero
    total -= total.mean(axis=-2, keepdims=True)
    slope = (part @ total) / (part @ part)
    total -= part[:, None] * slope[..., None, :]
    noise = (white * length) ** 2 / 15
    out: Array = np.sqrt(np.maximum((total**2).mean(axis=-2) - noise, 0.0))  # (1)
    return out


def force_wander_angle(rows: Rows, trembles: bool) -> float:
    """Rms angle by which the force turns within windows, rad; 0 on a table.

    On a table that is shaken it varies along the force nearly as much as across it.
    Where gyroscopes show that the device `trembles` in some windows only, more across
    than along is enough: a hand that holds it in these holds it in others.
    A course that all windows share is subtracted: outputs that settle make one. The
    window that varies most does not count: a hand holds the others as well, and a knock
    or a jump of a bias is in one.
    """
    x, usable = rows.x, rows.used[:, :3].all(axis=1) & ~rows.x.oriented
    held = [usable & (x.position == p) for p in np.unique(x.position[usable])]
    held = [at for at in held if at.sum() > 1]
    if len(held) < detections.MIN_HELD_WINDOWS:
        return 0.0
    offs = [rows.y[at, :3] - rows.y[at, :3].mean(axis=0) for at in held]
    squares, angle = list[tuple[float, float, float]](), []
    for at, off in zip(held, _without_shared_course(offs), strict=True):
        up = x.f[at][0] / np.linalg.norm(x.f[at][0])
        sd = rows.sd[at, :3]
        part = np.outer(off @ up, up)
        free = (len(off) - 1) * (1 - 1 / len(held))
        along, across = ((one / sd) ** 2 for one in (part, off - part))
        squares.append((float(across.sum()), float(along.sum()), free))
        length = np.linalg.norm(rows.y[at, :3].mean(axis=0))
        angle.append(((off - part) ** 2).sum() / (2 * free) / length**2)
    across, along, dof = np.sum(sorted(squares, key=lambda s: s[0] / s[2])[:-1], axis=0)
    ratio = 1.0 if trembles else detections.HELD_RATIO
    if across / 2 < max(dof + thresholds.DECIDES * np.sqrt(dof), ratio * along):
        return 0.0
    return float(np.sqrt(np.mean(angle)))


def _without_shared_course(offs: list[Array]) -> list[Array]:
    """Courses within windows, (n, 3) each, less their median course."""
    longest = max(map(len, offs))
    whole = np.full((len(offs), longest, 3), np.nan)
    for i, off in enumerate(offs):
        whole[i, : len(off)] = off
    shared = np.nanmedian(whole, axis=0)
    return [off - shared[: len(off)] for off in offs]
