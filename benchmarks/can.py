"""CAN frames into samples against python-can with cantools, as ratios in one run."""

from collections import defaultdict
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time

import can
import numpy as np

from benchmarks._load import load_at_1_khz
from fieldcal.core.errors import DeviceError
from fieldcal.core.samples import Block
from fieldcal.drivers.can_frame_groups import CanLinkHealth
from fieldcal.drivers.can_frames import FRAME_DTYPE, FrameBuffer, Frames
from fieldcal.drivers.can_map import VIRTUAL_DBC, load_database, read_map
from fieldcal.drivers.can_samples import CanAssembler
from fieldcal.drivers.driver import open_driver
from fieldcal.drivers.options import Options
from fieldcal.sim_device import Profile, VirtualDevice
from fieldcal.sim_device.can_packing import frames

SAMPLES = 30_000
"""Half a minute at 1 kHz: three times as many frames."""

BATCH = 3000
"""Frames decoded at once: a second."""

SPOILT = 999_999
"""Frames of a bus in trouble."""

RUNS = 5
GOAL = 10.0
DATABASE = load_database(VIRTUAL_DBC)


def messages() -> list[can.Message]:
    """Frames of the virtual device, as python-can hands them over."""
    packed = frames(VirtualDevice(Profile(), seed=1).take(SAMPLES))
    return [
        can.Message(
            timestamp=i / 3000,
            arbitration_id=frame.identifier,
            data=bytearray(frame.data),
            is_extended_id=False,
        )
        for i, frame in enumerate(packed)
    ]


def by_cantools(received: list[tuple[int, bytes]]) -> int:
    """Decode frame by frame; the number of frames."""
    decode = DATABASE.decode_message
    return len([decode(identifier, data) for identifier, data in received])


def numbers(rows: Frames) -> int:
    """Decode every signal of frames that came as rows; the number of frames."""
    got = 0
    for part in read_map(Options("can", "dbc=virtual")):
        data = rows["data"][rows["id"] == part.identifier]
        for channel in part.channels.values():
            channel.field.values(data)
        got += len(data)
    return got


def samples(rows: Frames) -> int:
    """Decode, put together and time samples; the number of their frames."""
    options = Options("can", "dbc=virtual")
    decoder = CanAssembler(read_map(options), CanLinkHealth(), options)
    got = 0
    for i in range(0, len(rows), BATCH):
        some = rows[i : i + BATCH]
        block = decoder.feed(some, some["t"].astype(float))
        got += 0 if block is None else len(block)
    return 3 * got


def as_rows(received: list[can.Message]) -> Frames:
    """Pack what python-can hands over."""
    packed = FrameBuffer(len(received))
    packed.fill(received, defaultdict(int))
    return packed.frames


def log_by_cantools(path: Path) -> int:
    """Read and decode a log frame by frame."""
    with can.LogReader(path) as log:
        return by_cantools([(m.arbitration_id, bytes(m.data)) for m in log])


def log_by_driver(path: Path) -> int:
    """Read and decode a log with the driver."""
    with open_driver(f"can:{path}?dbc=virtual&speed=max") as imu:
        with suppress(DeviceError):  # the end of the log
            for _ in imu.blocks():
                pass
        return 3 * imu.health.samples


def compare(
    what: str, theirs: Callable[[], int], ours: Callable[[], int], goal: float = 0.0
) -> None:
    """Print frames/s of both, the best of several runs in turn, and the ratio."""
    best = [float("inf"), float("inf")]
    for _ in range(RUNS):
        for k, run in enumerate((theirs, ours)):
            began = process_time()
            if run() != 3 * SAMPLES:
                print(f"! {what}: not every frame was decoded")
            best[k] = min(best[k], process_time() - began)
    slow, fast = (3 * SAMPLES / seconds / 1e3 for seconds in best)
    aim = f"{goal:4.0f}" if goal else ""
    print(f"{what:34} {slow:6.0f} k/s {fast:6.0f} k/s  {fast / slow:5.1f}  {aim}")


def spoilt(lost: float, doubled: float, moved: float) -> tuple[int, int, int]:
    """Samples that a bus in trouble lets through, wrong ones, and incomplete ones.

    Shares of the frames are lost, doubled, or come behind the next one.
    """
    rng = np.random.default_rng(99)
    n = SPOILT // 3
    six = np.round(rng.uniform(-30, 30, (n, 6)), 4)
    seq = np.arange(n, dtype=float)
    truth = Block.of(seq / 1000, six[:, :3], six[:, 3:], 0 * seq, seq)
    packed = frames(truth)
    rows = np.zeros(len(packed), FRAME_DTYPE)
    rows["id"] = [frame.identifier for frame in packed]
    rows["size"] = 8
    joined = b"".join(frame.data for frame in packed)
    rows["data"][:, :8] = np.frombuffer(joined, np.uint8).reshape(-1, 8)
    copies = 1 - (rng.uniform(size=len(rows)) < lost).astype(int)
    copies[rng.uniform(size=len(rows)) < doubled] = 2
    late = np.arange(len(rows)) + 1.5 * (rng.uniform(size=len(rows)) < moved)
    rows = np.repeat(rows, copies)[np.argsort(np.repeat(late, copies), kind="stable")]
    options, health = Options("can", "dbc=virtual"), CanLinkHealth()
    decoder = CanAssembler(read_map(options), health, options)
    whole = wrong = 0
    for i in range(0, len(rows), BATCH):
        some = rows[i : i + BATCH]
        block = decoder.feed(some, some["t"].astype(float))
        if block is not None:
            at = np.rint(block.t * 1000).astype(int)
            off = np.abs(block.six - truth.six[at]).max(axis=1)
            whole, wrong = whole + len(block), wrong + int(np.sum(off > 1e-3))
    return whole, wrong, health.incomplete


def main() -> None:
    """Print decoded frames a second of both, their ratio, and the load at 1 kHz."""
    received = messages()
    rows = as_rows(received)
    pairs = [(m.arbitration_id, bytes(m.data)) for m in received]

    def theirs() -> int:
        return by_cantools(pairs)

    print(f"{'frames':34} {'cantools':>10} {'fieldcal':>10}  ratio  goal")
    compare("decoded, every signal", theirs, lambda: numbers(rows), GOAL)
    compare("decoded, joined, timed", theirs, lambda: samples(rows))
    compare("the same from can.Message", theirs, lambda: samples(as_rows(received)))
    with TemporaryDirectory() as folder:
        path = Path(folder) / "frames.log"
        with can.Logger(path) as log:
            for message in received:
                log(message)
        compare(
            "read from a candump log",
            lambda: log_by_cantools(path),
            lambda: log_by_driver(path),
        )
    for what, shares in (
        ("10 % of the frames lost", (0.1, 0.0, 0.0)),
        ("10 % doubled", (0.0, 0.1, 0.0)),
        ("3 % each lost, doubled, moved", (0.03, 0.03, 0.03)),
    ):
        whole, wrong, incomplete = spoilt(*shares)
        print(
            f"{SPOILT} frames, {what}: {whole} samples whole, {incomplete} incomplete,"
            f" {wrong} wrong"
        )
    share, heard = load_at_1_khz(
        ["--can", "slcan", "--once"], "can:{}?interface=slcan&dbc=virtual"
    )
    print(
        f"slcan at 1 kHz: {heard:.0f} samples/s, {100 * share:.1f} % of a core,"
        f" {1 / share:.0f} devices"
    )
