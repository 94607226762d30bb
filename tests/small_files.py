"""A small file of every format, and what is in it."""

from __future__ import annotations

import json
import sqlite3
import zipfile
from collections.abc import Callable, Mapping, Sequence
from contextlib import closing
from pathlib import Path

import numpy as np
from bags import bag
from blackbox_logs import of_block
from logs import CAN_MAP, arrays, can_log, dataflash, dbc, imu, table, tlog, ulog

from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.session.folder import Session

COLUMNS = ("t", "ax", "ay", "az", "gx", "gy", "gz")


def _mcap(path: Path, block: Block) -> None:
    from fieldcal.calibration import Calibration, Nominal
    from fieldcal.exporters import ExportSource, mcap
    from fieldcal.session.recorder import Recorder

    with Recorder(path.parent / "made", {"format": 1}) as recorder:
        recorder.append(block)
    none = np.empty(0)
    unit = Calibration("joint", (), none, np.empty((0, 0)), (), 0.0, 0, 0.0)
    mcap.write(ExportSource(unit, Nominal(), Session.open(path.parent / "made")), path)


def _hdf5(path: Path, block: Block) -> None:
    arrays(path.with_suffix(".h5"), block)
    path.with_suffix(".h5").rename(path)


def _candump(path: Path, block: Block) -> None:
    can_log(path.with_suffix(".log"), block)
    path.with_suffix(".log").rename(path)


def _parquet(path: Path, block: Block) -> None:
    import pyarrow as pa
    import pyarrow.parquet

    columns = dict(zip(COLUMNS, table(block).T, strict=True))
    pyarrow.parquet.write_table(pa.table(columns), path)


def _rosbag(path: Path, block: Block) -> None:
    made = path.parent / "bags"
    made.mkdir()
    bag(made, table(block), first=False).rename(path)


def _phone(path: Path, block: Block) -> None:
    columns, files = table(block), {}
    for name, kind, own in (("Accelerometer", "m/s^2", slice(1, 4)),
                            ("Gyroscope", "rad/s", slice(4, 7))):  # fmt: skip
        rows = np.column_stack([columns[:, 0], columns[:, own]])
        heading = ",".join(["Time (s)", *(f"{axis} ({kind})" for axis in "XYZ")])
        lines = [",".join(f"{x:.17g}" for x in row) for row in rows]
        files[f"{name}.csv"] = "\n".join([heading, *lines]) + "\n"
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in files.items():
            archive.writestr(name, text)


def _sqlite(path: Path, block: Block) -> None:
    with closing(sqlite3.connect(path)) as database, database:
        names = ", ".join(f"{name} REAL" for name in COLUMNS)
        database.execute(f"CREATE TABLE imu ({names})")
        marks = ", ".join("?" * len(COLUMNS))
        rows = table(block).tolist()
        database.executemany(f"INSERT INTO imu VALUES ({marks})", rows)  # noqa: S608


def _json(path: Path, block: Block) -> None:
    rows = [dict(zip(COLUMNS, row, strict=True)) for row in table(block).tolist()]
    path.write_text("\n".join(json.dumps(row) for row in rows) + "\n")


def _markup(path: Path, block: Block) -> None:
    rows = [" ".join(f'{name}="{x!r}"' for name, x in zip(COLUMNS, row, strict=True))
            for row in table(block).tolist()]  # fmt: skip
    path.write_text("<log>\n" + "\n".join(f"<s {row}/>" for row in rows) + "\n</log>\n")


def _series(path: Path, block: Block) -> None:
    """One behind the other."""
    lines = [f"{row[0]!r},{name},{row[i]!r}" for i, name in enumerate(COLUMNS) if i
             for row in table(block).tolist()]  # fmt: skip
    path.write_text("\n".join(["time,variable,value", *lines]) + "\n")


def _tables(path: Path, block: Block) -> None:
    """One below the other."""
    parts = []
    for names, columns in (COLUMNS[1:4], (0, 1, 2, 3)), (COLUMNS[4:7], (0, 4, 5, 6)):
        lines = [
            ",".join(repr(row[i]) for i in columns) for row in table(block).tolist()
        ]
        parts += [",".join(["time", *names]), *lines]
    path.write_text("\n".join(parts) + "\n")


def _sheets(path: Path, block: Block) -> None:
    rows = table(block)
    sheets = {
        name: [["t", "x", "y", "z"], *np.column_stack([rows[:, 0], three]).tolist()]
        for name, three in (
            ("Accelerometer", rows[:, 1:4]), ("Gyroscope", rows[:, 4:7])
        )
    }  # fmt: skip
    write_workbooks(path, sheets)


def _octave(path: Path, block: Block) -> None:
    parts = ["# Created by Octave 6.4.0, Mon Jan 05 12:00:00 2026 UTC <me@pc>"]
    for name, column in zip(COLUMNS, table(block).T.tolist(), strict=True):
        head = f"# name: {name}\n# type: matrix\n# rows: {len(column)}\n# columns: 1"
        parts += [head, *(f" {x!r}" for x in column), "", ""]
    path.write_text("\n".join(parts) + "\n")


def _workbook(path: Path, block: Block) -> None:
    write_workbook(path, [COLUMNS, *table(block).tolist()])


