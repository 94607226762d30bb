"""Files that hold channels of one IMU at the same time, made one recording.

acc.csv gyr.csv                     row beside row, or each with its nearest
Accelerometer.csv Gravity.csv       parts of the specific force, which are added
imu.csv temperature.csv             a slow thermometer, interpolated
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from pathlib import Path
from typing import NamedTuple

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.samples import CHANNELS, Block
from fieldcal.importing.recording import Recording
from fieldcal.importing.session.merge import (
    SeveralFiles,
    count_from_one_day,
    stream_name,
    with_clock_times,
)
from fieldcal.importing.session.side_by_side import PEEKED, MergedFiles
from fieldcal.importing.session.warmth import Warmth
from fieldcal.importing.times.gravity_sum import GravitySum, lacks_gravity
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.words.file_names import part_of_force

FIRST_ROWS = 1 << 14
"""Rows at the beginning of a file that tell whether gravity is in it."""


class FileHead(NamedTuple):
    """A file, and its first rows by its own clock."""

    file: Recording
    rows: Block

    def measures(self, kind: str) -> bool:
        """Whether it has any number of a kind of channel: acc, gyr, temperature."""
        return bool(np.isfinite(getattr(self.rows, kind)).any())


def join_files(files: Sequence[Recording]) -> Recording:
    """Files of one IMU at the same time as one recording.

    Raises
    ------
    InputError
        If there are several thermometers or IMUs in them, or two hold one channel.

    """
    opened = files
    if any(part_of_force(_stem(one)) == "gravity" for one in files):
        files = _with_force(files)
    # of what sensor a file is, is said by now
    count_from_one_day(opened)
    heads = [_head(one, PEEKED) for one in files]
    _refuse_same_channels(heads)
    warm = [h for h in heads if not (h.measures("acc") or h.measures("gyr"))]
    others = [h for h in heads if h not in warm]
    slow = [h for h in warm if others and not _same_times(h.rows, others[0].rows)]
    left = [h.file for h in heads if h not in slow]
    imu = left[0] if len(left) == 1 else MergedFiles(left)
    if len(slow) > 1:
        raise InputError(
            f"{slow[1].file.path}: holds temperatures, and so does"
            f" {slow[0].file.path.name}: join the thermometer of the IMU alone"
        )
    return WarmedFiles([imu, slow[0].file]) if slow else imu


def _head(file: Recording, most: int) -> FileHead:
    return FileHead(file, with_clock_times(file).first_rows(stream_name(file), most))


def _refuse_same_channels(heads: Sequence[FileHead]) -> None:
    """Refuse files of which two hold the same channel: only one could be used."""
    first: dict[str, Path] = {}
    for head in heads:
        known = np.isfinite(head.rows.six).any(axis=0)
        for name in np.array(CHANNELS)[known]:
            if name in first:
                raise InputError(
                    f"{head.file.path}: holds {name}, and so does {first[name].name}:"
                    " --join is for files with different channels of one IMU; join"
                    " consecutive recordings of it with --in-order, and import two IMUs"
                    " one by one"
                )
            first[name] = head.file.path


def _stem(file: Recording) -> str:
    return file.path.name.split(".")[0]


def _same_times(one: Block, other: Block) -> bool:
    """Whether two files have the same times, as they count from their first rows."""
    n = min(len(one), len(other))
    since = [block.t[:n] - block.t[:1] for block in (one, other)]
    return np.array_equal(since[0], since[1], equal_nan=True)


def _with_force(files: Sequence[Recording]) -> list[Recording]:
    """Files with that of gravity added to the accelerations that lack it.

    Of accelerations that have gravity in them, the file of gravity is left out.
    """
    parts = [part_of_force(_stem(one)) for one in files]
    gravity = files[parts.index("gravity")]
    for one, part in zip(files, parts, strict=True):
        one.sensor = "acc" if part else one.sensor
    others = [one for one in files if one is not gravity]
    heads = [_head(one, FIRST_ROWS) for one in others]
    acc = [head for head in heads if head.measures("acc")]
    if len(acc) != 1:
        raise InputError(
            f"{gravity.path}: holds gravity, and {len(acc)} of the other files hold"
            " accelerations: join it with the one from which gravity was taken"
        )
    (force,) = acc
    if not lacks_gravity(force.rows.acc, _head(gravity, FIRST_ROWS).rows.acc):
        force.file.says.append(
            f"{gravity.path.name} is left out: {force.file.path.name} has gravity in it"
        )
        return others
    force.file.lacks_gravity = True
    whole = SummedFiles([force.file, gravity])
    return [whole if other is force.file else other for other in others]


class SummedFiles(SeveralFiles):
    """A file of accelerations without gravity, and one of gravity."""

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of the specific force.

        Raises
        ------
        InputError
            If no sample of one file is near any of the other.

        """
        both = [with_clock_times(part) for part in self._parts]
        judges = [RowValidator(str(p.path), p.place, p.repair) for p in both]
        total = GravitySum()
        acc, gravity = (
            judge.through(part.blocks(stream_name(part)))
            for judge, part in zip(judges, both, strict=True)
        )
        begin = float("nan")
        for block in total.through(acc, gravity):
            if np.isnan(begin) and len(block):
                begin = self.began = float(block.t[0])
            yield replace(block, t=block.t - begin) if self.from_first else block
        self._tell_judged(judges, both)
        if total.none:
            raise InputError(
                f"{both[1].path}: no sample is at a time at which {both[0].path.name}"
                " has one; join files of one recording, or record TotalAcceleration"
            )
        self.says.append(total.sentence())


class WarmedFiles(SeveralFiles):
    """Files of an IMU, joined, and that of a thermometer with times of its own."""

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples with the temperature at their times.

        Raises
        ------
        InputError
            If no sample lies within the times of the thermometer.

        """
        imu, part = self._parts[0], with_clock_times(self._parts[1])
        judge = RowValidator(str(part.path), part.place, part.repair)
        warmth = Warmth(judge.through(part.blocks(stream_name(part))))
        part.mended += [f"{part.path.name}: {said}" for said in judge.mended]
        for block in imu.blocks(stream_name(imu)):
            self.began = imu.began
            # times that count from no first row have their own zero
            zero = imu.began if np.isfinite(imu.began) else 0.0
            yield replace(block, temperature=warmth.at(block.t + zero))
        self._tell([imu, part])
        if not warmth.within:
            raise InputError(
                f"{part.path}: no sample of {imu.path.name} lies within its times,"
                f" {warmth.span()}; join files of one clock, in one unit of time"
            )
        self.says.append(warmth.sentence())
