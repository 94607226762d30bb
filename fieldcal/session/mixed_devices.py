"""Samples of two devices on one port, under the same names: their mean is of neither.

Each window shows how far they are apart. A vibration of half the sampling rate makes
two means of one device as well, but its phase at the samples runs on: the means draw
nearer within a window, and from window to window. Of two devices at rest

    a_i = b_2 - b_1 + (R - 1) f_i,   w_i = c_2 - c_1                               (1)

differ the means of accelerometers and gyroscopes in window i, with their biases b and
c, the rotation R from one to the other, and f_i the force on the first; but for scale
factors of some per cent. So there are two devices if each difference is steady within
its window, and all windows have the same difference (R = 1), or the same of the
gyroscopes, or differences that one rotation explains: also that there is none to be
seen where the force lies along its axis.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.once import once_per_block
from fieldcal.core.rotation import nearest_rotation
from fieldcal.core.samples import ACC, CHANNELS, GYR, Array, Block
from fieldcal.session.interleaved_devices import find_interleaved_devices
from fieldcal.windows.alternation import (
    CLEAR,
    FEWEST_SAMPLES,
    TwoMeans,
    alternating_means,
)

MOST_SAMPLES = 500
"""Samples at each end of a window that are looked at."""

FEWEST_WINDOWS = 2
"""Windows by which two devices are told from a vibration."""

FEWEST_TURNED, FEWEST_APART = 4, 3
"""Windows by which two devices are told by the rotation between them, as three fit any;
and those of them in which they differ."""

BARELY_SEEN = 12.0
"""Size of a difference up to which it may be missed, standard deviations of a sample:
twice that from which it is found."""

SAME_WITHIN = 0.2
"""Largest change of the difference that is none, as a share of it: scale factors change
it by some per cent of g, which is less than most biases differ by."""

ROUNDS = 4
"""Times that rotation and order of the windows are found from one another."""

KNOWN_TO = 0.05
"""Largest standard error of a difference that is compared, as a share of it."""

GIVE_EACH_A_PORT = (
    "record one device only: give each a port, names or a frame of its own, or have one"
    " of them send nothing"
)
"""What to do about two devices on one port."""


def difference_text(apart: Array, noise: Array) -> str:
    """The clearest difference of each sensor, such as ``ax by 0.49 m/s²``.

    Parameters
    ----------
    apart : differences (6,) m/s^2 and rad/s
    noise : what each is to be clear of

    """
    parts, clear = [], np.abs(apart) / noise
    for first, unit in ((0, "m/s²"), (3, "rad/s")):
        at = first + int(clear[first : first + 3].argmax())
        if clear[at] > CLEAR:
            parts.append(f"{CHANNELS[at]} by {abs(apart[at]):.2g} {unit}")
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
        f" {difference_text(means.apart, means.noise)}"
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
    apart, alike = [], []
    for begin, end in filter(None, windows):
        first, last = np.searchsorted(block.t, (begin, end))
        if last - first < FEWEST_SAMPLES:
            continue
        ends = _means_at_ends(block, int(first), int(last))
        known = [means for means in ends if means is not None]
        if len(known) == len(ends) and _are_the_same(known):
            apart.append(known[0])
        elif len(known) < len(ends) and all(map(_is_barely_seen, known)):
            alike.append(block.acc[first:last].mean(axis=0))
        else:
            return None
    everywhere = len(apart) >= FEWEST_WINDOWS and not alike
    same = everywhere and (_are_the_same(apart) or _have_same_rates(apart))
    return apart[0] if same or _are_turned(apart, alike) else None


@once_per_block
def _means_at_ends(block: Block, first: int, last: int) -> list[TwoMeans | None]:
    """Means of two devices in the parts of a window, None of what is of one."""
    return [alternating_means(part) for part in _ends(block[first:last].six)]


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
    if (means := find_mixed_devices(block, windows)) is not None:
        differ = difference_text(means.apart, means.noise)
    elif (found := find_interleaved_devices(block, windows)) is not None:
        differ = difference_text(found.size, found.error)
    else:
        return
    raise InputError(
        "the samples of two devices come by turns, under the same names, and differ in"
        f" one window in {differ}: their mean is that of neither; {GIVE_EACH_A_PORT}"
    )


def _ends(six: Array) -> tuple[Array, Array]:
    """Samples at both ends of a window; all of it twice if it is short."""
    half = len(six) // 2
    size = min(MOST_SAMPLES, half if half >= FEWEST_SAMPLES else len(six))
    return six[:size], six[len(six) - size :]


def _is_barely_seen(means: TwoMeans) -> bool:
    """Whether a difference is so small that it may be missed at the other end."""
    return bool(np.linalg.norm(means.apart / means.noise) < BARELY_SEEN)


def _differences(found: Sequence[TwoMeans], outputs: slice) -> Array:
    """Differences in units of noise, with the sign of the first, (windows, outputs)."""
    noise = np.median([means.noise for means in found], axis=0)
    apart = np.array([(means.apart / noise)[outputs] for means in found])
    return np.asarray(apart * np.where(apart @ apart[0] < 0, -1, 1)[:, None])


def _are_the_same(found: Sequence[TwoMeans], outputs: slice = slice(6)) -> bool:
    """Whether the differences are the same in units of noise, up to the sign."""
    apart = _differences(found, outputs)
    off = np.linalg.norm(apart - apart[0], axis=1)
    return bool(off.max() <= SAME_WITHIN * np.linalg.norm(apart[0]))


def _have_same_rates(found: Sequence[TwoMeans]) -> bool:
    """Whether the gyroscopes' differences are known, and the same: (1) for any R."""
    return _are_known(found, GYR) and _are_the_same(found, GYR)


