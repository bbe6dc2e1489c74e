"""Working folders: one for every point, made, filled, read with care, and removed."""

import os
import shutil
import stat
import tempfile
from dataclasses import dataclass
from pathlib import Path

from .checks import plain_relative

MOST_READ = 64 * 2**20
"""Bytes that are read of one file."""

_TRIES = 10_000


class Unreadable(ValueError):
    """A file is missing, too large, no plain file, or outside its folder."""


def read_inside(folder: Path, name: str, most: int = MOST_READ) -> bytes:
    """The bytes of a plain file in `folder`.

    Parameters
    ----------
    folder : Path
    name : str
        Relative; it, and what links on the way point to, must lie inside `folder`.
    most : int
        Bytes allowed.

    Raises
    ------
    Unreadable
        If the file is missing, too large, a pipe or device, or elsewhere.
    """
    try:
        home = folder.resolve(strict=True)
        place = (home / plain_relative("the file name", name)).resolve(strict=True)
        if not place.is_relative_to(home):
            raise Unreadable(f"{name} leads out of its folder")
        # Not blocking: a pipe of that name would wait for a writer for ever.
        descriptor = os.open(place, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
        try:
            return _content(descriptor, name, most)
        finally:
            os.close(descriptor)
    except FileNotFoundError:
        raise Unreadable(f"there is no file {name}") from None
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle, before Python 3.13
        raise Unreadable(f"cannot read {name}: {getattr(error, 'strerror', None) or error}") from None


def _content(descriptor: int, name: str, most: int) -> bytes:
    status = os.fstat(descriptor)
    if not stat.S_ISREG(status.st_mode):
        raise Unreadable(f"{name} is no plain file")
    if status.st_size > most:
        raise Unreadable(f"{name} has {status.st_size} bytes; at most {most} are read")
    with os.fdopen(descriptor, "rb", closefd=False) as file:
        return file.read(most)


@dataclass(frozen=True)
class WorkFolder:
    """The folder of one try of one point; nobody else's, so that points can run side by side."""

    path: Path

    @classmethod
    def make(cls, root: str | None, name: str) -> "WorkFolder":
        """A new folder ``name-1``, or ``name-2`` if that is there already, in `root` or in a temporary place."""
        if root is None:
            return cls(Path(tempfile.mkdtemp(prefix=f"flexdoce-{name}-")).resolve())
        place = Path(root)
        place.mkdir(parents=True, exist_ok=True)
        for number in range(1, _TRIES):
            try:
                (place / f"{name}-{number}").mkdir(mode=0o700)
            except FileExistsError:
                continue
            return cls((place / f"{name}-{number}").resolve())
        raise OSError(f"{place} holds {_TRIES} folders of the point {name}; remove what is not needed")

    def write(self, name: str, text: str) -> None:
        """A new file, in a folder of its own if the name says so; never over another or through a link."""
        with os.fdopen(self.sink(name), "wb") as file:
            file.write(text.encode())

    def sink(self, name: str) -> int:
        """File descriptor of a new file, for a process to write to; the caller closes it."""
        place = self.path / plain_relative("the file name", name)
        place.parent.mkdir(parents=True, exist_ok=True)
        return os.open(place, os.O_WRONLY | os.O_CREAT | os.O_EXCL | os.O_NOFOLLOW, 0o600)

    def read(self, name: str) -> str:
        """A file as text; bytes that are no UTF-8 become question marks. :class:`Unreadable` as :func:`read_inside`."""
        return read_inside(self.path, name).decode("utf-8", errors="replace")

    def size(self, name: str) -> int:
        """Bytes in a file; 0 if there is none."""
        try:
            return (self.path / name).lstat().st_size
        except OSError:
            return 0

    def remove(self) -> None:
        """Remove the folder and all in it; links are removed, not followed. What cannot be removed stays."""
        shutil.rmtree(self.path, ignore_errors=True)
