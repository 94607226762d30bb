"""Up to which frequency a recording and its reference show one motion.

With S the spectra over pieces of both, the share of a channel j of the reference that a
triad x of the recording makes at a frequency is

    g_j = s_xj^H S_xx^-1 s_xj / S_jj                                               (1)

less what three inputs make by chance. A body that pitches on its springs, say, is no
longer what its wheels say. Source: multiple coherence; J. Bendat and A. Piersol 2010.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Array

PIECE_S, HALF = 10.0, 0.5
"""Length of the pieces whose spectra are compared, s, and share of a channel's power
from which the reference counts as saying what the device goes through."""

EXACT, TINY = 1e-6, 1e-12
"""Part of all power that an input has for itself at least, and least power of any."""


def common_hz(x: Array, z: Array, rate_hz: float) -> float:
    """Frequency up to which a triad makes the channels that the reference has, Hz.

    Shares (1) above one half are counted up, and the frequency is where that is most;
    inf where it is that of all samples, or nothing is seen.

    Parameters
    ----------
    x, z : (n, 3) outputs, and the reference's; 0 where it has none
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
    inner = inner + EXACT * np.eye(3) * np.trace(inner, axis1=1, axis2=2)[:, None, None]
    made = np.einsum("fij,fij->fj", cross.conj(), np.linalg.solve(inner, cross)).real
    own = np.einsum("fii->fi", spectra[:, 3:, 3:]).real
    alone = np.clip(1 - made / np.maximum(own, TINY), 0.0, 1.0)
    many = max(len(parts) * 2 / 3, 5.0)  # pieces overlap by half
    share = 1 - alone * (many - 1) / (many - 4)
    rise = np.cumsum(share[1:].min(axis=1) - HALF)
    hz = np.fft.rfftfreq(length, 1 / rate_hz)[1:]
    top = int(np.argmax(rise))
    return float(hz[top]) if top < len(hz) - 1 else np.inf
