"""Ten million frames, most of them spoilt, through the serial decoders."""

import numpy as np

from benchmarks.codecs import TOLD
from fieldcal.core.samples import Array, Block
from fieldcal.drivers.codec import open_codec, wire_formats
from fieldcal.drivers.options import Options
from fieldcal.sim_device.wire import open_wire

FRAMES = 10_000_000 // len(wire_formats())
BATCH = 2000
SENT = {"text": "text?checksum=xor&digits=7"}
READ = {"text": "checksum=xor&"} | TOLD
ODDS = {"mip": 2**-16, "ubx": 2**-16, "vectornav": 2**-16}
"""Odds that strange bytes pass the check; 2^-8 unless told. Two flipped bits in a frame
may fare worse: Fletcher's sums do not see a pair of highest bits an even way apart."""


def samples(rng: np.random.Generator, begin: int) -> Block:
    """Samples that are all different, on a time that goes on."""
    return Block.of(
        (begin + np.arange(BATCH)) / 1000,
        np.round(rng.normal(0, 10, (BATCH, 3)), 3),
        np.round(rng.normal(0, 1, (BATCH, 3)), 3),
        np.full(BATCH, 25.0),
        np.arange(begin, begin + BATCH, dtype=float),
    )


def spoil(stream: bytes, rng: np.random.Generator) -> bytes:
    """Flip a bit in every other frame; exchange, lose and double bytes anywhere."""
    data = np.frombuffer(stream, np.uint8).copy()
    pairs = np.arange(BATCH // 2) * (len(data) // (BATCH // 2))
    flips = pairs + rng.integers(len(data) // BATCH, size=len(pairs))
    data[flips] ^= (1 << rng.integers(8, size=len(flips))).astype(np.uint8)
    strange = rng.integers(len(data), size=BATCH // 4)
    data[strange] = rng.integers(256, size=len(strange))
    copies = np.ones(len(data), dtype=np.int64)
    copies[rng.integers(len(data), size=BATCH // 8)] = 0
    copies[rng.integers(len(data), size=BATCH // 8)] = 2
    return np.repeat(data, copies).tobytes()


def keys(six: Array) -> set[bytes]:
    """Samples that can be looked up, coarse enough for every format's rounding."""
    whole = np.round(six[:, :3] * 20).astype(np.int64)
    return {row.tobytes() for row in whole}


def near(six: Array) -> list[set[bytes]]:
    """The same, for each sample, with the neighbours that rounding may lead to."""
    low = np.floor(np.clip(np.nan_to_num(six[:, :3], nan=1e9), -1e9, 1e9) * 20)
    corners = np.array(np.meshgrid([0, 1], [0, 1], [0, 1])).reshape(3, -1).T
    whole = low.astype(np.int64)
    return [{(row + corner).tobytes() for corner in corners} for row in whole]


def run(name: str, frames: int) -> tuple[int, int, int]:
    """Frames that came through, wrong samples, most bytes kept."""
    rng = np.random.default_rng(99)
    wire = open_wire(SENT.get(name, name))
    codec = open_codec(name, Options("fuzz", READ.get(name, "").rstrip("&")))
    before: set[bytes] = set()
    wrong = kept = 0
    for begin in range(0, frames, BATCH):
        block = samples(rng, begin)
        now = keys(block.six)
        got = codec.feed(spoil(wire.encode(block), rng), begin / 1000)
        kept = max(kept, codec.waiting_bytes)
        if got is not None:
            wrong += sum(not (some & now or some & before) for some in near(got.six))
        before = now
    return codec.health.samples, wrong, kept


def main() -> None:
    """Print, for each format, what came of spoilt frames."""
    print(
        f"{'format':10} {'frames':>8} {'whole':>8} {'wrong':>6} {'odds allow':>10} kept"
    )
    for name in wire_formats():
        whole, wrong, kept = run(name, FRAMES)
        allowed = (FRAMES - whole) * ODDS.get(name, 2**-8)
        print(f"{name:10} {FRAMES:8} {whole:8} {wrong:6} {allowed:10.1f} {kept} bytes")
