"""Transactions on the store, in SQLite or PostgreSQL.

Tables are created or migrated at first use. If a server becomes unavailable, the
transaction is repeated until it is available again, or `LONGEST_ABSENCE` has passed.
"""

from __future__ import annotations

import re
import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from sqlalchemy import Connection, Engine, create_engine, event, inspect, text
from sqlalchemy.engine import URL, make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, SQLAlchemyError
from sqlalchemy.pool import NullPool

from fieldcal.core.errors import InputError
from fieldcal.history.location import StoreLocation, is_address

LAST_MIGRATION = "runs"
"""The last migration."""

OLDER_VERSIONS, NEWEST_VERSION = (1, 2, 3), 4
"""user_version of a SQLite file that is migrated, and now."""

LOCK_TIMEOUT = 60.0
"""Longest wait for a file that another program has locked, s."""

LONGEST_ABSENCE = 60.0
"""Longest time for which a server may be unavailable, s."""

RETRY_INTERVAL = 0.5
"""Time between attempts, s."""

ENCODING = {"client_encoding": "utf8"}
"""Connection option: from a server without an encoding, texts would be bytes."""

LOCK = 0x1F1E1DCA1
"""Number of the advisory lock under which a server's tables are created."""

T = TypeVar("T")
Transaction = Callable[[Connection], T]


PASSWORD = re.compile(r"(?<=://)([^:/@\s]*):\S*@|(?<=password=)[^&\s]*")
"""Password in an address, also in one that is not understood."""


class _Outdated(Exception):
    """Tables must be migrated before they are read."""


class _Empty(Exception):
    """Nothing was ever stored: the first write was killed, or failed."""


class Database:
    """The store; opened for each transaction.

    Parameters
    ----------
    place : path of a file, created at the first write; or the address of a database

    """

    def __init__(self, place: StoreLocation) -> None:
        self.place = place
        self._known = False

    @property
    def location_text(self) -> str:
        """Location of the store, without a password."""
        return _without_password(str(self.place))

    def run(self, work: Transaction[T], write: bool = False) -> T:
        """Result of `work`, carried out in one transaction.

        Raises
        ------
        InputError
            If the store cannot be used; then nothing of `work` is stored.

        """
        try:
            return self._while_away(work, write)
        except (NoSuchModuleError, ArgumentError, ImportError) as error:
            raise InputError(
                f"{self.location_text}: is no address of a store"
                f" ({_without_password(str(error))}); write"
                " postgresql://user:password@host/name, which needs pip install"
                " 'fieldcal[fleet]', or name a file"
            ) from error
        except (SQLAlchemyError, OSError) as error:
            said = " ".join(str(getattr(error, "orig", None) or error).split())
            mend = "mend that, move the file away, or name another with --history"
            if is_address(self.place):
                mend = "see that its server runs, or name another with --history"
            raise InputError(
                f"{self.location_text}: the history cannot be used ({said}); {mend}"
            ) from error

    def _while_away(self, work: Transaction[T], write: bool) -> T:
        """As `run`, repeated while a server that was available is not."""
        until = time.monotonic() + LONGEST_ABSENCE
        while True:
            try:
                found = self._once(work, write)
            except DBAPIError as error:
                if (
                    not (_is_starting(error) or (self._known and _is_away(error)))
                    or time.monotonic() > until
                ):
                    raise
                time.sleep(RETRY_INTERVAL)
                continue
            self._known = is_address(self.place)
            return found

    def _once(self, work: Transaction[T], write: bool) -> T:
        try:
            return self._transaction(self._engine(write), work, write)
        except _Outdated:
            return self._transaction(self._engine(True), work, True)
        except _Empty:
            return self._transaction(_sqlite_engine(None), work, False)

    def _transaction(self, engine: Engine, work: Transaction[T], write: bool) -> T:
        try:
            with engine.connect() as db:
                db = db.execution_options(writes=write)
                with db.begin():
                    self._prepare(db, write)
                    return work(db)
        finally:
            engine.dispose()

    def _engine(self, write: bool) -> Engine:
        if is_address(self.place):
            try:
                url = make_url(str(self.place))
            except ValueError as error:  # a port that is no number
                raise ArgumentError(str(error)) from error
            if url.drivername == "postgresql":
                url = url.set(drivername="postgresql+psycopg")
            more = {} if url.get_backend_name() == "sqlite" else ENCODING
            return create_engine(url, poolclass=NullPool, connect_args=more)
        path = Path(self.place)
        if write:
            path.parent.mkdir(parents=True, exist_ok=True)
        return _sqlite_engine(path if write or path.exists() else None)

    def _prepare(self, db: Connection, may_make: bool) -> None:
        """Create the tables, or migrate them."""
        lite = db.dialect.name == "sqlite"
        if lite:
            version = db.exec_driver_sql("PRAGMA user_version").scalar_one()
            if version == NEWEST_VERSION:
                return
            foreign = version == 0 and inspect(db).get_table_names()
            if foreign or version not in (0, *OLDER_VERSIONS):
                self._refuse(f"version {version}")
            if not may_make and db.engine.url.database:
                raise _Outdated if version else _Empty
        else:
            if may_make:
                db.execute(text(f"SELECT pg_advisory_xact_lock({LOCK})"))
            version = _revision(db)
            if version == LAST_MIGRATION:
                return
            if version and version not in _revisions():
                self._refuse(f"revision {version}")
            if not may_make:
                raise _Outdated
        _upgrade(db)
        if lite:
            db.exec_driver_sql(f"PRAGMA user_version = {NEWEST_VERSION}")

    def _refuse(self, found: str) -> None:
        raise InputError(
            f"{self.location_text}: is no history of this version (found {found}); name"
            " another with --history"
        )


