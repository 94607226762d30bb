"""The store: whole or not at all, whoever writes and whatever fails meanwhile."""

from __future__ import annotations

import json
import multiprocessing
import os
import shutil
import socket
import sqlite3
import subprocess
import sys
import tempfile
import threading
from collections.abc import Iterator, Sequence
from contextlib import closing, contextmanager
from dataclasses import replace
from multiprocessing.context import ForkServerProcess
from pathlib import Path

import numpy as np
import pytest
from alembic import command
from alembic.script import ScriptDirectory
from sqlalchemy import inspect, text, update

from fieldcal.calibration import Calibration
from fieldcal.cli import main
from fieldcal.core.errors import InputError
from fieldcal.core.recorded_part import RecordedPart
from fieldcal.history import database, filters, sessions
from fieldcal.history.database import Database
from fieldcal.history.location import StoreLocation
from fieldcal.history.repeats import replacing_folders, shorter_copies, withdraw
from fieldcal.history.sessions import StoredSession
from fieldcal.history.store import History, earlier_runs
from fieldcal.history.tables import METADATA, SESSION

FORMER = """
CREATE TABLE run (
    id INTEGER PRIMARY KEY, serial TEXT NOT NULL, taken_at TEXT NOT NULL,
    session TEXT NOT NULL, go INTEGER NOT NULL, accepted INTEGER NOT NULL DEFAULT 0,
    temperature REAL, latitude_deg REAL, height_m REAL, software TEXT NOT NULL,
    result TEXT NOT NULL, UNIQUE (serial, session));
CREATE TABLE parameter (
    run INTEGER NOT NULL REFERENCES run (id) ON DELETE CASCADE, name TEXT NOT NULL,
    value REAL NOT NULL, sigma REAL NOT NULL, unit TEXT NOT NULL,
    PRIMARY KEY (run, name));
PRAGMA user_version = 1;
"""


def calibration(bias: float = 0.2, serial: str = "A1") -> Calibration:
    info = {"device": {"serial": serial}, "decision": {"go": True}}
    names, units = ("acc_bias.x", "gyr_bias.x"), ("m/s^2", "rad/s")
    covariance = np.diag([1e-6, 1e-10])
    return Calibration(
        "joint", names, np.array([bias, 0.01]), covariance, units, 1.0, 1, 1e-3,
        info=info,
    )  # fmt: skip


def stored(number: int, **other: object) -> StoredSession:
    one = sessions.session_of_calibration(
        Path(f"/s/{number}"), calibration(0.1 * number), None
    )
    return replace(one, reduced=bytes([number % 256]) * 100, **other)  # type: ignore[arg-type]


def put(place: StoreLocation, *some: StoredSession) -> None:
    data = Database(place)
    for one in some:
        data.run(lambda db, one=one: sessions.store_session(db, one), write=True)  # type: ignore[misc]


def everything(place: StoreLocation, **wanted: str) -> list[StoredSession]:
    return Database(place).run(
        lambda db: sessions.find_sessions(db, wanted, documents=True, reduced=True)
    )


def test_a_session_comes_back_as_it_was(tmp_path: Path) -> None:
    levels = {"lot": "7", "station": "B"}
    one = stored(1, levels=levels, diagnosis={"verdict": "consistent"}, fingerprint="f")
    put(tmp_path / "h", one, stored(2))
    assert everything(tmp_path / "h", lot="7") == [one]
    assert everything(tmp_path / "h", lot="8") == []
    values, sigmas = sessions.parameter_values(everything(tmp_path / "h"), "acc_bias.x")
    np.testing.assert_allclose(np.sort(values), [0.1, 0.2])
    np.testing.assert_allclose(sigmas, 1e-3)


def test_a_failure_takes_no_result_away(tmp_path: Path) -> None:
    place = tmp_path / "h"
    put(place, stored(1), StoredSession("/s/1", fingerprint="g", error="is gone"))
    (kept,) = everything(place)
    assert kept.error == "is gone" and kept.result == stored(1).result
    put(place, StoredSession("/s/2", error="no"), stored(2), stored(1))
    assert [one.error for one in everything(place)] == [None, None]


