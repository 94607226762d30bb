"""Memory that importing takes: the peak of a process of its own, of 1 h and of 4 h.

What is kept of a recording must not grow with it, so both are to be the same within a
few per cent. The device is turned every five minutes, at 1 kHz.
"""

import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from benchmarks._logs import RATE, dataflash, samples, ulog
from fieldcal.core.samples import Block

HOURS = (1, 4)
PIECE = 300 * RATE

CHILD = """
import sys
from pathlib import Path
from fieldcal.importing.session.ingest import import_stream
from fieldcal.importers import open_recording
from fieldcal.importing.recording import ReadOptions
names = ("t", "ax", "ay", "az", "gx", "gy", "gz")
recording = open_recording(Path(sys.argv[1]), ReadOptions(names))
name = recording.streams()[0].name
imported = import_stream(recording, name, Path(sys.argv[2]), {"format": 1}, 1.0)
# ru_maxrss would begin with that of the process that started this one
status = dict(line.split(":") for line in open("/proc/self/status") if "VmHWM" in line)
peak = int(status["VmHWM"].split()[0]) / 1024
print(peak, imported.facts.rows, len(imported.stretches))
"""


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


def write(path: Path, hours: int) -> None:
    """Write a log of a device that is turned again and again."""
    make = {".bin": dataflash, ".ulg": ulog, ".csv": text}[path.suffix]
    piece = samples(PIECE)
    turn = np.linspace(0, 0.5, 3 * RATE)[:, None] * [1, -1, 0]
    piece.acc[-len(turn) :] += turn
    head = len(make(piece[:0]))
    with path.open("wb") as file:
        file.write(make(piece[:0]))
        for k in range(hours * 3600 * RATE // PIECE):
            later = Block.of(piece.t + k * PIECE / RATE, piece.acc, piece.gyr)
            file.write(make(later)[head:])


def main() -> None:
    """Print the peaks."""
    print("peak of importing, MB   " + "  ".join(f"{h:5} h" for h in HOURS))
    with TemporaryDirectory() as folder:
        for ending in (".bin", ".ulg", ".csv"):
            peaks = []
            for hours in HOURS:
                path = Path(folder) / f"{hours}h{ending}"
                write(path, hours)
                done = subprocess.run(
                    [sys.executable, "-c", CHILD, str(path), f"{path}.session"],
                    capture_output=True, text=True, check=True,
                )  # fmt: skip
                peak, rows, stretches = done.stdout.split()
                if int(rows) != hours * 3600 * RATE:
                    raise SystemExit(f"{path.name}: {rows} rows came out")
                peaks.append(float(peak))
                path.unlink()
            growth = peaks[1] / peaks[0] - 1
            print(
                f"  {ending:20}" + "  ".join(f"{peak:7.0f}" for peak in peaks)
                + f"   {growth:+.1%}, {stretches} still stretches"
            )  # fmt: skip
