"""Lines of a text of numbers: the first, those behind, and all at once by Arrow."""

from __future__ import annotations

import csv

from fieldcal.core.samples import Array
from fieldcal.session.arrow_columns import float_values

MISSING = ("", "null", "NULL", "None", "NA", "N/A", "n/a", "#N/A", "NaN", "nan", "-",
           "--", "---", "?", "1.#QNAN", "-1.#QNAN", "1.#QNAN0", "-1.#QNAN0", "1.#IND",
           "-1.#IND", "1.#IND00", "-1.#IND00")  # fmt: skip
"""What stands in a cell that holds no value; the last as older C libraries of Microsoft
write one that cannot be calculated."""

COMMENTS = ("# ", "% ", "// ")
"""What lines that are no rows begin with, in many programs; without the space behind
it, a message of a receiver may."""

MINUS = "\u2212"
"""The sign that spreadsheets write before negative numbers in some languages."""

TOP = 1000
"""Lines at the top among which the first of numbers is looked for."""


def split_lines(data: bytes) -> list[str]:
    """Lines that are not empty, in UTF-8 or else in the code page of older Windows."""
    try:
        text = data.decode()
    except UnicodeDecodeError:
        text = data.decode("cp1252", errors="replace")
    lines = text.replace("\r\n", "\n").replace(MINUS, "-").split("\n")
    return [line for line in lines if line.strip()]


def split_quoted(line: str, separator: str) -> list[str]:
    """Cells of a line, without the quotes within which a separator parts none.

    A carriage return within a line, or a quote that nothing ends, parts none either.

    >>> split_quoted('"1,000", 2,"x"', ","), split_quoted('1,"2', ",")
    (['1,000', '2', 'x'], ['1', '"2'])
    """
    if '"' not in line:
        return line.split(separator)
    try:
        (row,) = csv.reader(
            [line.replace("\r", " ")],
            delimiter=separator,
            skipinitialspace=True,
            strict=True,
        )
    except (ValueError, csv.Error):
        return line.split(separator)
    return row


def top_lines(data: bytes, many: int = TOP) -> list[str]:
    """First lines, of so many those that are not empty."""
    return split_lines(b"\n".join(data.split(b"\n", many)[:many]))


def skip_lines(data: bytes, many: int) -> bytes:
    """Bytes behind the first `many` lines that are not empty."""
    at = 0
    while many and at < len(data):
        end = data.find(b"\n", at)
        end = len(data) if end < 0 else end
        many -= bool(data[at:end].strip())
        at = end + 1
    return data[at:]


def cell_count(line: str, separator: str | None) -> int:
    """Number of cells of a line."""
    return len(line.split(separator))


def plain_numbers(
    data: bytes, width: int, use: list[int], separator: str | None
) -> list[Array] | None:
    """Numbers of columns by Arrow, (n,) each; None if they are not all numbers."""
    if separator is None or len(separator) > 1:
        return None
    import pyarrow as pa
    import pyarrow.csv

    comma = separator != "," and b"," in data[: data.find(b"\n")]
    names = [str(i) for i in range(width)]
    wanted = [names[i] for i in use]
    try:
        table = pyarrow.csv.read_csv(
            pa.BufferReader(data),
            pyarrow.csv.ReadOptions(
                use_threads=False, column_names=names, block_size=len(data) + 1
            ),
            pyarrow.csv.ParseOptions(delimiter=separator, quote_char=False),
            pyarrow.csv.ConvertOptions(
                column_types=dict.fromkeys(wanted, pa.float64()),
                decimal_point="," if comma else ".",
                include_columns=wanted,
                null_values=[*MISSING],
            ),
        )
    except (pa.ArrowInvalid, ValueError):
        return None
    return [float_values(table.column(name)) for name in wanted]
