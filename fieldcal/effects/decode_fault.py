"""Values off by whole bytes.

Of a 16-bit count, high and low byte hi, lo:

    sign-extended low byte   256 hi + lo - 256 [lo >= 128]
    swapped bytes            256 lo + hi
    wrapped                  count - 65536 [count > 32767], and the other way about

Each can be undone count by count; what was broken gets smoother by it, what was whole
rougher. Single samples that jump away and back by more than the device can move are
none of these; each is replaced by the mean of those beside it. Those that are off by
one size are put back by it (`torn_values`). Source: model of this project; the usual
slips in reading a register pair.

>>> import numpy as np
>>> course = np.arange(1000, 3000, 7)
>>> broken = course - 256 * (course % 256 >= 128)
>>> kind, mended = undo_decode_fault(broken)
>>> kind, bool((mended == course).all())
('low_byte_signed', True)
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.probability import MAD_TO_SIGMA
from fieldcal.core.samples import CHANNELS, Array, Block
from fieldcal.physics.effect import Chain, Param
from fieldcal.physics.recording import CheckedSamples, Fault
from fieldcal.physics.torn_values import torn_values
from fieldcal.windows.spikes import WILD, without_spikes

Counts = NDArray[np.int64]

JUMP = 128
"""Smallest step between samples that counts as a jump, LSB."""

MIN_JUMP_RATIO = 5
"""Ratio of jumps removed to jumps added from which a fault is undone."""

WIDEST = 70_000
"""Largest count of a 16-bit value; larger ones are decimals."""

MIN_REMOVED_JUMPS, WRAPPED_ONCE = 4, 2
"""Smallest number of jumps removed, and of an axis beside others that wrap."""

BYTE, WORD = 256, 65536
"""Values of a byte, and of two."""

NEARER = 10.0
"""Factor by which values of one byte must come nearer to the prediction."""

UNLIKELY = (5.0, 0.5)
"""Smallest deviation of an outlier at rest, m/s^2 and rad/s."""

NEIGHBOURING_SAMPLES = 10
"""Samples to either side that tell whether something shakes the device."""

AROUND, CHANCE = 500, 1e-4
"""Samples to either side whose tail is looked at, and the chance that a sample of that
tail goes as far. Rectified vibration has an exponential tail, and not a normal one."""

SAMPLES_AT_ONCE = 1 << 16
"""Samples looked at together: an hour of them need not be in memory once more."""

MOVED = (np.inf, 10.0)
"""How many times that a device on its way may depart by: put down, it is stopped within
a sample by any force, but its rate does not come and go within one."""


def undo_decode_fault(
    counts: Counts, fewest: int = MIN_REMOVED_JUMPS
) -> tuple[str, Counts]:
    """Return the kind of fault, "" if none, and the counts without it.

    `fewest` jumps must go.
    """
    before = np.abs(np.diff(counts))
    best, kind, mended = float(before.sum()), "", counts
    for name, undo in _UNDO.items():
        tried = undo(counts)
        after = np.abs(np.diff(tried))
        gone = int(((before > JUMP) & (after < before / 2)).sum())
        made = int(((after > JUMP) & (before < after / 2)).sum())
        if (
            gone >= fewest
            and gone > MIN_JUMP_RATIO * made
            and float(after.sum()) < best
        ):
            best, kind, mended = float(after.sum()), name, tried
    return kind, mended


def _extended(counts: Counts) -> Counts:
    return counts + 256 * (counts % 256 >= 128)


def _swapped(counts: Counts) -> Counts:
    return counts.astype(np.int16).byteswap().astype(np.int64)


def _wrapped(counts: Counts) -> Counts:
    """Counts without their jumps by 2^16; as they are if no wrap made those.

    What wrapped lies within 16 bits, and a jump that is no nearer to 2^16 than to 0 may
    as well be noise, whose next sample is as far away.
    """
    low, high = int(counts.min()), int(counts.max())
    jumps = np.diff(counts, prepend=counts[:1])
    size = np.abs(jumps) / WORD
    clear, unclear = (size > 2 / 3).sum(), ((size > 1 / 3) & (size <= 2 / 3)).sum()
    signed, unsigned = -WORD // 2 <= low and high < WORD // 2, low >= 0 and high < WORD
    if not (signed or unsigned) or clear <= MIN_JUMP_RATIO * unclear:
        return counts
    turns = -np.round(jumps / WORD).astype(np.int64)
    return counts + WORD * np.cumsum(turns)


_UNDO = {
    "low_byte_signed": _extended,
    "bytes_swapped": _swapped,
    "wrapped": _wrapped,
}


class DecodeFault(Chain):
    """Fault in the decoding of 16-bit values."""

    params = (Param("step", "LSB", 65536.0),)
    covariate = "clusters 256 LSB apart, jumps at ±2^15"
    treatment = "mend"
    decided_by = "the byte order and width in the device's manual"
    cure = (
        "Correct byte order, width or sign in the decoder; single wild values come of"
        " damaged frames: check the cable, its speed, and that checksums are looked at;"
        " values off by one size, of a register that changes as it is read: switch on"
        " its block data update, or wait until data is ready."
    )
    source = "model of this project"

    def find(self, recording: CheckedSamples) -> list[Fault]:
        """Channels that become smooth when a slip is undone, or without wild values."""
        wild = _outlier_samples(recording)
        slips = [_fault(recording, c) for c in range(len(CHANNELS))]
        for first in (0, 3):
            triad = range(first, first + 3)
            if any(f and f.values["kind"] == "wrapped" for f in slips[first:][:3]):
                # one driver reads all three; one turn wraps an axis there and back
                again = (slips[c] or _fault(recording, c, WRAPPED_ONCE) for c in triad)
                slips[first : first + 3] = again
        found = [slip or _restore_outliers(recording, c, wild[:, c])
                 for c, slip in enumerate(slips)]  # fmt: skip
        for first in (0, 3):
            if not any(found[first : first + 3]):
                found[first : first + 3] = _put_back(recording, first)
        return [fault for fault in found if fault is not None]

    def say_repaired(self, fault: Fault) -> str:
        """Which channel, and how its bytes were taken."""
        return (
            f"{fault.channel}: bytes were decoded wrongly"
            f" ({fault.values.get('kind', 'unknown')}) and are put right here; mend the"
            " driver that wrote them"
        )


def _put_back(recording: CheckedSamples, first: int) -> list[Fault | None]:
    """Faults of a sensor's three channels with samples that are off by one size."""
    block = recording.block
    triad, t = block.gyr if first else block.acc, block.t
    torn = torn_values(triad, recording.still, recording.steps[first : first + 3])
    out: list[Fault | None] = [None, None, None]
    if torn is None:
        return out
    for axis in np.flatnonzero(torn.off.any(axis=0)):
        c = first + int(axis)
        rows, mended = np.flatnonzero(torn.off[:, axis]), block.six
        mended[:, c] -= torn.off[:, axis]
        out[axis] = Fault(
            channel=CHANNELS[c],
            values={"channel": CHANNELS[c], "kind": "one_size"},
            sigmas={},
            from_s=float(t[rows[0]]),
            to_s=float(t[rows[-1]]),
            size=torn.size,
            mended=mended,
        )
    return out


