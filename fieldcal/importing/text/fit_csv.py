"""Messages of a FIT file as Garmin's FitCSVTool writes them: samples within cells.

    Type,Local Number,Message,Field 1,Value 1,Units 1,Field 2,Value 2,Units 2,…
    Data,4,accelerometer_data,timestamp,"900",s,timestamp_ms,"20",ms,sample_time_offset,
    "0|10|20",ms,calibrated_accel_x,"0.01|0.02|0.01",g,…

A message holds some samples, each at its offset from the time of the message. Each of
the accelerometer goes with the nearest of the gyroscope. Calibrated values are taken
where a message has them; else the counts, calibrated as the last message before them
says, or, where none does, as they are: then nobody says their zero. Source: the fields
of accelerometer_data and gyroscope_data in the profile of the FIT SDK.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import NamedTuple

from fieldcal.importing.text.fit_calibration import (
    MESSAGE,
    FitCalibration,
    calibrated_sensor,
)
from fieldcal.importing.text.nearest_lines import NearestLines
from fieldcal.importing.text.text_form import Reader, TextForm
from fieldcal.importing.text.text_lines import split_quoted
from fieldcal.importing.text.text_top import is_number
from fieldcal.importing.words.sensor_words import AXES

HEADING = "Type,Local Number,Message,Field 1,Value 1,Units 1"
DATA = "Data"
MESSAGES = {"accelerometer_data": "accel", "gyroscope_data": "gyro"}
"""Messages of samples, and what the fields of their axes begin with."""

UNITS = {"accel": "g", "gyro": "deg/s"}
"""Units of their calibrated values."""

WITHIN = "|"
"""Between the values of a cell."""


class FitSamples(NamedTuple):
    """Samples of a message.

    Attributes
    ----------
    kind : of `UNITS`
    calibrated : whether they are, else counts
    times : s
    rows : values of the three axes of each

    """

    kind: str
    calibrated: bool
    times: list[float]
    rows: list[list[str]]


class FitCsv(TextForm):
    """Samples of both sensors as rows."""

    gathers = True

    def __init__(
        self,
        calibrated: Mapping[str, bool],
        calibrations: Mapping[str, FitCalibration],
    ) -> None:
        self._calibrated, self._first = calibrated, calibrations
        units = {k: f" [{UNITS[k]}]" if known or k in calibrations else ""
                 for k, known in calibrated.items()}  # fmt: skip
        self.names = ("time [s]", *(f"{kind}_{axis}{unit}"
                      for kind, unit in units.items() for axis in AXES))  # fmt: skip
        if any(not known and k in calibrations for k, known in calibrated.items()):
            self.says = (
                "counts of its sensors are calibrated as its own messages say: what is"
                " found remains of that calibration"
            )

    @classmethod
    def of(cls, lines: Sequence[str], separator: str | None) -> FitCsv | None:
        """The form, if its heading is that of the tool and a message has samples."""
        if not any(line.startswith(HEADING) for line in lines[:1]):
            return None
        read = [one for line in lines if (one := _samples(line)) is not None]
        calibrated = {one.kind: one.calibrated for one in read}
        kinds = [kind for kind in UNITS if kind in calibrated]
        known: dict[str, FitCalibration] = {}
        for line in lines:
            if (found := _calibration(line)) is not None:
                known.setdefault(*found)
        return cls({k: calibrated[k] for k in kinds}, known) if kinds else None

    def reader(self) -> Reader:
        """Return what reads a text of this form from its beginning."""
        pairs = NearestLines(len(AXES))
        known = dict(self._first)

        def rows(one: FitSamples) -> Iterator[list[str]]:
            calibration = None if one.calibrated else known.get(one.kind)
            values_of = calibration.apply(one.rows) if calibration else one.rows
            for t, values in zip(one.times, values_of, strict=True):
                if len(self._calibrated) == 1:
                    yield [f"{t:.6f}", *values]
                elif one.kind == "gyro":
                    yield from pairs.rate(t, values)
                else:
                    yield from pairs.force(t, [f"{t:.6f}", *values])

        def read(lines: Sequence[str]) -> list[str]:
            found = [] if lines else pairs.rest()
            for line in lines:
                if (said := _calibration(line)) is not None and said[0] in known:
                    known[said[0]] = said[1]
                one = _samples(line)
                if one is not None and self._calibrated.get(one.kind) == one.calibrated:
                    found += rows(one)
            return [",".join(row) for row in found]

        return read


def _calibration(line: str) -> tuple[str, FitCalibration] | None:
    """Sensor and calibration of a message; None of another line."""
    if MESSAGE not in line:
        return None
    fields = _fields(split_quoted(line, ","))
    found = FitCalibration.of(fields, WITHIN)
    sensor = calibrated_sensor(fields)
    return (sensor, found) if sensor and found is not None else None


def _fields(cells: Sequence[str]) -> dict[str, str]:
    """Values of the fields of a message, by their names."""
    triples = zip(cells[3::3], cells[4::3], strict=False)
    return {name: text.strip('"') for name, text in triples if name}


def _samples(line: str) -> FitSamples | None:
    """Samples of a message; None of another line, or where cells differ in length."""
    cells = split_quoted(line, ",")
    if len(cells) <= len(AXES) or cells[0] != DATA or cells[2] not in MESSAGES:
        return None
    fields = _fields(cells)
    kind = MESSAGES[cells[2]]
    began, more = (fields.get(name, "") for name in ("timestamp", "timestamp_ms"))
    calibrated = bool(fields.get(f"calibrated_{kind}_x"))
    before = "calibrated_" if calibrated else ""
    axes = [fields.get(f"{before}{kind}_{axis}", "").split(WITHIN) for axis in AXES]
    offsets = fields.get("sample_time_offset", "0").split(WITHIN)
    if {len(offsets)} != {*map(len, axes)} or not all(
        is_number(one, False) for one in (began, more or "0", *offsets)
    ):
        return None
    start = float(began) + 1e-3 * float(more or 0)
    times = [start + 1e-3 * float(one) for one in offsets]
    return FitSamples(
        kind, calibrated, times, [[*row] for row in zip(*axes, strict=True)]
    )
