"""The session folder: what is read, what is refused and with which words."""

import gzip
import json
import os
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.csv
import pyarrow.parquet
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError, SessionError
from fieldcal.core.gravity import G0
from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.session import description_file, sample_files, sample_table
from fieldcal.session.arrow_encoder import ArrowEncoder
from fieldcal.session.folder import Session
from fieldcal.session.integrity import file_faults
from fieldcal.session.recorder import Recorder

HEAD = "t,ax,ay,az,gx,gy,gz"
ROWS = "0.00,0,-9.81,0,0,0,0\n0.01,0,-9.80,0,0,0,0\n"


def folder(at: Path, toml: str = "", csv: str | None = f"{HEAD}\n{ROWS}") -> Path:
    at.mkdir(exist_ok=True)
    (at / "session.toml").write_text("format = 1\n" + toml)
    if csv is not None:
        (at / "samples.csv").write_text(csv)
    return at


def block(n: int = 50, start: float = 0.0) -> Block:
    rng = np.random.default_rng(1)
    t = start + np.arange(n) / 100
    return Block.of(t, rng.normal(size=(n, 3)), rng.normal(size=(n, 3)))


def test_units_become_si_and_missing_values_stay_missing(tmp_path: Path) -> None:
    toml = '[units]\nacceleration = "mg"\nangular_rate = "deg/s"\n'
    csv = f"{HEAD},temperature\n0,0,-1000,0,180,0,0,25\n1,,nan,0,0,0,0,\n"
    got = Session.open(folder(tmp_path, toml, csv)).block
    np.testing.assert_allclose(got.acc[0], [0, -G0, 0])
    np.testing.assert_allclose(got.gyr[0], [np.pi, 0, 0])
    assert np.isnan(got.acc[1, :2]).all() and np.isnan(got.temperature[1])
    assert np.isnan(got.seq).all()


def test_what_else_is_said_of_a_device_can_be_stored(tmp_path: Path) -> None:
    toml = "[device]\nbought = 2026-01-02\nat = 2026-01-02T03:04:05Z\n"
    toml += "limits = [1.5, inf, {worst = nan}]\n"
    device = Session.open(folder(tmp_path, toml)).about.device
    assert json.loads(json.dumps(device, allow_nan=False)) == {
        "bought": "2026-01-02",
        "at": "2026-01-02T03:04:05+00:00",
        "limits": [1.5, None, {"worst": None}],
    }


@pytest.mark.skipif(os.name != "posix", reason="every name is Unicode elsewhere")
def test_a_name_that_is_not_utf_8_is_refused_with_the_remedy(tmp_path: Path) -> None:
    inner = folder(tmp_path / os.fsdecode(b"caf\xe9")) / "a"
    says = r"a: the name caf\\udce9 is not UTF-8; rename"
    with pytest.raises(SessionError, match=says):
        Session.open(folder(inner))
    with pytest.raises(SessionError, match=says):
        Recorder(inner, {"format": 1})
    with pytest.raises(SessionError, match=says):
        list(file_faults(inner))
    with pytest.raises(InputError, match="is not UTF-8; rename"):
        open_recording(inner / "samples.csv", ReadOptions())


def test_every_file_kind_gives_the_same_samples(tmp_path: Path) -> None:
    wanted = block()
    table = pa.Table.from_batches([sample_table.to_record_batch(wanted)])
    csv = tmp_path / "a.csv"
    pa.csv.write_csv(table, csv)
    (tmp_path / "b.csv.gz").write_bytes(gzip.compress(csv.read_bytes()))
    pyarrow.parquet.write_table(table, tmp_path / "c.parquet")
    with Recorder(tmp_path / "d", {"format": 1}) as recorder:
        recorder.append(wanted)
    for name in ("a.csv", "b.csv.gz", "c.parquet", "d/samples.arrows"):
        got, warnings, _ = sample_files.read_samples(tmp_path / name)
        assert not warnings, name
        np.testing.assert_array_equal(got.six, wanted.six)
        np.testing.assert_array_equal(got.t, wanted.t)


