"""Samples of two devices on one port, under the same names: their mean is of neither.

Each window shows how far they are apart. Two devices differ by the same in all windows,
but for their scale factors. So a vibration of half the sampling rate, whose phase at
the samples is another in each window, is not taken for a second device.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.windows.alternation import CLEAR, TwoMeans, alternating_means

MOST_SAMPLES = 500
"""Samples of each window that are looked at."""

FEWEST_WINDOWS = 2
"""Windows by which two devices are told from a vibration."""

SAME_WITHIN = 0.2
"""Largest change of the difference from window to window, as a share of it: scale
factors change it by some per cent of g, which is less than most biases differ by."""

GIVE_EACH_A_PORT = (
    "record one device only: give each a port, names or a frame of its own, or have one"
    " of them send nothing"
)
"""What to do about two devices on one port."""


def difference_text(means: TwoMeans) -> str:
    """The clearest difference of each sensor, such as ``ax by 0.49 m/s²``."""
    parts, clear = [], np.abs(means.apart) / means.noise
    for first, unit in ((0, "m/s²"), (3, "rad/s")):
        at = first + int(clear[first : first + 3].argmax())
        if clear[at] > CLEAR:
            parts.append(f"{CHANNELS[at]} by {abs(means.apart[at]):.2g} {unit}")
    return " and ".join(parts)


def mixed_samples_text(six: Array) -> str:
    """What shows that samples as they arrive are of two devices; empty if they do not.

    Parameters
    ----------
    six : consecutive samples, (n, 6) m/s^2 and rad/s; nan where there is none

    """
    means = alternating_means(six)
    if means is None:
        return ""
    return (
        "two devices seem to send on one port: the samples change to and fro in"
        f" {difference_text(means)}"
    )


def find_mixed_devices(
    block: Block, windows: Sequence[tuple[float, float] | None]
) -> TwoMeans | None:
    """What two devices differ by whose samples come by turns; None if it is one.

    Parameters
    ----------
    block : samples of the session
    windows : begin and end of each, s of device time; None where none was taken

    """
    found = []
    for begin, end in filter(None, windows):
        first, last = np.searchsorted(block.t, (begin, end))
        few = slice(first, min(last, first + MOST_SAMPLES))
        means = alternating_means(np.hstack([block.acc[few], block.gyr[few]]))
        if means is None:
            return None
        found.append(means)
    if len(found) < FEWEST_WINDOWS or not _are_the_same(found):
        return None
    return found[0]


def refuse_mixed_devices(
    block: Block, windows: Sequence[tuple[float, float] | None]
) -> None:
    """Refuse a recording in which the samples of two devices come by turns.

    The parameters are those of `find_mixed_devices`.

    Raises
    ------
    InputError
        Saying by how much they differ.

    """
    means = find_mixed_devices(block, windows)
    if means is not None:
        raise InputError(
            "the samples of two devices come by turns, under the same names, and differ"
            f" in {difference_text(means)}: their mean is that of neither;"
            f" {GIVE_EACH_A_PORT}"
        )


def _are_the_same(found: Sequence[TwoMeans]) -> bool:
    """Whether the differences are the same in units of noise, up to the sign."""
    noise = np.median([means.noise for means in found], axis=0)
    apart = np.array([means.apart for means in found]) / noise
    apart *= np.sign(apart @ apart[0])[:, None]
    off = np.linalg.norm(apart - apart[0], axis=1)
    return bool(off.max() <= SAME_WITHIN * np.linalg.norm(apart[0]))
