"""Exit codes, and what a disk says: as the operator meets them."""

import doctest
import errno
import re
from pathlib import Path

import pytest

from fieldcal.core import errors
from fieldcal.core.errors import (
    FieldcalError,
    LinkLost,
    Moved,
    RecordingEnded,
    disk_says,
)


def test_every_error_ends_with_the_code_that_is_documented() -> None:
    found = {
        name: kind.exit_code
        for name, kind in vars(errors).items()
        if isinstance(kind, type) and issubclass(kind, FieldcalError)
    }
    tree = re.findall(r"^[| +-]*(\w+) {2,}(\d+)\b", errors.__doc__ or "", re.MULTILINE)
    assert found == {name: int(code) for name, code in tree}
    assert (found["Moved"], found["InputError"], found["DeviceError"]) == (1, 2, 3)
    assert found["Stopped"] == 130, "as a shell says it of an interrupt"


def test_a_disturbance_carries_its_text_instant_and_axis() -> None:
    moved = Moved("disturbed on ax", 12.5, "ax")
    assert (str(moved), moved.at, moved.axis) == ("disturbed on ax", 12.5, "ax")
    assert moved.seconds == 0.0
    assert Moved("disturbed on ax", 12.5, "ax", 0.25).seconds == 0.25


def test_a_lost_link_carries_what_to_check_apart_from_what_to_do_next() -> None:
    lost = LinkLost("the port is gone: plug it in")
    assert lost.fault == "the port is gone: plug it in"
    assert str(lost) == "the port is gone: plug it in, then start again"


def test_a_recording_that_is_played_ends_by_its_name_and_length() -> None:
    ended = RecordingEnded(Path("march/log.csv"), 12.34567)
    assert str(ended) == "march/log.csv has ended after 12.346 s"


@pytest.mark.parametrize(
    ("number", "why", "remedy"),
    [
        (errno.ENOSPC, "full", "make room"),
        (errno.EROFS, "read-only", "name another"),
        (errno.EACCES, "may not write", "name another folder"),
        (errno.EIO, "does not answer", "put it in again"),
        (errno.ENODEV, "gone", "put it in again"),
        (errno.ENOENT, "not there", "make it"),
    ],
)
def test_a_disk_says_why_and_what_to_do(number: int, why: str, remedy: str) -> None:
    cause, _, action = disk_says(OSError(number, "as the system puts it")).partition(
        ": "
    )
    assert why in cause and remedy in action


def test_what_is_not_known_is_said_in_the_words_of_the_system() -> None:
    assert disk_says(OSError(errno.EMLINK, "Too many links")) == "Too many links"
    assert disk_says(OSError("no number at all")) == "no number at all"


def test_examples() -> None:
    failed, tried = doctest.testmod(errors)
    assert tried and not failed