@pytest.mark.parametrize(
    ("csv", "says"),
    [
        ("", "is empty"),
        (HEAD + "\n", "no rows"),
        (f"{HEAD}\n0,0,0,0,0,0,0\n1,0,x,0,0,0,0\n", "row 2, column ay: 'x'"),
        (f"{HEAD}\n0,0,0,0,0,0,0\n0,0,0,0,0,0,0\n", "row 2, column t: 0 s is the same"),
        (f"{HEAD}\n1,0,0,0,0,0,0\n0,0,0,0,0,0,0\n", "row 2, column t: 0 s is before"),
        (f"{HEAD}\n1,0,0,0,0,0\n2,0,0,0,0,0,0\n", "row 1 has 6 columns, not 7"),
        (f"{HEAD}\nnan,0,0,0,0,0,0\n", "row 1, column t"),
        (f"{HEAD}\n0,inf,0,0,0,0,0\n", "row 1, column ax: inf"),
        ("t,ax,ay\n0,0,0\n", "no column az"),
        ("t,p\n0,0\n", "neither accelerometers"),
        ("ax,ay,az\n0,0,0\n", "no column t"),
        ("1,2,3\n4,5,6\n", "first row must name the columns"),
    ],
)
def test_a_samples_file_that_makes_no_sense_is_refused_with_the_place(
    tmp_path: Path, csv: str, says: str
) -> None:
    session = Session.open(folder(tmp_path, csv=csv))
    with pytest.raises(SessionError, match="samples.csv") as error:
        _ = session.block
    assert says in str(error.value)


def test_no_samples_file_or_two_of_them(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="no samples file"):
        _ = Session.open(folder(tmp_path, csv=None)).block
    folder(tmp_path)
    (tmp_path / "samples.parquet").write_bytes(b"")
    with pytest.raises(SessionError, match="keep one"):
        _ = Session.open(tmp_path).block


def test_files_saved_with_a_byte_order_mark_are_read(tmp_path: Path) -> None:
    plain = Session.open(folder(tmp_path))
    for name in ("session.toml", "samples.csv"):
        path = tmp_path / name
        path.write_text(path.read_text(), encoding="utf-8-sig")
    marked = Session.open(tmp_path)
    assert marked.about.raw == plain.about.raw
    np.testing.assert_array_equal(marked.block.t, plain.block.t)
    np.testing.assert_array_equal(marked.block.acc, plain.block.acc)


def test_a_csv_cut_off_anywhere_keeps_its_whole_rows(tmp_path: Path) -> None:
    text = f"{HEAD}\n{ROWS}0.02,0,-9.82,0,0,0,0\n"
    first_row = text.index("\n", text.index("\n") + 1)
    for end in range(first_row, len(text)):
        (tmp_path / "samples.csv").write_text(text[:end])
        got, _, _ = sample_files.read_samples(tmp_path / "samples.csv")
        whole = text[:end].count("\n") - 1
        assert whole <= len(got) <= whole + 1


