"""A place of a sample stream whose bytes cannot be used, and its sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

if TYPE_CHECKING:
    import pyarrow as pa

COPY_AGAIN = (
    "if the file was copied, copy it again from where it came; otherwise take again"
    " what is missing"
)
"""Remedy where samples are lost."""


MARKER = b"\xff\xff\xff\xff"
"""First bytes of every message of a stream; messages begin at multiples of 8 bytes."""

LOOKED_AT = 256
"""Bytes at the beginning that tell text from other files."""


class StreamDamage(NamedTuple):
    """Bytes that cannot be used since the last intact batch.

    Attributes
    ----------
    first, end : first of them, and one past the last
    batches, rows : those among them that can be read, with a wrong checksum

    """

    first: int
    end: int
    batches: int = 0
    rows: int = 0

    def extended(self, end: int, batches: int, rows: int) -> StreamDamage:
        """The same place with further bytes, up to `end`."""
        return StreamDamage(self.first, end, self.batches + batches, self.rows + rows)


def lost_between(what: str, last: pa.RecordBatch | None, then: pa.RecordBatch) -> str:
    """Sentence about what is lost between two intact batches.

    Parameters
    ----------
    what : which rows or bytes
    last, then : the batches around the place; None where it is at the beginning

    """
    before, first = device_time(last, -1), device_time(then, 0)
    when = ""
    if first is not None:
        when = f" before {first:.2f} s"
        if before is not None:
            when = f" between {before:.2f} and {first:.2f} s"
    return f"{what}{when} are damaged or missing, and left out: {COPY_AGAIN}"


def lost_at_end(row: int, last: pa.RecordBatch | None) -> str:
    """Sentence about damaged rows from `row` on, behind which no intact one stands."""
    return f"rows from {row} on{after(last)} are damaged and left out: {COPY_AGAIN}"


def cut_off(rows: int, last: pa.RecordBatch | None) -> str:
    """Sentence about a stream whose end is missing, of which `rows` are whole."""
    return (
        f"was cut off{after(last)}, as by a kill or an incomplete copy; its {rows}"
        " whole rows are used"
    )


def after(last: pa.RecordBatch | None) -> str:
    """Behind which time it is, as part of a sentence; empty if that is not known."""
    time = device_time(last, -1)
    return "" if time is None else f" after {time:.2f} s"


def device_time(batch: pa.RecordBatch | None, row: int) -> float | None:
    """Device time of a row of a batch, s; None without a number there."""
    if batch is None or "t" not in batch.schema.names or not batch.num_rows:
        return None
    value = batch.column("t")[row].as_py()
    return float(value) if isinstance(value, int | float) else None


def no_samples_text(data: bytes) -> str:
    r"""What is wrong with a stream of which no batch can be read, with the remedy.

    >>> no_samples_text(b"t,ax,ay,az\n0.0,1,2,3\n")[:40]
    'is text and no Arrow stream: name it sam'
    """
    head = data[:LOOKED_AT]
    if not data.strip(b"\0"):
        what = "is empty" if not data else f"consists of {len(data)} zeros"
        return (
            f"{what}, as after a power cut before the disk had it: copy it again from"
            " where it came, or record the session again"
        )
    if data.startswith(MARKER):
        return (
            "holds no whole sample: it was cut off or damaged before the end of the"
            " first batch; copy it again from where it came, or record the session"
            " again"
        )
    if head.isascii() and head.decode("ascii").replace("\n", "").isprintable():
        return "is text and no Arrow stream: name it samples.csv if it holds samples"
    return (
        "is damaged, or no Arrow stream: nothing in it can be read; copy it again from"
        " where it came, or record the session again"
    )
