"""JSON as programs write it: records, lists, and records of several samples each."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError
from fieldcal.core.samples import Block, concat
from fieldcal.importers import open_recording
from fieldcal.importing.read_options import ReadOptions
from fieldcal.importing.records.cut_json import (
    whole_beginning,
    without_last_commas,
)
from fieldcal.importing.records.json_lists import json_lists
from fieldcal.importing.records.pandas_json import records_of_frame

ROWS = 60
T = np.arange(ROWS) / 50
ACC = np.column_stack([0.1 * np.sin(T), 0.2 + 0 * T, 9.8 + 0 * T])
GYR = np.column_stack([0.01 * np.cos(T), 0 * T, 0.02 + 0 * T])


def axes(row: np.ndarray) -> dict[str, float]:
    return dict(zip("xyz", row.tolist(), strict=True))


def nested(i: int) -> dict[str, Any]:
    return {"t": T[i], "acc": axes(ACC[i]), "gyro": axes(GYR[i])}


def flat(i: int) -> dict[str, Any]:
    row: dict[str, Any] = {"time": f"2024-05-03T12:00:{T[i]:09.6f}Z", "on": True}
    for name, values in (("a", ACC[i]), ("g", GYR[i])):
        row |= {name + x: v for x, v in axes(values).items()}
    return row


def blocks(size: int) -> dict[str, Any]:
    some = [slice(i, i + size) for i in range(0, ROWS, size)]
    return {
        "data": [
            {
                "imu6": {
                    "Timestamp": int(1000 * T[s.start]),
                    "ArrayAcc": [axes(row) for row in ACC[s]],
                    "ArrayGyro": [axes(row) for row in GYR[s]],
                }
            }
            for s in some
        ]
    }


DOCUMENTS = {
    "lines": "\n".join(json.dumps(nested(i)) for i in range(ROWS)),
    "list": json.dumps([flat(i) for i in range(ROWS)], indent=1),
    "columns": json.dumps({"t": T.tolist(), "acc": ACC.tolist(), "gyr": GYR.tolist()}),
    "blocks": json.dumps(blocks(10)),
    "vectors": "\n".join(
        json.dumps({"t": t, "accel": a, "gyro": g})
        for t, a, g in zip(T.tolist(), ACC.tolist(), GYR.tolist(), strict=True)
    ),
}


def read(path: Path, repair: bool = False) -> Block:
    unit = "ms" if "imu6" in path.read_text() else "s"
    wanted = ReadOptions(time_unit=unit)
    recording = open_recording(path, wanted, repair=repair)
    return concat(list(recording.blocks(recording.streams()[0].name)))


@pytest.mark.parametrize("name", DOCUMENTS)
def test_records_and_lists_are_samples(tmp_path: Path, name: str) -> None:
    path = tmp_path / "log.json"
    path.write_text(DOCUMENTS[name])
    got = read(path)
    np.testing.assert_allclose(got.acc, ACC)
    np.testing.assert_allclose(got.gyr, GYR)
    np.testing.assert_allclose(got.t - got.t[0], T, atol=1e-6)


def test_a_lost_record_stretches_no_other(tmp_path: Path) -> None:
    document, size = blocks(10), 10
    del document["data"][3]
    path = tmp_path / "log.json"
    path.write_text(json.dumps(document))
    whole = np.delete(T, slice(3 * size, 4 * size))
    np.testing.assert_allclose(read(path).t, whole, atol=1e-3)


def test_a_line_that_is_cut_off_is_refused_or_left_out(tmp_path: Path) -> None:
    path = tmp_path / "log.json"
    path.write_text(DOCUMENTS["lines"][:-20])
    with pytest.raises(InputError, match=f"line {ROWS}: is no JSON.*--repair"):
        read(path)
    assert len(read(path, repair=True)) == ROWS - 1


def test_what_a_device_says_before_its_first_record_is_passed_over(
    tmp_path: Path,
) -> None:
    path = tmp_path / "log.txt"
    path.write_text("Connecting to WiFi....\nready: 50 Hz\n" + DOCUMENTS["lines"])
    np.testing.assert_allclose(read(path).acc, ACC)


@pytest.mark.parametrize("lines", [False, True])
def test_records_of_two_sensors_go_together(tmp_path: Path, lines: bool) -> None:
    """As telephones write them, each number a text; or one a line."""
    late = T + 0.1 / ROWS
    kinds = {
        "TotalAcceleration": (T, ACC), "Accelerometer": (T, 0 * ACC),
        "Gyroscope": (late, GYR), "Magnetometer": (T, 50 * ACC),
    }  # fmt: skip
    records: list[dict[str, Any]] = [{"sensor": "Metadata", "device": "a telephone"}]
    for i in range(ROWS):
        for name, (t, three) in kinds.items():
            axes = dict(zip("xyz", three[i].tolist(), strict=True))
            said = {k: f"{v:.12g}" for k, v in {"time": t[i], **axes}.items()}
            whole = {"sensor": name, "data": axes, "ts": t[i]}
            records.append(whole if lines else {"sensor": name, **said})
    path = tmp_path / "log.json"
    one_each = "\n".join(json.dumps(one) for one in records[1:])
    path.write_text(one_each if lines else json.dumps(records))
    recording = open_recording(path, ReadOptions(time_unit="s"))
    got = concat(list(recording.blocks(recording.streams()[0].name)))
    np.testing.assert_allclose(got.acc, ACC)
    np.testing.assert_allclose(got.gyr, GYR)
    pairing = "those of TotalAcceleration are taken, each with the nearest of Gyroscope"
    assert any(pairing in one for one in recording.says)


def test_records_of_different_sensors_are_not_mixed() -> None:
    lines = [
        {"sensor": s, "x": x, "t": i} for i in range(3) for s, x in (("a", 1), ("g", 2))
    ]
    got = {name: values.tolist() for name, values in json_lists(lines)}
    assert got["a_x"] == [1, 1, 1] and got["g_x"] == [2, 2, 2]


DEEP = st.recursive(
    st.none() | st.booleans() | st.floats() | st.integers() | st.text(max_size=9),
    lambda one: (
        st.lists(one, max_size=4)
        | st.dictionaries(st.text(max_size=4), one, max_size=4)
    ),
    max_leaves=20,
)


def test_imus_in_a_list_of_each_record_are_imus_and_samples_are_samples(
    tmp_path: Path,
) -> None:
    path = tmp_path / "log.json"
    both = [{"acc": axes(ACC[i]), "gyro": axes(GYR[i])} for i in range(ROWS)]
    other = [{"acc": axes(2 * ACC[i]), "gyro": axes(GYR[i])} for i in range(ROWS)]
    path.write_text("\n".join(
        json.dumps({"t": T[i], "imus": [{"id": "left", **a}, {"id": "right", **b}]})
        for i, (a, b) in enumerate(zip(both, other, strict=True))
    ))  # fmt: skip
    recording = open_recording(path, ReadOptions())
    left, right = recording.streams()
    for stream, times in ((left, 1), (right, 2)):
        got = concat(list(recording.alone(stream.name).blocks(stream.name)))
        np.testing.assert_allclose(got.acc, times * ACC)
        np.testing.assert_allclose(got.gyr, GYR)
    # numbers that go on are those of samples
    fields = [{"id": i, **row} for i, row in enumerate(both)]
    path.write_text("\n".join(
        json.dumps({"t": T[i], "samples": fields[i : i + 2]}) for i in range(0, ROWS, 2)
    ))  # fmt: skip
    np.testing.assert_allclose(read(path).acc, ACC)


@given(st.lists(DEEP, min_size=2, max_size=6) | DEEP)
def test_any_document_has_lists_or_none(document: Any) -> None:
    for name, values in json_lists(document):
        assert name and values.ndim in (1, 2) and values.dtype == float


FRAME = {"t": T, **{f"a{x}": ACC[:, i] for i, x in enumerate("xyz")},
         **{f"g{x}": GYR[:, i] for i, x in enumerate("xyz")}}  # fmt: skip
KEYS = [str(i) for i in range(ROWS)]
RECORDS = [{n: float(c[i]) for n, c in FRAME.items()} for i in range(ROWS)]
BARE = [{n: v for n, v in one.items() if n != "t"} for one in RECORDS]
STAMPS = [f"20240503T1200{T[i]:09.6f}Z" for i in range(ROWS)]


def by_column(records: list[dict[str, Any]], keys: list[str]) -> dict[str, Any]:
    return {n: {k: r[n] for k, r in zip(keys, records, strict=True)}
            for n in records[0]}  # fmt: skip


FRAMES: dict[str, Any] = {
    "columns": by_column(RECORDS, KEYS),
    "columns of every other row": by_column(RECORDS, [str(2 * i) for i in range(ROWS)]),
    "columns with stamps": by_column(
        [{"time": s, **r} for s, r in zip(STAMPS, BARE, strict=True)], KEYS
    ),
    "an index in ms": by_column(BARE, [f"{1714737600000 + 1e3 * t:.0f}" for t in T]),
    "an index of stamps": by_column(BARE, STAMPS),
    "index": dict(zip(KEYS, RECORDS, strict=True)),
    "records": RECORDS,
    "records with stamps": [
        {"stamp": s, **r} for s, r in zip(STAMPS, BARE, strict=True)
    ],
    "split": {
        "columns": list(FRAME),
        "index": list(range(ROWS)),
        "data": [list(r.values()) for r in RECORDS],
    },
    "rows below their names": [list(FRAME), *(list(r.values()) for r in RECORDS)],
    "table": {
        "schema": {"fields": [], "pandas_version": "1.4.0"},
        "data": [{"index": i, **r} for i, r in enumerate(RECORDS)],
    },
}
"""As `pandas.DataFrame.to_json` writes them, and as tables are written by others."""


@pytest.mark.parametrize("name", FRAMES)
def test_a_data_frame_is_samples(tmp_path: Path, name: str) -> None:
    path = tmp_path / "log.json"
    path.write_text(json.dumps(FRAMES[name]))
    wanted = ReadOptions(time_unit="ms" if "ms" in name else "s")
    recording = open_recording(path, wanted)
    got = concat(list(recording.blocks(recording.streams()[0].name)))
    np.testing.assert_allclose(got.acc, ACC)
    np.testing.assert_allclose(got.gyr, GYR)
    np.testing.assert_allclose(got.t - got.t[0], T, atol=1e-6)


@given(
    st.recursive(
        st.none() | st.integers() | st.floats() | st.text(max_size=3),
        lambda inner: st.lists(inner, max_size=3) | st.dictionaries(
            st.sampled_from(["0", "1", "columns", "index", "data", "t", "schema"]),
            inner, max_size=3,
        ),
    )
)  # fmt: skip
def test_any_document_is_a_data_frame_or_none(document: Any) -> None:
    frame = records_of_frame(document)
    assert frame is None or all(isinstance(one, dict) for one in frame)


@pytest.mark.parametrize("indent", [None, 1])
@pytest.mark.parametrize("within", [False, True])
def test_a_document_that_was_cut_off_is_read_up_to_its_last_whole_record(
    tmp_path: Path, indent: int | None, within: bool
) -> None:
    records = [nested(i) for i in range(ROWS)]
    document = {"device": {"id": 1, "axes": [1, 2]}, "data": records}
    text = json.dumps(document if within else records, indent=indent)
    path = tmp_path / "log.json"
    path.write_text(text[: text.rindex('"gyro"')])
    with pytest.raises(InputError, match="its end: is cut off .* --repair"):
        open_recording(path, ReadOptions()).streams()
    recording = open_recording(path, ReadOptions(), repair=True)
    (stream,) = recording.streams()
    block = concat(recording.blocks(stream.name))
    np.testing.assert_allclose(block.acc, ACC[:-1])
    np.testing.assert_allclose(block.gyr, GYR[:-1])


def test_lists_side_by_side_that_were_cut_off_are_not_of_one_length(
    tmp_path: Path,
) -> None:
    document = {"t": T.tolist(), "acc": ACC.tolist(), "gyro": GYR.tolist()}
    path = tmp_path / "log.json"
    path.write_text(json.dumps(document)[:-100])
    recording = open_recording(path, ReadOptions(), repair=True)
    with pytest.raises(InputError, match="different lengths"):
        for stream in recording.streams():
            concat(recording.alone(stream.name).blocks(stream.name))


def test_a_comma_behind_the_last_record_is_none_too_many(tmp_path: Path) -> None:
    path = tmp_path / "log.json"
    records = ",\n".join(json.dumps(nested(i)) for i in range(ROWS))
    path.write_text(f"[{records},\n]\n")
    recording = open_recording(path, ReadOptions())
    (stream,) = recording.streams()
    np.testing.assert_allclose(concat(recording.blocks(stream.name)).acc, ACC)


@given(st.text(alphabet='[]{},:"\\\\1 at', max_size=60))
def test_any_text_is_nearly_a_document_or_is_none(text: str) -> None:
    whole = whole_beginning(text)
    assert whole is None or len(whole) >= 2
    assert without_last_commas(text).replace(",", "") == text.replace(",", "")