def test_a_gz_cut_off_is_read_as_far_as_it_goes_and_says_so(tmp_path: Path) -> None:
    rows = "".join(f"{i / 100},{i % 7},-9.8,{i % 3},0,0,0\n" for i in range(5000))
    packed = gzip.compress(f"{HEAD}\n{rows}".encode())
    path = tmp_path / "samples.csv.gz"
    path.write_bytes(packed[: len(packed) // 2])
    got, warnings, _ = sample_files.read_samples(path)
    assert 100 < len(got) < 5000 and "cut off" in warnings[0]
    path.write_bytes(b"no gzip at all")
    with pytest.raises(SessionError, match="is no gzip file, or damaged"):
        sample_files.read_samples(path)


@pytest.mark.thorough
def test_a_stream_cut_at_any_byte_keeps_every_whole_batch(tmp_path: Path) -> None:
    sizes = []
    with Recorder(tmp_path / "s", {"format": 1}) as recorder:
        path = tmp_path / "s" / "samples.arrows"
        for i in range(2):
            recorder.append(block(2, start=i))
            recorder.flush()
            sizes.append(path.stat().st_size)
    data = path.read_bytes()
    cut = tmp_path / "cut.arrows"
    for end in range(len(data)):
        cut.write_bytes(data[:end])
        whole = sum(end >= size for size in sizes)
        try:
            got, warnings, _ = sample_files.read_samples(cut)
        except SessionError as error:
            assert whole == 0 and str(cut) in str(error)
            continue
        assert len(got) == 2 * whole and warnings
        np.testing.assert_array_equal(got.acc[:2], block(2).acc)


def test_a_session_is_never_overwritten(tmp_path: Path) -> None:
    Recorder(tmp_path, {"format": 1}).close()
    with pytest.raises(SessionError, match="holds a session already"):
        Recorder(tmp_path, {"format": 1})


def test_windows_of_a_live_session_stand_in_its_marks(tmp_path: Path) -> None:
    about = {"format": 1, "position": [{"alpha_deg": 0.0, "beta_deg": 0.0}] * 2}
    with Recorder(tmp_path, about) as recorder:
        recorder.append(block())
        recorder.mark("window", position=1, start_s=0.1, end_s=0.4)
    with (tmp_path / "marks.jsonl").open("a") as marks:
        marks.write('{"event": "window", "posi')
    session = Session.open(tmp_path)
    assert session.windows == (None, (0.1, 0.4))
    assert [m["event"] for m in session.marks()] == ["window"]
    assert len(session.block) == 50
    (tmp_path / "marks.jsonl").write_text("{nonsense\n{}\n")
    session = Session.open(tmp_path)
    assert list(session.marks()) == [{}]
    assert session.warnings == ("marks.jsonl: line 1 is damaged and left out",)


@pytest.mark.parametrize(
    ("toml", "says"),
    [
        ("format = 2", "format = 2 cannot be: write format = 1"),
        ("[site]\ngravity = 0", "[site] gravity = 0 cannot be: give the local"),
        ("[site]\nlevel_deg = -0.1", "[site] level_deg = -0.1 cannot be"),
        ("[site]\nlevel_deg = 20", "level_deg = 20 cannot be: give one sigma"),
        (
            "[site]\nlatitude_deg = 'x'",
            'latitude_deg = "x" cannot be: give',
        ),
        ("[site]\nlatitude_deg = 100.0", "latitude_deg = 100.0 cannot be"),
        (
            "[units]\nacceleration = 'furlong'",
            '= "furlong" cannot be: write one of',
        ),
        ("[frame]\nmounting = ['+x', '+x', '+z']", "right-handed"),
        (
            "[nominal]\nacc_bias = [1, 2]",
            "[nominal] acc_bias = [1, 2] cannot be",
        ),
        ("[device]\ngrade = 'toy'", 'write "consumer", "tactical" or "navigation"'),
        ("[model]\neffects = 'base_tilt'", "list of ids"),
        (
            "[[position]]\nalpha_deg = 1",
            "[[position]] number 1 beta_deg is missing",
        ),
        ("[[position]]\nstart_s = 5\nend_s = 5", "it must come before"),
        ("[[position]]\nrate_deg_s = [1]", "three numbers"),
        ("[[position]]\nspeed_deg_s = 0", "more than 0"),
        ("[[position]]\nspeed_sd_deg_s = 1", "speed_deg_s"),
        (
            "[[position]]\nspeed_deg_s = 5\nrate_deg_s = [1, 0, 0]",
            "for an axis that nobody knows",
        ),
        ("[[position]]\nspeed_deg_s = 5\nalpha_deg = 1\nbeta_deg = 0", "an attitude"),
        ("[sampling]\nrate_hz = -1", "rate_hz = -1 cannot be"),
        ("x = [", "is not TOML"),
    ],
)
def test_a_session_toml_that_makes_no_sense_is_refused_with_the_place(
    tmp_path: Path, toml: str, says: str
) -> None:
    (tmp_path / "session.toml").write_text(toml)
    with pytest.raises(SessionError, match="session.toml") as error:
        Session.open(tmp_path)
    assert says in str(error.value)


def test_a_folder_without_session_toml_is_said_to_be_none(tmp_path: Path) -> None:
    with pytest.raises(SessionError, match="fieldcal import"):
        Session.open(tmp_path / "nowhere")


json_values = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=5),
    lambda inner: st.lists(inner, max_size=4),
    max_leaves=6,
)
tables = st.dictionaries(
    st.sampled_from(["alpha_deg", "mounting", "acc_bias", "gravity", "effects", "x"]),
    json_values,
    max_size=4,
)
names = st.sampled_from(["site", "frame", "nominal", "model", "position", "units"])


