"""Archives of telephones: a .zip, or a folder, with a text file for each sensor.

phyphox and the Sensor Logger of Android and iOS write ``Accelerometer.csv``,
``Gyroscope.csv`` and others, with one clock for all. The name of the file says the
sensor, its columns the axes; each sample of the accelerometer goes with the nearest of
the gyroscope. ``TotalAcceleration`` goes before ``Accelerometer``, from which some
programs take gravity out: ``Gravity``, if it is there, is added to it then. Where
``Metadata.csv`` says that iOS wrote it and nothing was standardised, the sign of the
accelerations is turned, which count gravity downwards there.
"""

from __future__ import annotations

import csv
import zipfile
from collections.abc import Iterable, Iterator
from copy import copy
from dataclasses import replace
from pathlib import Path
from typing import Any

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block
from fieldcal.importers.csv_like import TextColumns
from fieldcal.importers.workbook import MARKS
from fieldcal.importing import columns
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.recording import ImuStream, Recording
from fieldcal.importing.times.alignment import AlignedPair
from fieldcal.importing.times.gravity_sum import GravitySum, lacks_gravity
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.importing.times.slower_sensor import SlowerSensor
from fieldcal.importing.words.file_names import ACC, GRAVITY, GYR, LINEAR, TOTAL
from fieldcal.importing.words.telephone_names import UNTOLD

WHAT = "archives of telephones: phyphox, Sensor Logger"

SENSOR = {"a": "acc", "v": "acc", "g": "gyr"}
"""What the axes of each file are read as; v is gravity, where the force lacks it."""

FIRST_ROWS = 1 << 14
"""Rows at the beginning of a file that tell whether gravity is in it."""


ABOUT = "metadata.csv"
"""File of an archive that says the platform."""

DOWNWARDS = (
    "Metadata.csv says that iOS wrote it, not standardised, which counts gravity"
    " downwards: the sign of the accelerations is turned"
)


def _platform(path: Path) -> tuple[str, bool]:
    """Platform that wrote an archive, and whether what it wrote was standardised."""
    try:
        about = [n for n in member_names(path) if Path(n).name.lower() == ABOUT]
        text = _member(path, about[0]).decode("utf-8", "replace") if about else ""
    except (zipfile.BadZipFile, OSError, RuntimeError, ValueError):
        return "", False  # whoever reads the sensors says so
    said = next(csv.DictReader(text.splitlines()), {})
    platform, standard = (str(said.get(k)) for k in ("platform", "standardisation"))
    return platform.lower(), standard.lower() == "true"


def member_names(path: Path) -> list[str]:
    """Names of the files of an archive, or of a folder that it was unpacked to."""
    if path.is_dir():
        return sorted(one.name for one in path.iterdir() if one.is_file())
    with zipfile.ZipFile(path) as archive:
        return archive.namelist()


def _member(path: Path, name: str) -> bytes:
    if path.is_dir():
        return (path / name).read_bytes()
    with zipfile.ZipFile(path) as archive:
        return archive.read(name)


def is_unpacked(folder: Path) -> bool:
    """Whether a folder holds what such an archive does: a file of each sensor."""
    stems = {_stem(name) for name in member_names(folder) if _is_text(name)}
    whole = stems & {*ACC} or (stems & {*LINEAR} and stems & {*GRAVITY})
    return bool(whole and stems & {*GYR, *GRAVITY, Path(ABOUT).stem})


def _is_text(name: str) -> bool:
    return name.lower().endswith(".csv")


def _stem(name: str) -> str:
    return Path(name).stem.lower().replace(" ", "")


def recognises(head: bytes, path: Path) -> bool:
    """Whether a file begins like an archive, but not of arrays or sheets."""
    zipped = head.startswith(b"PK\x03\x04") and b".npy" not in head
    return zipped and not any(mark in head for mark in MARKS)