@pytest.mark.parametrize("error_between", [False, True])
def test_a_session_whose_serial_number_was_corrected_is_one_unit(
    tmp_path: Path, error_between: bool
) -> None:
    place = tmp_path / "h"
    put(place, stored(1, serial="A-1"), stored(2))
    (first,) = History(place).runs("A-1")
    History(place).accept("A-1", first.number)
    between = [StoredSession("/s/1", error="no")] if error_between else []
    put(place, *between, stored(1))
    assert everything(place) == [stored(1), stored(2)]
    assert History(place).serials() == [("A1", 2, "")]
    runs = History(place).runs("A1")
    assert {r.session: r.accepted for r in runs} == {"/s/1": True, "/s/2": False}


def former_store(place: StoreLocation, rows: Sequence[tuple[object, ...]]) -> None:
    """A store before `recordings`; of each row serial, folder, accepted and result."""
    config = database._alembic_config()
    engine = Database(place)._engine(True)
    with engine.connect() as db, db.begin():
        config.attributes["connection"] = db  # type: ignore[attr-defined]
        command.upgrade(config, "sessions")  # type: ignore[arg-type]
        if db.dialect.name == "sqlite":
            db.exec_driver_sql("PRAGMA user_version = 2")
        table = SESSION.name
        columns = "serial, folder, accepted, result, software"
        names = ("serial", "folder", "accepted", "result")
        for row in rows:
            db.execute(
                text(
                    f"INSERT INTO {table} ({columns})"
                    " VALUES (:serial, :folder, :accepted, :result, '9')"
                ),
                dict(zip(names, row, strict=True)),
            )
        db.execute(text("INSERT INTO parameter (session, name, value, sigma, unit)"
                        f" SELECT id, 'x', 1, 1, '1' FROM {table}"))  # fmt: skip
    engine.dispose()


def check_migration(place: StoreLocation) -> None:
    results = [json.dumps(calibration(b).to_json()) for b in (0.1, 0.2, 0.3)]
    rows = [
        ("A-1", "/s/1", True, results[0]),
        ("A1", "/s/1", False, results[1]),
        ("", "/s/1", False, None),
        ("A1", "/s/2", False, results[2]),
    ]
    former_store(place, rows)
    runs = History(place).runs("A1")
    assert [(r.session, r.accepted) for r in runs] == [("/s/1", True), ("/s/2", False)]
    assert [r.calibration.value("acc_bias.x") for r in runs] == [0.2, 0.3]
    assert History(place).serials() == [("A1", 2, "")]
    data = Database(place)
    count = text("SELECT count(*) FROM parameter")
    assert data.run(lambda db: db.execute(count).scalar_one()) == 2
    again = update(SESSION).values(folder="/s/1")
    with pytest.raises(InputError, match=r"(?i)unique"):
        data.run(lambda db: db.execute(again), write=True)


def test_a_folder_that_is_stored_twice_already_is_one_session_again(
    tmp_path: Path,
) -> None:
    check_migration(tmp_path / "h")


PART = RecordedPart("5a", 0.0, 90.0)


def test_a_recording_in_two_folders_is_one_calibration(tmp_path: Path) -> None:
    """The last one stored counts; a part of it that it does not share is another."""
    place = tmp_path / "h"
    put(place, stored(1, part=PART), stored(2, part=replace(PART, start=90.0, end=180)))
    History(place).accept("A1", 1)
    put(place, stored(3, part=replace(PART, start=3.0)), stored(4, part=None))
    runs = History(place).runs("A1")
    assert {(r.session, r.accepted) for r in runs} == {
        ("/s/2", False), ("/s/3", True), ("/s/4", False)
    }  # fmt: skip
    assert History(place).serials() == [("A1", 3, "")]
    once = Database(place).run(lambda db: sessions.find_sessions(db, once=True))
    assert [one.folder for one in once] == ["/s/2", "/s/3", "/s/4"]
    assert len(everything(place)) == 4, "each folder has its result"
    put(place, stored(1, part=PART))
    assert {r.session for r in History(place).runs("A1")} == {"/s/1", "/s/2", "/s/4"}


def test_a_copy_without_a_serial_number_does_not_replace_its_device(
    tmp_path: Path,
) -> None:
    place = tmp_path / "h"
    put(place, stored(1, part=PART), stored(2, serial="", part=PART))
    assert [r.session for r in History(place).runs("A1")] == ["/s/1"]
    put(place, stored(3, serial="B1", part=PART))
    assert History(place).serials() == [("B1", 1, "")], "its number was corrected"
    put(place, StoredSession("/s/4", error="no", part=PART))
    assert History(place).serials() == [("B1", 1, "")], "an error replaces no result"


