"""Times as clocks of many countries and programs write them."""

from __future__ import annotations

from collections.abc import Callable
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from joined import read_files
from laid_about import turned

from fieldcal.importing.times.clock_text import ClockText, is_clock

ROWS = turned(35, 50.0, 2.0)
MIDNIGHT = datetime(2026, 3, 14, 23, 59, 50)


def at(form: str) -> Callable[[datetime], str]:
    return lambda now: now.strftime(form)


FORMS = {
    "short year": at("%y%m%d_%H%M%S.%f"),
    "day first": at("%d%m%y-%H%M%S.%f"),
    "basic": at("%Y%m%d_%H%M%S.%f"),
    "underscore": at("%Y/%m/%d_%H:%M:%S.%f"),
    "dashes": at("%Y-%m-%d-%H-%M-%S-%f"),
    "ordinal": at("%Y-%jT%H:%M:%S.%f"),
    "ordinal, colons": at("%Y:%j:%H:%M:%S.%f"),
    "day of the year": at("%j:%H:%M:%S.%f"),
    "words": at("%B %d %Y %H:%M:%S.%f"),
    "words, day first": at("%d %B %Y %H:%M:%S.%f"),
    "mail": at("%a, %d %b %Y %H:%M:%S.%f GMT"),
    "signs": at("%Y年%m月%d日 %H:%M:%S.%f"),
    "all signs": at("%Y年%m月%d日%H时%M分%S.%f秒"),
}


@pytest.mark.parametrize("name", FORMS)
def test_times_run_on_over_midnight(name: str, tmp_path: Path) -> None:
    write = FORMS[name]
    lines = ["time,ax,ay,az,gx,gy,gz"]
    lines += [",".join([write(MIDNIGHT + timedelta(seconds=row[0])),
                        *(f"{x:.8g}" for x in row[1:])])
              for row in ROWS.tolist()]  # fmt: skip
    path = tmp_path / "log.csv"
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
    block, _ = read_files([path])
    np.testing.assert_allclose(block.t, ROWS[:, 0], atol=2e-6)
    np.testing.assert_allclose(block.acc, ROWS[:, 1:4], atol=1e-6)


@given(st.datetimes(datetime(2001, 1, 1), datetime(2037, 1, 1)))
def test_each_form_is_a_clock(now: datetime) -> None:
    for write in FORMS.values():
        clock, later = ClockText(), now + timedelta(seconds=90.5)
        assert is_clock(write(now))
        first, second = (clock.seconds(write(one)) for one in (now, later))
        assert first is not None and second is not None
        if now.date() == later.date():
            assert second - first == pytest.approx(90.5, abs=1e-5)


@pytest.mark.parametrize("number", ["999999_111111", "260314_251530", "1_000", "12_5"])
def test_numbers_with_a_low_line_are_no_clock(number: str) -> None:
    assert not is_clock(number)


@given(st.text(alphabet="0123456789-:T/. 年月日Mar,_", max_size=30))
def test_no_text_breaks_the_reader(text: str) -> None:
    assert isinstance(is_clock(text), bool)
    seconds = ClockText().seconds(text)
    assert seconds is None or isinstance(seconds, float)


@pytest.mark.parametrize(
    ("text", "seconds"),
    [("9999-999T10:10:10", None), ("2026-000T99:99:99", 99 * 3661.0)],
)
def test_days_that_no_year_has_break_nothing(text: str, seconds: float | None) -> None:
    assert ClockText().seconds(text) == seconds


def written(form: str, first: datetime, many: int, step: float) -> list[str]:
    return [(first + timedelta(seconds=step * i)).strftime(form) for i in range(many)]


@pytest.mark.parametrize("form", ["%I:%M:%S.%f", "%Y-%m-%d %I:%M:%S.%f"])
def test_a_clock_of_twelve_hours_goes_on_behind_twelve(form: str) -> None:
    clock = ClockText()
    texts = written(form, datetime(2026, 1, 5, 12, 40), 3000, 1.0)
    since = np.array([clock.seconds(text) for text in texts], float)
    np.testing.assert_allclose(np.diff(since), 1.0)


def test_an_hour_that_comes_twice_in_autumn_is_counted_twice() -> None:
    before = written("%Y-%m-%d %H:%M:%S", datetime(2026, 10, 25, 2, 30), 1800, 1.0)
    behind = written("%Y-%m-%d %H:%M:%S", datetime(2026, 10, 25, 2, 0), 1800, 1.0)
    clock = ClockText()
    since = np.array([clock.seconds(text) for text in before + behind], float)
    np.testing.assert_allclose(np.diff(since), 1.0)


def test_a_clock_that_is_set_back_otherwise_is_not_mended() -> None:
    clock = ClockText()
    texts = ("10:30:00", "10:30:01", "09:30:02", "09:30:03")
    since = [clock.seconds(text) for text in texts]
    assert since[2] is not None and since[1] is not None and since[2] < since[1]
