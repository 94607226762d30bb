"""The session folder: one format for live sessions, imports and offline work.

    session.toml    what was known and planned          (`description`)
    samples.<ext>   the raw samples                     (`sample_files`, `recorder`)
    marks.jsonl     what happened, as it happened       (`marks`)
    result.json     calibration, by solve

session.toml is never rewritten: windows of a live session stand in marks.jsonl, and
whatever is derived goes into its own file.
"""

from __future__ import annotations

import contextlib
import json
import os
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import SessionError, disk_says
from fieldcal.core.positions import Position
from fieldcal.core.samples import Array, Block, too_quick
from fieldcal.session import description, sample_files
from fieldcal.session.blank_samples import without_blanks
from fieldcal.session.clock import SteadyClock, steadied
from fieldcal.session.description import Description
from fieldcal.session.installed import as_sent, in_one_calibration, stretches
from fieldcal.session.marks import ADDED, MARKS, read_marks
from fieldcal.session.units import ACC_UNITS, GYR_UNITS

DESCRIPTION = "session.toml"
RESULT = "result.json"


@dataclass
class Session:
    """A session folder, opened for reading.

    Attributes
    ----------
    folder : where
    about : what session.toml says, with the windows that marks.jsonl adds
    warnings : what was cut off or passed over while reading

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
            If it is none, or its session.toml or marks.jsonl cannot be used.

        """
        folder = Path(folder)
        about = description.read(folder / DESCRIPTION)
        says: list[str] = []
        marks = list(read_marks(folder / MARKS, says))
        says += _unconfirmed(about.raw)
        about = _with_windows(_with_added(about, marks), marks)
        about = replace(about, sent=as_sent(about.nominal, marks))
        return cls(folder, about, tuple(says))

    def with_windows(self, windows: tuple[tuple[float, float] | None, ...]) -> Session:
        """The same recording with other windows of the positions."""
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
        """Latitude, rad."""
        return self.about.latitude

    @property
    def mounting(self) -> Array:
        """P of procedure = P @ device, (3, 3)."""
        return self.about.mounting

    @property
    def grade(self) -> str:
        """Grade: tactical, or navigation when the gyroscopes see the Earth rate."""
        return self.about.grade

    @property
    def nominal(self) -> Mapping[str, Array]:
        """The calibration a simulation starts from: (3,) by group."""
        return self.about.nominal

    @property
    def rate_hz(self) -> float:
        """Nominal rate, or what the times say where none is given."""
        t = self.block.t
        if self.about.rate_hz is not None or len(t) < 2:
            return self.about.rate_hz or np.nan
        return float(1 / np.median(np.diff(t)))

    @cached_property
    def block(self) -> Block:
        """All samples, in SI units; volts and counts by the nominal scale factors.

        Where the device changed its own calibration meanwhile, as under the last one.
        Where its clock was set meanwhile, times and windows go on as if it had not
        been, and `warnings` says so. It is nan
        in the disturbances that windows were taken around.
        """
        raw, cut = sample_files.read(sample_files.find(self.folder))
        raw, blank = without_blanks(raw)
        if blank:
            cut += (
                f"{blank} samples are zero in all outputs, which no device on the"
                " ground puts out: they count as lost",
            )
        self.warnings += cut
        steps = np.diff(raw.t)
        if len(steps) and (said := too_quick(1 / max(float(np.median(steps)), 1e-300))):
            raise SessionError(f"{self.folder}: {said}")
        units, gauge = self.about.units, self.about.gauge.size
        for triad, unit in (
            (raw.acc, ACC_UNITS[units["acceleration"]] / gauge[0]),
            (raw.gyr, GYR_UNITS[units["angular_rate"]] / gauge[1]),
        ):
            if unit != 1.0:
                np.multiply(triad, unit, out=triad)
        whole, changed = in_one_calibration(raw, self.marks())
        self.warnings += changed
        return self._steadied(_left_out(whole, self.about.without))

    def blocks(self) -> Iterator[Block]:
        """Samples as `block` has them, part by part, however long the recording is.

        Where the device changed its own calibration meanwhile, all at once.
        """
        if len(stretches(self.marks())) > 1:
            yield self.block
            return
        clock = SteadyClock()
        units, gauge = self.about.units, self.about.gauge.size
        acc = ACC_UNITS[units["acceleration"]] / gauge[0]
        gyr = GYR_UNITS[units["angular_rate"]] / gauge[1]
        for whole in sample_files.blocks(sample_files.find(self.folder)):
            raw, _ = without_blanks(whole)
            part = replace(raw, acc=raw.acc * acc, gyr=raw.gyr * gyr)
            yield clock.add(_left_out(part, self.about.without))
        yield clock.rest()

    def _steadied(self, raw: Block) -> Block:
        """Samples and windows without steps of the device's clock."""
        steady = steadied(raw)
        if steady is None:
            return raw
        self.warnings += tuple(step.sentence() for step in steady.steps)

        def moved(span: tuple[float, float]) -> tuple[float, float]:
            return steady.moved(span[0]), steady.moved(span[1])

        self.about = replace(
            self.about,
            windows=tuple(w and moved(w) for w in self.about.windows),
            without=tuple(map(moved, self.about.without)),
        )
        return steady.block

    def marks(self) -> Iterator[dict[str, Any]]:
        """Marks in order."""
        return read_marks(self.folder / MARKS)

    def write_json(self, name: str, content: Mapping[str, Any]) -> Path:
        """Write a derived file whole, or not at all."""
        return write_whole(
            self.folder / name, json.dumps(content, indent=2, allow_nan=False) + "\n"
        )


