"""An awkward log, drawn at random: how it was handled, what it holds, how it is laid.

What is drawn is also what a user would know who is asked: `Log.answers`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from benchmarks.awkward.motion import Floats, G, Handling, Moved, moved, outputs
from benchmarks.awkward.written import NAMED, Columns, heading, write
from fieldcal.core.samples import Block
from fieldcal.sim_device.wire import open_wire

ACC = {"m/s^2": 1.0, "g": 1 / G, "mg": 1000 / G} | {
    f"{n} in g": n / G for n in (16384, 8192, 4096, 2048, 256)
}
GYR = {"rad/s": 1.0, "deg/s": 180 / np.pi, "mrad/s": 1e3} | {
    f"{n} in deg/s": n * 180 / np.pi for n in (131.072, 65.536, 32.768, 16.384)
}
TIME = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
WARM: Mapping[str, tuple[float, float]] = {
    "degC": (1, 0), "cdegC": (100, 0), "K": (1, 273.15), "count": (256, -256 * 25),
}  # fmt: skip
WIRES = ("witmotion", "vectornav", "mip", "xsens", "ubx")
HEADS = ("none", "bare", "units", "second line", "txwx", "axis (unit)", "grouped")
JUMP = 1.7e9
"""What a clock jumps by when it hears the time of day, s."""

KINDS = ("samples",) * 7 + ("means", "wire", "several")


@dataclass(frozen=True)
class Log:
    """A log and what is true of it.

    Attributes
    ----------
    path : of the file
    kind : of `KINDS`
    said : what was drawn, for people
    t : (n,) s
    timed : whether the file says it
    acc, gyr : (n, 3) by IMU, m/s^2 and rad/s
    warm : (n,) deg C, or None
    answers : options that answer each question, by a word of it
    moved : what the device went through

    """

    path: Path
    kind: str
    said: dict[str, object]
    t: Floats
    acc: list[Floats]
    gyr: list[Floats]
    warm: Floats | None
    answers: dict[str, list[str]]
    moved: Moved = field(repr=False)
    timed: bool = True


def draw(seed: int, folder: Path) -> Log:
    """Draw a log and write it into a folder."""
    rng = np.random.default_rng(seed)
    kind = str(rng.choice(KINDS))
    handling = _handling(rng, kind)
    went = moved(handling, rng)
    many = int(rng.integers(2, 4)) if kind == "several" else 1
    noise = float(np.exp(rng.uniform(np.log(3e-3), np.log(0.06))))
    odd = int(rng.integers(many)) if kind == "several" and rng.random() < 0.5 else -1
    devices = [
        outputs(went, handling, noise, 0.95 if i == odd else 1.0, rng)
        for i in range(many)
    ]
    acc, gyr = [a for a, _ in devices], [w for _, w in devices]
    said: dict[str, object] = {"kind": kind, "noise": round(noise, 4)}
    said |= {"rate": handling.rate, "positions": handling.positions, "out": odd}
    log = Log(folder / "log.csv", kind, said, went.t, acc, gyr, None, {}, went)
    log = _spoilt(log, handling, rng)
    if kind == "wire":
        return _as_bytes(log, folder, rng)
    if kind == "means":
        return _as_means(log, folder, rng)
    return _as_text(log, folder, rng)


def _handling(rng: np.random.Generator, kind: str) -> Handling:
    rate = float(rng.choice([20.0, 50.0, 62.5, 100.0, 200.0]))
    still = rng.random() < 0.1 and kind == "samples"
    positions = 1 if still else int(rng.integers(5, 13))
    one = Handling(positions, rng.uniform(2.5, 5), rng.uniform(0.8, 2.0), rate)
    how = rng.choice(["table", "table", "hand", "slow", "hum"])
    if how == "hand":
        return replace(one, wobble=float(rng.uniform(0.005, 0.03)))
    if how == "slow":
        return replace(one, slow=float(rng.uniform(0.001, 0.01)))
    return replace(one, hum=float(rng.uniform(0.02, 0.3))) if how == "hum" else one


def _spoilt(log: Log, handling: Handling, rng: np.random.Generator) -> Log:
    """What recorders do: bursts, pauses, a clock that is set, clipping, dead bands.

    Rows that are marked as without a value, and damaged ones, are written so later.
    """
    t, acc, gyr = log.t, [a.copy() for a in log.acc], [w.copy() for w in log.gyr]
    spoils = rng.choice(
        ["", "", "bursts", "jump", "clipped", "dead band", "marked", "wild"]
    )
    if spoils == "bursts" and log.kind in ("samples", "several"):
        t = t + np.floor(t / 5.0) * 300.0
    if spoils == "clipped":
        gyr = [np.clip(w, -np.deg2rad(250), np.deg2rad(250)) for w in gyr]
    if spoils == "dead band":
        gyr = [np.where(np.abs(w - np.median(w, axis=0)) < 0.02,
                        np.median(w, axis=0), w) for w in gyr]  # fmt: skip
    log.said["spoilt"] = str(spoils)
    return replace(log, t=t, acc=acc, gyr=gyr)


def _as_bytes(log: Log, folder: Path, rng: np.random.Generator) -> Log:
    wire = str(rng.choice(WIRES))
    n = len(log.t)
    warm = np.full(n, 25.0)
    block = Block.of(log.t, log.acc[0], log.gyr[0], warm, np.arange(n, dtype=float))
    spec = wire
    log.said["wire"] = wire
    if wire == "witmotion":
        acc = int(rng.choice([2, 4, 8, 16]))
        gyr = int(rng.choice([500, 1000, 2000]))
        spec += f"?acc_range={acc}&gyr_range={gyr}"
        log.answers["acc_range"] = ["--options", f"acc_range={acc}&gyr_range={gyr}"]
    data = bytearray(open_wire(spec).encode(block))
    for at in rng.integers(0, len(data), int(rng.choice([0, 0, 5]))):
        data[at] ^= 1 << int(rng.integers(8))
    boot = b"starting up\r\n" * int(rng.choice([0, 1, 500]))
    path = folder / "log.bin"
    path.write_bytes(boot + bytes(data))
    return replace(log, path=path, warm=warm)


def _as_means(log: Log, folder: Path, rng: np.random.Generator) -> Log:
    some = [slice(a, b) for a, b in log.moved.rests]
    acc, gyr, sd_a, sd_g = (
        np.array([f(x[s], axis=0) for s in some])
        for x, f in ((log.acc[0], np.mean), (log.gyr[0], np.mean),
                     (log.acc[0], np.std), (log.gyr[0], np.std))
    )  # fmt: skip
    names = [f"{k}{x}" for k in "ag" for x in "xyz"]
    unit = str(rng.choice(["m/s^2", "g"]))
    table, head = np.hstack([acc * ACC[unit], gyr]), names
    if rng.random() < 0.5:
        counts = np.array([[b - a] for a, b in log.moved.rests], dtype=float)
        table = np.hstack([table, sd_a * ACC[unit], sd_g, counts])
        head = [*names, *(f"{n}_std" for n in names), "n"]
    log.said.update({"acc": unit, "columns": len(head)})
    log.answers["--sigma"] = ["--sigma", "0.01,0.001"]
    log.answers["--gyr-unit"] = ["--gyr-unit", "rad/s"]
    lines = [",".join(head), *(",".join(f"{x:.9g}" for x in row) for row in table)]
    log.path.write_text("\n".join(lines) + "\n")
    return replace(log, timed=False, acc=[acc], gyr=[gyr])


def _as_text(log: Log, folder: Path, rng: np.random.Generator) -> Log:
    acc_unit, gyr_unit = str(rng.choice(list(ACC))), str(rng.choice(list(GYR)))
    time_unit, head = str(rng.choice(list(TIME))), str(rng.choice(HEADS))
    if log.kind == "several":
        head = str(rng.choice(["bare", "units"]))
    timed = bool(rng.random() < 0.85)
    log.said.update(acc=acc_unit, gyr=gyr_unit, time=time_unit, head=head, timed=timed)
    columns: Columns = []
    if timed:
        columns.append(("t", time_unit, _stamps(log, rng) * TIME[time_unit]))
    zero = float(rng.choice([0.0, 0.0, 33000.0])) if "in" in acc_unit else 0.0
    log.said["zero"] = zero
    for i, (a, w) in enumerate(zip(log.acc, log.gyr, strict=True)):
        many = f"imu{i}_" if len(log.acc) > 1 else ""
        columns += _three(f"{many}a", acc_unit, a * ACC[acc_unit] + zero, rng)
        columns += _three(f"{many}g", gyr_unit, w * GYR[gyr_unit], rng)
    columns, lost = _lost(columns, str(log.said["spoilt"]), rng)
    warm = None
    if rng.random() < 0.4 and head not in ("grouped", "axis (unit)", "txwx"):
        warm = _thermometer(log, columns, rng)
    path = write(folder, columns, head, rng, log.said)
    log.answers.update(_answers(log, columns, head))
    # rows that are marked as without a value are no samples
    acc, gyr = (
        [np.delete(x, lost, axis=0) for x in some] for some in (log.acc, log.gyr)
    )
    known = None if head == "none" or warm is None else np.delete(warm, lost)
    return replace(
        log, path=path, t=np.delete(log.t, lost), acc=acc, gyr=gyr, warm=known,
        timed=timed,
    )  # fmt: skip


def _lost(
    columns: Columns, spoilt: str, rng: np.random.Generator
) -> tuple[Columns, NDArray[np.intp]]:
    """Columns of which some rows have no value, or any; and which have none."""
    none = np.zeros(0, dtype=np.intp)
    if spoilt not in ("marked", "wild"):
        return columns, none
    n = len(columns[0][2])
    rows = rng.choice(n, max(1, n // 150), replace=False)
    number = float(rng.choice([-999.0, 9999.0, -1.0, -32768.0]))
    out: Columns = []
    for name, unit, values in columns:
        whole = values.copy()
        if name != "t":
            most = 10 * np.abs(values).max()
            wild = rng.uniform(-most, most, len(rows))
            whole[rows] = number if spoilt == "marked" else wild
        out.append((name, unit, whole))
    return out, rows if spoilt == "marked" else none


def _answers(log: Log, columns: Columns, head: str) -> dict[str, list[str]]:
    channels = {f"{k}{x}" for k in "ag" for x in "xyz"} | {"t"}
    before = ["_"] if log.said["form"] == "tagged" else []
    thermal = "_" if head == "none" else "temperature"
    named = [n if n in channels else thermal for n, _, _ in columns]
    if log.said["form"] in NAMED:
        # where columns have names, they are asked for by these
        (over,) = heading("bare" if head == "units" else head, columns)
        pairs = zip(named, over, strict=True)
        named = [f"{n}={name}" for n, name in pairs if n in channels]
    zero = log.said["zero"]
    return ({"--acc-zero": ["--acc-zero", f"{zero:g}"]} if zero else {}) | {
        "--acc-unit": _option("acc", str(log.said["acc"])),
        "--gyr-unit": _option("gyr", str(log.said["gyr"])),
        "--time-unit": ["--time-unit", str(log.said["time"])],
        "--rate": ["--rate", str(log.said["rate"])],
        "--columns": ["--columns", ",".join([*before, *named])],
    }


def _stamps(log: Log, rng: np.random.Generator) -> Floats:
    """Times as the device writes them, s."""
    stamps = log.t + float(rng.choice([0.0, 12.3]))
    if log.said["spoilt"] == "jump":
        later = np.arange(len(stamps)) > len(stamps) // 2
        stamps = stamps + np.where(later, JUMP, 0.0)
    return stamps


def _three(name: str, unit: str, values: Floats, rng: np.random.Generator) -> Columns:
    """Columns of three axes; counts are whole, and some are decoded wrongly."""
    if "in" in unit:
        values = np.round(values)
        for at in rng.integers(0, len(values), int(rng.choice([0, 0, 0, 0, 8]))):
            values[at, rng.integers(3)] += 256
    return [(f"{name}{axis}", unit, values[:, j]) for j, axis in enumerate("xyz")]


def _thermometer(log: Log, columns: Columns, rng: np.random.Generator) -> Floats:
    """Deg C of a thermometer that is added to the columns."""
    unit = str(rng.choice(list(WARM)))
    size, off = WARM[unit]
    warm: Floats = 25 + 3 * np.arange(len(log.t)) / len(log.t)
    name = str(rng.choice(["temperature", "baro_temp"]))
    values = np.round(size * warm + off, 2)
    columns.append((name, "degC" if unit == "degC" else "", values))
    log.said["warm"] = unit
    scale = ["--temp-lsb", "256", "--temp-zero", "25"] if unit == "count" else []
    log.answers["--temp-unit"] = ["--temp-unit", unit, *scale]
    return warm


def _option(kind: str, unit: str) -> list[str]:
    lsb, _, bare = unit.rpartition(" in ")
    scale = [f"--{kind}-lsb", lsb] if lsb else []
    return [f"--{kind}-unit", bare, *scale]
