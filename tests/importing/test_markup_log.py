"""Recordings in XML and HTML."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.core.errors import InputError
from fieldcal.importing.records.markup import read_markup

ROWS = turned(43, 50.0, 2.0)
NAMES = ("t", "ax", "ay", "az", "gx", "gy", "gz")
DECLARED = '<?xml version="1.0" encoding="UTF-8"?>\n<!-- made by a logger -->\n'


def each(form: str, parted: str = "\n") -> str:
    """A text for each row, with its numbers."""
    return parted.join(form.format(*row) for row in ROWS.tolist())


def attributes() -> str:
    pairs = " ".join(f'{name}="{{{i}:.9g}}"' for i, name in enumerate(NAMES))
    return f'{DECLARED}<log device="2">\n{each(f"<s {pairs}/>")}\n</log>'


def nested() -> str:
    """In one line, with a space of names and values that have units."""
    form = ("<i:s><i:t unit='s'>{0:.9g}</i:t><i:acc x='{1:.9g}' y='{2:.9g}'"
            " z='{3:.9g}'></i:acc><i:gyr><i:x>{4:.9g}</i:x><i:y>{5:.9g}</i:y>"
            "<i:z>{6:.9g}</i:z></i:gyr></i:s>")  # fmt: skip
    return f"<i:log xmlns:i='urn:imu'><i:n>7</i:n>{each(form, '')}</i:log>"


def named() -> str:
    """With names in attributes, and lists of numbers."""
    form = ('<row><p name="t" value="{0:.9g}"/><p name="acc">{1:.9g} {2:.9g}'
            ' {3:.9g}</p><p name="gyr">{4:.9g}, {5:.9g}, {6:.9g}</p>')  # fmt: skip
    form += "</row>"
    return f"{DECLARED}<log>{each(form)}</log>"


def track() -> str:
    """As devices write tracks with what else they measure."""
    points = [
        f'<trkpt lat="48.1" lon="11.5"><ele>512</ele><time>2026-03-14T10:'
        f"{int(t // 60):02d}:{t % 60:06.3f}Z</time><extensions><m:ax>{a[0]:.9g}</m:ax>"
        f"<m:ay>{a[1]:.9g}</m:ay><m:az>{a[2]:.9g}</m:az><m:gx>{a[3]:.9g}</m:gx>"
        f"<m:gy>{a[4]:.9g}</m:gy><m:gz>{a[5]:.9g}</m:gz></extensions></trkpt>"
        for t, *a in ROWS.tolist()
    ]
    return f"{DECLARED}<gpx><trk><trkseg>{''.join(points)}</trkseg></trk></gpx>"


def page() -> str:
    """As pandas shows a data frame, within a page whose paragraphs nothing ends."""
    head = "".join(f"<th>{name}</th>" for name in ("", *NAMES))
    rows = "\n".join(
        f"<tr><th>{i}</th>" + "".join(f"<td>{x:.9g}</td>" for x in row) + "</tr>"
        for i, row in enumerate(ROWS.tolist())
    )
    return (
        "<!DOCTYPE html><html><head><meta charset='utf-8'></head><body><p>Log of"
        f" &lt;imu&gt;<br><table border=1><thead><tr>{head}</tr></thead>"
        f"<tbody>{rows}</tbody></table></body></html>"
    )


def loose_table() -> str:
    """Of cells and rows that nothing ends."""
    head = "<TR>" + "".join(f"<TD>{name}" for name in NAMES)
    row = "<TR>" + "".join(f"<TD>{{{i}:.9g}}" for i in range(len(NAMES)))
    return f"<TABLE>{head}{each(row)}</TABLE>"


def workbook() -> str:
    cell = '<Cell><Data ss:Type="Number">{{{}:.9g}}</Data></Cell>'
    head = "".join(f'<Cell><Data ss:Type="String">{n}</Data></Cell>' for n in NAMES)
    row = f"<Row>{''.join(cell.format(i) for i in range(len(NAMES)))}</Row>"
    return (
        f"{DECLARED}<Workbook xmlns:ss='urn:schemas-microsoft-com:office:spreadsheet'>"
        f"<Worksheet ss:Name='log'><Table><Row>{head}</Row>{each(row)}</Table>"
        "</Worksheet></Workbook>"
    )


@pytest.mark.parametrize(
    "written", [attributes, nested, named, track, page, loose_table, workbook]
)
def test_its_samples_are_read(written: Callable[[], str], tmp_path: Path) -> None:
    path = tmp_path / "log"
    path.write_text(written())
    block, says = read_files([path])
    assert not any("gravity turns" in one for one in says), "names tell the columns"
    np.testing.assert_allclose(block.t - block.t[0], ROWS[:, 0], atol=1e-6)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)
    np.testing.assert_allclose(block.gyr, ROWS[:, 4:], atol=1e-6)


@pytest.mark.parametrize("written", [attributes, nested, track])
def test_one_that_is_cut_off_is_read_up_to_its_last_whole_record(
    written: Callable[[], str], tmp_path: Path
) -> None:
    path = tmp_path / "log.xml"
    whole = written()
    end = whole.rindex("</")
    path.write_text(whole[: int(0.7 * end)])
    with pytest.raises(InputError, match="is cut off behind its last whole record"):
        read_files([path])


def test_entities_of_its_own_are_not_replaced() -> None:
    bomb = '<!DOCTYPE x [<!ENTITY a "ha"><!ENTITY b "&a;&a;">]><x><y>&b;</y></x>'
    assert "haha" not in str(read_markup(bomb).contents)


@given(st.text(alphabet="<>/=\"' atrd1.!-&;", max_size=200))
def test_no_text_breaks_the_reader(text: str) -> None:
    assert isinstance(read_markup(text).contents, dict)
    assert "table" in read_markup(f"<table><tr><td>1</td>{text}</tr></table>").contents


@given(st.lists(st.lists(st.floats(-1e6, 1e6), min_size=2, max_size=2), min_size=2))
def test_what_is_written_is_read(rows: list[list[float]]) -> None:
    records = "".join(f'<s t="{t!r}"><v><x>{x!r}</x></v></s>' for t, x in rows)
    found = read_markup(f"<log>{records}</log>").contents["log"]["s"]
    assert [[one["t"], one["v"]["x"]] for one in found] == rows