class PhoneArchive(Recording):
    """An archive with the IMU of a telephone."""

    asks_units = True
    _texts: dict[str, TextColumns] | None = None
    _sign_is_known = False

    def streams(self) -> list[ImuStream]:
        """Return the one IMU."""
        for text in self._opened().values():
            text.streams()
        return [ImuStream("0", f"columns in {columns.describe_units(self.wanted)}")]

    def files(self) -> list[Path]:
        """The archive, or the files of a folder that are read."""
        if not self.path.is_dir():
            return [self.path]
        about = [n for n in member_names(self.path) if n.lower() == ABOUT]
        return [self.path / name for name in (*self._members().values(), *about)]

    def notes(self, stream: str) -> dict[str, Any]:
        """Return the units."""
        return columns.unit_notes(self.wanted)

    def blocks(self, stream: str) -> Iterator[Block]:
        """Samples of both sensors, those of the accelerometer with the nearest."""
        both = {kind: self._in_units(t) for kind, t in self._opened().items()}
        judges = {
            kind: RowValidator(f"{self.path}: {one.member}", one.place, self.repair)
            for kind, one in both.items()
        }
        flows = {k: judges[k].through(one.blocks("0")) for k, one in both.items()}
        acc, total = flows["a"], GravitySum()
        if "v" in flows:
            acc = total.through(acc, flows["v"])
        slower = SlowerSensor()
        yield from slower.through(AlignedPair().through(acc, flows.get("g", iter(()))))
        self.says += [s for s in slower.says if s not in self.says]
        for kind, one in both.items():
            said = [*one.mended, *judges[kind].mended]
            self.mended += [f"{one.member}: {sentence}" for sentence in said]
            self.says += [s for s in one.says if s not in self.says]
            self.says += [f"{one.member}: {said}" for said in judges[kind].says]
        if "v" in both:
            self._say_sum(total, both["v"].member)

    def _say_sum(self, total: GravitySum, gravity: str) -> None:
        """Say how gravity was added, or refuse what has no times in common.

        Raises
        ------
        InputError
            If no sample had gravity near it.

        """
        if total.none:
            raise InputError(
                f"{self.path}: {gravity}: no sample is at a time at which the"
                " accelerometer has one; record again, with TotalAcceleration"
            )
        self.says.append(total.sentence())

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

    def _opened(self) -> dict[str, TextColumns]:
        """The texts of each sensor, as they are in it."""
        if self._texts is None:
            texts = {}
            wanted = self._with_sign()
            for kind, member in self._members().items():
                text = TextColumns(self.path, wanted, self.repair)
                text.member, text.sensor, text.from_first = member, SENSOR[kind], False
                texts[kind] = text
            self._texts = texts
            self._without_needless_gravity(texts)
            self.wanted = self._said(texts.values())
        return self._texts

    def _with_sign(self) -> ReadOptions:
        """Options with the sign of accelerations that iOS counts the other way."""
        platform, standard = _platform(self.path)
        self._sign_is_known = platform in ("ios", "android")
        if self.wanted.columns or platform != "ios" or standard:
            return self.wanted
        self.says.append(DOWNWARDS)
        return replace(self.wanted, reversed=frozenset(("ax", "ay", "az")))

    def _without_needless_gravity(self, texts: dict[str, TextColumns]) -> None:
        """Leave gravity out where the accelerometer has it."""
        if "v" not in texts:
            return
        acc, gravity = (texts[k].first_rows("0", FIRST_ROWS).acc for k in "av")
        if not lacks_gravity(acc, gravity):
            left = texts.pop("v").member
            self.says.append(
                f"{left} is left out: {texts['a'].member} has gravity in it"
            )

    def _said(self, texts: Iterable[TextColumns]) -> ReadOptions:
        """What the texts' headings say of all units."""
        said = self.wanted
        for text in texts:
            one = next(iter(text.imus().values()))
            without = [UNTOLD] if self._sign_is_known else []
            self.says += [s for s in text.says if s not in (*self.says, *without)]
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
            names = [name for name in member_names(self.path) if _is_text(name)]
        except (zipfile.BadZipFile, OSError, RuntimeError, ValueError) as error:
            raise InputError(
                f"{self.path}: cannot be read: {error}; copy it again from where it"
                " came"
            ) from error
        stems = {_stem(name): name for name in reversed(names)}
        gravity = next((stems[n] for n in GRAVITY if n in stems), None)
        forces = (*ACC, *(LINEAR if gravity else ()))
        acc = next((stems[n] for n in forces if n in stems), None)
        gyr = next((stems[n] for n in GYR if n in stems), None)
        if acc is None:
            raise InputError(
                f"{self.path}: has no file of an accelerometer, such as"
                f" Accelerometer.csv; unpack it and import the one that is: there are"
                f" {', '.join(names[:12]) or 'no .csv files'}"
            )
        whole = gravity is None or _stem(acc) in TOTAL
        parts = {} if whole else {"v": gravity or ""}
        return {"a": acc, **parts} | ({"g": gyr} if gyr else {})
