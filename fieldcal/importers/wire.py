"""Bytes of a serial port kept in a file: VectorNav, MIP, WitMotion and the others.

The wire format is found by what decodes; ``--options "format=mip"`` names it, with its
options as in a device's address.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from fieldcal.core.errors import FieldcalError, InputError
from fieldcal.core.samples import Block
from fieldcal.drivers.codec import Codec, open_codec, recognise_format
from fieldcal.drivers.options import Options
from fieldcal.importing.recording import ImuStream, Recording

WHAT = "bytes of a serial port"

CUT = 1 << 20
"""Bytes decoded at once."""

RANGES = {"witmotion": ("acc_range", "gyr_range")}
"""Options of formats that do not send their full scales."""

USUAL_FULL_SCALES = ((2.0, 4.0, 8.0, 16.0), (125.0, 250.0, 500.0, 1000.0, 2000.0))
"""Usual full scales, g and deg/s; the last is what formats take."""

SECONDS = 1.0
"""Time that the first bytes are taken for, where the format asks."""


def recognises(head: bytes, path: Path) -> bool:
    """Whether one of the wire formats fits."""
    return recognise_format(head, SECONDS) is not None


class WireStream(Recording):
    """The bytes of one device."""

    _codec: Codec | None = None
    _name = ""

    def streams(self) -> list[ImuStream]:
        """Return the one IMU."""
        self._opened()
        return [ImuStream("0", f"{self._name}, units of its format")]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return the format."""
        return {"format": self._name}

    def rescaled(self, acc: float, gyr: float) -> str:
        """Full scales, where the format leaves them to the user."""
        if self._name not in RANGES:
            return ""
        given = Options("options", self.wanted.options)
        given.text("format")
        says = []
        for name, usual, many in zip(
            RANGES[self._name], USUAL_FULL_SCALES, (acc, gyr), strict=True
        ):
            full = given.number(name, usual[-1], 0.0, 1e6) / many
            near = min(usual, key=lambda one: abs(np.log(one / full)))
            says.append(f"{name}={near:g}")
        return f'--options "{"&".join(says)}"'

    def _opened(self) -> Codec:
        options = Options("options", self.wanted.options)
        self._name = options.text("format")
        if not self._name:
            first = next(self.pieces(CUT), b"")
            fits = recognise_format(first, SECONDS)
            if fits is None:
                raise InputError(
                    f"{self.path}: say what bytes these are, such as --options "
                    '"format=mip"'
                )
            self._name = fits[0]
            query = self.wanted.options or fits[1].query
            options = Options("options", query)
        if self.wanted.rate_hz:
            options = options.with_fixed(rate=str(self.wanted.rate_hz))
        codec = open_codec(self._name, options)
        options.finish()
        return codec

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples, some bytes at a time."""
        codec = self._opened()
        for data in self.pieces(CUT):
            try:
                block = codec.feed(data)
            except FieldcalError as error:
                raise InputError(f"{self.path}: {error}") from error
            if block is not None:
                yield block
        health = codec.health
        if not health.samples:
            raise InputError(
                f"{self.path}: holds no sample of {self._name} that has a time; give"
                " the rate with --rate where the device sends none, or check the"
                " options"
            )
        lost = health.skipped + codec.waiting_bytes
        if lost or health.bad or health.gaps:
            self.says.append(
                f"{lost} of {health.received} bytes belong to no whole frame,"
                f" {health.bad} frames failed their check, {health.missing} samples"
                f" are missing in {health.gaps} gaps"
            )