def _without_password(text: str) -> str:
    """Text with the passwords of addresses hidden.

    >>> _without_password("mysql://lab:s3c@ret@db/imu?password=x&a=b")
    'mysql://lab:***@db/imu?password=***&a=b'
    """
    return PASSWORD.sub(lambda m: f"{m[1]}:***@" if m[1] is not None else "***", text)


def _sqlite_engine(path: Path | None) -> Engine:
    """Engine of a SQLite file; None is an empty store in memory."""
    made = create_engine(
        URL.create("sqlite", database=None if path is None else str(path)),
        poolclass=NullPool,
        connect_args={"timeout": LOCK_TIMEOUT},
    )
    event.listen(made, "connect", _configure_connection)
    event.listen(made, "begin", _begin)
    return made


def _configure_connection(connection: object, _record: object) -> None:
    """Disable the driver's own transactions; also creating tables belongs to ours."""
    connection.isolation_level = None  # type: ignore[attr-defined]
    connection.execute("PRAGMA foreign_keys = ON")  # type: ignore[attr-defined]


def _begin(db: Connection) -> None:
    writes = db.get_execution_options().get("writes")
    db.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _is_away(error: DBAPIError) -> bool:
    """Whether a server closed the connection, or accepts none at the moment."""
    state = str(getattr(error.orig, "sqlstate", None) or "")
    return error.connection_invalidated or state in ("", "57P01")


def _is_starting(error: DBAPIError) -> bool:
    """Whether a server is starting or shutting down."""
    said = str(error.orig)
    return "database system is" in said and "FATAL" in said


def _revision(db: Connection) -> str:
    """The last migration of the tables; empty before the first."""
    if not inspect(db).has_table("alembic_version"):
        return ""
    return str(db.execute(text("SELECT version_num FROM alembic_version")).scalar())


def _alembic_config() -> object:
    from alembic.config import Config

    config = Config()
    here = Path(__file__).parent / "migrations"
    config.set_main_option("script_location", str(here).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config


def _revisions() -> set[str]:
    """Names of all migrations."""
    from alembic.script import ScriptDirectory

    scripts = ScriptDirectory.from_config(_alembic_config())  # type: ignore[arg-type]
    return {one.revision for one in scripts.walk_revisions()}


def _upgrade(db: Connection) -> None:
    """Carry out the missing migrations in the open transaction."""
    from alembic import command

    config = _alembic_config()
    config.attributes["connection"] = db  # type: ignore[attr-defined]
    command.upgrade(config, "head")  # type: ignore[arg-type]
