"""Samples at the beginning of a file that the file before it holds as well.

A logger that begins a new file before it ends the last one, or a recording that was
exported in two parts, has the same samples in both: times and values are the same.
"""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Array, Block, concat

STAMP = 1e-6
"""Largest difference of the stamps of one sample in two files, s: digits of stamps."""

COMPARED = 200
"""Samples at the beginning of a file that tell whether they are in another."""

AT_SEAM = 0.5
"""Part of the file before, at its end, in which the next one may begin. One that begins
further ahead has a clock that began anew, as have files that all begin near zero."""


class Overlap:
    """The samples of a file from the beginning of the next one on.

    Parameters
    ----------
    names : of the file, and of the next one
    blocks : samples of the file, in order
    begins : time of the first sample of the next one, by the clock of the file, s

    Attributes
    ----------
    shared : samples of the next file that were found in the file
    head : first samples of the file

    """

    def __init__(
        self, names: tuple[str, str], blocks: Iterable[Block], begins: float
    ) -> None:
        self._names, self.shared = names, 0
        parts, head = list[Block](), None
        for block in blocks:
            if head is None and np.isfinite(block.t).any():
                head = block[np.flatnonzero(np.isfinite(block.t))[:COMPARED]]
            parts.append(block[np.flatnonzero(block.t >= begins - STAMP)])
        self._rest = concat(parts)
        self.head = self._rest if head is None else head
        self._begins = begins

    @property
    def first(self) -> float:
        """Time of the first sample of the file, s; nan without one."""
        return float(self.head.t[0]) if len(self.head) else np.nan

    @property
    def seconds(self) -> float:
        """How long both files are said to record, s."""
        return float(self._rest.t[-1] - self._begins) if len(self._rest) else 0.0

    @property
    def begins_anew(self) -> bool:
        """Whether the clock of the next file began anew, as far as its times tell."""
        end = self._begins + self.seconds
        return self.seconds > AT_SEAM * (end - self.first)

    def holds(self, block: Block) -> bool:
        """Whether the samples of a block up to the end of the file are in the file."""
        return self._split(block)[1]

    def contains(self, block: Block) -> bool:
        """Whether any sample of a block lies in the file's time, and all are in it."""
        count, same = self._split(block)
        return count > 0 and same

    def without_shared(self, block: Block) -> Block:
        """A block of the next file without samples that are in the file.

        Raises
        ------
        InputError
            If other samples are there at the same time.

        """
        count, same = self._split(block)
        if not same:
            raise self.refusal()
        self.shared += count
        return block[count:]

    def refusal(self) -> InputError:
        """Error about files of the same time that hold other samples."""
        before, name = self._names
        return InputError(
            f"{name}: begins {self.seconds:.2f} s before {before} ends, and their"
            " samples of that time differ: these are not parts of one recording."
            " Import them one by one if they are of two devices; cut what overlaps from"
            " one of them; or, if the clock began anew between them, name the columns"
            " without the time (--columns -,ax,…) and state --rate"
        )

    def order_refusal(self) -> InputError:
        """Error about a file that is named behind the next one in time."""
        earlier, later = self._names
        return InputError(
            f"{earlier}: begins {self._begins - self.first:.2f} s before {later}, which"
            " is named before it: name the files in the order of their times"
        )

    def sentence(self) -> str:
        """What is said of the samples that both hold."""
        before, name = self._names
        return (
            f"{name}: begins {self.seconds:.2f} s before {before} ends, and"
            f" {self.shared} samples are the same in both: they are used once"
        )

    def _split(self, block: Block) -> tuple[int, bool]:
        """Samples of a block up to the file's end, and whether all are in the file."""
        rest = self._rest
        if not len(rest):
            return 0, True
        count = int(np.searchsorted(block.t, rest.t[-1] + STAMP, side="right"))
        t, six = block.t[:count], block.six[:count]
        at = np.searchsorted(rest.t, t - STAMP)
        inside = at < len(rest)
        at = np.where(inside, at, 0)
        near = inside & (np.abs(rest.t[at] - t) <= STAMP)
        return count, bool(near.all()) and _same(rest.six[at], six)


def _same(one: Array, other: Array) -> bool:
    return np.array_equal(one, other, equal_nan=True)
