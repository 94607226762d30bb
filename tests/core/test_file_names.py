"""Names that are not UTF-8: shown by their bytes, and refused where they would stay."""

from __future__ import annotations

import doctest
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core import file_names
from fieldcal.core.errors import SessionError
from fieldcal.core.file_names import refuse_undecodable_path, storable_text


@given(st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\0")))
def test_text_that_can_be_stored_is_kept(text: str) -> None:
    assert storable_text(text) == text


@given(st.binary())
def test_any_name_of_a_file_can_be_stored(name: bytes) -> None:
    stored = storable_text(os.fsdecode(name))
    assert "\0" not in stored
    assert stored.encode().decode() == stored


def test_what_cannot_be_stored_is_shown_by_its_number() -> None:
    assert storable_text("caf\udce9 α\0b") == r"caf\udce9 α\x00b"


@pytest.mark.parametrize("name", ["log", "messung α", "测量", "a b.csv"])
def test_a_path_of_utf8_passes(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    refuse_undecodable_path(path)
    assert storable_text(str(path)) == str(path)


@pytest.mark.parametrize("inner", ["", "march", "march/log.csv"])
def test_a_path_that_is_not_utf8_is_refused_with_the_name_to_change(
    tmp_path: Path, inner: str
) -> None:
    path = tmp_path / "caf\udce9" / inner
    with pytest.raises(SessionError) as told:
        refuse_undecodable_path(path)
    shown = str(tmp_path / r"caf\udce9" / inner)
    assert str(told.value) == (
        rf"{shown}: the name caf\udce9 is not UTF-8; rename that file or folder"
    )


def test_a_folder_is_refused_by_the_name_it_has_on_the_disk(tmp_path: Path) -> None:
    folder = tmp_path / "caf\udce9"
    folder.mkdir()
    (link := tmp_path / "cafe").symlink_to(folder, target_is_directory=True)
    with pytest.raises(SessionError, match=r"cafe: the name caf\\udce9 is not UTF-8"):
        refuse_undecodable_path(link)


def test_examples() -> None:
    failed, tried = doctest.testmod(file_names)
    assert tried and not failed
