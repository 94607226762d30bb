"""Text columns: what is said of them is used, what is wrong is named with its place."""

import gzip
from pathlib import Path

import numpy as np
import pyarrow.parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.cli import main
from fieldcal.core.errors import FieldcalError, InputError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importers.csv_like import TextColumns
from fieldcal.importing.read_options import ReadOptions as Layout
from fieldcal.importing.times.row_validator import RowValidator
from fieldcal.session.folder import Session

ACC = ("ax", "ay", "az")


def read(path: Path, layout: Layout, repair: bool = False) -> Block:
    recording = TextColumns(path, layout)
    judge = RowValidator(str(path), recording.place, repair)
    return concat(judge.through(recording.blocks("0")))


def file(folder: Path, text: str) -> Path:
    path = folder / "log.txt"
    path.write_text(text)
    return path


@pytest.mark.parametrize("separator", [",", ";", "\t", "  "])
def test_separators_are_found(tmp_path: Path, separator: str) -> None:
    rows = "\n".join(separator.join(r) for r in (["1", "2", "3"], ["4", "5", "6"]))
    got = read(file(tmp_path, rows), Layout(ACC, rate_hz=50))
    np.testing.assert_array_equal(got.acc, [[1, 2, 3], [4, 5, 6]])
    np.testing.assert_allclose(got.t, [0, 0.02])
    assert np.isnan(got.gyr).all()


@pytest.mark.parametrize("more", [0, 60, 400])
def test_headings_are_left_out_however_many(tmp_path: Path, more: int) -> None:
    heading = "Fs,100\nWaiting time,3\n" + "\n# about it, 5\n" * more
    heading += "Start,2,3\nax,ay,az\n"
    got = read(file(tmp_path, heading + "1,2,3\n4,5,6\n"), Layout(ACC, rate_hz=1))
    np.testing.assert_array_equal(got.acc, [[1, 2, 3], [4, 5, 6]])
    told = read(file(tmp_path, "9,9,9\n1,2,3\n"), Layout(ACC, rate_hz=1, skip=1))
    np.testing.assert_array_equal(told.acc, [[1, 2, 3]])


def test_units_counts_and_skipped_columns(tmp_path: Path) -> None:
    layout = Layout(
        ("t", "_", *ACC, "gx", "gy", "gz", "temperature"),
        acc_unit="g",
        acc_lsb=16384,
        gyr_unit="deg/s",
        gyr_lsb=131,
        time_unit="ms",
    )
    text = "1000,77,16384,0,0,131,0,0,25.5\n1010,77,0,,0,0,262,0,\n"
    got = read(file(tmp_path, text), layout)
    np.testing.assert_allclose(got.t, [0, 0.01])
    np.testing.assert_allclose(got.acc[0], [G0, 0, 0])
    assert np.isnan(got.acc[1, 1]) and np.isnan(got.temperature[1])
    np.testing.assert_allclose(np.rad2deg(got.gyr[:, :2]), [[1, 0], [0, 2]])


@pytest.mark.parametrize("separator", [";", "\t"])
@pytest.mark.parametrize("last", ["3,5", "nan", ""])
def test_decimal_commas_are_read_and_told(
    tmp_path: Path, separator: str, last: str
) -> None:
    rows = [["x", "y", "z"], ["-1,25", "2,5e1", "3"], ["4", "0,5", last]]
    path = file(tmp_path, "\n".join(separator.join(r) for r in rows))
    recording = TextColumns(path, Layout(ACC, rate_hz=1))
    got = concat(recording.blocks("0")).acc
    third = 3.5 if last == "3,5" else np.nan
    np.testing.assert_array_equal(got, [[-1.25, 25, 3], [4, 0.5, third]])
    assert recording.says == ["its numbers have decimal commas"]