def _are_known(found: Sequence[TwoMeans], outputs: slice) -> bool:
    """Whether the differences are large enough beside their errors to be compared."""
    sizes = np.linalg.norm(_differences(found, outputs), axis=1)
    return bool((np.array([m.error for m in found]) <= KNOWN_TO * sizes).all())


def _are_turned(apart: Sequence[TwoMeans], alike: Sequence[Array]) -> bool:
    """Whether one rotation and biases explain the forces of all windows, (1).

    `alike` are forces, (3,) m/s^2, that both devices measured alike: along the axis by
    which one is turned against the other.
    """
    few = len(apart) < FEWEST_APART or len(apart) + len(alike) < FEWEST_TURNED
    if few or not _are_known(apart, ACC):
        return False
    seen = [[means.one[ACC], means.other[ACC]] for means in apart]
    pairs = np.array([*seen, *([force, force] for force in alike)])
    size = np.linalg.norm(pairs[:, 0] - pairs[:, 1], axis=1)
    begins = product((False, True), repeat=FEWEST_TURNED - 1)
    off = min(_off_one_rotation(pairs, (False, *begin)) for begin in begins)
    return bool(off <= SAME_WITHIN * np.sqrt(np.mean(size**2)))


def _off_one_rotation(pairs: Array, begin: Sequence[bool]) -> float:
    """Rms of what a rotation and biases leave of the forces, m/s^2, (1).

    Parameters
    ----------
    pairs : forces on both devices in each window, (n, 2, 3) in either order
    begin : which of the first windows have them in the other order

    """
    swapped = np.array(begin)
    for _ in range(ROUNDS):
        at = np.arange(len(swapped))
        one, other = pairs[at, swapped.astype(int)], pairs[at, 1 - swapped.astype(int)]
        middle, far = one.mean(axis=0), other.mean(axis=0)
        turn = nearest_rotation((other - far).T @ (one - middle))
        left = [
            b - far - (a - middle) @ turn.T
            for a, b in ((pairs[:, 0], pairs[:, 1]), (pairs[:, 1], pairs[:, 0]))
        ]
        off = np.linalg.norm(left, axis=2)
        swapped = off[1] < off[0]
    return float(np.sqrt(np.mean(off.min(axis=0) ** 2)))
