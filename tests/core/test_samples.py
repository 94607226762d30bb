"""Blocks of samples: what is given, what is not, cut and joined."""

import doctest

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core import samples
from fieldcal.core.samples import (
    Block,
    Grain,
    common_unit,
    concat,
    impossible_rate_text,
    runs_of_true,
    split_by_time,
)


def whole(n: int, start: float = 0.0) -> Block:
    """A block in which every number is another one."""
    six = np.arange(6.0 * n).reshape(n, 6)
    t = start + np.arange(n) / 10
    return Block.of(t, six[:, :3], -six[:, 3:], 20 + t, 7 * t, t + 100)


def test_what_is_given_is_there_in_its_place() -> None:
    block = whole(4)
    assert len(block) == 4
    np.testing.assert_array_equal(block.six[1], [6, 7, 8, -9, -10, -11])
    assert block.temperature[1] == pytest.approx(20.1)
    assert block.seq[1] == pytest.approx(0.7)
    assert block.t_host[1] == pytest.approx(100.1)


def test_lists_and_whole_numbers_become_arrays_of_floats() -> None:
    columns = ([0, 1], [[1, 2, 3]] * 2, [[4, 5, 6]] * 2, [20, 21], [1, 2], [0, 1])
    block = Block.of(*columns)  # type: ignore[arg-type]
    for name in ("t", "acc", "gyr", "temperature", "seq", "t_host"):
        assert getattr(block, name).dtype == float


def test_what_is_not_given_is_unknown_and_of_the_right_shape() -> None:
    block = Block.of(np.arange(3.0), np.zeros((3, 3)))
    for values, shape in [
        (block.gyr, (3, 3)),
        (block.temperature, (3,)),
        (block.seq, (3,)),
        (block.t_host, (3,)),
    ]:
        assert values.shape == shape and np.isnan(values).all()
    with pytest.raises(ValueError, match="read-only"):
        block.gyr[0, 0] = 1.0


def test_between_takes_the_start_and_leaves_the_end() -> None:
    block = whole(10)
    assert block.between(block.t[2], block.t[5]).t.tolist() == block.t[2:5].tolist()
    assert len(block.between(-1.0, 0.0)) == 0 and len(block.between(-1.0, 99.0)) == 10


def test_a_slice_takes_the_same_rows_of_everything() -> None:
    block, part = whole(6), whole(6)[2:4]
    for name in ("t", "acc", "gyr", "temperature", "seq", "t_host"):
        np.testing.assert_array_equal(getattr(part, name), getattr(block, name)[2:4])


def test_the_grain_of_a_device_by_channel() -> None:
    np.testing.assert_array_equal(Grain(0.5, 0.25).step, [0.5] * 3 + [0.25] * 3)
    assert not Grain().step.any() and not Grain().cut


@given(st.lists(st.integers(0, 30), max_size=5), st.integers(1, 30))
def test_cut_and_joined_is_what_it_was(cuts: list[int], n: int) -> None:
    block = whole(n)
    edges = [0, *sorted(min(c, n) for c in cuts), n]
    joined = concat(block[a:b] for a, b in zip(edges, edges[1:], strict=False))
    for name in ("t", "acc", "gyr", "temperature", "seq", "t_host"):
        np.testing.assert_array_equal(getattr(joined, name), getattr(block, name))


def test_nothing_joined_is_an_empty_block() -> None:
    nothing = concat([])
    assert len(nothing) == 0 and nothing.six.shape == (0, 6)


def test_pieces_hold_all_samples_once_in_order_by_their_time() -> None:
    block = Block.of(np.array([5.0, 5.4, 6.1, 6.2, 9.3, 9.9, 10.5]), np.ones((7, 3)))
    cut = [part.t.tolist() for part in split_by_time(block, 1.0)]
    # of 5 to 6, 6 to 7, 9 to 10 and beyond; where no samples came is no piece
    assert cut == [[5.0, 5.4], [6.1, 6.2], [9.3, 9.9], [10.5]]


def test_pieces_begin_at_their_edge() -> None:
    block = Block.of(np.arange(7.0), np.ones((7, 3)))
    assert [len(part) for part in split_by_time(block, 2.0)] == [2, 2, 3]
    assert [len(part) for part in split_by_time(block, 60.0)] == [7]


@pytest.mark.parametrize(
    ("names", "unit"),
    [
        (["ax", "ay", "az"], "m/s^2"),
        (["gx", "gz"], "rad/s"),
        (["ax", "gx"], None),
        (["t", "seq"], ""),
        (["t", "ax"], None),
        ([], None),
    ],
)
def test_the_unit_that_channels_share(names: list[str], unit: str | None) -> None:
    assert common_unit(names) == unit


@pytest.mark.parametrize("rate", [0.01, 200.0, 32_000.0, 1e6, np.nan])
def test_a_rate_that_a_device_may_have_needs_no_text(rate: float) -> None:
    assert impossible_rate_text(rate) == ""


def test_a_rate_that_no_device_has_is_told_with_the_option_to_correct_it() -> None:
    assert impossible_rate_text(2.345e8) == (
        "its samples come 2.3e+08 times a second, which no IMU does: the times are in"
        " another unit than s; import the recording again with --time-unit"
    )
    assert impossible_rate_text(np.inf).startswith("its samples come inf times")
    assert impossible_rate_text(np.nextafter(1e6, 2e6))


@given(st.lists(st.booleans()))
def test_runs_are_those_of_a_walk_along_the_flags(flags: list[bool]) -> None:
    expected: list[list[int]] = []
    for i, (flag, before) in enumerate(
        zip(flags, [False, *flags][: len(flags)], strict=True)
    ):
        if flag and not before:
            expected.append([i, i + 1])
        elif flag:
            expected[-1][1] = i + 1
    assert runs_of_true(np.array(flags, dtype=bool)).tolist() == expected


def test_examples() -> None:
    failed, tried = doctest.testmod(samples)
    assert tried and not failed


def test_a_signalling_nan_of_a_damaged_file_is_a_nan() -> None:
    read = np.array([[0x7F800001] * 3], np.uint32).view(np.float32)
    block = Block.of(np.zeros(1), read, gyr=read)
    assert np.isnan(block.acc).all() and np.isnan(block.gyr).all()