def _outlier_samples(recording: CheckedSamples) -> NDArray[np.bool_]:
    """Whether single samples jump by more than the device can move, (n, 6)."""
    n, edge, still = len(recording.block), AROUND + 3, recording.still
    out, moved = np.zeros((n, 6), dtype=bool), np.repeat(MOVED, 3)
    unlikely = np.repeat(UNLIKELY, 3) * np.abs(recording.scale)
    for first in range(0, n, SAMPLES_AT_ONCE):
        some = slice(max(first - edge, 0), min(first + SAMPLES_AT_ONCE + edge, n))
        block = recording.block[some]
        if _lie_within(block, unlikely / 2):  # no sample is that far from any other
            continue
        most = np.where(still[some, None], 1.0, moved) * unlikely
        found = _outliers_in_block(block, most)
        out[first : first + SAMPLES_AT_ONCE] = found[first - some.start :][
            :SAMPLES_AT_ONCE
        ]
    return out


def _lie_within(block: Block, most: Array) -> bool:
    """Whether all samples of each output are known, and lie within `most`, (6,)."""
    spread = np.concatenate([np.ptp(triad, axis=0) for triad in (block.acc, block.gyr)])
    return bool((spread < most).all())


def _outliers_in_block(block: Block, most: Array) -> NDArray[np.bool_]:
    """`_outlier_samples` of a block, for jumps of more than `most`, (n, 6)."""
    six = block.six
    apart = np.zeros_like(six)
    apart[1:-1] = np.abs(six[1:-1] - (six[:-2] + six[2:]) / 2)
    wild: NDArray[np.bool_] = np.nan_to_num(apart) > most
    if not wild.any():
        return wild
    wild &= np.isnan(without_spikes(block).six)
    apart, steps = np.nan_to_num(apart), np.arange(2, NEIGHBOURING_SAMPLES + 2)
    for c in np.flatnonzero(wild.any(axis=0)):
        rows = np.flatnonzero(wild[:, c])
        sides = (
            np.clip(np.add.outer(rows, s), 0, len(six) - 1) for s in (steps, -steps)
        )
        usual = np.max([np.median(apart[near, c], axis=1) for near in sides], axis=0)
        others = np.where(_samples_beside_outliers(wild[:, c]), np.nan, apart[:, c])
        tails = [_tail_threshold(others[max(r - AROUND, 0) : r + AROUND]) for r in rows]
        least = np.maximum(WILD * MAD_TO_SIGMA * usual, tails)
        wild[rows, c] = apart[rows, c] > least
    return wild


