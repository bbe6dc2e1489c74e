"""SQLite, and all that it may do wrong: the file of points opened, checked, brought up to date, read and written."""

import errno
import sqlite3
import time
import zlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from contextlib import closing, contextmanager
from pathlib import Path
from typing import NamedTuple

from .errors import InputError

FORMAT = 2
"""``user_version`` of the file; 0 is the table without wall time, worker and checksum."""

BUSY_SECONDS = 30.0
ASKED_AT_ONCE = 500  # SQLite allows at least 999 placeholders in a query
NETWORK = {"nfs", "nfs4", "cifs", "smb3", "smbfs", "9p", "fuse.sshfs", "lustre", "gpfs", "beegfs", "ceph", "afs"}
"""File systems that several machines mount: there a write-ahead log, which lives on shared memory, is not safe."""

OLD = {"key": "TEXT PRIMARY KEY", "oracle": "TEXT NOT NULL", "settings": "TEXT NOT NULL",
       "responses": "TEXT NOT NULL", "status": "TEXT NOT NULL", "reason": "TEXT NOT NULL"}  # fmt: skip
NEW = {"seconds": "REAL", "worker": "TEXT", "checksum": "INTEGER"}
TABLE = ", ".join(f"{name} {kind}" for name, kind in (OLD | NEW).items())


class Row(NamedTuple):
    """One point as it lies in the file; `seconds`, `worker` and `checksum` are None in rows of format 0."""

    key: str
    oracle: str
    settings: str
    responses: str
    status: str
    reason: str
    seconds: float | None = None
    worker: str | None = None
    checksum: int | None = None

    @property
    def digest(self) -> int:
        """CRC-32 of what the row says: SQLite notices a broken page, not a changed digit."""
        told = "\n".join((self.key, self.settings, self.responses, self.status, self.reason))
        return zlib.crc32(told.encode("utf-8", "replace"))

    def sealed(self) -> "Row":
        """The row with its checksum."""
        return self._replace(checksum=self.digest)


def connect(path: Path) -> sqlite3.Connection:
    """A connection whose commits are on the disk when they return; it waits for other writers."""
    db = sqlite3.connect(path, timeout=BUSY_SECONDS)
    db.execute("PRAGMA synchronous = FULL")
    return db


def prepared(path: Path, connected: Callable[[], sqlite3.Connection]) -> sqlite3.Connection:
    """A connection to a sound file of today's format, with a write-ahead log where that is possible.

    Raises
    ------
    sqlite3.DatabaseError
        If the file is no such database, is damaged, or cannot be written.
    """
    if not on_network(path):
        try:
            return _patiently(lambda: _opened(connected, "WAL"))
        except sqlite3.OperationalError as error:
            if code(error) in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED, sqlite3.SQLITE_FULL):
                raise
    return _patiently(lambda: _opened(connected, "DELETE"))


def _patiently(opened: Callable[[], sqlite3.Connection]) -> sqlite3.Connection:
    """Several tries: changing the journal does not wait for others by itself."""
    until = time.monotonic() + BUSY_SECONDS
    while True:
        try:
            return opened()
        except sqlite3.OperationalError as error:
            if code(error) not in (sqlite3.SQLITE_BUSY, sqlite3.SQLITE_LOCKED) or time.monotonic() > until:
                raise
        time.sleep(0.02)


def _opened(connected: Callable[[], sqlite3.Connection], journal: str) -> sqlite3.Connection:
    db = connected()
    try:
        if journal != "WAL":
            # A file left in WAL mode can be opened without shared memory only by one who has it alone.
            db.execute("PRAGMA locking_mode = EXCLUSIVE")
        # The mode is kept in the file: to set it where it is set already would only want a lock.
        if db.execute("PRAGMA journal_mode").fetchone()[0].upper() != journal:
            db.execute(f"PRAGMA journal_mode = {journal}")
        db.execute("PRAGMA locking_mode = NORMAL")
        _refuse_programs(db)
        found = db.execute("PRAGMA quick_check(1)").fetchone()[0]
        if found != "ok":
            raise sqlite3.DatabaseError(found.replace("\n", " ").strip("* "))
        _update(db)
    except BaseException:
        db.close()
        raise
    return db


def _update(db: sqlite3.Connection) -> None:
    """Make the table, or give an old one its new columns."""
    version = db.execute("PRAGMA user_version").fetchone()[0]
    if version > FORMAT:
        raise sqlite3.DatabaseError(f"its format {version} is that of a newer flexdoce")
    if version < FORMAT:
        with db:
            db.execute("BEGIN IMMEDIATE")
            db.execute(f"CREATE TABLE IF NOT EXISTS points ({TABLE})")
            there = _columns(db)
            for name in NEW.keys() - there:
                db.execute(f"ALTER TABLE points ADD COLUMN {name} {NEW[name]}")
            db.execute(f"PRAGMA user_version = {FORMAT}")
    if missing := [name for name in OLD | NEW if name not in _columns(db)]:
        raise sqlite3.DatabaseError(f"its table has no column {missing[0]!r}")


def _refuse_programs(db: sqlite3.Connection) -> None:
    """Refuse views and triggers: we make none, and a table that is a view may compute for ever."""
    found = db.execute("SELECT type, name FROM sqlite_master WHERE type IN ('view', 'trigger')").fetchone()
    if found:
        raise sqlite3.DatabaseError(f"it holds the {found[0]} {found[1]!r}, which is none of ours")


