"""Values off by whole bytes.

Of a 16-bit count, high and low byte hi, lo:

    sign-extended low byte   256 hi + lo - 256 [lo >= 128]
    swapped bytes            256 lo + hi
    wrapped                  count - 65536 [count > 32767], and the other way about

Each can be undone count by count; what was broken gets smoother by it, what was whole
rougher. Single samples that jump away and back by more than the device can move are
none of these; each is replaced by the mean of those beside it. Source: model of this
project; the usual slips in reading a register pair.

>>> import numpy as np
>>> course = np.arange(1000, 3000, 7)
>>> broken = course - 256 * (course % 256 >= 128)
>>> kind, mended = undone(broken)
>>> kind, bool((mended == course).all())
('low_byte_signed', True)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.chances import DEVIATION
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import CheckedSamples, Fault
from fieldcal.windows.spikes import WILD, without_spikes

Counts = NDArray[np.int64]

JUMP = 128
"""LSB from which a step between samples is a jump."""

CLEARLY = 5
"""How many more jumps have to go than come."""

WIDEST = 70_000
"""Counts beyond which values are no 16-bit ones, but decimals written out."""

FEWEST = 4
"""Jumps that have to go."""

BYTE = 256
"""Values of a byte."""

NEARER = 10.0
"""How many times nearer values of one byte come to what they ought to be."""

UNLIKELY = (5.0, 0.5)
"""Departure that no sensor at rest has, m/s^2 and rad/s."""

BESIDE = 10
"""Samples to either side that tell whether something shakes the device."""

AROUND, CHANCE = 500, 1e-4
"""Samples to either side whose tail is looked at, and the chance that a sample of that
tail goes as far. Rectified vibration has an exponential tail, and not a normal one."""

AT_ONCE = 1 << 16
"""Samples looked at together: an hour of them need not be in memory once more."""

MOVED = (np.inf, 10.0)
"""How many times that a device on its way may depart by: put down, it is stopped within
a sample by any force, but its rate does not come and go within one."""


def undone(counts: Counts) -> tuple[str, Counts]:
    """What happened to counts and what they were; "" where nothing did."""
    before = np.abs(np.diff(counts))
    best, kind, mended = float(before.sum()), "", counts
    for name, undo in _UNDO.items():
        tried = undo(counts)
        after = np.abs(np.diff(tried))
        gone = int(((before > JUMP) & (after < before / 2)).sum())
        made = int(((after > JUMP) & (before < after / 2)).sum())
        if gone >= FEWEST and gone > CLEARLY * made and float(after.sum()) < best:
            best, kind, mended = float(after.sum()), name, tried
    return kind, mended


def _extended(counts: Counts) -> Counts:
    return counts + 256 * (counts % 256 >= 128)


def _swapped(counts: Counts) -> Counts:
    return counts.astype(np.int16).byteswap().astype(np.int64)


def _wrapped(counts: Counts) -> Counts:
    jumps = np.diff(counts, prepend=counts[:1])
    turns = -np.round(jumps / 65536).astype(np.int64)
    return counts + 65536 * np.cumsum(turns)


_UNDO = {
    "low_byte_signed": _extended,
    "bytes_swapped": _swapped,
    "wrapped": _wrapped,
}


class DecodeFault(Chain):
    """A slip in decoding 16-bit values."""

    params = (Param("step", "LSB", 65536.0),)
    covariate = "clusters 256 LSB apart, jumps at ±2^15"
    treatment = "mend"
    decided_by = "the byte order and width in the device's manual"
    cure = (
        "Correct byte order, width or sign in the decoder; single wild values come of"
        " damaged frames: check the cable, its speed, and that checksums are looked at."
    )
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Channels that become smooth when a slip is undone, or without wild values."""
        wild = _wild(recording)
        found = (_fault(recording, c) or _of_wild(recording, c, wild[:, c])
                 for c in range(len(CHANNELS)))  # fmt: skip
        return [fault for fault in found if fault is not None]


def _wild(recording: CheckedSamples) -> NDArray[np.bool_]:
    """Single samples that jump by more than the device can move, (n, 6)."""
    n, edge, still = len(recording.block), AROUND + 3, recording.still
    out, moved = np.zeros((n, 6), dtype=bool), np.repeat(MOVED, 3)
    for first in range(0, n, AT_ONCE):
        some = slice(max(first - edge, 0), min(first + AT_ONCE + edge, n))
        most = np.where(still[some, None], 1.0, moved) * np.repeat(UNLIKELY, 3)
        found = _wild_in(recording.block[some], most * np.abs(recording.scale))
        out[first : first + AT_ONCE] = found[first - some.start :][:AT_ONCE]
    return out


