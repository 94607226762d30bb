"""Importers against merely reading with each format's library, in processor time.

The ratios are medians over pairs: of reading all samples, of making a session of them,
and of the latter to reading them and writing the same rows as Parquet by pyarrow, which
no import can do without. Where a library takes a few milliseconds only the last says
anything of the import.
"""

from collections.abc import Callable
from pathlib import Path
from statistics import median
from tempfile import TemporaryDirectory
from time import process_time

from benchmarks._logs import COLUMNS, ROWS, samples, write_all
from fieldcal.importing import bring_in
from fieldcal.recording import Wanted, open_recording

RUNS = 5
GOAL = 1.5


def timed(work: Callable[..., object], *arguments: object) -> float:
    """Processor time of a piece of work, s."""
    began = process_time()
    work(*arguments)
    return process_time() - began


def ours(path: Path, wanted: Wanted, folder: Path | None) -> None:
    """Read all samples, or make a session of them."""
    recording = open_recording(path, wanted)
    stream = recording.streams()[0].name
    if path.suffix == ".mcap":
        stream = "/imu/raw"
    if folder is None:
        for _ in recording.blocks(stream):
            pass
    else:
        bring_in(recording, stream, folder, {"format": 1}, 1.0)


def written(path: Path) -> None:
    """Write the rows as Parquet, as plainly as can be."""
    import pyarrow as pa
    import pyarrow.parquet

    block = samples(ROWS)
    columns = dict(zip(COLUMNS, [block.t, *block.six.T], strict=True))
    pyarrow.parquet.write_table(pa.table(columns), path, compression="lz4")


def importing(folder: Path) -> None:
    """Print reading and importing against the library."""
    print(f"{ROWS} samples                 library  samples  session  session to")
    print(f"{'':37}{'':18}          read + write")
    for name, (path, read, wanted) in write_all(folder, ROWS).items():
        pairs = []
        for run in range(RUNS + 1):
            made = timed(samples, ROWS)
            theirs = timed(read, path)
            both = theirs + timed(written, folder / "rows.parquet") - made
            here = timed(ours, path, wanted, None)
            whole = timed(ours, path, wanted, folder / f"{path.name}{run}")
            pairs.append((theirs, here / theirs, whole / theirs, whole / both))
        columns = [median(column) for column in zip(*pairs[1:], strict=True)]
        within = "" if columns[2] <= GOAL else f"  above {GOAL} x"
        print(
            f"  {name:25} {columns[0]:7.3f} s {columns[1]:6.2f} x"
            f" {columns[2]:6.2f} x {columns[3]:9.2f} x{within}"
        )


def main() -> None:
    """Print the table."""
    with TemporaryDirectory() as folder:
        importing(Path(folder))
