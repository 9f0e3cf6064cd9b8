"""The tables, and how a database is opened. SQLite by default, PostgreSQL by URL."""

from __future__ import annotations

from pathlib import Path

from sqlalchemy import Boolean, Column, Engine, Float, Integer, MetaData, String, Table, Text, create_engine, event
from sqlalchemy.engine import make_url
from sqlalchemy.exc import ArgumentError, SQLAlchemyError

from tryon_server.problems import problem_error

metadata = MetaData()

garments = Table(
    "garments",
    metadata,
    Column("id", String(64), primary_key=True),
    Column("name", String(200), nullable=False),
    Column("digest", String(64), nullable=False),  # sha256 of the pattern file
    Column("panel_count", Integer, nullable=False),
    Column("seam_count", Integer, nullable=False),
    Column("vertex_count", Integer, nullable=False),  # of the mesh that the check made
    Column("triangle_count", Integer, nullable=False),
    Column("area", Float, nullable=False),  # [m^2]
    Column("created", Float, nullable=False),  # [s] since 1970
)

readings = Table(  # how a garment that is a mesh is read
    "readings",
    metadata,
    Column("garment", String(64), primary_key=True),
    Column("reading", Text, nullable=False),  # JSON: units, up, rest_shape, notes
)

uploads = Table(  # motions, bodies and prints
    "uploads",
    metadata,
    Column("id", String(64), primary_key=True),
    Column("kind", String(50), nullable=False),
    Column("key", String(64), nullable=False, unique=True),  # sha256 of the file and of what was told about it
    Column("digest", String(64), nullable=False),  # sha256 of the file
    Column("created", Float, nullable=False),  # [s] since 1970
    Column("record", Text, nullable=False),  # JSON
)

wishes = Table(  # what a session was opened with besides
    "wishes",
    metadata,
    Column("session", String(64), primary_key=True),
    Column("wish", Text, nullable=False),  # JSON: size, body
)

outfits = Table(  # what a session wears, where that is not only the garment that it was opened with
    "outfits",
    metadata,
    Column("session", String(64), primary_key=True),
    Column("outfit", Text, nullable=False),  # JSON
)

finishes = Table(  # what sessions chose for the looks of their fabric
    "finishes",
    metadata,
    Column("session", String(64), primary_key=True),
    Column("dye", String(7)),
    Column("print", String(64)),
)

sessions = Table(
    "sessions",
    metadata,
    Column("id", String(64), primary_key=True),
    Column("garment", String(64), nullable=False),
    Column("motion", String(200)),
    Column("fabric", String(200), nullable=False),
    Column("preset", String(50), nullable=False),
    Column("created", Float, nullable=False),  # [s] since 1970
    Column("ended", Float),  # [s] since 1970
    Column("ending", String(500)),  # why it ended, for people
)

effects = Table(  # what is asked of those that act in sessions
    "effects",
    metadata,
    Column("session", String(64), primary_key=True),
    Column("wishes", Text, nullable=False),  # JSON
)

edits = Table(  # of the patterns that sessions wear
    "edits",
    metadata,
    Column("session", String(64), primary_key=True),
    Column("id", Integer, primary_key=True, autoincrement=False),  # counted in the session
    Column("edit", Text, nullable=False),  # JSON
    Column("mirror", Boolean, nullable=False),
    Column("specification", Text, nullable=False),  # JSON: the pattern that it made
    Column("made", Float, nullable=False),  # [s] since 1970
    Column("undone", Boolean, nullable=False),
)

waiting_edits = Table(  # changes of patterns, effects and outfits that were asked for and are not made yet
    "waiting_edits",
    metadata,
    Column("session", String(64), primary_key=True),
    Column("number", Integer, primary_key=True, autoincrement=False),  # counted in the session
    Column("change", Text, nullable=False),  # JSON
)


def open_database(url: str) -> Engine:
    """A connection pool on ``url`` with the tables in place.

    SQLite runs in write-ahead-log mode, so that a reader never waits for a writer, and waits up to 5 s for a lock.

    Raises:
        ProblemError: the URL is malformed, its driver is not installed or the database can't be reached.
    """
    shown = "URL"
    try:
        parsed = make_url(url)
        shown = parsed.render_as_string(hide_password=True)
        if parsed.get_backend_name() == "sqlite" and parsed.database:
            Path(parsed.database).parent.mkdir(parents=True, exist_ok=True)
        engine = create_engine(parsed, pool_pre_ping=True)
        if engine.dialect.name == "sqlite":
            event.listen(engine, "connect", _prepare_sqlite)
        metadata.create_all(engine)
    except (ArgumentError, ImportError, SQLAlchemyError, OSError) as error:
        raise problem_error(
            "database.unreachable",
            f"the database {shown} can't be opened: {str(error).splitlines()[0]}",
            "Correct TRYON_SERVER_DATABASE_URL, or unset it to use the embedded SQLite file",
        ) from error
    return engine


def _prepare_sqlite(connection: object, _record: object) -> None:
    cursor = connection.cursor()  # type: ignore[attr-defined]
    cursor.execute("PRAGMA journal_mode=WAL")
    cursor.execute("PRAGMA synchronous=NORMAL")
    cursor.execute("PRAGMA busy_timeout=5000")
    cursor.close()
