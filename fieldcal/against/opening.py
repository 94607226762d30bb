"""Opens a simulator's output: a session folder, or any file that import reads.

A file need not state positions. If the recording's windows, counted from the first
sample, lie within rests of the simulated device, it followed the same schedule; what is
beyond a rest, because the simulator began to write a little later, is cut off.
Otherwise its rests are the recording's positions in order, if their numbers agree.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from fieldcal.against.motion.held import count_attitudes, count_positions, what_is_held
from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import Recording
from fieldcal.importing.session.ingest import import_stream
from fieldcal.importing.units.settled_units import settle_units
from fieldcal.session.description import Description
from fieldcal.session.folder import Session

Span = tuple[float, float]

STILL_S = 1.0
"""Shortest rest, s."""

INSIDE = 0.9
"""Least part of a window that must lie in a rest."""


@dataclass(frozen=True, slots=True)
class SimulatorOutput:
    """The output of a simulator.

    Attributes
    ----------
    block : its samples
    about : content of session.toml; None of a file
    rests : stretches in which the simulated device rests; only of a file
    says : notices for the user

    """

    block: Block
    about: Description | None
    rests: tuple[Span, ...]
    says: tuple[str, ...]


def open_simulator_output(
    path: Path, real: tuple[Block, Description]
) -> tuple[Block, Description, list[str]]:
    """Samples and description of a simulator's output, and notices for the user.

    Parameters
    ----------
    path : a session folder, or a file
    real : the recording that it is compared with

    Raises
    ------
    InputError
        If it cannot be read, or does not show the same positions.
    SessionError
        If it is a folder that is no session.

    """
    read = read_output(path)
    if read.about is not None:
        _check_same_is_held(path, (read.block, read.about), real)
        return read.block, read.about, list(read.says)
    about = _description_of_simulated(path, read.block, read.rests, *real)
    _check_it_turns(path, (read.block, about), real)
    return read.block, about, list(read.says)


def _check_same_is_held(
    path: Path, sim: tuple[Block, Description], real: tuple[Block, Description]
) -> None:
    """Refuse a session that holds one position, or moves, unlike the recording.

    What its calibration is would be told by what is usual, not by its samples.
    """
    theirs, ours = what_is_held(*sim), what_is_held(*real)
    if theirs == ours or ours == "motion":
        return
    raise _holds_others(path, count_positions(*sim), count_positions(*real))


def _check_it_turns(
    path: Path, sim: tuple[Block, Description], real: tuple[Block, Description]
) -> None:
    """Refuse a file of a device that stayed as it was while the recorded one turned.

    It rests at all times of the recording, and so seems to follow its schedule.
    """
    count, wanted = count_attitudes(*sim), count_attitudes(*real)
    if count == 1 < wanted:
        raise _holds_others(path, count, wanted)


def _holds_others(path: Path, count: int, wanted: int) -> InputError:
    return InputError(
        f"{path}: shows {_positions(count)}, and the recording {wanted}: let the"
        " simulator hold the positions of the recording"
    )


def _positions(count: int) -> str:
    return f"{count} position{'s' * (count != 1)}"


def read_output(path: Path) -> SimulatorOutput:
    """Read a simulator's output, with or without positions.

    Raises
    ------
    InputError
        If it cannot be read.
    SessionError
        If it is a folder that is no session.

    """
    if path.is_dir():
        session = Session.open(path)
        block = session.block  # before its warnings, which reading adds to
        return SimulatorOutput(block, session.about, (), tuple(session.warnings))
    recording = open_recording(path, ReadOptions())
    stream = _only_stream(recording)
    guessed, _ = settle_units(recording, stream)
    with TemporaryDirectory() as folder:
        there = Path(folder) / "simulated"
        made = import_stream(recording, stream, there, {"format": 1}, STILL_S)
        block = Session.open(there).block
    said = (f"{what.replace('_', ' ')} taken as {why}" for what, why in guessed.items())
    rests = tuple((rest.start, rest.end) for rest in made.rests)
    return SimulatorOutput(block, None, rests, tuple(said))


def _only_stream(recording: Recording) -> str:
    streams = recording.streams()
    if len(streams) != 1:
        names = ", ".join(stream.name for stream in streams)
        raise InputError(
            f"{recording.path}: holds {len(streams)} IMUs ({names}): make a session of"
            f" one, with fieldcal import {recording.path} --instance NAME, and compare"
            " with that"
        )
    return streams[0].name


def _description_of_simulated(
    path: Path, block: Block, rests: Sequence[Span], real: Block, about: Description
) -> Description:
    """The recording's description, with windows where the simulated device rests."""
    ours = [w for w in about.windows if w is not None]
    if not ours:
        return about
    about = replace(
        about.in_time_order(),
        nominal={k: v / abs(v) if k.endswith("scale") else 0 * v
                 for k, v in about.nominal.items()},
    )  # fmt: skip
    later = float(block.t[0] - real.t[0])
    moved = [None if w is None else (w[0] + later, w[1] + later) for w in about.windows]
    resting = [None if w is None else _part_in_rest(w, rests) for w in moved]
    if sum(part is not None for part in resting) == len(ours):
        gaps = tuple(
            (start + later, end + later) for start, end in about.excluded_spans
        )
        return replace(about, windows=tuple(resting), excluded_spans=gaps)
    if len(rests) == len(ours) == len(about.windows):
        return replace(about, windows=tuple(rests), excluded_spans=())
    raise InputError(
        f"{path}: the simulated device rests {len(rests)} time{'s' * (len(rests) != 1)}"
        f" and not at the times of the recording, which has {_positions(len(ours))}:"
        " let the simulator hold the same positions in the same order, or import the"
        " file and write its positions into session.toml"
    )


def _part_in_rest(window: Span, rests: Sequence[Span]) -> Span | None:
    """The part of a window in a rest; None if too much of it is in none."""
    start, end = window
    parts = [(max(start, a), min(end, b)) for a, b in rests]
    first, last = max(parts, key=lambda part: part[1] - part[0], default=(0.0, 0.0))
    return (first, last) if last - first > INSIDE * (end - start) else None
