"""TOML and JSON that cannot be parsed, and values that JSON cannot represent."""

from __future__ import annotations

import doctest
import json
import math
import tomllib
from datetime import UTC, date, datetime, time
from types import MappingProxyType

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core import documents
from fieldcal.core.documents import (
    BYTE_ORDER_MARK,
    json_values,
    load_json,
    load_toml,
)

DIGITS = "9" * 9999

values = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(),
    lambda inner: st.lists(inner) | st.dictionaries(st.text(), inner),
    max_leaves=20,
)


@given(st.dictionaries(st.text("abcdefgh", min_size=1), st.integers()))
def test_a_byte_order_mark_changes_nothing(table: dict[str, int]) -> None:
    toml = "".join(f"{key} = {value}\n" for key, value in table.items())
    text = json.dumps(table)
    for mark in ("", BYTE_ORDER_MARK):
        assert load_toml(mark + toml) == table
        assert load_json(mark + text) == table


def test_only_one_byte_order_mark_is_skipped() -> None:
    with pytest.raises(tomllib.TOMLDecodeError):
        load_toml(2 * BYTE_ORDER_MARK + "a = 1")
    with pytest.raises(json.JSONDecodeError):
        load_json(2 * BYTE_ORDER_MARK + "1")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("a = ", "^Invalid value"),
        ("a = 1\na = 2", "^Cannot overwrite a value"),
        ("a = " + "[" * 9999, "^it is nested too deeply$"),
        ("a = " + DIGITS, "^it has a number of thousands of digits$"),
    ],
    ids=["no value", "key twice", "nested", "digits"],
)
def test_toml_that_cannot_be_parsed(text: str, why: str) -> None:
    with pytest.raises(tomllib.TOMLDecodeError, match=why):
        load_toml(text)


@pytest.mark.parametrize("mark", ["", BYTE_ORDER_MARK])
def test_a_faulty_line_is_shown_with_what_is_wrong_with_it(mark: str) -> None:
    with pytest.raises(tomllib.TOMLDecodeError) as error:
        load_toml(f"{mark}a = 1\r\n  height_m = -170,5\r\n")
    assert str(error.value).endswith("in 'height_m = -170,5': write a decimal point")
    for other in ("a = 1\nb = [1 2]", "a = 1\nb = 1 2", 'a = 1\nb = "c", "d"'):
        with pytest.raises(tomllib.TOMLDecodeError) as error:
            load_toml(mark + other)
        assert str(error.value).endswith(f", in {other[6:]!r}")
    with pytest.raises(tomllib.TOMLDecodeError) as error:
        load_toml(mark + "x" * 999)
    assert len(str(error.value)) < 200


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("[1,", "^Expecting value: line 1 column 4"),
        ("[" * 99999, "^it is nested too deeply$"),
        (DIGITS, "^it has a number of thousands of digits$"),
    ],
    ids=["no end", "nested", "digits"],
)
def test_json_that_cannot_be_parsed(text: str, why: str) -> None:
    with pytest.raises(ValueError, match=why):
        load_json(text)


def test_dates_and_times_become_their_iso_text() -> None:
    toml = "a = 2026-03-01\nb = 2026-03-01T09:30:00Z\nc = 07:05:00"
    assert load_toml(toml) == {
        "a": date(2026, 3, 1),
        "b": datetime(2026, 3, 1, 9, 30, tzinfo=UTC),
        "c": time(7, 5),
    }
    assert json_values(load_toml(toml)) == {
        "a": "2026-03-01",
        "b": "2026-03-01T09:30:00+00:00",
        "c": "07:05:00",
    }


def test_numbers_that_json_does_not_have_become_null_at_any_depth() -> None:
    nothing = [math.nan, math.inf, -math.inf]
    made = json_values(MappingProxyType({"a": (1.5, *nothing), "b": [{"c": nothing}]}))
    assert made == {"a": [1.5, None, None, None], "b": [{"c": [None] * 3}]}
    assert type(made) is dict and type(made["a"]) is list


@given(values)
def test_every_value_is_written_and_finite_ones_are_kept(value: object) -> None:
    text = json.dumps(json_values(value), allow_nan=False)

    def refuse(_: str) -> None:
        raise AssertionError

    null = json.loads(json.dumps(value), parse_constant=lambda _: None)
    assert json.loads(text, parse_constant=refuse) == null


def test_examples() -> None:
    failed, tried = doctest.testmod(documents)
    assert tried and not failed
