"""The session folder, of live sessions and of imported recordings.

    session.toml    device, site and planned positions  (`description`)
    samples.<ext>   the raw samples                     (`sample_files`, `recorder`)
    marks.jsonl     events of the run                   (`marks`)
    result.json     calibration, by solve

session.toml is never rewritten. The windows of a live session are in marks.jsonl, and
results are written to files of their own.
"""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import SessionError
from fieldcal.core.file_names import refuse_undecodable_path
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array, Block, impossible_rate_text
from fieldcal.session import description_file, sample_files
from fieldcal.session.blank_samples import (
    are_lost,
    blank_rows,
    blank_warning,
    remove_blank_samples,
    without_rows,
)
from fieldcal.session.clock_steps import ClockStepRemover, remove_clock_steps
from fieldcal.session.description import Description
from fieldcal.session.file_writing import write_atomically
from fieldcal.session.installed_calibration import (
    installed_stretches,
    nominal_as_sent,
    under_last_calibration,
)
from fieldcal.session.marks import (
    MARKS,
    POSITION_ADDED,
    gaps_without_restart,
    read_marks,
)
from fieldcal.session.position_tables import parse_positions
from fieldcal.session.schemas import load_schema, misspelt_keys
from fieldcal.session.units import ACC_UNITS, GYR_UNITS

DESCRIPTION = "session.toml"
RESULT = "result.json"


@dataclass
class Session:
    """A session folder, opened for reading.

    Attributes
    ----------
    folder : path of the folder
    about : content of session.toml, with positions and windows from marks.jsonl, and,
        once `block` was read, with what is damaged in the samples left out of windows
    warnings : sentences about what was cut off or left out while reading

    """

    folder: Path
    about: Description
    warnings: tuple[str, ...] = ()

    @classmethod
    def open(cls, folder: Path | str) -> Session:
        """Open a session folder.

        Raises
        ------
        SessionError
            If it is no session folder, its path is not UTF-8, or session.toml or
            marks.jsonl cannot be used.

        """
        folder = Path(folder)
        refuse_undecodable_path(folder)
        about = description_file.read_description(folder / DESCRIPTION)
        says: list[str] = []
        marks = list(read_marks(folder / MARKS, says))
        says += _guess_warnings(about.raw)
        says += _misspelt_warnings(about.raw)
        about = _with_windows(_with_added_positions(about, marks), marks)
        about = replace(about, nominal_as_sent=nominal_as_sent(about.nominal, marks))
        return cls(folder, about, tuple(says))

    def with_windows(self, windows: tuple[tuple[float, float] | None, ...]) -> Session:
        """The same recording with other windows."""
        out = Session(self.folder, replace(self.about, windows=windows), self.warnings)
        out.block = self.block
        return out

    @property
    def positions(self) -> tuple[Position, ...]:
        """Positions in the order of session.toml."""
        return self.about.positions

    @property
    def windows(self) -> tuple[tuple[float, float] | None, ...]:
        """Window of each position, (start, end) in s of device time."""
        return self.about.windows

    @property
    def gravity(self) -> float:
        """Local gravity, m/s^2."""
        return self.about.gravity

    @property
    def latitude(self) -> float:
        """Latitude, rad; nan if it is not stated."""
        return self.about.latitude

    @property
    def mounting(self) -> Array:
        """P of procedure = P @ device, (3, 3)."""
        return self.about.mounting

    @property
    def grade(self) -> str:
        """Grade: consumer, tactical, or navigation."""
        return self.about.grade

    @property
    def nominal(self) -> Mapping[str, Array]:
        """The calibration a simulation starts from: (3,) by group."""
        return self.about.nominal

    @property
    def rate_hz(self) -> float:
        """Stated sampling rate, or that of the times if none is stated, Hz."""
        t = self.block.t
        if self.about.rate_hz is not None or len(t) < 2:
            return self.about.rate_hz or np.nan
        return float(1 / np.median(np.diff(t)))

    @cached_property
    def block(self) -> Block:
        """All samples, in SI units; volts and counts by the nominal scale factors.

        If the device changed its own calibration during the recording, all samples are
        converted to the last one. If its clock was set during the recording, times and
        windows are corrected for that, and `warnings` says so. Samples in disturbances
        that are excluded from windows are nan.
        """
        raw, cut, lost = sample_files.read_samples(
            sample_files.find_samples(self.folder)
        )
        without = tuple(sorted((*self.about.excluded_spans, *lost)))
        self.about = replace(self.about, excluded_spans=without)
        raw, blank = remove_blank_samples(raw)
        if blank:
            cut += (blank_warning(blank),)
        self.warnings += cut
        steps = np.diff(raw.t)
        if len(steps) and (
            said := impossible_rate_text(1 / max(float(np.median(steps)), 1e-300))
        ):
            raise SessionError(f"{self.folder}: {said}")
        units, gauge = self.about.units, self.about.gauge.size
        for triad, unit in (
            (raw.acc, ACC_UNITS[units["acceleration"]] / gauge[0]),
            (raw.gyr, GYR_UNITS[units["angular_rate"]] / gauge[1]),
        ):
            if unit != 1.0:
                np.multiply(triad, unit, out=triad)
        whole, changed = under_last_calibration(raw, self.marks())
        self.warnings += changed
        return self._steadied(_blank_gaps(whole, self.about.excluded_spans))

    def blocks(self, clock: ClockStepRemover | None = None) -> Iterator[Block]:
        """Samples as in `block`, part by part, with bounded memory.

        `windows` remain in recorded times: `clock`, which removes the steps of the
        device's clock, corrects them as far as the samples have been read. If the
        device changed its own calibration, or `block` was read before, the whole
        recording is one part, and the windows are corrected already.
        """
        if "block" in vars(self) or len(installed_stretches(self.marks())) > 1:
            yield self.block
            return
        clock, cut, blank = clock or ClockStepRemover(), list[str](), 0
        units, gauge = self.about.units, self.about.gauge.size
        acc = ACC_UNITS[units["acceleration"]] / gauge[0]
        gyr = GYR_UNITS[units["angular_rate"]] / gauge[1]
        for whole in sample_files.iterate_samples(
            sample_files.find_samples(self.folder), cut
        ):
            zeros = blank_rows(whole)
            lost = len(zeros) > 0 and self._zeros_are_lost
            raw = without_rows(whole, zeros) if lost else whole
            blank += len(whole) - len(raw)
            part = replace(raw, acc=raw.acc * acc, gyr=raw.gyr * gyr)
            yield clock.add(_blank_gaps(part, self.about.excluded_spans))
        yield clock.flush()
        cut += [blank_warning(blank)] if blank else []
        self.warnings += (*cut, *(step.sentence() for step in clock.steps))

    @cached_property
    def _zeros_are_lost(self) -> bool:
        """Whether rows of zeros are lost samples, as all samples tell together."""
        blank = rows = 0
        for part in sample_files.iterate_samples(
            sample_files.find_samples(self.folder)
        ):
            blank, rows = blank + len(blank_rows(part)), rows + len(part)
        return are_lost(blank, rows)

    def _steadied(self, raw: Block) -> Block:
        """Samples and windows without steps of the device's clock."""
        found = remove_clock_steps(raw)
        if found is None:
            return raw
        steady, clock = found
        self.warnings += tuple(step.sentence() for step in clock.steps)

        def moved(span: tuple[float, float]) -> tuple[float, float]:
            return clock.corrected(span[0]), clock.corrected(span[1])

        self.about = replace(
            self.about,
            windows=tuple(w and moved(w) for w in self.about.windows),
            excluded_spans=tuple(map(moved, self.about.excluded_spans)),
            gaps_without_restart=tuple(map(moved, self.about.gaps_without_restart)),
        )
        return steady

    def marks(self) -> Iterator[dict[str, Any]]:
        """Marks in order."""
        return read_marks(self.folder / MARKS)

    def write_json(self, name: str, content: Mapping[str, Any]) -> Path:
        """Write a JSON file to the folder atomically."""
        return write_atomically(
            self.folder / name, json.dumps(content, indent=2, allow_nan=False) + "\n"
        )


