"""u-blox: each sample as a UBX-ESF-RAW message of 68 bytes.

    0xB5 0x62 0x10 0x03 length(2)  ms(4)  7 times: data(3) kind(1) tag(4)  sums(2)

Little-endian. Kinds: 14, 13, 5 angular rate x, y, z in 2^-12 deg/s; 12 temperature in
0.01 deg C; 16, 17, 18 acceleration x, y, z in 2^-10 m/s^2; 24 bits, signed, that clip.
The tag counts 39.0625 us in 24 bits. The sums are Fletcher's over all between. Source:
UBX-13003221, UBX-ESF-RAW.
"""

from __future__ import annotations

import numpy as np

from fieldcal.core.samples import Block
from fieldcal.sim_device.wire import Wire

MESSAGE = np.dtype(
    [("sync", "u1", 2), ("number", "u1", 2), ("length", "<u2"), ("ms", "<u4")]
    + [("values", [("word", "<u4"), ("tag", "<u4")], 7), ("sums", "u1", 2)]
)

KINDS = np.array([14, 13, 5, 12, 16, 17, 18])
TICK_S = 39.0625e-6
FULL = 2**23


class UbxWire(Wire):
    """ESF-RAW messages."""

    def encode(self, block: Block) -> bytes:
        """Encode each sample as one message."""
        rates = np.rad2deg(block.gyr) * 4096
        centi = block.temperature[:, None] * 100
        values = np.hstack([rates, centi, block.acc * 1024])
        whole = np.clip(np.rint(np.nan_to_num(values)), -FULL, FULL - 1)
        words = whole.astype(np.int64) & 0xFFFFFF | KINDS << 24
        messages = np.zeros(len(block), MESSAGE)
        messages["sync"], messages["number"] = (0xB5, 0x62), (0x10, 0x03)
        messages["length"] = MESSAGE.itemsize - 8
        messages["ms"] = np.rint(block.t * 1e3).astype(np.int64) % 2**32
        messages["values"]["word"] = words
        tags = np.rint(block.t / TICK_S).astype(np.int64) % 2**24
        messages["values"]["tag"] = tags[:, None]
        body = messages.view(np.uint8).reshape(len(block), -1)[:, 2:-2]
        running = np.cumsum(body, axis=1, dtype=np.uint8)
        messages["sums"][:, 0] = running[:, -1]
        messages["sums"][:, 1] = running.sum(axis=1, dtype=np.uint8)
        return messages.tobytes()
