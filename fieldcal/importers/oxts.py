"""Folders of KITTI's OXTS: a text file for each sample, and one of their times.

    oxts/timestamps.txt                a time of a clock in each line
    oxts/data/0000000000.txt           30 numbers, of which some are ax ay az, wx wy wz

Name the folder, or its ``timestamps.txt``. Source: the dataset's ``dataformat.txt``.
"""

from __future__ import annotations

from collections.abc import Iterator
from itertools import islice, zip_longest
from pathlib import Path

from fieldcal.core.errors import InputError
from fieldcal.importers import TIMES
from fieldcal.importers.csv_like import TextColumns
from fieldcal.importing.files.packed_stream import PIECE

WHAT = "folders of OXTS samples, as KITTI has them"

DATA = "data"

NAMES = (
    "lat lon alt roll pitch yaw vn ve vf vl vu ax ay az af al au wx wy wz wf wl wu"
    " pos_accuracy vel_accuracy navstat numsats posmode velmode orimode"
).split()

HEAD = "\t".join(["time", *NAMES])

LINES = 4096
"""Samples read together."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file holds the times of such a folder."""
    return path.name == TIMES and any((path.parent / DATA).glob("*.txt"))


class OxtsFolder(TextColumns):
    """The samples of a folder."""

    def place(self, row: int) -> str:
        """Name the file of a sample."""
        return f"file {row + 1} of {DATA}"

    def files(self) -> list[Path]:
        """The times, and the file of each sample."""
        return [self.path, *sorted((self.path.parent / DATA).glob("*.txt"))]

    def pieces(self, size: int = PIECE) -> Iterator[bytes]:
        """Samples as lines of columns, with a line of names.

        Raises
        ------
        InputError
            If there are more times than samples, or fewer.

        """
        times, *samples = self.files()
        with times.open(encoding="utf-8") as stamps:
            lines = (line.strip() for line in stamps if line.strip())
            pairs = zip_longest(lines, samples)
            while some := list(islice(pairs, LINES)):
                found = [] if samples[0] != some[0][1] else [HEAD]
                for stamp, sample in some:
                    if stamp is None or sample is None:
                        raise InputError(
                            f"{self.path}: has more times than there are files in"
                            f" {DATA}, or fewer; copy the folder again"
                        )
                    found.append("\t".join([stamp, *sample.read_text().split()]))
                yield ("\n".join(found) + "\n").encode()