def _misspelt_warnings(raw: Mapping[str, Any]) -> list[str]:
    """Warnings about keys that are nearly known ones: what they state is not used."""
    # a plan's table [run] and its keys are no part of a session, and known as well
    known: dict[str, Any] = {name: {} for name in load_schema("plan")["properties"]}
    return [
        f"{DESCRIPTION}: {fault}; as it is, it is not used"
        for fault in misspelt_keys(raw, {"properties": known}, load_schema("session"))
    ]


def _guess_warnings(raw: Mapping[str, Any]) -> list[str]:
    """Warnings about values that an import guessed and the user has not confirmed."""
    return [
        f"{what.replace('_', ' ')} {'were' if what == 'columns' else 'was'} taken as"
        f" {why}: confirm it by deleting {what}"
        f" under [guessed] in {DESCRIPTION}, or import again and say what it is"
        for what, why in raw.get("guessed", {}).items()
    ]


def _blank_gaps(block: Block, gaps: Iterable[tuple[float, float]]) -> Block:
    """A block with nan in the samples that are excluded from windows."""
    cut = [slice(*np.searchsorted(block.t, gap).tolist()) for gap in gaps]
    if not cut:
        return block
    acc, gyr = block.acc.copy(), block.gyr.copy()
    for gap in cut:
        acc[gap] = gyr[gap] = np.nan
    return replace(block, acc=acc, gyr=gyr)


def _with_added_positions(
    about: Description, marks: list[dict[str, Any]]
) -> Description:
    """The description with the positions that were added during the run appended."""
    added = [mark for mark in marks if mark.get("event") == POSITION_ADDED]
    return description_file.with_added_positions(about, parse_positions(added)[0])


def _with_windows(about: Description, marks: list[dict[str, Any]]) -> Description:
    windows = list(about.windows)
    for mark in marks:
        i = mark.get("position")
        if not isinstance(i, int) or not 0 <= i < len(windows):
            continue  # the position behind the fitted ones is for verification
        if mark.get("event") == "window":
            windows[i] = (float(mark["start_s"]), float(mark["end_s"]))
        elif mark.get("event") == "repeated":
            windows[i] = None
    gaps = [
        (float(start), float(end))
        for mark in marks
        if mark.get("event") == "window"
        for start, end in mark.get("without_s", ())
    ]
    without = tuple(sorted((*about.excluded_spans, *gaps)))
    return replace(
        about,
        windows=tuple(windows),
        excluded_spans=without,
        gaps_without_restart=tuple(gaps_without_restart(marks)),
    )
