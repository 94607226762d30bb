"""Transactions on the store, in SQLite or PostgreSQL, whole or not at all.

Tables are made, and those of earlier versions brought up to date, where they are first
used. A server that goes away in the middle is waited for, and what was not committed is
done again.
"""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import TypeVar

from sqlalchemy import Connection, Engine, create_engine, event, inspect, text
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, DBAPIError, NoSuchModuleError, SQLAlchemyError
from sqlalchemy.pool import NullPool

from fieldcal.core.errors import InputError
from fieldcal.history.place import Place, is_address

HEAD = "sessions"
"""The last migration."""

OLDEST, NEWEST = 1, 2
"""user_version of a SQLite file before the first migration, and since."""

WAIT = 60.0
"""How long another program may hold the file, s."""

RETURNS = 60.0
"""How long a server that was there may be away, s."""

AGAIN = 0.5
"""Between two looks whether it is back, s."""

ENCODING = {"client_encoding": "utf8"}
"""Of a server whose tables are in no encoding texts would come as bytes."""

LOCK = 0x1F1E1DCA1
"""Number of the lock under which a server's tables are made."""

T = TypeVar("T")
Work = Callable[[Connection], T]


class _Outdated(Exception):
    """Tables must be made or brought up to date before they are read."""


class Database:
    """The store, opened when it is asked.

    Parameters
    ----------
    place : file, made when something is first written; or a database's address

    """

    def __init__(self, place: Place) -> None:
        self.place = place
        self._known = False

    @property
    def shown(self) -> str:
        """The place, without a password."""
        if not is_address(self.place):
            return str(self.place)
        return make_url(str(self.place)).render_as_string(hide_password=True)

    def done(self, work: Work[T], write: bool = False) -> T:
        """What some work in one transaction returns.

        Raises
        ------
        InputError
            If the store cannot be used; then nothing of the work is in it.

        """
        try:
            return self._while_away(work, write)
        except (NoSuchModuleError, ArgumentError, ImportError) as error:
            raise InputError(
                f"{self.place}: is no address of a store ({error}); write"
                " postgresql://user:password@host/name, which needs pip install"
                " 'fieldcal[fleet]', or name a file"
            ) from error
        except (SQLAlchemyError, OSError) as error:
            said = str(getattr(error, "orig", None) or error).strip()
            raise InputError(
                f"{self.shown}: the history cannot be used ({said}); mend that, move"
                " the file away, or name another with --history"
            ) from error

    def _while_away(self, work: Work[T], write: bool) -> T:
        """The same, where a server that was there may go and come back."""
        until = time.monotonic() + RETURNS
        while True:
            try:
                found = self._once(work, write)
            except DBAPIError as error:
                if (
                    not (_begins(error) or (self._known and _is_away(error)))
                    or time.monotonic() > until
                ):
                    raise
                time.sleep(AGAIN)
                continue
            self._known = is_address(self.place)
            return found

    def _once(self, work: Work[T], write: bool) -> T:
        try:
            return self._transaction(work, write)
        except _Outdated:
            return self._transaction(work, True)

    def _transaction(self, work: Work[T], write: bool) -> T:
        engine = self._engine(write)
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
            url = make_url(str(self.place))
            if url.drivername == "postgresql":
                url = url.set(drivername="postgresql+psycopg")
            more = {} if url.get_backend_name() == "sqlite" else ENCODING
            return create_engine(url, poolclass=NullPool, connect_args=more)
        path = Path(self.place)
        if write:
            path.parent.mkdir(parents=True, exist_ok=True)
        there = write or path.exists()
        name = f"sqlite:///{path}" if there else "sqlite://"
        made = create_engine(name, poolclass=NullPool, connect_args={"timeout": WAIT})
        event.listen(made, "connect", _plain)
        event.listen(made, "begin", _begun)
        return made

    def _prepare(self, db: Connection, may_make: bool) -> None:
        """Make the tables, or bring them up to date."""
        lite = db.dialect.name == "sqlite"
        if lite:
            version = db.exec_driver_sql("PRAGMA user_version").scalar_one()
            memory = not db.engine.url.database
            if version == NEWEST:
                return
            if version not in (0, OLDEST) or not (version or may_make or memory):
                self._refuse(f"version {version}")
            if not may_make and not memory:
                raise _Outdated
        else:
            if may_make:
                db.execute(text(f"SELECT pg_advisory_xact_lock({LOCK})"))
            version = _revision(db)
            if version == HEAD:
                return
            if version and version not in _revisions():
                self._refuse(f"revision {version}")
            if not may_make:
                raise _Outdated
        _upgrade(db)
        if lite:
            db.exec_driver_sql(f"PRAGMA user_version = {NEWEST}")

    def _refuse(self, found: str) -> None:
        raise InputError(
            f"{self.shown}: is no history of this version (found {found}); name"
            " another with --history"
        )


def _plain(connection: object, _record: object) -> None:
    """Let nobody but us begin transactions, those that make tables among them."""
    connection.isolation_level = None  # type: ignore[attr-defined]
    connection.execute("PRAGMA foreign_keys = ON")  # type: ignore[attr-defined]


def _begun(db: Connection) -> None:
    writes = db.get_execution_options().get("writes")
    db.exec_driver_sql("BEGIN IMMEDIATE" if writes else "BEGIN")


def _is_away(error: DBAPIError) -> bool:
    """Whether a server closed the connection, or takes none at the moment."""
    state = str(getattr(error.orig, "sqlstate", None) or "")
    return error.connection_invalidated or state in ("", "57P01")


def _begins(error: DBAPIError) -> bool:
    """Whether a server is there and takes no connection yet, or any more."""
    said = str(error.orig)
    return "database system is" in said and "FATAL" in said


def _revision(db: Connection) -> str:
    """The last migration that was carried out; empty before the first."""
    if not inspect(db).has_table("alembic_version"):
        return ""
    return str(db.execute(text("SELECT version_num FROM alembic_version")).scalar())


def _config() -> object:
    from alembic.config import Config

    config = Config()
    here = Path(__file__).parent / "migrations"
    config.set_main_option("script_location", str(here).replace("%", "%%"))
    config.set_main_option("path_separator", "os")
    return config


def _revisions() -> set[str]:
    """All migrations that there are."""
    from alembic.script import ScriptDirectory

    scripts = ScriptDirectory.from_config(_config())  # type: ignore[arg-type]
    return {one.revision for one in scripts.walk_revisions()}


def _upgrade(db: Connection) -> None:
    """Carry out the migrations that are missing, in the transaction that is open."""
    from alembic import command

    config = _config()
    config.attributes["connection"] = db  # type: ignore[attr-defined]
    command.upgrade(config, "head")  # type: ignore[arg-type]
