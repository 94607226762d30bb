"""Archives of telephones: a .zip with a text file for each sensor.

phyphox and the Sensor Logger of Android and iOS write ``Accelerometer.csv``,
``Gyroscope.csv`` and others, with one clock for all. The name of the file says the
sensor, its columns the axes; each sample of the accelerometer goes with the nearest of
the gyroscope. ``TotalAcceleration`` goes before ``Accelerometer``, from which some
programs take gravity out.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.importers.csv_like import TextColumns
from fieldcal.importers.workbook import MARKS
from fieldcal.importing import columns
from fieldcal.importing.recording import ImuStream, ReadOptions, Recording
from fieldcal.importing.times.alignment import AlignedPair
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.words.file_names import ACC, GYR

WHAT = "archives of telephones: phyphox, Sensor Logger"

SENSOR = {"a": "acc", "g": "gyr"}


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like an archive, but not of arrays or sheets."""
    zipped = head.startswith(b"PK\x03\x04") and b".npy" not in head
    return zipped and not any(mark in head for mark in MARKS)


class PhoneArchive(Recording):
    """An archive with the IMU of a telephone."""

    asks_units = True
    _texts: tuple[TextColumns, ...] = ()

    def streams(self) -> list[ImuStream]:
        """Return the one IMU."""
        for text in self._opened():
            text.streams()
        return [ImuStream("0", f"columns in {columns.describe_units(self.wanted)}")]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return the units."""
        return columns.unit_notes(self.wanted)

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of both sensors, those of the accelerometer with the nearest."""
        pair, both = AlignedPair(), [self._in_units(t) for t in self._opened()]
        judges = [
            RowValidator(f"{self.path}: {one.member}", one.place, self.repair)
            for one in both
        ]
        flows = [j.through(t.blocks("0")) for j, t in zip(judges, both, strict=True)]
        acc, gyr = [*flows, iter(())][:2]
        yield from pair.through(acc, gyr)
        for judge, one in zip(judges, both, strict=True):
            said = [*one.mended, *judge.mended]
            self.mended += [f"{one.member}: {sentence}" for sentence in said]
            self.says += [s for s in one.says if s not in self.says]

    def _in_units(self, text: TextColumns) -> TextColumns:
        """A text of one sensor, in the units that were found for all."""
        one = copy(text)
        one.says, one.mended = [], []
        one.wanted = replace(
            one.imus()["0"],
            acc_unit=self.wanted.acc_unit, acc_lsb=self.wanted.acc_lsb,
            gyr_unit=self.wanted.gyr_unit, gyr_lsb=self.wanted.gyr_lsb,
            time_unit=self.wanted.time_unit,
        )  # fmt: skip
        one.imus_found = {"0": one.wanted}
        return one

    def _opened(self) -> tuple[TextColumns, ...]:
        """The texts of accelerometer and gyroscope, as they are in it."""
        if self._texts:
            return self._texts
        texts = []
        for kind, member in self._members().items():
            text = TextColumns(self.path, self.wanted, self.repair)
            text.member, text.sensor, text.from_first = member, SENSOR[kind], False
            texts.append(text)
        self._texts = tuple(texts)
        self.wanted = self._said()
        return self._texts

    def _said(self) -> ReadOptions:
        """What the texts' headings say of all units."""
        said = self.wanted
        for text in self._texts:
            one = next(iter(text.imus().values()))
            self.says += [s for s in text.says if s not in self.says]
            said = replace(
                said,
                columns=tuple(dict.fromkeys((*said.columns, *one.columns))),
                acc_unit=said.acc_unit or one.acc_unit,
                gyr_unit=said.gyr_unit or one.gyr_unit,
                time_unit=said.time_unit or one.time_unit,
                named=said.named | one.named,
            )
        return said

    def _members(self) -> dict[str, str]:
        """Names of the files of each sensor.

        Raises
        ------
        InputError
            If there is no accelerometer among them.

        """
        try:
            with zipfile.ZipFile(self.path) as archive:
                names = [n for n in archive.namelist() if n.lower().endswith(".csv")]
        except (zipfile.BadZipFile, OSError, RuntimeError, ValueError) as error:
            raise InputError(
                f"{self.path}: cannot be read: {error}; copy it again from where it"
                " came"
            ) from error
        stems = {Path(n).stem.lower().replace(" ", ""): n for n in reversed(names)}
        acc = next((stems[n] for n in ACC if n in stems), None)
        gyr = next((stems[n] for n in GYR if n in stems), None)
        if acc is None:
            raise InputError(
                f"{self.path}: has no file of an accelerometer, such as"
                f" Accelerometer.csv; unpack it and import the one that is: there are"
                f" {', '.join(names[:12]) or 'no .csv files'}"
            )
        return {"a": acc} | ({"g": gyr} if gyr else {})