@given(st.dictionaries(names, json_values | tables | st.lists(tables, max_size=3)))
def test_any_table_is_read_or_refused_in_words(raw: dict[str, Any]) -> None:
    try:
        about = description_file.parse_description(raw)
    except InputError as error:
        assert str(error)
    else:
        assert about.gravity > 0


def test_a_derived_file_is_whole_and_strict_json(tmp_path: Path) -> None:
    session = Session.open(folder(tmp_path))
    path = session.write_json("result.json", {"a": 1})
    assert json.loads(path.read_text()) == {"a": 1}
    with pytest.raises(ValueError, match="JSON"):
        session.write_json("result.json", {"a": float("nan")})
    assert json.loads(path.read_text()) == {"a": 1}
    assert sorted(p.name for p in tmp_path.iterdir()) == [
        "result.json",
        "samples.csv",
        "session.toml",
    ]


def test_what_is_no_part_of_a_window_is_missing(tmp_path: Path) -> None:
    rows = "".join(f"{t / 10},0,-9.8,{t},0,0,0\n" for t in range(40))
    toml = "[[position]]\nstart_s = 0.5\nend_s = 3.5\n"
    toml += "without_s = [[2.0, 2.5], [1.0, 1.2]]\n"
    session = Session.open(folder(tmp_path, toml, f"{HEAD}\n{rows}"))
    left_out = np.isnan(session.block.six).all(axis=1)
    assert np.flatnonzero(left_out).tolist() == [10, 11, 20, 21, 22, 23, 24]
    assert session.about.excluded_spans == ((1.0, 1.2), (2.0, 2.5))
    parts = [np.isnan(part.acc[:, 0]) for part in session.blocks()]
    np.testing.assert_array_equal(np.concatenate(parts), left_out)


@pytest.mark.parametrize(
    "gaps", ["[[0.2, 1.0]]", "[[1.0, 4.0]]", "[[2.0, 1.0]]", "[[1.0, 2.0], [1.5, 3.0]]"]
)
def test_what_is_no_part_of_a_window_lies_within_it(tmp_path: Path, gaps: str) -> None:
    toml = f"[[position]]\nstart_s = 0.5\nend_s = 3.5\nwithout_s = {gaps}\n"
    with pytest.raises(SessionError, match="number 1 without_s = .*start_s and end_s"):
        Session.open(folder(tmp_path, toml))


def test_a_long_parquet_file_is_not_held_in_memory(tmp_path: Path) -> None:
    """Of many groups of rows no more than a few are there at a time."""
    rng = np.random.default_rng(3)
    columns = {name: rng.normal(size=400_000) for name in HEAD.split(",")}
    columns["t"] = np.arange(400_000) / 1000.0
    path = tmp_path / "samples.parquet"
    pa.parquet.write_table(pa.table(columns), path, row_group_size=20_000)
    before, most, rows = pa.total_allocated_bytes(), 0, 0
    for part in sample_files.iterate_samples(path):
        rows += len(part)
        most = max(most, pa.total_allocated_bytes() - before)
    assert rows == 400_000
    assert most < path.stat().st_size / 2


