"""Writes a session folder from one stream of a recording, atomically."""

from __future__ import annotations

import glob
import os
import shutil
import tempfile
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from time import time
from typing import Any, NamedTuple

from fieldcal.core.errors import InputError, SessionError, disk_says
from fieldcal.core.file_names import refuse_undecodable_path
from fieldcal.core.samples import Array, Block, impossible_rate_text
from fieldcal.importing.files.spool import SpooledRows
from fieldcal.importing.recording import Recording
from fieldcal.importing.session.found_rests import RestSearch, find_rests
from fieldcal.importing.session.held_values import HeldValues
from fieldcal.importing.session.late_rates import late_rates
from fieldcal.importing.session.sample_writer import SampleWriter, file_record
from fieldcal.importing.session.stream_facts import StreamFacts
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.units.scales import MIN_ROWS
from fieldcal.importing.units.time_units import SLOWEST_HZ, recording_date
from fieldcal.session.clock_steps import ClockStep, ClockStepRemover
from fieldcal.session.folder import DESCRIPTION
from fieldcal.session.lock import SessionLock
from fieldcal.session.marks import MARKS, mark_line
from fieldcal.windows.cells import CellAccumulator
from fieldcal.windows.joined_rests import RestPeriod
from fieldcal.windows.jumps import JumpFinder
from fieldcal.windows.spikes import without_spikes
from fieldcal.windows.stretches import cell_rows


@dataclass(frozen=True, slots=True)
class ImportedSession:
    """A session folder that an import wrote.

    Attributes
    ----------
    folder : where
    facts : what was found
    rests : where the device was still, s of device time
    says : what the user must know, repairs first
    forces : (m, 3) means of the accelerometers in these rests, m/s^2

    """

    folder: Path
    facts: StreamFacts
    rests: list[RestPeriod]
    says: list[str]
    forces: Array


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
        If the recording cannot be used, naming file, row and column; or the folder's
        path is not UTF-8.
    SessionError
        If the folder cannot be written.

    """
    refuse_undecodable_path(folder)
    if folder.exists() and any(folder.iterdir()):
        raise InputError(f"{folder}: is not empty; name another folder with -o")
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        removed = remove_broken_off(folder)
        part = Path(tempfile.mkdtemp(dir=folder.parent, prefix=f".{folder.name}."))
        held = SessionLock(part)
        try:
            made = _write_session(part, recording, stream, about, still)
            held.release()
            part.chmod(0o755)
            _flush_to_disk(*part.iterdir(), part)
            part.replace(folder)
            _flush_to_disk(folder.parent)
        except BaseException:
            held.release()
            shutil.rmtree(part, ignore_errors=True)
            raise
    except OSError as error:
        raise SessionError(
            f"{folder}: cannot be written: {disk_says(error)}"
        ) from error
    return replace(made, folder=folder, says=[*removed, *made.says])


def remove_broken_off(folder: Path) -> list[str]:
    """Remove files of killed imports into this folder; return a sentence about each.

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


def _flush_to_disk(*paths: Path) -> None:
    """Flush files and folders to disk, so that a power cut leaves no empty ones."""
    for path in paths if os.name == "posix" else ():
        there = os.open(path, os.O_RDONLY)
        try:
            os.fsync(there)
        finally:
            os.close(there)


class _WrittenRows(NamedTuple):
    """What was seen of the rows while they were written.

    Attributes
    ----------
    facts, held, clock, judge : what each gathered
    rests : where the device was still

    """

    facts: StreamFacts
    held: HeldValues
    clock: ClockStepRemover
    judge: RowValidator
    rests: RestSearch