def write_workbook(path: Path, rows: Sequence[Sequence[str | float]]) -> None:
    """Write a workbook of one sheet."""
    write_workbooks(path, {"log": rows})


def write_workbooks(
    path: Path, sheets: Mapping[str, Sequence[Sequence[str | float]]]
) -> None:
    """Write a workbook of sheets by their names, by the parts ECMA-376 asks for."""
    main = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    office = "http://schemas.openxmlformats.org/officeDocument/2006/relationships"
    package = "http://schemas.openxmlformats.org/package/2006"
    sheet = "application/vnd.openxmlformats-officedocument.spreadsheetml"
    link = f'<Relationship Id="r%d" Type="{office}/%s" Target="%s"/>'
    links = f'<Relationships xmlns="{package}/relationships">%s</Relationships>'
    own = [link % (i, "worksheet", f"worksheets/sheet{i}.xml")
           for i, _ in enumerate(sheets, 1)]  # fmt: skip
    parts = {
        "[Content_Types].xml": f'<Types xmlns="{package}/content-types">'
        '<Default Extension="rels"'
        ' ContentType="application/vnd.openxmlformats-package.relationships+xml"/>'
        f'<Override PartName="/xl/workbook.xml" ContentType="{sheet}.sheet.main+xml"/>'
        + "".join(f'<Override PartName="/xl/worksheets/sheet{i}.xml"'
                  f' ContentType="{sheet}.worksheet+xml"/>'
                  for i, _ in enumerate(sheets, 1))
        + "</Types>",
        "_rels/.rels": links % (link % (1, "officeDocument", "xl/workbook.xml")),
        "xl/_rels/workbook.xml.rels": links % "".join(own),
        "xl/workbook.xml": f'<workbook xmlns="{main}" xmlns:r="{office}"><sheets>'
        + "".join(f'<sheet name="{name}" sheetId="{i}" r:id="r{i}"/>'
                  for i, name in enumerate(sheets, 1))
        + "</sheets></workbook>",
    }  # fmt: skip
    for i, rows in enumerate(sheets.values(), 1):
        cells = "".join(f"<row>{''.join(map(_cell, row))}</row>" for row in rows)
        parts[f"xl/worksheets/sheet{i}.xml"] = (
            f'<worksheet xmlns="{main}"><sheetData>{cells}</sheetData></worksheet>'
        )
    with zipfile.ZipFile(path, "w") as archive:
        for name, text in parts.items():
            archive.writestr(name, text)


def _cell(value: str | float) -> str:
    if isinstance(value, str):
        return f'<c t="inlineStr"><is><t>{value}</t></is></c>'
    return "<c/>" if np.isnan(value) else f"<c><v>{value!r}</v></c>"


SMALL: dict[str, Callable[[Path, Block], object]] = {
    "ulog": lambda path, block: path.write_bytes(ulog({0: block}, {})),
    "dataflash": lambda path, block: path.write_bytes(dataflash({0: block}, {})),
    "tlog": lambda path, block: path.write_bytes(tlog({0: block}, {})),
    "mcap": _mcap,
    "rosbag": _rosbag,
    "phone_zip": _phone,
    "arrays": _hdf5,
    "can_log": _candump,
    "json_log": _json,
    "sqlite_log": _sqlite,
    "markup_log": _markup,
    "series_log": _series,
    "octave_text": _octave,
    "sensor_tables": _tables,
    "sensor_sheets": _sheets,
    "blackbox": lambda path, block: path.write_bytes(of_block(block)),
    "parquet": _parquet,
    "workbook": _workbook,
    "csv_like": lambda path, block: np.savetxt(path, table(block), delimiter=","),
}


OF_NAMES = ("mcap", "rosbag", "phone_zip", "json_log", "blackbox", "sqlite_log",
            "markup_log", "series_log", "octave_text", "sensor_tables",
            "sensor_sheets")  # fmt: skip
"""Formats whose channels names tell."""


class Small:
    """A small file of a format, and what is in it."""

    def __init__(self, name: str, path: Path) -> None:
        self.name, self.path = name, path
        SMALL[name](path, imu(1, 40))
        (path.parent / "imu.dbc").write_text(dbc())
        options = f"dbc={path.parent / 'imu.dbc'}&map={CAN_MAP}"
        options = options if name == "can_log" else ""
        self.wanted = ReadOptions(COLUMNS, options=options)
        if name in OF_NAMES:
            self.wanted = ReadOptions()
        self.content = path.read_bytes()
        self.expected = whole(path, self.wanted)

    def __repr__(self) -> str:
        return self.name

    def knows(self, found: Block) -> bool:
        """Whether every triad of values is one of those written."""
        for kind in ("acc", "gyr"):
            rows = getattr(self.expected, kind).round(9).tolist()
            known = {tuple(row) for row in rows}
            for row in getattr(found, kind).round(9).tolist():
                if not np.isnan(row).all() and tuple(row) not in known:
                    return False
        return True


def whole(
    path: Path, wanted: ReadOptions, name: str = "", repair: bool = False
) -> Block:
    opened = open_recording(path, wanted, name, repair)
    stream = opened.streams()[0].name
    opened.notes(stream)
    judge = RowValidator(str(path), opened.place, repair)
    return concat(judge.through(opened.blocks(stream)))
