"""A SQL database by its URL: SQLite in a file of this machine, or a PostgreSQL server that several machines share.

Service and worker open the job database with it. No message contains the password of a URL.
"""

import sqlite3
import time
from contextlib import suppress
from pathlib import Path

from sqlalchemy import URL, Engine, create_engine, event, make_url, text
from sqlalchemy.exc import IntegrityError, SQLAlchemyError

from slipstick.errors import InvalidValue

_POSTGRESQL = ("postgresql", "postgres")
_LONGEST_REASON = 300
_FORMS = "Write sqlite:///FOLDER/FILE.sqlite or postgresql://USER:PASSWORD@HOST:PORT/DATABASE"
# A host that vanished without closing its connections is noticed within 15 s, and its locks are free after that.
_CONNECTION = {"connect_timeout": 5, "keepalives_idle": 5, "keepalives_interval": 2, "keepalives_count": 5,
               "tcp_user_timeout": 15_000}


@event.listens_for(Engine, "connect")
def _prepare_sqlite(connection: object, _: object) -> None:
    if isinstance(connection, sqlite3.Connection):
        # DBOS calls `unixepoch` with subsecond precision, which SQLite supports from version 3.42 on.
        connection.create_function("unixepoch", -1, lambda *_: time.time())
        connection.execute("PRAGMA busy_timeout=30000")
        connection.execute("PRAGMA journal_mode=WAL")


def create_tables(engine: Engine, *statements: str) -> None:
    """Create tables by statements CREATE TABLE IF NOT EXISTS, also while another process does."""
    for statement in statements:
        with suppress(IntegrityError), engine.begin() as connection:  # PostgreSQL: both at the same moment
            connection.execute(text(statement))


def is_server(url: str) -> bool:
    """Whether the database is a PostgreSQL server; raises `InvalidValue` for any other URL that is not of SQLite."""
    return _parse_url(url).get_backend_name() == "postgresql"


def shown(url: str) -> str:
    """The URL with asterisks for the password; raises `InvalidValue`."""
    parsed = _parse_url(url)
    # The query may contain a password as well.
    return parsed.set(drivername=parsed.get_backend_name(), query={}).render_as_string(hide_password=True)


def file_of(url: str) -> Path | None:
    """The file of a SQLite database; None for a server."""
    parsed = _parse_url(url)
    return Path(str(parsed.database)) if parsed.get_backend_name() == "sqlite" else None


def open_database(url: str) -> Engine:
    """Connect to the database; raises `InvalidValue` if it cannot be reached.

    The folder of a SQLite file is made if it does not exist. The engine notices connections that a restarted server
    has closed, and opens new ones.
    """
    parsed, path = _parse_url(url), file_of(url)
    if path:
        path.parent.mkdir(parents=True, exist_ok=True)
        engine = create_engine(parsed)
    else:
        engine = create_engine(parsed, pool_pre_ping=True, connect_args=_CONNECTION)
    try:
        with engine.connect():
            return engine
    except SQLAlchemyError as error:
        reason = " ".join(str(getattr(error, "orig", error)).split())[:_LONGEST_REASON].rstrip(".?")
        raise InvalidValue(f"The job database {shown(url)} cannot be opened: {reason}",
                           "Check the address, that the server runs, and user and password") from None


def clock(engine: Engine) -> str:
    """SQL expression of the time of the database in s, because the clocks of several machines differ."""
    return "extract(epoch from clock_timestamp())" if engine.dialect.name == "postgresql" else "unixepoch('subsec')"


def _parse_url(url: str) -> URL:
    try:
        parsed = make_url(url)
    except (SQLAlchemyError, ValueError):  # whose messages quote parts of the URL
        raise InvalidValue("The URL of the job database is not valid", _FORMS) from None
    if parsed.drivername.partition("+")[0] in _POSTGRESQL:
        return parsed.set(drivername="postgresql+psycopg")
    if parsed.get_backend_name() != "sqlite":
        raise InvalidValue(f"The job database cannot be of the kind '{parsed.drivername[:50]}'", _FORMS)
    if parsed.database in (None, "", ":memory:"):  # which only one process would see
        raise InvalidValue("The job database has no file", _FORMS)
    return parsed