def _write_session(
    part: Path,
    recording: Recording,
    stream: str,
    about: Mapping[str, Any],
    still: float,
) -> ImportedSession:
    """Write samples, session.toml and marks into the folder `part`."""
    import tomlkit

    seen = _write_samples(part, recording, stream, still, "position" in about)
    facts, judge, clock, found = seen.facts, seen.judge, seen.clock, seen.rests
    # an empty list would be in the way of the tables that the user adds
    given = not found.rests or "position" in about
    tables = {} if given else {"position": found.positions}
    text = tomlkit.dumps({**about, **tables})
    (part / DESCRIPTION).write_text(text, encoding="utf-8")
    recording.says += judge.says
    if "position" not in about:
        recording.says += [*seen.held.says(facts.rate_hz), *facts.silences()]
    recording.says += [said for said in (found.how, found.left_out) if said]
    recording.says += [step.sentence() for step in clock.steps]
    repairs = [*recording.mended, *judge.mended]
    marks = _marks(recording, stream, facts, repairs, clock.steps)
    marks += "".join(map(mark_line, found.marks))
    (part / MARKS).write_text(marks, "utf-8")
    none = [found.none] if found.none else []
    rests, forces = found.rests, found.forces
    return ImportedSession(
        part, facts, rests, [*repairs, *recording.says, *none], forces
    )


def _write_samples(
    part: Path, recording: Recording, stream: str, still: float, means: bool
) -> _WrittenRows:
    """Write the samples of a stream, or `means`, and find where the device rests."""
    judge = RowValidator(str(recording.path), recording.place, recording.repair)
    facts, held, clock = StreamFacts(), HeldValues(), ClockStepRemover()
    cells, jumps = CellAccumulator(), JumpFinder()
    with SampleWriter(part / "samples.parquet") as written, SpooledRows(part) as rows:
        blocks = _without_clock_steps(clock, recording.blocks(stream))
        for good in judge.through(blocks):
            if len(good):
                facts.add(good)
                held.add(good)
                cells.add(without_spikes(good))
                if recording.wanted.rate_hz:
                    jumps.add(good)
                rows.add(cell_rows(cells.take_complete()))
                written.add(good)
        _refuse_useless(recording, facts, means)
        facts.left_out = judge.left_out
        written.close()
        rests = find_rests(jumps, rows, cells.table, written.between, still)
        late = "" if means else late_rates(rows)
        recording.says += [late] if late else []
    return _WrittenRows(facts, held, clock, judge, rests)


def _refuse_useless(recording: Recording, facts: StreamFacts, means: bool) -> None:
    """Raise InputError if nothing can come of these rows, samples or `means`."""
    if not facts.measured and facts.coldest is not None:
        raise InputError(
            f"{recording.path}: holds temperatures alone; import it with the file of"
            " the IMU beside it, with --join"
        )
    if not facts.measured:
        raise InputError(
            f"{recording.path}: has no number of an accelerometer or gyroscope in any"
            " row that can be used; name its columns with --columns"
        )
    if said := impossible_rate_text(facts.rate_hz):
        raise InputError(f"{recording.path}: column t: {said}")
    if facts.rate_hz < SLOWEST_HZ and facts.rows >= MIN_ROWS and not means:
        raise InputError(
            f"{recording.path}: column t: its samples are {1 / facts.rate_hz:.2g} s"
            " apart, which no recording is: the times are in another unit; import it"
            " again with --time-unit ms, us or ns, or name another column by --columns"
        )


def _without_clock_steps(
    clock: ClockStepRemover, blocks: Iterable[Block]
) -> Iterator[Block]:
    """Blocks with the steps of the device's clock removed."""
    for block in blocks:
        yield clock.add(block)
    yield clock.flush()


def _marks(
    recording: Recording,
    stream: str,
    facts: StreamFacts,
    repairs: list[str],
    steps: list[ClockStep],
) -> str:
    """Marks that record the origin of the samples."""
    now = round(time(), 3)
    stamps = (recording.began, facts.start_s, facts.first_arrival_s)
    imported = {
        "event": "imported",
        "files": [file_record(path) for path in recording.files()],
        "format": type(recording.parts[0]).__module__.rpartition(".")[2],
        "stream": stream,
        **facts.table(),
        "repairs": repairs,
        "says": recording.says,
        "taken_at": recording_date(stamps, now),
        "host_s": now,
    }
    notes = dict(recording.notes(stream))
    grain = notes.pop("grain", None)
    marks = [imported, {"event": "device", **notes, "host_s": now}]
    if grain is not None:
        marks.append({"event": "grain", **grain, "host_s": now})
    marks += [{"event": "clock_step", **s._asdict(), "host_s": now} for s in steps]
    return "".join(mark_line(mark) for mark in marks)
