"""Archives that strangers send: sessions come out whole, all else is refused."""

from __future__ import annotations

import io
import stat
import struct
import zipfile
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from fieldcal.core.errors import InputError
from fieldcal.service.bounds import ServiceBounds
from fieldcal.service.upload import archive_members, session_members, unpack

ABOUT = b"format = 1\n"
SMALL = ServiceBounds(upload=1 << 20, unpacked=10_000, members=8)


def packed(path: Path, files: dict[str, bytes], **more: int) -> Path:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            info = zipfile.ZipInfo(name)
            for key, value in more.items():
                setattr(info, key, value)
            archive.writestr(info, content)
    return path


def taken(path: Path, folder: Path, bounds: ServiceBounds = SMALL) -> Path:
    files = session_members(archive_members(path, bounds))
    assert files is not None
    unpack(path, files, folder, bounds)
    return folder


@pytest.mark.parametrize("top", ["", "unit 7/", "a/b/"])
def test_a_session_comes_out_with_its_files_alone(tmp_path: Path, top: str) -> None:
    files = {f"{top}session.toml": ABOUT, f"{top}marks.jsonl": b"{}\n",
             f"{top}.DS_Store": b"x",
             f"__MACOSX/{top}._session.toml": b"x"}  # fmt: skip
    folder = taken(packed(tmp_path / "z", files), tmp_path / "out")
    assert {p.name: p.read_bytes() for p in folder.iterdir()} == {
        "session.toml": ABOUT, "marks.jsonl": b"{}\n",
    }  # fmt: skip


def test_what_is_no_session_is_left_to_import(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.write_bytes(b"t,ax\n")
    assert archive_members(plain, SMALL) == [] and session_members([]) is None
    phone = packed(tmp_path / "phone.zip", {"Accelerometer.csv": b"t,x\n"})
    assert session_members(archive_members(phone, SMALL)) is None


@pytest.mark.parametrize(
    "name",
    ["../evil", "/etc/evil", "a/../../evil", "x/session.toml/evil", "C:\\evil",
     "..\\evil", "sub/evil", "c:evil", "."],
)  # fmt: skip
def test_names_lead_nowhere_else(tmp_path: Path, name: str) -> None:
    bad = packed(tmp_path / "z", {"session.toml": ABOUT, name: b"x"})
    with pytest.raises(InputError, match="does not lie beside"):
        session_members(archive_members(bad, SMALL))


@given(st.lists(st.text(min_size=1, max_size=20), max_size=5, unique=True))
def test_whatever_names_there_are_nothing_is_written_outside(
    tmp_path_factory: pytest.TempPathFactory, names: list[str]
) -> None:
    root = tmp_path_factory.mktemp("any")
    data = io.BytesIO()
    with zipfile.ZipFile(data, "w") as archive:
        for name in ["session.toml", *names]:
            if "\x00" not in name and name.encode("utf-8", "ignore").decode() == name:
                archive.writestr(zipfile.ZipInfo(name), ABOUT)
    (root / "z").write_bytes(data.getvalue())
    try:
        taken(root / "z", root / "out")
    except InputError:
        pass
    assert {p.name for p in root.iterdir()} <= {"z", "out"}
    if (root / "out").exists():
        assert all(p.is_file() for p in (root / "out").iterdir())


def test_links_and_encrypted_files_are_none(tmp_path: Path) -> None:
    link = packed(tmp_path / "l", {"session.toml": b"/etc/passwd"},
                  external_attr=(stat.S_IFLNK | 0o777) << 16)  # fmt: skip
    with pytest.raises(InputError, match="link, encrypted"):
        archive_members(link, SMALL)
    path = packed(tmp_path / "e", {"session.toml": ABOUT})
    data = bytearray(path.read_bytes())
    at = data.index(b"PK\x01\x02")
    data[at + 8] |= 1
    path.write_bytes(bytes(data))
    with pytest.raises(InputError, match="link, encrypted"):
        archive_members(path, SMALL)


def test_bombs_are_refused_by_what_they_say_and_by_what_they_are(
    tmp_path: Path,
) -> None:
    said = packed(tmp_path / "s", {"session.toml": ABOUT, "samples.csv": bytes(20_000)})
    with pytest.raises(InputError, match="MiB unpacked"):
        archive_members(said, SMALL)
    many = {f"{i}": b"" for i in range(9)}
    with pytest.raises(InputError, match="9 files, 8 are taken"):
        archive_members(packed(tmp_path / "m", many), SMALL)
    data = bytearray(said.read_bytes())
    at = data.index(b"PK\x01\x02", data.index(b"PK\x01\x02") + 4)
    data[at + 24 : at + 28] = struct.pack("<I", 100)  # a lie about the size
    (tmp_path / "lie").write_bytes(bytes(data))
    with pytest.raises(InputError, match="damaged|larger"):
        taken(tmp_path / "lie", tmp_path / "out")
    written = sum(p.stat().st_size for p in (tmp_path / "out").iterdir())
    assert written <= SMALL.unpacked


def test_two_sessions_a_broken_one_and_files_of_the_service_are_refused(
    tmp_path: Path,
) -> None:
    two = packed(tmp_path / "2", {"a/session.toml": ABOUT, "b/session.toml": ABOUT})
    with pytest.raises(InputError, match="several sessions"):
        session_members(archive_members(two, SMALL))
    path = packed(tmp_path / "b", {"session.toml": ABOUT * 40, "x": bytes(2000)})
    data = bytearray(path.read_bytes())
    data[50] ^= 0xFF
    path.write_bytes(bytes(data))
    with pytest.raises(InputError):
        taken(path, tmp_path / "broken")
    own = b'format = 1\n[run]\nlimits = "/etc/passwd"\n'
    with pytest.raises(InputError, match="limits"):
        taken(packed(tmp_path / "o", {"session.toml": own}), tmp_path / "own")


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_an_archive_damaged_on_its_way_says_so_however_it_is_packed(
    tmp_path: Path, method: int
) -> None:
    path = tmp_path / "a.zip"
    with zipfile.ZipFile(path, "w", method) as archive:
        archive.writestr("session.toml", "format = 1\n" * 99)
        begins = archive.infolist()[0].header_offset + 30 + len("session.toml")
    data = bytearray(path.read_bytes())
    data[begins + 12 : begins + 30] = bytes(18)
    path.write_bytes(data)
    with pytest.raises(InputError, match="the archive is damaged: .+; send it again"):
        taken(path, tmp_path / "s")
