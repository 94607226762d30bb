"""Writes a session folder from one stream of a recording, atomically."""

from __future__ import annotations

import glob
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import asdict, dataclass
from pathlib import Path
from time import time
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError, SessionError, disk_says
from fieldcal.core.samples import Array, Block, too_quick
from fieldcal.importing.merge import MergedFiles
from fieldcal.importing.recording import Recording
from fieldcal.importing.spool import SpooledRows
from fieldcal.importing.validation import RowValidator, SampleWriter, digest
from fieldcal.session.clock import ClockStep, SteadyClock
from fieldcal.session.folder import DESCRIPTION, MARKS, mark_line
from fieldcal.session.lock import SessionLock
from fieldcal.windows.cells import Cells
from fieldcal.windows.spikes import without_spikes
from fieldcal.windows.stretch_ends import reasons
from fieldcal.windows.stretches import still_stretches_of_file, summary, why_none

LONG = 5.0
"""Mean periods without a sample that are a gap."""

PAUSE = 1.0
"""Shortest gap that is a pause of the recording, s: in others samples came late."""


def mean_period(t: Array) -> float:
    """Mean distance of times (n,) between pauses, s; nan of one.

    What a pause is depends on the period, so the longest are left out until none is.

    >>> round(mean_period(np.r_[np.arange(20), 9000 + np.arange(20)] / 50), 9)
    0.02
    """
    steps = np.diff(t)
    while len(steps):
        period = float(steps.mean())
        if not (long := steps > max(LONG * period, PAUSE)).any():
            return period
        steps = steps[~long]
    return float("nan")


@dataclass(slots=True)
class StreamFacts:
    """What was found in a stream.

    Attributes
    ----------
    rows : samples that were taken
    start_s, end_s : first and last time
    gaps, longest_gap_s : times that no sample came for `LONG` mean periods
    pauses, paused_s : those of them that last `PAUSE`, and the duration of all these
    coldest, warmest : deg C, None where there is no temperature
    left_out : rows that were left out, where that was asked for
    measured : whether any accelerometer or gyroscope has a number

    """

    rows: int = 0
    start_s: float = float("nan")
    end_s: float = float("nan")
    gaps: int = 0
    longest_gap_s: float = 0.0
    pauses: int = 0
    paused_s: float = 0.0
    coldest: float | None = None
    warmest: float | None = None
    left_out: int = 0
    measured: bool = False
    _period: float = float("nan")

    def add(self, block: Block) -> None:
        """Take in the block that follows."""
        if not self.rows:
            self.start_s = float(block.t[0])
            self._period = mean_period(block.t)
        pause = float(block.t[0]) - self.end_s if self.rows else 0.0
        steps = block.t[1:] - block.t[:-1]
        for gaps in (np.array([pause]), steps):
            long = gaps[gaps > LONG * self._period]
            self.gaps += len(long)
            paused = long[long >= PAUSE]
            self.pauses += len(paused)
            self.paused_s += float(paused.sum())
            if len(long):
                self.longest_gap_s = max(self.longest_gap_s, float(gaps.max()))
        self.rows += len(block)
        self.measured = self.measured or bool(np.isfinite(block.six).any())
        self.end_s = float(block.t[-1])
        known = block.temperature[np.isfinite(block.temperature)]
        if len(known):
            low, high = float(known.min()), float(known.max())
            self.coldest = low if self.coldest is None else min(low, self.coldest)
            self.warmest = high if self.warmest is None else max(high, self.warmest)

    @property
    def rate_hz(self) -> float:
        """Mean rate between the pauses, Hz; nan where no sample follows another."""
        steps = self.rows - 1 - self.pauses
        span = self.end_s - self.start_s - self.paused_s
        return steps / span if steps > 0 and span > 0 else float("nan")

    def sentence(self) -> str:
        """Say it in a line."""
        many = "1 sample" if self.rows == 1 else f"{self.rows} samples"
        says = [f"{many} over {self.end_s - self.start_s:.1f} s"]
        if np.isfinite(self.rate_hz):
            says.append(f"{self.rate_hz:.4g} Hz")
        if self.coldest is not None:
            says.append(f"{self.coldest:.1f} to {self.warmest:.1f} °C")
        if self.gaps:
            gaps = f"{self.gaps} gaps of up to" if self.gaps > 1 else "a gap of"
            says.append(f"{gaps} {self.longest_gap_s:.3g} s")
        return ", ".join(says)

    def table(self) -> dict[str, Any]:
        """What a mark keeps of it."""
        kept = {
            k: v for k, v in asdict(self).items() if k[0] != "_" and k != "measured"
        }
        rate = self.rate_hz
        return kept | {"rate_hz": round(rate, 6) if np.isfinite(rate) else None}


@dataclass(frozen=True, slots=True)
class ImportedSession:
    """A session folder that an import wrote.

    Attributes
    ----------
    folder : where
    facts : what was found
    stretches : where the device was still, s of device time
    says : what the user must know, repairs first
    rests : (m, 3) means of the accelerometers in these stretches, m/s^2

    """

    folder: Path
    facts: StreamFacts
    stretches: list[tuple[float, float]]
    says: list[str]
    rests: Array


