"""The scan for frames, all at once, against the scan byte by byte."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.drivers.framing import FrameCandidates, byte_rows, select_frames

candidate = st.tuples(st.integers(0, 200), st.integers(2, 30), st.booleans())


def by_steps(
    at: dict[int, tuple[int, bool]], size: int, undecided: int
) -> tuple[list[int], int, int, int]:
    """Frames, rest, refused and skipped, as one would do it by hand."""
    taken, refused, skipped, i = [], 0, 0, 0
    while i < size:
        if i not in at:
            if i >= undecided:
                break
            skipped += 1
            i += 1
        elif i + at[i][0] > size:
            break
        elif at[i][1]:
            taken.append(i)
            i += at[i][0]
        else:
            refused += 1
            skipped += 1
            i += 1
    return taken, i, refused, skipped


@given(st.lists(candidate, max_size=40), st.integers(1, 220))
def test_the_same_as_byte_by_byte(
    found: list[tuple[int, int, bool]], size: int
) -> None:
    at = {start: (length, good) for start, length, good in found if start < size}
    starts = np.array(sorted(at), dtype=int)
    ends = np.array([start + at[start][0] for start in sorted(at)], dtype=int)
    good = np.array([at[s][1] or s + at[s][0] > size for s in sorted(at)], dtype=bool)
    got = select_frames(FrameCandidates(starts, ends, good, size), size)
    expected = by_steps(at, size, size)
    assert (got.starts.tolist(), got.rest, got.bad, got.skipped) == expected


@given(st.binary(min_size=50, max_size=60), st.lists(st.integers(0, 40), max_size=9))
def test_rows(data: bytes, starts: list[int]) -> None:
    got = byte_rows(np.frombuffer(data, np.uint8), np.array(starts, dtype=int), 10)
    assert [row.tobytes() for row in got] == [data[s : s + 10] for s in starts]