def test_a_session_that_is_withdrawn_leaves_its_copy(tmp_path: Path) -> None:
    """The copy that was replaced counts again, accepted as the deleted one was."""
    place = tmp_path / "h"
    later = replace(PART, start=90.0, end=180.0)
    put(place, stored(1, part=PART), stored(2, serial="", part=later), stored(5))
    put(place, stored(3, part=replace(PART, end=180.0)), stored(4, part=later))
    put(place, stored(3, part=replace(PART, end=180.0)))
    History(place).accept("A1", 4)
    assert {r.session for r in History(place).runs("A1")} == {"/s/3", "/s/5"}

    def withdrawn(*folders: str) -> dict[str, bool]:
        Database(place).run(lambda db: withdraw(db, folders), write=True)
        return {r.session: r.accepted for r in History(place).runs("A1")}

    found = withdrawn("/s/3", "/s/of nobody")
    assert found == {"/s/1": True, "/s/4": True, "/s/5": False}
    assert withdrawn("/s/2") == found, "it did not count"
    assert set(withdrawn("/s/5", "/s/4")) == {"/s/1"}
    assert len(everything(place)) == 1


def test_of_sessions_with_the_same_samples_the_first_is_used() -> None:
    """Added up, each of them would count as evidence of its own."""
    other = stored(2, part=replace(PART, digest="b7"))
    some = [stored(1, part=PART), other, stored(3, part=PART), stored(4), stored(5)]
    kept, left_out = sessions.without_repeats(some)
    assert [one.folder for one in kept] == ["/s/1", "/s/2", "/s/4", "/s/5"]
    assert [(one.folder, other.folder) for one, other in left_out] == [("/s/3", "/s/1")]


BEGUN = RecordedPart("5a", 0.0, 90.0, 9000, "run 7")
CONTINUED = RecordedPart("c3", 0.0, 150.0, 15000, "run 7")


@pytest.mark.parametrize("order", [(1, 2), (2, 1)])
def test_of_a_run_and_its_copy_made_before_it_was_continued_the_longer_counts(
    tmp_path: Path, order: tuple[int, int]
) -> None:
    place = tmp_path / "h"
    both = {1: stored(1, part=BEGUN), 2: stored(2, part=CONTINUED)}
    put(
        place,
        *(both[i] for i in order),
        stored(3, part=replace(BEGUN, digest="b7", run="r8")),
    )
    assert {r.session for r in History(place).runs("A1")} == {"/s/2", "/s/3"}
    data = Database(place)
    assert data.run(shorter_copies) == [("/s/1", "/s/2")]
    assert data.run(lambda db: shorter_copies(db, {"serial": "B1"})) == []
    assert data.run(replacing_folders) == {}, "it would not count if solved again"
    put(place, stored(4, serial="", part=replace(CONTINUED, samples=20000)))
    assert {r.session for r in History(place).runs("A1")} == {"/s/2", "/s/3"}
    data.run(lambda db: withdraw(db, ["/s/2", "/s/4"]), write=True)
    assert {r.session for r in History(place).runs("A1")} == {"/s/1", "/s/3"}


def test_of_a_run_and_its_copies_the_longer_is_used_in_its_place() -> None:
    later = stored(4, part=replace(CONTINUED, start=90.0))
    some = [stored(1, part=BEGUN), stored(2, part=CONTINUED), stored(3), later]
    kept, left_out = sessions.without_repeats(some)
    assert [one.folder for one in kept] == ["/s/2", "/s/3"]
    assert [(one.folder, other.folder) for one, other in left_out] == [
        ("/s/4", "/s/2"), ("/s/1", "/s/2"),
    ]  # fmt: skip


