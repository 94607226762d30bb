"""Memory that importing takes: the peak of a process of its own, of 1 h and of 4 h.

What is kept of a recording must not grow with it, so both are to be the same within a
few per cent. The device is turned every five minutes, at 1 kHz.
"""

import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks._logs import RATE, dataflash, samples, ulog
from fieldcal.core.samples import Block
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.session.ingest import import_stream

HOURS = (1, 4)
PIECE = 300 * RATE
NAMES = ("t", "ax", "ay", "az", "gx", "gy", "gz")

CHILD = "from benchmarks.import_memory import *; peak(*map(Path, sys.argv[1:]))"


def peak(recorded: Path, folder: Path) -> None:
    """Import a file and print the peak of this process, MB, rows and rests.

    `ru_maxrss` would begin with that of the process that started this one.
    """
    recording = open_recording(recorded, ReadOptions(NAMES))
    name = recording.streams()[0].name
    imported = import_stream(recording, name, folder, {"format": 1}, 1.0)
    status = Path("/proc/self/status").read_text().splitlines()
    most = next(int(w.split()[1]) for w in status if w.startswith("VmHWM"))
    print(most / 1024, imported.facts.rows, len(imported.rests))


def text(block: Block) -> bytes:
    """Comma-separated columns, by Arrow."""
    import pyarrow as pa
    import pyarrow.csv

    rows = np.column_stack([block.t, block.six])
    names = [str(i) for i in range(rows.shape[1])]
    table = pa.table(dict(zip(names, np.round(rows, 6).T, strict=True)))
    sink = pa.BufferOutputStream()
    options = pyarrow.csv.WriteOptions(include_header=False)
    pyarrow.csv.write_csv(table, sink, options)
    out: bytes = sink.getvalue().to_pybytes()
    return out


def pieces(hours: int) -> Iterator[Block]:
    """A device that is turned again and again."""
    piece = samples(PIECE)
    turn = np.linspace(0, 0.5, 3 * RATE)[:, None] * [1, -1, 0]
    piece.acc[-len(turn) :] += turn
    for k in range(hours * 3600 * RATE // PIECE):
        yield Block.of(piece.t + k * PIECE / RATE, piece.acc, piece.gyr)


def write(path: Path, hours: int) -> None:
    """Write its log."""
    if path.suffix == ".parquet":
        write_parquet(path, hours)
        return
    make = {".bin": dataflash, ".ulg": ulog, ".csv": text}[path.suffix]
    head = len(make(samples(0)))
    with path.open("wb") as file:
        file.write(make(samples(0)))
        for piece in pieces(hours):
            file.write(make(piece)[head:])


def write_parquet(path: Path, hours: int) -> None:
    """Write its log, a group of rows for each piece."""
    import pyarrow as pa
    import pyarrow.parquet

    schema = pa.schema([(name, pa.float64()) for name in NAMES])
    with pyarrow.parquet.ParquetWriter(path, schema) as file:
        for piece in pieces(hours):
            rows = np.column_stack([piece.t, piece.six])
            table = pa.table(dict(zip(NAMES, rows.T, strict=True)))
            file.write_table(table)


def main() -> None:
    """Print the peaks."""
    print("peak of importing, MB   " + "  ".join(f"{h:5} h" for h in HOURS))
    with TemporaryDirectory() as folder:
        for ending in (".bin", ".ulg", ".csv", ".parquet"):
            peaks = []
            for hours in HOURS:
                path = Path(folder) / f"{hours}h{ending}"
                write(path, hours)
                done = subprocess.run(
                    [sys.executable, "-c", CHILD, str(path), f"{path}.session"],
                    capture_output=True, text=True, check=True,
                )  # fmt: skip
                most, rows, rests = done.stdout.split()
                if int(rows) != hours * 3600 * RATE:
                    raise SystemExit(f"{path.name}: {rows} rows came out")
                peaks.append(float(most))
                path.unlink()
            growth = peaks[1] / peaks[0] - 1
            print(
                f"  {ending:20}" + "  ".join(f"{one:7.0f}" for one in peaks)
                + f"   {growth:+.1%}, {rests} rests"
            )  # fmt: skip