def _columns(db: sqlite3.Connection) -> set[str]:
    return {row[1] for row in db.execute("PRAGMA table_info(points)")}


def rows(db: sqlite3.Connection, keys: Sequence[str]) -> Iterator[Row]:
    """Rows of those keys that have one; ``ValueError`` for a row that is not as it was written."""
    for start in range(0, len(keys), ASKED_AT_ONCE):
        some = keys[start : start + ASKED_AT_ONCE]
        marks = ", ".join("?" * len(some))
        for found in db.execute(f"SELECT {', '.join(Row._fields)} FROM points WHERE key IN ({marks})", some):
            row = Row(*found)
            if row.checksum is not None and row.checksum != row.digest:
                raise ValueError(f"point {row.key[:8]} is not as it was written")
            yield row


def write(db: sqlite3.Connection, new: Iterable[Row]) -> None:
    """One transaction; a good answer is never replaced."""
    names, marks = ", ".join(Row._fields), ", ".join("?" * len(Row._fields))
    changes = ", ".join(f"{name} = excluded.{name}" for name in Row._fields if name != "key")
    with db:
        db.executemany(
            f"INSERT INTO points ({names}) VALUES ({marks}) "
            f"ON CONFLICT (key) DO UPDATE SET {changes} WHERE points.status <> 'ok'",
            [row.sealed() for row in new],
        )


def close(db: sqlite3.Connection, alone: bool) -> None:
    """Close; if `alone`, leave one file that any reader can open, without a log beside it."""
    try:
        if alone:
            db.execute("PRAGMA busy_timeout = 0")
            db.execute("PRAGMA journal_mode = DELETE")
    except sqlite3.Error:
        pass  # somebody reads it, or the disk is full: the log stays, and nothing is lost
    finally:
        db.close()


def oracles(db: sqlite3.Connection) -> dict[str, int]:
    """How many points there are of each oracle, version and parameters."""
    return dict(db.execute("SELECT oracle, COUNT(*) FROM points GROUP BY oracle"))


def counts(path: Path) -> dict[str, tuple[int, str]]:
    """By status: how many points, and the reason of the last; without writing anything.

    Raises
    ------
    InputError
        If the file cannot be read.
    """
    try:
        with _read_only(path) as db:
            query = "SELECT status, COUNT(*), MAX(rowid) FROM points GROUP BY status"
            last = {status: (n, row) for status, n, row in db.execute(query)}
            reason = "SELECT reason FROM points WHERE rowid = ?"
            told = {status: str(db.execute(reason, (row,)).fetchone()[0]) for status, (_, row) in last.items()}
            return {str(status): (n, told[status]) for status, (n, _) in last.items()}
    except sqlite3.Error as error:
        raise InputError(f"cannot read the point store {path}: {error}") from None


def keys(path: Path) -> frozenset[str]:
    """Keys of all points, without writing anything; ``InputError`` if the file cannot be read."""
    try:
        with _read_only(path) as db:
            return frozenset(key for (key,) in db.execute("SELECT key FROM points"))
    except sqlite3.Error as error:
        raise InputError(f"cannot read the point store {path}: {error}") from None


@contextmanager
def _read_only(path: Path) -> Iterator[sqlite3.Connection]:
    with closing(sqlite3.connect(f"{path.resolve().as_uri()}?mode=ro", uri=True, timeout=2.0)) as db:
        _refuse_programs(db)
        yield db


def code(error: sqlite3.Error) -> int:
    """SQLite's primary result code; 0 where there is none."""
    return getattr(error, "sqlite_errorcode", 0) & 0xFF


def translated(error: sqlite3.Error, path: Path) -> Exception:
    """The same trouble in words that the command line has: the disk's, or a damaged store."""
    if isinstance(error, sqlite3.ProgrammingError):
        return error
    told = {
        sqlite3.SQLITE_FULL: (errno.ENOSPC, "no space left on the device"),
        sqlite3.SQLITE_READONLY: (errno.EROFS, "it cannot be written"),
        sqlite3.SQLITE_PERM: (errno.EACCES, "it cannot be written"),
        sqlite3.SQLITE_IOERR: (errno.EIO, f"the disk refuses ({error})"),
        sqlite3.SQLITE_CANTOPEN: (errno.EIO, f"the disk refuses ({error})"),
        sqlite3.SQLITE_PROTOCOL: (errno.ENOLCK, f"file locks do not work there ({error})"),
        sqlite3.SQLITE_BUSY: (errno.EBUSY, f"another program has held it for {BUSY_SECONDS:g} s"),
        sqlite3.SQLITE_LOCKED: (errno.EBUSY, f"another program has held it for {BUSY_SECONDS:g} s"),
    }
    if code(error) in told:
        number, words = told[code(error)]
        return OSError(number, words, str(path))
    return InputError(f"the point store {path} is damaged ({error}); move it away or use --fresh")


def on_network(path: Path, mounts: Path = Path("/proc/self/mounts")) -> bool:
    """Whether `path` lies on a file system that several machines mount, as far as the system tells."""
    try:
        lines = mounts.read_text(encoding="utf-8", errors="replace").splitlines()
        place = path.resolve()
    except OSError:
        return False
    fields = [line.split(" ") for line in lines]
    found = [(len(f[1]), f[2]) for f in fields if len(f) > 2 and place.is_relative_to(f[1].replace("\\040", " "))]
    # Of two mounts on one place the later one is seen.
    return bool(found) and max(reversed(found), key=lambda mount: mount[0])[1] in NETWORK
