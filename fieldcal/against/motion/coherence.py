"""Frequency up to which a recording and its reference show the same motion.

With S the spectra over pieces of both, the share of a channel j of the reference that a
triad x of the recording explains at a frequency is

    g_j = s_xj^H S_xx^-1 s_xj / S_jj                                               (1)

less the share that three inputs explain by chance. Above that frequency the reference
may differ from the motion of the sensor, as wheels do from a body on its springs.
Source: multiple coherence; J. Bendat and A. Piersol 2010.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

PIECE_S, HALF = 10.0, 0.5
"""Length of the pieces whose spectra are compared, s, and share of a channel's power
from which reference and device count as moving together."""

MIN_POWER_SHARE, MIN_POWER = 1e-6, 1e-12
"""Least power of an input, as a part of all power, and least power of any channel."""


def common_hz(x: Array, z: Array, rate_hz: float) -> float:
    """Frequency up to which a triad explains the channels of the reference, Hz.

    It is where the cumulated excess of the shares (1) over one half is largest; inf if
    that is the highest frequency, or if there is no motion.

    Parameters
    ----------
    x, z : (n, 3) outputs of the device, and of the reference; 0 where missing
    rate_hz : samples a second

    """
    seen = z[:, z.any(axis=0)]
    if not seen.size or not x.any():
        return np.inf
    length = min(int(PIECE_S * rate_hz), len(x))
    starts = range(0, len(x) - length + 1, length // 2)
    window = np.hanning(length)[:, None]
    parts = [np.fft.rfft(window * np.hstack([x, seen])[i : i + length], axis=0)
             for i in starts]  # fmt: skip
    spectra = np.einsum("pfi,pfj->fij", np.conj(parts), np.array(parts))
    inner, cross = spectra[:, :3, :3], spectra[:, :3, 3:]
    inner = (
        inner
        + MIN_POWER_SHARE * np.eye(3) * np.trace(inner, axis1=1, axis2=2)[:, None, None]
    )
    made = np.einsum("fij,fij->fj", cross.conj(), np.linalg.solve(inner, cross)).real
    own = np.einsum("fii->fi", spectra[:, 3:, 3:]).real
    alone = np.clip(1 - made / np.maximum(own, MIN_POWER), 0.0, 1.0)
    many = max(len(parts) * 2 / 3, 5.0)  # pieces overlap by half
    share = 1 - alone * (many - 1) / (many - 4)
    rise = np.cumsum(share[1:].min(axis=1) - HALF)
    hz = np.fft.rfftfreq(length, 1 / rate_hz)[1:]
    top = int(np.argmax(rise))
    return float(hz[top]) if top < len(hz) - 1 else np.inf
