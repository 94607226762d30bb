"""Logs of every format with known samples, and what merely reads them."""

import struct
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.importing.read_options import ReadOptions
from fieldcal.session.recorder import Recorder

ROWS = 100_000
RATE = 1000
COLUMNS = ("t", "ax", "ay", "az", "gx", "gy", "gz")


def samples(n: int) -> Block:
    """At rest, 1 kHz."""
    rng = np.random.default_rng(1)
    acc = rng.normal(0, 0.02, (n, 3)) + [0, 0, -9.8]
    return Block.of(np.arange(n) / RATE + 1, acc, rng.normal(0, 1e-3, (n, 3)))


def dataflash(block: Block) -> bytes:
    """An ArduPilot log."""
    out = b""
    for kind, size, name, letters, labels in (
        (128, 89, "FMT", "BBnNZ", "Type,Length,Name,Format,Columns"),
        (132, 36, "IMU", "QBffffff", "TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ"),
    ):
        texts = (text.encode() for text in (name, letters, labels))
        out += b"\xa3\x95\x80" + struct.pack("<BB4s16s64s", kind, size, *texts)
    rows = np.zeros(
        len(block),
        [("mark", "3u1"), ("t", "<u8"), ("i", "u1"), ("w", "3<f4"), ("f", "3<f4")],
    )
    rows["mark"] = (0xA3, 0x95, 0x84)
    rows["t"], rows["w"], rows["f"] = np.round(block.t * 1e6), block.gyr, block.acc
    return out + rows.tobytes()


def ulog(block: Block) -> bytes:
    """A PX4 log of sensor_combined."""

    def message(kind: str, body: bytes) -> bytes:
        return struct.pack("<HB", len(body), ord(kind)) + body

    form = b"sensor_combined:uint64_t timestamp;float[3] gyro_rad;"
    form += b"float[3] accelerometer_m_s2;"
    out = b"ULog\x01\x12\x35\x01" + bytes(8) + message("B", bytes(40))
    out += message("F", form) + message("A", b"\0\1\0sensor_combined")
    rows = np.zeros(
        len(block),
        [("size", "<u2"), ("kind", "u1"), ("id", "<u2"), ("t", "<u8"), ("w", "3<f4"),
         ("f", "3<f4")],
    )  # fmt: skip
    rows["size"], rows["kind"], rows["id"] = 34, ord("D"), 1
    rows["t"], rows["w"], rows["f"] = np.round(block.t * 1e6), block.gyr, block.acc
    return out + rows.tobytes()


def text(block: Block) -> bytes:
    """Comma-separated columns."""
    rows = np.column_stack([block.t, block.six]).tolist()
    return "\n".join(",".join(f"{x:.6f}" for x in row) for row in rows).encode() + b"\n"


def write_tlog(path: Path, block: Block) -> None:
    """Write a telemetry log of HIGHRES_IMU."""
    from pymavlink.dialects.v20 import all as dialect

    link: Any = dialect.MAVLink(None, srcSystem=1, srcComponent=1)
    with path.open("wb") as file:
        for t, acc, gyr in zip(
            block.t.tolist(), block.acc.tolist(), block.gyr.tolist(), strict=True
        ):
            said = dialect.MAVLink_highres_imu_message(
                round(t * 1e6), *acc, *gyr, 0, 0, 0, 0, 0, 0, 20, 0xFFFF, 0
            )
            file.write(struct.pack(">Q", int(1.7e15 + 1e6 * t)) + said.pack(link))
            link.seq = (link.seq + 1) % 256


def write_can(path: Path, block: Block) -> None:
    """Write a candump or Vector log."""
    import can

    with can.Logger(str(path)) as log:
        for t, acc in zip(block.t.tolist(), block.acc.tolist(), strict=True):
            data = struct.pack("<3hH", *(round(x * 1000) for x in acc), 0)
            log.on_message_received(
                can.Message(
                    timestamp=1.5e9 + t, arbitration_id=16, data=data,
                    is_extended_id=False, channel="can0",
                )
            )  # fmt: skip


DBC = """VERSION ""
BS_:
BU_: X
BO_ 16 A: 8 X
 SG_ ax : 0|16@1- (0.001,0) [0|0] "m/s^2" X
 SG_ ay : 16|16@1- (0.001,0) [0|0] "m/s^2" X
 SG_ az : 32|16@1- (0.001,0) [0|0] "m/s^2" X
"""


def write_mcap(path: Path, block: Block) -> None:
    """Write raw and calibrated samples as the exporter does."""
    from fieldcal.calibration import Calibration, Nominal
    from fieldcal.exporters import ExportSource, mcap
    from fieldcal.session.folder import Session

    made = path.parent / "recorded"
    with Recorder(made, {"format": 1}) as recorder:
        recorder.append(block)
    none = np.empty(0)
    unit = Calibration("joint", (), none, np.empty((0, 0)), (), 0.0, 0, 0.0)
    mcap.write(ExportSource(unit, Nominal(), Session.open(made)), path)


