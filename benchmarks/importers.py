"""Importers against merely reading with each format's library, in processor time.

The ratios are medians over pairs: of reading all samples, and of making a session of
them; neither should be above 1.5. Beside them is what it takes to write the same rows
as Parquet by pyarrow, as plainly as can be, which no session can do without: where a
library takes a few milliseconds, because the file holds the numbers as memory does,
that alone is many times the reading, and only the last ratio, the session to reading
and plain writing, says anything of it. What a session costs beyond that, it costs in
any format: each row is looked at, summed up for the still stretches, written with
checksums, and the file is hashed. Opening a file takes a millisecond, which is as much
as a library takes to read a hundred thousand rows of an array.
"""

import gc
import shutil
from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time

from benchmarks._logs import COLUMNS, ROWS, Log, samples, write_all, write_tables
from fieldcal.core.samples import Block
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.session.ingest import import_stream

RUNS = 5
GOAL = 1.5


def timed(work: Callable[..., object], *arguments: object) -> float:
    """Processor time of a piece of work, s."""
    began = process_time()
    work(*arguments)
    return process_time() - began


def ours(path: Path, wanted: ReadOptions, folder: Path | None) -> None:
    """Read all samples, or make a session of them."""
    recording = open_recording(path, wanted)
    stream = recording.streams()[0].name
    if path.suffix == ".mcap":
        stream = "/imu/raw"
    if folder is None:
        for _ in recording.blocks(stream):
            pass
    else:
        import_stream(recording, stream, folder, {"format": 1}, 1.0)


def written(path: Path, block: Block) -> None:
    """Write the rows as Parquet, as plainly as can be."""
    import pyarrow as pa
    import pyarrow.parquet

    columns = dict(zip(COLUMNS, [block.t, *block.six.T], strict=True))
    pyarrow.parquet.write_table(pa.table(columns), path, compression="lz4")


def importing(folder: Path, logs: dict[str, Log], rows: int) -> None:
    """Print reading and importing against the library."""
    print(f"{rows:9} samples            library    plain  samples  session  session to")
    print(f"{'':38}{'write':>8}{'':18}  read + write")
    block = samples(rows)
    for name, (path, read, wanted) in logs.items():
        # what the libraries of other formats left behind is no matter of this one
        gc.collect()
        gc.freeze()
        pairs = []
        for run in range(RUNS + 1):
            theirs = timed(read, path)
            plain = timed(written, folder / f"{run}.parquet", block)
            here = timed(ours, path, wanted, None)
            whole = timed(ours, path, wanted, folder / f"{path.name}{run}")
            pairs.append(
                (theirs, plain, here / theirs, whole / theirs, whole / (theirs + plain))
            )
            shutil.rmtree(folder / f"{path.name}{run}")
            (folder / f"{run}.parquet").unlink()
        columns = [median(column) for column in zip(*pairs[1:], strict=True)]
        print(
            f"  {name:25} {columns[0]:7.3f} s {columns[1]:6.3f} s {columns[2]:6.2f} x"
            f" {columns[3]:6.2f} x {columns[4]:9.2f} x{_remark(columns)}"
        )


def _remark(columns: list[float]) -> str:
    """Say where the goal is missed, and where no import could reach it."""
    theirs, plain, samples, session, _ = columns
    least = 1 + plain / theirs
    reading = f"  samples above {GOAL} x" if samples > GOAL else ""
    if session <= GOAL:
        return reading
    if least > GOAL:
        return f"{reading}  reading and plain writing alone take {least:.1f} x"
    return f"{reading}  session above {GOAL} x"


def main() -> None:
    """Print the tables; the second shows what does not grow with the log."""
    for rows, write in ((ROWS, write_all), (10 * ROWS, write_tables)):
        with TemporaryDirectory() as folder:
            importing(Path(folder), write(Path(folder), rows), rows)