@pytest.mark.parametrize("ending", ["csv", "csv.gz", "arrows"])
def test_part_by_part_is_what_the_whole_is_where_the_end_is_missing(
    tmp_path: Path, ending: str
) -> None:
    rows = [f"{t / 100},0.1,-9.8,{t % 7},0,0,0" for t in range(5000)]
    data = "\n".join([HEAD, *rows, ""]).encode()
    (tmp_path / "session.toml").write_text("format = 1\n")
    path = tmp_path / f"samples.{ending}"
    if ending == "arrows":
        names = HEAD.split(",")
        columns = np.array([[float(x) for x in row.split(",")] for row in rows]).T
        whole = pa.table(dict(zip(names, columns, strict=True)))
        with pa.ipc.new_stream(str(path), whole.schema) as stream:
            stream.write_table(whole, max_chunksize=1000)
        data = path.read_bytes()
    elif ending == "csv.gz":
        data = gzip.compress(data)
    path.write_bytes(data[: -len(data) // 4 - 3])
    at_once, parted = Session.open(tmp_path), Session.open(tmp_path)
    got = concat(parted.blocks())
    assert 1000 < len(got) == len(at_once.block) < 5000
    np.testing.assert_array_equal(got.six, at_once.block.six)
    assert any("cut off" in said for said in at_once.warnings)
    assert parted.warnings == at_once.warnings


def test_names_of_columns_may_have_spaces_about_them(tmp_path: Path) -> None:
    session = Session.open(folder(tmp_path, "", f"{HEAD.replace(',', ', ')}\n{ROWS}"))
    np.testing.assert_array_equal(concat(session.blocks()).six, session.block.six)


def test_a_column_that_is_there_twice_is_refused(tmp_path: Path) -> None:
    session = Session.open(folder(tmp_path, "", f"{HEAD[:-2]}gx\n{ROWS}"))
    with pytest.raises(SessionError, match="two columns gx"):
        _ = session.block
    with pytest.raises(SessionError, match="two columns gx"):
        list(session.blocks())


def test_names_are_the_same_with_blanks_around_them(tmp_path: Path) -> None:
    toml = "[device]\nserial = ' A7 '\nlot = '7\\t'\n[site]\nstation = '  '\n"
    toml = toml.replace("'7\\t'", '"7\\t"')
    about = Session.open(folder(tmp_path / "s", toml)).about
    assert about.device == {"serial": "A7", "lot": "7"}
    assert about.raw["site"]["station"] == ""


def test_samples_keep_no_file_in_memory(tmp_path: Path) -> None:
    """Columns of a file of one batch are parts of its bytes."""
    block = Block.of(np.arange(50.0), np.ones((50, 3)), seq=np.arange(50.0))
    encoder = ArrowEncoder(sample_table.samples_schema())
    path = tmp_path / "samples.arrows"
    path.write_bytes(
        encoder.encode(sample_table.to_record_batch(block)) + encoder.end()
    )
    read, _, _ = sample_files.read_samples(path)
    for column in (read.t, read.seq, read.acc.T, read.gyr.T):
        assert column.flags.c_contiguous
        assert (column if column.base is None else column.base).flags.owndata
    np.testing.assert_array_equal(read.seq, block.seq)


def test_a_misspelt_key_of_a_session_is_told(tmp_path: Path) -> None:
    """What it states is not used, which nobody would notice."""
    toml = """
        notes = "mine"
        [site]
        latitude = 50.45
        town = "Kyiv"
        [run]
        procedure = "five_position"
        seconds = 30.0
        """
    (said,) = Session.open(folder(tmp_path / "s", toml)).warnings
    assert "[site] latitude is not known: write latitude_deg" in said
    assert not Session.open(
        folder(tmp_path / "t", toml.replace("latitude", "latitude_deg"))
    ).warnings
