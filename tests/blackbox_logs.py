"""Blackbox logs, written as the firmware's documentation says."""

from __future__ import annotations

import struct

import numpy as np
from numpy.typing import NDArray

from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block

Counts = NDArray[np.int64]

FIELDS = (
    "loopIteration", "time", *(f"gyroADC[{i}]" for i in range(3)),
    *(f"accSmooth[{i}]" for i in range(3)),
)  # fmt: skip
ROWS, EVERY = 200, 16
SIGNED = ",".join("0" if name in FIELDS[:2] else "1" for name in FIELDS)


def unsigned(value: int) -> bytes:
    """Seven bits a byte, the last without its highest."""
    out = bytearray()
    while value > 127:
        out.append(value & 127 | 128)
        value >>= 7
    return bytes([*out, value])


def signed(value: int) -> bytes:
    return unsigned(2 * value if value >= 0 else -2 * value - 1)


def header(
    scale: float, firmware: str = "Cleanflight", fields: str = "", more: str = ""
) -> bytes:
    bits = struct.unpack("<I", struct.pack("<f", scale))[0]
    names = fields or ",".join(FIELDS)
    many = len(names.split(","))
    lines = [
        "Product:Blackbox flight data recorder by Nicholas Sherlock", "Data version:2",
        f"I interval:{EVERY}", "P interval:1/1",
        f"Field I name:{names}", f"Field I signed:{SIGNED}",
        f"Field I predictor:{','.join('0' * many)}",
        f"Field I encoding:{','.join('1' if i < 2 else '0' for i in range(many))}",
        # the loop counts up, all else is told by what came before
        f"Field P predictor:{','.join('6' if not i else '1' for i in range(many))}",
        f"Field P encoding:{','.join('9' if not i else '0' for i in range(many))}",
        f"Firmware type:{firmware}", f"gyro_scale:0x{bits:08x}", "acc_1G:2048",
        *([more] if more else []),
    ]  # fmt: skip
    return "".join(f"H {line}\n" for line in lines).encode()


def counts(seed: int) -> Counts:
    rng = np.random.default_rng(seed)
    table = np.zeros((ROWS, len(FIELDS)), dtype=np.int64)
    table[:, 0] = np.arange(ROWS)
    table[:, 1] = 5_000_000 + 1000 * np.arange(ROWS)
    table[:, 2:5] = rng.integers(-300, 300, (ROWS, 3))
    table[:, 5:] = [12, -30, 2050] + rng.integers(-9, 9, (ROWS, 3))
    return table


def frames(table: Counts) -> bytes:
    out = bytearray()
    before = table[0]
    for i, row in enumerate(table.tolist()):
        if i % EVERY == 0:
            out += b"I" + unsigned(row[0]) + unsigned(row[1])
            out += b"".join(signed(value) for value in row[2:])
        else:
            pairs = zip(row[1:], before[1:], strict=True)
            out += b"P" + b"".join(signed(int(a - b)) for a, b in pairs)
        before = row
    return bytes(out) + b"E\xffEnd of log\x00"


def of_block(block: Block) -> bytes:
    """A flight with the samples of a block, rounded to counts."""
    table = np.zeros((len(block), len(FIELDS)))
    table[:, 0] = np.arange(len(block))
    table[:, 1] = block.t * 1e6
    table[:, 2:5] = np.rad2deg(block.gyr)
    table[:, 5:] = block.acc / G0 * 2048
    return header(1.0) + frames(np.round(table).astype(np.int64))
