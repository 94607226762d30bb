"""Recordings read without a session: as fast as a test of many forms needs it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.session.joining import join_files
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.units.settled_units import settle_units

NOTHING_SAID = ReadOptions()


def read_files(
    paths: Sequence[str | Path], wanted: ReadOptions = NOTHING_SAID
) -> tuple[Block, list[str]]:
    """Samples of files, which are joined where there are several, and what is said."""
    opened = [open_recording(Path(path), wanted) for path in paths]
    recording = join_files(opened) if len(opened) > 1 else opened[0]
    (stream,) = recording.streams()
    settle_units(recording, stream.name)
    one = recording.alone(stream.name)
    judge = RowValidator(str(one.path), one.place, one.repair)
    block = concat(judge.through(one.blocks(stream.name)))
    return block, [*one.says, *judge.says, *one.mended, *judge.mended]