def test_the_screen_says_which_copy_does_not_count(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    place = tmp_path / "h"
    put(place, stored(1, part=BEGUN), stored(2, part=CONTINUED))
    said = "/s/1: is a copy of /s/2 with fewer samples, and does not count\n"
    assert main(["history", "A1", "--history", str(place)]) == 0
    assert capsys.readouterr().err == f"fieldcal history: {said}"
    main(["lot", "serial=A1", "--history", str(place)])
    assert f"fieldcal lot: {said}" in capsys.readouterr().err


def test_a_copy_of_a_session_is_not_what_it_is_compared_with(tmp_path: Path) -> None:
    put(tmp_path / "h", stored(1, part=PART), stored(2))
    runs = History(tmp_path / "h").runs("A1")
    part = replace(PART, end=60.0)
    assert len(earlier_runs(runs, Path("/s/9"), None)) == 2
    (other,) = earlier_runs(runs, Path("/s/9"), None, part)
    assert other.session == "/s/2"


def test_a_history_of_before_the_store_is_taken_over(tmp_path: Path) -> None:
    place = tmp_path / "h.sqlite"
    result = json.dumps(calibration().to_json())
    with closing(sqlite3.connect(place)) as db:
        db.executescript(FORMER)
        row = (7, "A1", "2026-03-01", "/s/1", 0, 1, 21.5, 50.0, 170.0, "9", result)
        db.execute(f"INSERT INTO run VALUES ({', '.join('?' * len(row))})", row)
        db.execute("INSERT INTO parameter VALUES (7, 'acc_bias.x', 0.2, 0.001, 'g')")
        db.commit()
    (run,) = History(place).runs("A1")
    assert run.number == 7 and run.go is False and run.accepted
    assert (run.temperature, run.latitude_deg, run.height_m) == (21.5, 50.0, 170.0)
    assert (run.taken_at, run.session, run.software) == ("2026-03-01", "/s/1", "9")
    np.testing.assert_array_equal(run.calibration.covariance, calibration().covariance)
    (one,) = everything(place)
    assert one.parameters == {"acc_bias.x": (0.2, 0.001, "g")}
    History(place).add("2026-03-02", Path("/s/2"), calibration())
    assert [r.number for r in History(place).runs("A1")] == [7, 8]
    with closing(sqlite3.connect(place)) as db:
        tables = {n for (n,) in db.execute("SELECT name FROM sqlite_master")}
        assert "run" not in tables and "run_parameter" not in tables


def test_migrations_make_the_tables_that_the_program_uses(tmp_path: Path) -> None:
    put(tmp_path / "h", stored(1))

    def columns(db: object) -> dict[str, set[str]]:
        look = inspect(db)
        return {t: {c["name"] for c in look.get_columns(t)}
                for t in METADATA.tables}  # fmt: skip

    made = Database(tmp_path / "h").run(columns)
    assert made == {
        name: {c.name for c in table.c} for name, table in METADATA.tables.items()
    }
    scripts = ScriptDirectory.from_config(database._alembic_config())  # type: ignore[arg-type]
    assert scripts.get_current_head() == database.LAST_MIGRATION


def write(place: StoreLocation, name: int) -> None:
    put(place, *(replace(stored(i), folder=f"/{name}/{i}") for i in range(6)))


def writers(place: StoreLocation, count: int) -> list[ForkServerProcess]:
    """Processes that write some sessions each."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([__name__])
    some = [context.Process(target=write, args=(place, n)) for n in range(count)]
    for one in some:
        one.start()
    return some


def ended(some: list[ForkServerProcess]) -> list[int | None]:
    for one in some:
        one.join()
    return [one.exitcode for one in some]


@pytest.mark.thorough
def test_eight_writers_at_once_lose_nothing(tmp_path: Path) -> None:
    some = writers(tmp_path / "h", 8)
    assert ended(some) == [0] * 8
    found = everything(tmp_path / "h")
    assert len(found) == 48
    assert all(len(f.parameters) == 2 and len(f.reduced or b"") == 100 for f in found)


FILLING = """
import resource, sys
sys.path[:0] = sys.argv[2:]
from test_store import put, stored
from fieldcal.core.errors import InputError
put(sys.argv[1], stored(0))
resource.setrlimit(resource.RLIMIT_FSIZE, (150_000, 150_000))
for i in range(1, 1000):
    try:
        put(sys.argv[1], stored(i))
    except InputError as error:
        sys.exit(f"{i}: {error}")
"""


@pytest.mark.thorough
def test_a_full_disk_leaves_what_was_there_and_nothing_half(tmp_path: Path) -> None:
    here = [str(folder) for folder in Path(__file__).parents[:3:2]]
    call = [sys.executable, "-c", FILLING, str(tmp_path / "h"), *here]
    told = subprocess.run(call, capture_output=True, text=True).stderr
    count = int(told.split(":")[0])
    assert count > 5 and "the history cannot be used" in told and "mend that" in told
    found = everything(tmp_path / "h")
    assert len(found) == count
    assert all(len(f.parameters) == 2 and f.reduced for f in found)
    put(tmp_path / "h", stored(count))
    assert len(everything(tmp_path / "h")) == count + 1


def test_a_word_that_is_no_condition_is_refused() -> None:
    assert filters.parse_filters(["lot=7", "since=2026"]) == {
        "lot": "7",
        "since": "2026",
    }
    for wrong in ("lot", "colour=red"):
        with pytest.raises(InputError, match="is no condition"):
            filters.parse_filters([wrong])


@pytest.mark.parametrize(
    ("word", "found"),
    [
        ("until=2026-9-30", [1, 2]),
        ("since=2026-9-30", [2, 3]),
        ("since=2026-10", [3]),
        ("until=2026-9", [1, 2]),
        ("until=2025", []),
        ("since=2026-09-30T14:00:00+02:00", [2, 3]),
        ("since=2026-09-30T12:00:01", [3]),
        ("until=2026-09-30T12:00", [1, 2]),
    ],
)
def test_dates_are_dates_however_they_are_written(
    tmp_path: Path, word: str, found: list[int]
) -> None:
    days = ("2026-02-01", "2026-09-30", "2026-11-01")
    some = [
        stored(i, taken_at=f"{day}T12:00:00+00:00") for i, day in enumerate(days, 1)
    ]
    put(tmp_path / "h", *some, stored(4))
    wanted = filters.parse_filters([word])
    assert [int(s.folder[3:]) for s in everything(tmp_path / "h", **wanted)] == found
    data = Database(tmp_path / "h")
    said = data.run(lambda db: sessions.untimed_sentence(db, wanted))
    assert said == "sessions of unknown time that are left out: 1"
    assert data.run(lambda db: sessions.untimed_sentence(db, {"serial": "A1"})) == ""


@pytest.mark.parametrize("value", ["November", "", "30.9.2026", "2026-13-01", "1-2-3"])
def test_what_is_no_date_is_said_to_be_none(value: str) -> None:
    with pytest.raises(InputError, match=f"since={value}: is no date .*write it as"):
        filters.parse_filters([f"since={value}"])


def test_an_address_that_is_none_is_said_without_its_password() -> None:
    with pytest.raises(InputError, match="is no address of a store"):
        everything("nothing://x/y")
    with pytest.raises(InputError, match="cannot be used") as told:
        everything("postgresql://lab:secret@127.0.0.1:1/imus")
    assert "secret" not in str(told.value) and str(told.value).isprintable()
    assert "); see that its server runs, or name another with" in str(told.value)


@pytest.mark.parametrize(
    "address",
    [
        "mysql://lab:secret@db/imu",
        "nothing://lab:secret@x/y",
        "postgresql://lab:se@cret@db:port/imu",
        "://lab:secret@db",
        "mysql://db/imu?user=lab&password=secret",
    ],
)
def test_no_password_of_an_address_that_is_not_understood_is_said(address: str) -> None:
    with pytest.raises(InputError, match="is no address of a store") as told:
        everything(address)
    assert "cret" not in str(told.value) and "***" in str(told.value)


@pytest.mark.parametrize("name", ["what?x=1.sqlite", "a#b", "100%25.sqlite", "a b&c"])
def test_a_file_of_any_name_is_written_and_read(tmp_path: Path, name: str) -> None:
    put(tmp_path / name, stored(1))
    assert (tmp_path / name).is_file() and everything(tmp_path / name) == [stored(1)]


def test_a_first_write_that_was_killed_leaves_an_empty_store(tmp_path: Path) -> None:
    killed = (
        "import os, signal, sys\nfrom fieldcal.history.database import Database\n"
        "Database(sys.argv[1]).run("
        "lambda db: os.kill(os.getpid(), signal.SIGKILL), write=True)"
    )
    subprocess.run([sys.executable, "-c", killed, str(tmp_path / "h")], check=False)
    assert (tmp_path / "h").exists()
    assert everything(tmp_path / "h") == [] and History(tmp_path / "h").serials() == []
    put(tmp_path / "h", stored(1))
    assert everything(tmp_path / "h") == [stored(1)]


def test_a_first_write_that_fails_leaves_an_empty_store(tmp_path: Path) -> None:
    with pytest.raises(ZeroDivisionError):
        Database(tmp_path / "h").run(lambda _: 1 // 0, write=True)
    assert everything(tmp_path / "h") == []


@pytest.mark.parametrize("write", [False, True])
def test_a_database_of_another_program_is_left_alone(
    tmp_path: Path, write: bool
) -> None:
    with closing(sqlite3.connect(tmp_path / "other")) as db:
        db.execute("CREATE TABLE urls (url TEXT)")
        db.commit()
    before = (tmp_path / "other").read_bytes()
    with pytest.raises(InputError, match="is no history of this version"):
        Database(tmp_path / "other").run(lambda _: None, write)
    assert (tmp_path / "other").read_bytes() == before


# -- a real PostgreSQL


def programs() -> Path:
    """Folder of PostgreSQL's programs, as Debian's package has it."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"))
    found += [Path(p) for p in [shutil.which("initdb")] if p]
    if not found:
        pytest.skip("PostgreSQL is not installed: apt install postgresql")
    if os.geteuid() == 0 and not shutil.which("runuser"):
        pytest.skip("PostgreSQL does not run as root, and there is no runuser")
    return found[-1].parent