def import_stream(
    recording: Recording,
    stream: str,
    folder: Path,
    about: Mapping[str, Any],
    still: float,
) -> ImportedSession:
    """Make a session of one stream.

    Parameters
    ----------
    recording, stream : what is imported
    folder : made new, or empty
    about : tables of session.toml but the positions
    still : shortest still stretch that counts as a position, s

    Raises
    ------
    InputError
        If the recording cannot be used; names file, row and column.
    SessionError
        If the folder cannot be written.

    """
    if folder.exists() and any(folder.iterdir()):
        raise InputError(f"{folder}: is not empty; name another folder with -o")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        removed = remove_broken_off(folder)
        part = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
        held = SessionLock(part)
        try:
            facts, stretches, says, rests = _fill(part, recording, stream, about, still)
            held.release()
            part.chmod(0o755)
            _settle(*part.iterdir(), part)
            part.replace(folder)
            _settle(folder.parent)
        except BaseException:
            held.release()
            shutil.rmtree(part, ignore_errors=True)
            raise
    except OSError as error:
        raise SessionError(
            f"{folder}: cannot be written: {disk_says(error)}"
        ) from error
    return ImportedSession(folder, facts, stretches, [*removed, *says], rests)


def remove_broken_off(folder: Path) -> list[str]:
    """Remove what imports into this folder left that were killed, a sentence each.

    An import that still runs holds a lock of its own.
    """
    said = []
    for part in sorted(folder.parent.glob(f".{glob.escape(folder.name)}.????????")):
        try:
            SessionLock(part).release()
        except (SessionError, OSError):
            continue
        shutil.rmtree(part, ignore_errors=True)
        said.append(f"{part.name}, left by an import that was killed, is removed")
    return said


def _settle(*paths: Path) -> None:
    """See files and folders onto the disk: a power cut must leave no empty ones."""
    for path in paths if os.name == "posix" else ():
        there = os.open(path, os.O_RDONLY)
        try:
            os.fsync(there)
        finally:
            os.close(there)


def _fill(
    part: Path,
    recording: Recording,
    stream: str,
    about: Mapping[str, Any],
    still: float,
) -> tuple[StreamFacts, list[tuple[float, float]], list[str], Array]:
    import tomlkit

    judge = RowValidator(str(recording.path), recording.place, recording.repair)
    facts, cells, clock = StreamFacts(), Cells(), SteadyClock()
    with SampleWriter(part / "samples.parquet") as written, SpooledRows(part) as rows:
        for block in _steadied(clock, recording.blocks(stream)):
            good = judge.good(block)
            if len(good):
                facts.add(good)
                cells.add(without_spikes(good))
                rows.add(summary(cells.take_complete()))
                written.add(good)
        if not facts.rows:
            raise InputError(f"{recording.path}: has no row that can be used")
        if not facts.measured:
            raise InputError(
                f"{recording.path}: has no number of an accelerometer or gyroscope in"
                f" {facts.rows} rows; name its columns with --columns"
            )
        if said := too_quick(facts.rate_hz):
            raise InputError(f"{recording.path}: {said}")
        facts.left_out = judge.left_out
        written.close()
        rest = cells.table
        rows.add(summary(rest))
        stretches = still_stretches_of_file(rows, rest.origin, written.between, still)
        why = "" if stretches or still == np.inf else why_none(rows, rest.origin)
        ends = reasons(rows, rest.origin, stretches)
        rests = np.array([_mean_of(written.between(*span)) for span in stretches])
    repairs = [*recording.mended, *judge.mended]
    positions = [{"start_s": round(s, 6), "end_s": round(e, 6)} for s, e in stretches]
    # an empty list would be in the way of the tables that the user adds
    tables = {"position": positions} if positions and "position" not in about else {}
    text = tomlkit.dumps({**about, **tables})
    (part / DESCRIPTION).write_text(text, encoding="utf-8")
    recording.says += [step.sentence() for step in clock.steps]
    marks = _marks(recording, stream, facts, repairs, clock.steps)
    marks += "".join(
        mark_line(
            {"event": "still", "start_s": s, "end_s": e, "began": began, "ended": ended}
        )
        for (s, e), (began, ended) in zip(stretches, ends, strict=True)
    )
    (part / MARKS).write_text(marks, "utf-8")
    none = [f"no still stretch was found: {why}"] if why else []
    says = [*repairs, *recording.says, *none]
    return facts, stretches, says, rests.reshape(-1, 3)


def _mean_of(blocks: Iterable[Block]) -> Array:
    """Mean of the accelerometers over some blocks, (3,) m/s^2; nan of those without."""
    total, many = np.zeros(3), np.zeros(3)
    for block in blocks:
        total += np.nansum(block.acc, axis=0)
        many += np.isfinite(block.acc).sum(axis=0)
    mean: Array = np.divide(total, many, out=np.full(3, np.nan), where=many > 0)
    return mean


def _steadied(clock: SteadyClock, blocks: Iterable[Block]) -> Iterator[Block]:
    """Blocks without the steps of the device's clock."""
    for block in blocks:
        yield clock.add(block)
    yield clock.rest()


def _marks(
    recording: Recording,
    stream: str,
    facts: StreamFacts,
    repairs: list[str],
    steps: list[ClockStep],
) -> str:
    """What is kept of where the samples come from."""
    parts = recording.parts if isinstance(recording, MergedFiles) else [recording]
    now = round(time(), 3)
    imported = {
        "event": "imported",
        "files": [digest(path) for part in parts for path in part.files()],
        "format": type(parts[0]).__module__.rpartition(".")[2],
        "stream": stream,
        **facts.table(),
        "repairs": repairs,
        "says": recording.says,
        "host_s": now,
    }
    notes = dict(recording.notes(stream))
    grain = notes.pop("grain", None)
    marks = [imported, {"event": "device", **notes, "host_s": now}]
    if grain is not None:
        marks.append({"event": "grain", **grain, "host_s": now})
    marks += [{"event": "clock_step", **s._asdict(), "host_s": now} for s in steps]
    return "".join(mark_line(mark) for mark in marks)
