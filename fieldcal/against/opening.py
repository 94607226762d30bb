"""A simulator's output, opened: a session folder, or any file that import reads.

A file need not say where the device was. Where the recording's windows, at the same
times from the first sample on, lie in stretches in which the simulated device rests,
it followed the same schedule; else its rests are the recording's positions, in order,
if there are as many.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.importers import open_recording
from fieldcal.importing.recording import ReadOptions, Recording
from fieldcal.importing.session.ingest import import_stream
from fieldcal.importing.units.unit_guess import settle_units
from fieldcal.session.description import Description
from fieldcal.session.folder import Session

Span = tuple[float, float]

STILL_S = 1.0
"""Shortest rest that counts as one, s."""

INSIDE = 0.9
"""Part of a window that must lie in a rest, for the window to be held there."""


@dataclass(frozen=True, slots=True)
class SimulatorOutput:
    """What a simulator wrote.

    Attributes
    ----------
    block : its samples
    about : what session.toml says; None of a file
    rests : in which the simulated device rests, of a file
    says : what the user must know

    """

    block: Block
    about: Description | None
    rests: tuple[Span, ...]
    says: tuple[str, ...]


def opened(
    path: Path, real: tuple[Block, Description]
) -> tuple[Block, Description, list[str]]:
    """Samples and description of a simulator's output, and what the user must know.

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
        return read.block, read.about, list(read.says)
    about = _placed(path, read.block, read.rests, *real)
    return read.block, about, list(read.says)


def read_output(path: Path) -> SimulatorOutput:
    """Read a simulator's output, whatever it shows.

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


def _placed(
    path: Path, block: Block, rests: Sequence[Span], real: Block, about: Description
) -> Description:
    """The recording's description, with windows where the simulated device rests."""
    ours = [w for w in about.windows if w is not None]
    if not ours:
        return about
    about = replace(
        about.in_time(),
        nominal={k: v / abs(v) if k.endswith("scale") else 0 * v
                 for k, v in about.nominal.items()},
    )  # fmt: skip
    later = float(block.t[0] - real.t[0])
    moved = [None if w is None else (w[0] + later, w[1] + later) for w in about.windows]
    if all(w is None or _inside(w, rests) for w in moved):
        gaps = tuple((start + later, end + later) for start, end in about.without)
        return replace(about, windows=tuple(moved), without=gaps)
    if len(rests) == len(ours) == len(about.windows):
        return replace(about, windows=tuple(rests), without=())
    raise InputError(
        f"{path}: the simulated device rests {len(rests)} times and not at the times of"
        f" the recording, which has {len(ours)} positions: let the simulator hold the"
        " same positions in the same order, or import the file and write its positions"
        " into session.toml"
    )


def _inside(window: Span, rests: Sequence[Span]) -> bool:
    start, end = window
    most = max((min(end, b) - max(start, a) for a, b in rests), default=0.0)
    return most > INSIDE * (end - start)