def _wild_in(block: Block, most: Array) -> NDArray[np.bool_]:
    """The same of a part of the samples, of jumps that are at `most` likely, (n, 6)."""
    six = block.six
    apart = np.zeros_like(six)
    apart[1:-1] = np.abs(six[1:-1] - (six[:-2] + six[2:]) / 2)
    wild: NDArray[np.bool_] = np.nan_to_num(apart) > most
    if not wild.any():
        return wild
    wild &= np.isnan(without_spikes(block).six)
    apart, steps = np.nan_to_num(apart), np.arange(2, BESIDE + 2)
    for c in np.flatnonzero(wild.any(axis=0)):
        rows = np.flatnonzero(wild[:, c])
        sides = (
            np.clip(np.add.outer(rows, s), 0, len(six) - 1) for s in (steps, -steps)
        )
        usual = np.max([np.median(apart[near, c], axis=1) for near in sides], axis=0)
        others = np.where(_touched(wild[:, c]), np.nan, apart[:, c])
        tails = [_tail(others[max(r - AROUND, 0) : r + AROUND]) for r in rows]
        least = np.maximum(WILD * DEVIATION * usual, tails)
        wild[rows, c] = apart[rows, c] > least
    return wild


def _touched(wild: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Samples that are wild, or depart from one beside them that is, (n,)."""
    out: NDArray[np.bool_] = np.convolve(wild, np.ones(3), "same") > 0
    return out


def _tail(values: Array) -> float:
    """What one of some values exceeds by `CHANCE`, if their tail is an exponential.

    Its scale is that between the tenth and the hundredth of them that is largest.
    """
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0
    tenth, hundredth = np.quantile(known, (0.9, 0.99))
    scale = (hundredth - tenth) / np.log(10)
    return float(hundredth + scale * np.log(len(values) / 100 / CHANCE))


def _of_wild(
    recording: CheckedSamples, c: int, wild: NDArray[np.bool_]
) -> Fault | None:
    """Wild values of one channel, and what they may have been."""
    rows = np.flatnonzero(wild)
    if not len(rows):
        return None
    six, t = recording.block.six, recording.block.t
    size = float(np.abs(six[rows, c]).max())
    six[rows, c] = (six[rows - 1, c] + six[rows + 1, c]) / 2
    return Fault(
        channel=CHANNELS[c],
        values={"channel": CHANNELS[c], "kind": "wild"},
        sigmas={},
        from_s=float(t[rows[0]]),
        to_s=float(t[rows[-1]]),
        size=size,
        mended=six,
    )


def _fault(recording: CheckedSamples, c: int) -> Fault | None:
    """What happened to one channel."""
    lsb = float(recording.steps[c])
    values, t = recording.channel(c), recording.block.t
    if not lsb or not np.isfinite(values).all() or not np.ptp(values):
        return None
    if np.abs(values).max() > WIDEST * lsb:
        return None
    counts = np.round(values / lsb).astype(np.int64)
    kind, mended = undone(counts)
    fine = _within(values, lsb) if np.abs(counts).max() <= BYTE // 2 else 0.0
    if fine:
        # whoever swaps counts of one byte gets multiples of 256, or one less
        swapped = np.round(values / fine).astype(np.int64)
        other, whole = undone(swapped)
        if other and _nearer(recording, c, whole * fine):
            kind, mended, counts, lsb = other, whole, swapped, fine
    if not kind:
        return None
    wrong = np.flatnonzero(mended != counts)
    six = recording.block.six
    six[:, c] = mended * lsb
    return Fault(
        channel=CHANNELS[c],
        values={"channel": CHANNELS[c], "kind": kind},
        sigmas={},
        from_s=float(t[wrong[0]]),
        to_s=float(t[wrong[-1]]),
        size=float(np.abs(mended - counts).max() * lsb),
        mended=six,
    )


def _within(values: Array, step: float) -> float:
    """Step of a grid 256 times finer, of values near a coarse one; 0 of others."""
    gaps = np.diff(np.unique(values))
    gaps = gaps[gaps < 1.5 * step]
    fine = np.round(BYTE * gaps / step).sum()
    return float(gaps.sum() / fine) if fine else 0.0


def _nearer(recording: CheckedSamples, c: int, mended: Array) -> bool:
    """Whether outputs come much nearer to what the nominal calibration predicts.

    Where a force is not known, it is no larger than gravity.
    """
    x = recording.x
    expected = np.hstack([x.f, x.w])[:, c]
    foretold = recording.bias[c] + recording.scale[c] * np.nan_to_num(expected)
    known = np.isfinite(expected) | (c >= 3)
    slack = np.where(known, 0.0, x.gravity * recording.scale[c])

    def off(values: Array) -> float:
        """Largest of the windows' rms distances, less what is not known."""
        largest = 0.0
        held = zip(recording.windows, foretold, slack, strict=True)
        for (first, last), one, some in held:
            apart = np.square(values[first:last] - one)
            if len(apart):
                largest = max(largest, float(np.sqrt(apart.mean()) - some))
        return largest

    before = off(recording.channel(c))
    return before > UNLIKELY[c // 3] and off(mended) < before / NEARER