@pytest.mark.parametrize("ends", ["\n", "\r\n", "\r"])
def test_a_mark_of_utf_8_costs_no_row(tmp_path: Path, ends: str) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes(ends.join(["1,2,3", "4,5,6", ""]).encode("utf-8-sig"))
    got = read(path, Layout(ACC, rate_hz=1))
    np.testing.assert_array_equal(got.acc, [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize("encoding", ["utf-16", "utf-16-be", "utf-16-le"])
def test_utf_16_is_read(tmp_path: Path, encoding: str) -> None:
    path = tmp_path / "log.csv"
    path.write_bytes("1,2,3\r\n4,5,6\r\n".encode(encoding))
    recording = open_recording(path, Layout(ACC, rate_hz=1))
    got = concat(list(recording.blocks("0")))
    np.testing.assert_array_equal(got.acc, [[1, 2, 3], [4, 5, 6]])


@pytest.mark.parametrize("cut", [2, 3, 4])
def test_a_last_line_that_is_not_whole_is_named(tmp_path: Path, cut: int) -> None:
    path = file(tmp_path, "1,2,3\n4,5,6\n7,8,9"[:-cut])
    with pytest.raises(InputError, match="line 3: has [12] columns, not 3"):
        read(path, Layout(ACC, rate_hz=1))


def test_a_gz_is_read_as_such(tmp_path: Path) -> None:
    path = tmp_path / "log.gz"
    path.write_bytes(gzip.compress(b"1 2 3\n4 5 6\n"))
    assert len(read(path, Layout(ACC, rate_hz=1))) == 2
    path.write_bytes(gzip.compress(b"1 2 3\n4 5 6\n")[:-3])
    with pytest.raises(InputError, match="the packed file is cut off"):
        read(path, Layout(ACC, rate_hz=1))


@pytest.mark.parametrize(
    ("text", "layout", "says"),
    [
        ("", Layout(ACC, 1), "no line has numbers"),
        ("one two three\n", Layout(ACC, 1), "no line has numbers"),
        ("1,2\n", Layout(ACC, 1), "has 2 columns, 3 are named"),
        ("1,2,3\n1,x,3\n", Layout(ACC, 1), "'x'"),
        ("1,2,3\n", Layout(ACC), "give the rate"),
        ("1,2,3\n", Layout(("ax", "ay", "up"), 1), "'up' is none of"),
        ("1,2,3\n", Layout(("ax", "ax", "ay"), 1), "named twice"),
        ("1,2,3\n", Layout(("t", "_", "_")), "neither ax ay az nor"),
        ("1,2,3\n", Layout(ACC, 1, acc_unit="furlong"), "'furlong' is none of"),
        (
            "1,1,2,3\n1,1,2,4\n2,1,2,3\n",
            Layout(("t", *ACC)),
            "line 2, column t: is not later than above",
        ),
    ],
)
def test_what_cannot_be_used_is_refused_in_words(
    tmp_path: Path, text: str, layout: Layout, says: str
) -> None:
    with pytest.raises(InputError) as error:
        read(file(tmp_path, text), layout)
    assert says in str(error.value)


@pytest.mark.parametrize("repair", [False, True])
@pytest.mark.parametrize("rows", [12, 300])
def test_a_file_written_newest_first_is_to_be_sorted(
    tmp_path: Path, rows: int, repair: bool
) -> None:
    lines = [f"{t},1,2,3\n" for t in range(rows, 0, -1)]
    path = file(tmp_path, "".join(lines))
    with pytest.raises(InputError, match="newest first; sort its rows"):
        read(path, Layout(("t", *ACC)), repair)


def test_what_is_left_of_a_file_is_most_of_it(tmp_path: Path) -> None:
    """Leaving rows out does not mend a file of which few remain."""
    good = [f"{t},1,2,{3 + t % 2}\n" for t in range(40)]
    bad = [f"{t},1,2,inf\n" for t in range(40, 100)]
    path, layout = file(tmp_path, "".join(good + bad)), Layout(("t", *ACC))
    with pytest.raises(InputError, match="60 of 100 rows cannot be used"):
        read(path, layout, repair=True)
    assert (
        len(read(file(tmp_path, "".join(good + bad[:40])), layout, repair=True)) == 40
    )


@given(st.text(alphabet="0123456789.,;-+e \t\nabc\0é", max_size=80))
def test_any_text_is_read_or_refused_in_words(
    tmp_path_factory: object, text: str
) -> None:
    assert isinstance(tmp_path_factory, pytest.TempPathFactory)
    folder = tmp_path_factory.mktemp("x", numbered=True)
    try:
        got = read(file(folder, text), Layout(ACC, rate_hz=10))
    except FieldcalError as error:
        assert "log.txt" in str(error)
    else:
        assert got.acc.shape == (len(got), 3)


def test_import_finds_the_standstills_and_never_overwrites(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    rng = np.random.default_rng(0)
    acc = 0.01 * rng.standard_normal((3000, 3)) + [0, -9.81, 0]
    gyr = 1e-3 * rng.standard_normal((3000, 3))
    gyr[1000:1400] += 0.5
    acc[1400:] += [5, 2, 0]
    acc[1000:1400] += np.linspace(0, 1, 400)[:, None] * [5, 2, 0]
    np.savetxt(tmp_path / "log.csv", np.hstack([acc, gyr]), delimiter=",")
    call = ["import", str(tmp_path / "log.csv"), "--columns", "ax,ay,az,gx,gy,gz"]
    call += ["--rate", "100", "-o", str(tmp_path / "s"), "--latitude", "50"]
    assert main(call) == 0
    assert "2 still stretches" in capsys.readouterr().err
    session = Session.open(tmp_path / "s")
    first, second = session.windows
    assert first and second and first[1] <= 10.0 and second[0] >= 14.0
    assert first[1] - first[0] > 8 and second[1] - second[0] > 14
    np.testing.assert_allclose(session.block.acc, acc, atol=1e-9)
    assert main(call) == 2
    assert "is not empty" in capsys.readouterr().err


def test_temperatures_that_come_late_are_kept_and_none_is_none(tmp_path: Path) -> None:
    n = 40_000
    t = np.arange(n) / 100
    warm = np.where(t < 300, np.nan, 20.0)
    rows = [f"{a:.2f},0.1,0.2,9.8,{w:.1f}" for a, w in zip(t, warm, strict=True)]
    path = file(tmp_path, "\n".join(rows) + "\n")
    call = ["import", str(path), "--columns", "t,ax,ay,az,temperature"]
    call += ["--acc-unit", "m/s^2", "-o", str(tmp_path / "s")]
    assert main(call) == 0
    np.testing.assert_array_equal(Session.open(tmp_path / "s").block.temperature, warm)
    stored = pyarrow.parquet.read_table(tmp_path / "s" / "samples.parquet")
    assert stored["gx"].null_count == stored["seq"].null_count == n
    assert stored["temperature"].null_count < 30_000 == np.isnan(warm).sum()
