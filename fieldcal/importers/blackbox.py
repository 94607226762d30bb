"""Blackbox logs of Betaflight, Cleanflight and INAV (.bbl, .bfl, .txt of a recorder).

A stream is a flight: a recorder appends one log behind the other. ``accSmooth`` counts
``acc_1G`` in one g, ``gyroADC`` times ``gyro_scale`` is deg/s (rad/us where Baseflight
wrote it), a tenth of it where ``blackbox_high_resolution`` is on, ``time`` is us. Both
went through the firmware's filters, the gyroscopes less what they showed when it was
armed. Frames are read by `orangebox`.
Source: Betaflight, Blackbox logging internals; blackbox.c, blackboxHighResolutionScale.
"""

from __future__ import annotations

import logging
import struct
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block
from fieldcal.importing.files.packed_stream import unpacked_file
from fieldcal.importing.recording import ImuStream, Recording

WHAT = "blackbox of Betaflight, INAV: .bbl, .bfl"

BEGINS = b"H Product:Blackbox flight data recorder"

MOST_LOOPS = 1 << 16
"""Loops of the firmware between two frames at most; the counter has 16 bits."""

ROWS = 1 << 14
"""Rows put together in a block."""

ACC = tuple(f"accSmooth[{i}]" for i in range(3))
GYR = tuple(f"gyroADC[{i}]" for i in range(3))
TIME = "time"

FINE, FINER = "blackbox_high_resolution", 10.0
"""Setting by which gyroADC is so many times as large, to lose less by rounding."""

MEANT = "Baseflight"
"""Firmware whose gyro_scale is rad/us."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like one."""
    return head.startswith(BEGINS)


class BlackboxLog(Recording):
    """Flights of a flight controller."""

    def needs(self) -> tuple[tuple[str, ...], str]:
        """Return what reading it takes."""
        return ("orangebox",), "betaflight"

    def streams(self) -> list[ImuStream]:
        """Flights with samples of an accelerometer or a gyroscope."""
        with unpacked_file(self.path, self.cut_off) as path:
            many = self._opened(path, 1).reader.log_count
            names = {n: self._opened(path, n).field_names for n in range(1, many + 1)}
        says = "m/s^2, rad/s, filtered by the firmware"
        whole = [n for n, fields in names.items() if {*ACC} <= {*fields}]
        if not whole:
            raise InputError(
                f"{self.path}: has no accSmooth: let the firmware log the accelerometer"
                " (set blackbox_disable_acc = OFF), and record again"
            )
        return [ImuStream(f"log.{n}", says) for n in whole]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return what the log says of the device."""
        with unpacked_file(self.path, self.cut_off) as path:
            headers = self._opened(path, _number(stream)).headers
        said = ("Firmware type", "Firmware revision", "Craft name", "acc_1G",
                "gyro_scale", FINE, "gyro_lowpass_hz", "acc_lpf_hz")  # fmt: skip
        return {"message": stream, "acc_unit": "m/s^2", "gyr_unit": "rad/s"} | {
            name: str(headers[name]) for name in said if name in headers
        }

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of a flight, many at a time."""
        rows: list[list[float]] = []
        with unpacked_file(self.path, self.cut_off) as path:
            log = self._opened(path, _number(stream))
            scales = _scales(self.path, log.headers)
            places = {name: i for i, name in enumerate(log.field_names)}
            wanted = [places.get(name) for name in (TIME, *ACC, *GYR)]
            for data in self._frames(log):
                rows.append([np.nan if i is None else data[i] for i in wanted])
                if len(rows) == ROWS:
                    yield _block(rows, scales)
                    rows = []
        if rows:
            yield _block(rows, scales)

    def _opened(self, path: Path, number: int) -> Any:
        from orangebox import Parser

        log = logging.getLogger("orangebox")
        if not log.handlers:  # what it takes for missing is no matter of the user's
            log.addHandler(logging.NullHandler())
        try:
            opened = Parser.load(str(path), number)
        except Exception as error:
            # a reader made of what the file says raises what it likes
            raise InputError(
                f"{self.path}: its headers cannot be read:"
                f" {error or type(error).__name__}; copy it again from where it came"
            ) from error
        _check_intervals(self.path, opened.headers)
        return opened

    def _frames(self, log: Any) -> Iterator[tuple[float, ...]]:
        """Values of the frames that are whole."""
        seen = 0
        try:
            for frame in log.frames():
                yield frame.data
                seen += 1
        except Exception as error:
            why = str(error) or type(error).__name__
            self.cut_off(f"frame {seen + 1}", f"cannot be read: {why}")


def _number(stream: str) -> int:
    return int(stream.rpartition(".")[2])


def _scales(path: Path, headers: Mapping[str, Any]) -> tuple[float, float]:
    """m/s^2 and rad/s in one count of each sensor."""
    counts = headers.get("acc_1G", 0)
    if not isinstance(counts, (int, float)) or counts <= 0:
        raise InputError(
            f"{path}: does not say acc_1G, the counts in a g; export it with"
            " blackbox_decode and import the .csv with --acc-unit g --acc-lsb 2048"
        )
    gyr = _scale_of(path, headers.get("gyro_scale", headers.get("gyro.scale", 1)))
    gyr /= FINER if str(headers.get(FINE, "0")) not in ("0", "OFF") else 1
    is_rad = str(headers.get("Firmware type", "")) == MEANT
    return G0 / counts, gyr * 1e6 if is_rad else float(np.deg2rad(gyr))


def _check_intervals(path: Path, headers: Mapping[str, Any]) -> None:
    """Refuse intervals between frames by which their reader would count for ever.

    It seeks the next loop with a frame: of num/denom, with num below 1 there is none.
    A single 0 says that every frame stands for itself.
    """
    for name in ("I interval", "P interval"):
        said = str(headers.get(name, "1"))
        parts = [int(p) if p.strip().isdecimal() else -1 for p in said.split("/")]
        least = 0 if len(parts) == 1 else 1
        if not all(least <= part <= MOST_LOOPS for part in parts):
            raise InputError(
                f"{path}: its header {name} is {said!r}, which is no interval between"
                " frames; copy it again from where it came"
            )


def _scale_of(path: Path, said: Any) -> float:
    """What a header says of the gyroscopes' scale: 1, or the bits of a float."""
    try:
        whole = int(said, 16) if isinstance(said, str) else int(said)
        scale = struct.unpack("<f", struct.pack("<I", whole))[0] if whole > 1 else 1.0
    except (ValueError, TypeError, OverflowError, struct.error):
        scale = np.nan
    if not (np.isfinite(scale) and scale > 0):
        raise InputError(
            f"{path}: its header gyro_scale is {said!r}, which is no scale of a"
            " gyroscope (0x3f800000 would be 1); copy it again from where it came"
        )
    return float(scale)


def _block(rows: list[list[float]], scales: tuple[float, float]) -> Block:
    table = np.array(rows, dtype=float)
    acc, gyr = scales
    return Block.of(table[:, 0] * 1e-6, table[:, 1:4] * acc, table[:, 4:] * gyr)