class Server:
    """A PostgreSQL of its own in a folder, on a free port."""

    def __init__(self, folder: Path) -> None:
        self.programs, self.folder = programs(), folder
        with closing(socket.socket()) as probe:
            probe.bind(("127.0.0.1", 0))
            self.port = probe.getsockname()[1]
        self.place = f"postgresql://tester@127.0.0.1:{self.port}/postgres"
        self._call("initdb", "-U", "tester", "-A", "trust", "--no-sync", "--locale=C")

    def _call(self, name: str, *words: str) -> None:
        as_user = []
        if os.geteuid() == 0:
            ours = Path(tempfile.gettempdir()).resolve()
            for part in self.folder.resolve().parents:
                if ours in part.parents:  # the way there, however deep
                    part.chmod(0o755)
            shutil.chown(self.folder, "nobody")
            self.folder.chmod(0o700)
            as_user = ["runuser", "-u", "nobody", "--"]
        call = [*as_user, str(self.programs / name), "-D", str(self.folder), *words]
        subprocess.run(call, check=True, stdout=subprocess.DEVNULL, cwd="/")

    def start(self) -> None:
        # no socket in the folder: its name may be longer than a socket's can be
        options = f"-p {self.port} -c unix_socket_directories= "
        options += "-c listen_addresses=127.0.0.1"
        self._call("pg_ctl", "-w", "-s", "-l", str(self.folder / "log"),
                   "-o", options, "start")  # fmt: skip

    def stop(self) -> None:
        self._call("pg_ctl", "-w", "-s", "-m", "immediate", "stop")