def _unconfirmed(raw: Mapping[str, Any]) -> list[str]:
    """What an import guessed, until the user takes it out of [guessed]."""
    return [
        f"{what.replace('_', ' ')} was taken as {why}: confirm it by deleting {what}"
        f" under [guessed] in {DESCRIPTION}, or import again and say what it is"
        for what, why in raw.get("guessed", {}).items()
    ]


def _left_out(block: Block, gaps: Iterable[tuple[float, float]]) -> Block:
    """A block with nan in what is no part of the windows."""
    cut = [slice(*np.searchsorted(block.t, gap).tolist()) for gap in gaps]
    if not cut:
        return block
    acc, gyr = block.acc.copy(), block.gyr.copy()
    for gap in cut:
        acc[gap] = gyr[gap] = np.nan
    return replace(block, acc=acc, gyr=gyr)


def _with_added(about: Description, marks: list[dict[str, Any]]) -> Description:
    """With the positions that were added while it was recorded, behind the planned."""
    added = [mark for mark in marks if mark.get("event") == ADDED]
    return description.with_more(
        about,
        [Position.deg(m["alpha_deg"], m["beta_deg"], m.get("name", "")) for m in added],
    )


def _with_windows(about: Description, marks: list[dict[str, Any]]) -> Description:
    windows = list(about.windows)
    for mark in marks:
        i = mark.get("position")
        if mark.get("event") == "window" and isinstance(i, int) and i < len(windows):
            windows[i] = (float(mark["start_s"]), float(mark["end_s"]))
        elif mark.get("event") == "repeated" and isinstance(i, int):
            windows[i : i + 1] = [None]
    gaps = [
        (float(start), float(end))
        for mark in marks
        if mark.get("event") == "window"
        for start, end in mark.get("without_s", ())
    ]
    without = tuple(sorted((*about.without, *gaps)))
    return replace(about, windows=tuple(windows), without=without)


def write_whole(path: Path, content: str | bytes) -> Path:
    """Replace a file atomically: a reader finds the old content or the new one.

    Raises
    ------
    SessionError
        If it cannot be written.

    """
    try:
        handle, name = tempfile.mkstemp(dir=path.parent, prefix=f".{path.name}.")
        try:
            with os.fdopen(handle, "wb") as file:
                file.write(content.encode() if isinstance(content, str) else content)
                file.flush()
                os.fsync(file.fileno())
            os.chmod(name, 0o644)
            os.replace(name, path)
        except BaseException:
            with contextlib.suppress(OSError):
                os.unlink(name)
            raise
    except OSError as error:
        raise SessionError(f"{path}: cannot be written: {disk_says(error)}") from error
    return path