def read_ulog(path: Path) -> None:
    """Read by pyulog."""
    from pyulog import ULog

    ULog(str(path))


def read_dataflash(path: Path) -> None:
    """Read by pymavlink."""
    from pymavlink.DFReader import DFReader_binary

    reader = DFReader_binary(str(path))
    while reader.recv_match(type=["IMU"]) is not None:
        pass
    reader.close()


def read_tlog(path: Path) -> None:
    """Read by pymavlink."""
    from pymavlink import mavutil

    link = mavutil.mavlink_connection(str(path))
    while link.recv_match(type=["HIGHRES_IMU"]) is not None:
        pass
    link.close()


def read_can(path: Path) -> None:
    """Read by python-can."""
    import can

    with can.LogReader(str(path)) as log:
        for _ in log:
            pass


def read_mcap(path: Path) -> None:
    """Read by mcap and mcap-ros2-support."""
    from mcap.reader import make_reader
    from mcap_ros2.decoder import DecoderFactory

    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        for _ in reader.iter_decoded_messages(topics=["/imu/raw"]):
            pass


def read_text(path: Path) -> None:
    """Read by numpy."""
    np.loadtxt(path, delimiter=",")


def read_hdf5(path: Path) -> None:
    """Read by h5py."""
    import h5py

    with h5py.File(path) as file:
        _ = file["imu"][()]


def read_matlab(path: Path) -> None:
    """Read by scipy."""
    from scipy.io import loadmat

    loadmat(path)


def read_npz(path: Path) -> None:
    """Read by numpy."""
    with np.load(path) as file:
        _ = file["imu"]


def read_parquet(path: Path) -> None:
    """Read by pyarrow."""
    import pyarrow.parquet

    pyarrow.parquet.read_table(path)


Log = tuple[Path, Callable[[Path], None], ReadOptions]
"""A file, what merely reads it, and what the user says of it."""


def write_tables(folder: Path, rows: int) -> dict[str, Log]:
    """Files of the formats that libraries read fastest."""
    import h5py
    import pyarrow as pa
    import pyarrow.parquet
    from scipy.io import savemat

    block = samples(rows)
    table = np.column_stack([block.t, block.six])
    (folder / "x.csv").write_bytes(text(block))
    for name, packing in (("x.h5", None), ("packed.h5", "gzip")):
        with h5py.File(folder / name, "w") as file:
            file.create_dataset("imu", data=table, compression=packing)
    savemat(folder / "x.mat", {"imu": table})
    np.savez(folder / "x.npz", imu=table)
    # as MATLAB itself saves it
    savemat(folder / "packed.mat", {"imu": table}, do_compression=True)
    columns = dict(zip(COLUMNS, table.T, strict=True))
    pyarrow.parquet.write_table(pa.table(columns), folder / "x.parquet")
    named = ReadOptions(COLUMNS)
    return {
        "csv, numpy": (folder / "x.csv", read_text, named),
        "matlab, scipy": (folder / "x.mat", read_matlab, named),
        "matlab packed, scipy": (folder / "packed.mat", read_matlab, named),
        "hdf5, h5py": (folder / "x.h5", read_hdf5, named),
        "hdf5 packed, h5py": (folder / "packed.h5", read_hdf5, named),
        "npz, numpy": (folder / "x.npz", read_npz, named),
        "parquet, pyarrow": (folder / "x.parquet", read_parquet, named),
    }


def write_all(folder: Path, rows: int) -> dict[str, Log]:
    """Files of every format."""
    block = samples(rows)
    (folder / "imu.dbc").write_text(DBC)
    (folder / "x.ulg").write_bytes(ulog(block))
    (folder / "x.bin").write_bytes(dataflash(block))
    write_tlog(folder / "x.tlog", block)
    write_can(folder / "x.log", block)
    write_can(folder / "x.asc", block)
    write_can(folder / "x.blf", block)
    write_mcap(folder / "x.mcap", block)
    bus = ReadOptions(options=f"dbc={folder / 'imu.dbc'}&map=ax=ax,ay=ay,az=az")
    none = ReadOptions()
    return {
        "ulog, pyulog": (folder / "x.ulg", read_ulog, none),
        "dataflash, pymavlink": (folder / "x.bin", read_dataflash, none),
        "tlog, pymavlink": (folder / "x.tlog", read_tlog, none),
        "mcap, mcap-ros2-support": (folder / "x.mcap", read_mcap, none),
        "candump, python-can": (folder / "x.log", read_can, bus),
        "asc, python-can": (folder / "x.asc", read_can, bus),
        "blf, python-can": (folder / "x.blf", read_can, bus),
        **write_tables(folder, rows),
    }