@contextmanager
def running(folder: Path) -> Iterator[Server]:
    folder.mkdir()
    try:
        server = Server(folder)
        server.start()
    except subprocess.CalledProcessError as error:
        pytest.skip(f"no PostgreSQL can be started here: {error}")
    try:
        yield server
    finally:
        if (folder / "postmaster.pid").exists():
            server.stop()


@pytest.mark.thorough
def test_postgresql_restarted_among_eight_writers_loses_nothing(tmp_path: Path) -> None:
    pytest.importorskip("psycopg")
    with running(tmp_path / "pg") as server:
        put(server.place, stored(200))
        some = writers(server.place, 7)
        data = Database(server.place)
        for i in range(12):
            one = replace(stored(i), folder=f"/own/{i}")
            if i == 6:
                server.stop()
                back = threading.Timer(0.3, server.start)
                back.start()
            data.run(lambda db, one=one: sessions.store_session(db, one), write=True)  # type: ignore[misc]
        back.join()
        # writers that had not reached the server yet may have found it away
        codes = ended(some)
        found = everything(server.place)
        assert len([f for f in found if f.folder.startswith("/own/")]) == 12
        for n, code in enumerate(codes):
            whole = [f for f in found if f.folder.startswith(f"/{n}/")]
            assert len(whole) == 6 or code != 0
        assert all(len(f.parameters) == 2 and f.reduced for f in found)
        assert len({f.folder for f in found}) == len(found)
        assert History(server.place).runs("A1")[0].calibration.names


@pytest.mark.thorough
def test_a_store_on_a_server_is_migrated_as_well(tmp_path: Path) -> None:
    pytest.importorskip("psycopg")
    with running(tmp_path / "pg") as server:
        check_migration(server.place)