def _samples_beside_outliers(wild: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """Whether samples are outliers or next to one, (n,)."""
    out: NDArray[np.bool_] = np.convolve(wild, np.ones(3), "same") > 0
    return out


def _tail_threshold(values: Array) -> float:
    """Value that is exceeded with probability `CHANCE` in an exponential tail.

    Its scale is that between the tenth and the hundredth of them that is largest.
    """
    known = values[np.isfinite(values)]
    if not len(known):
        return 0.0
    tenth, hundredth = np.quantile(known, (0.9, 0.99))
    scale = (hundredth - tenth) / np.log(10)
    return float(hundredth + scale * np.log(len(values) / 100 / CHANCE))


def _restore_outliers(
    recording: CheckedSamples, c: int, wild: NDArray[np.bool_]
) -> Fault | None:
    """Fault of a channel with outliers, which are replaced; None without outliers."""
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


def _fault(
    recording: CheckedSamples, c: int, fewest: int = MIN_REMOVED_JUMPS
) -> Fault | None:
    """Decoding fault of one channel; None if there is none. `fewest` jumps must go."""
    lsb = float(recording.steps[c])
    values, t = recording.channel(c), recording.block.t
    if not lsb or not np.isfinite(values).all() or not np.ptp(values):
        return None
    if np.abs(values).max() > WIDEST * lsb:
        return None
    counts = np.round(values / lsb).astype(np.int64)
    kind, mended = undo_decode_fault(counts, fewest)
    fine = _finer_step(values, lsb) if np.abs(counts).max() <= BYTE // 2 else 0.0
    if fine:
        # swapped counts of one byte are multiples of 256, or one less
        swapped = np.round(values / fine).astype(np.int64)
        other, whole = undo_decode_fault(swapped)
        if other and _is_nearer_to_prediction(recording, c, whole * fine):
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


def _finer_step(values: Array, step: float) -> float:
    """Step of a 256 times finer grid of the values; 0 if there is none."""
    gaps = np.diff(np.unique(values))
    gaps = gaps[gaps < 1.5 * step]
    fine = np.round(BYTE * gaps / step).sum()
    return float(gaps.sum() / fine) if fine else 0.0


def _is_nearer_to_prediction(recording: CheckedSamples, c: int, mended: Array) -> bool:
    """Whether mended outputs are much nearer to those of the nominal calibration.

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
