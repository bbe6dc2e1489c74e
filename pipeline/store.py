"""The run folder: the only place, with the runner, that touches the disk."""

import shutil
from collections.abc import Sequence
from pathlib import Path, PurePath
from types import TracebackType
from typing import ClassVar, Self

from experiments.oracles import Oracle
from experiments.runs import Status

from .config import Config, differences, dump_config, load_config
from .errors import InputError
from .lock import LOCK, FolderLock, flushed
from .log import LOG
from .points import PointStore

CONFIG, POINTS, STATE = "config.toml", "points.sqlite", "state.json"
WORK = "work"
"""Where a program that is run as an oracle works, a folder a point."""
OURS = (
    "provenance.json", POINTS, f"{POINTS}-journal", f"{POINTS}-wal", f"{POINTS}-shm", "model.json", "report.html",
    "command.json", "oracle.json", "oracle.py", STATE, LOG, "screening", "fit", "validation", "inversion", "exports",
    WORK,
)  # fmt: skip
FOLDERS = ("screening", "fit", "validation", "inversion", "exports", WORK)
MOST_READ = 256 * 2**20
"""Bytes of a file of the folder that are read back."""

LEFT_OVER = {LOCK, LOG, STATE, f"{STATE}.partial", f"{CONFIG}.partial"}
"""What a run leaves that was killed before its folder had a config."""

SWEEP, TABLE, PAGE, CACHE = "sweep.toml", "sweep.csv", "sweep.html", "cache"
"""What a sweep's folder holds beside its members."""


class RunFolder:
    """A run folder that belongs to one config.

    Parameters
    ----------
    path : Path
        Use :meth:`claim` or :meth:`existing` to get one.
    """

    kind: ClassVar[str] = "run folder"
    config_name: ClassVar[str] = CONFIG
    ours: ClassVar[tuple[str, ...]] = OURS
    left_over: ClassVar[frozenset[str]] = frozenset(LEFT_OVER)

    def __init__(self, path: Path) -> None:
        self.path = path
        self.lock: FolderLock | None = None

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: type[BaseException] | None, error: BaseException | None, at: TracebackType | None) -> None:
        if self.lock is not None:
            self.lock.release()

    @classmethod
    def claim(cls, path: Path, config: Config, fresh: bool = False) -> Self:
        """The folder for `config`: new, or continued if it holds the same config; emptied of our files if `fresh`.

        It is locked until the context that it is ends.

        Raises
        ------
        InputError
            If the folder holds something else, belongs to another config, is being run in, or cannot be written;
            nothing is touched then.
        """
        folder = cls(path)
        try:
            folder._refuse(config, fresh)
            path.mkdir(parents=True, exist_ok=True)
            folder.lock = FolderLock(path)
            # Another run may have come and gone since.
            folder._take(config, fresh, folder._owner(config, fresh))
        except OSError as error:
            folder.__exit__(None, None, None)
            raise InputError(f"cannot use the output folder {path}: {error.strerror}") from None
        except BaseException:
            folder.__exit__(None, None, None)
            raise
        return folder

    @classmethod
    def check(cls, path: Path, config: Config, fresh: bool = False) -> None:
        """Whether :meth:`claim` would give the folder, but for its lock; ``InputError`` if not. Touches nothing."""
        try:
            cls(path)._refuse(config, fresh)
        except OSError as error:
            raise InputError(f"cannot use the output folder {path}: {error.strerror}") from None

    def _refuse(self, config: Config, fresh: bool) -> None:
        self._refuse_odd_files((LOCK, self.config_name, *(() if fresh else self.ours)))
        self._owner(config, fresh)

    def _refuse_odd_files(self, names: Sequence[str]) -> None:
        """Refuse links, pipes and the like where our files lie: a run writes in its own folder, and nowhere else."""
        for place in (self.path / name for name in names):
            if place.is_symlink():
                raise InputError(_linked(place))
            if place.exists() and not (place.is_dir() if place.name in FOLDERS else place.is_file()):
                raise InputError(f"{place} is no plain {'folder' if place.name in FOLDERS else 'file'}: move it away")

    def _owner(self, config: Config, fresh: bool) -> Config | None:
        """The config that the folder belongs to, if it does; ``InputError`` if `config` cannot have it."""
        path = self.path
        if path.exists() and not path.is_dir():
            raise InputError(f"the output folder {path} is a file; name a folder with --out")
        if not path.is_dir() or {p.name for p in path.iterdir()} <= self.left_over:
            return None
        if not (path / self.config_name).is_file():
            raise InputError(f"the folder {path} is not empty and is no {self.kind}; name another with --out")
        owner = load_config(path / self.config_name)
        keys = differences(owner, config)
        if keys and not fresh:
            raise InputError(
                f"the folder {path} belongs to another config (different: {', '.join(keys)}); "
                "name another with --out, or start it anew with --fresh"
            )
        return owner

    def _take(self, config: Config, fresh: bool, owner: Config | None) -> None:
        if fresh:
            for name in self.ours:
                self.discard(name)
        if owner is None or differences(owner, config):
            # A config.toml that says the same stays as it is: somebody may have written it by hand.
            self.write(self.config_name, dump_config(config))

    @classmethod
    def existing(cls, path: Path) -> tuple[Self, Config]:
        """A run folder that is there already, with its config; ``InputError`` if it is none."""
        if not (path / cls.config_name).is_file():
            raise InputError(f"{path} is not a {cls.kind}: it has no {cls.config_name}")
        if (path / cls.config_name).is_symlink():
            raise InputError(_linked(path / cls.config_name))
        return cls(path), load_config(path / cls.config_name)

    @property
    def taken_over(self) -> str:
        """Whose lock was found in the folder without anybody holding it; empty if nobody's."""
        before = self.lock.before if self.lock else None
        return (
            f"the lock of {before} was left behind: that process is gone, and its lock was taken over" if before else ""
        )

    def inside(self, name: str) -> Path:
        """Where a file or folder of ours lies; ``InputError`` if a link on the way leads elsewhere."""
        target, parts = self.path / name, PurePath(name).parts
        if PurePath(name).is_absolute() or ".." in parts:
            raise ValueError(f"{name!r} is not inside of the folder")
        for place in (self.path.joinpath(*parts[: i + 1]) for i in range(len(parts))):
            # A link in place of a file is replaced, not followed.
            if place.is_symlink() and (place != target or place.is_dir()):
                raise InputError(_linked(place))
        return target

    def write(self, name: str, text: str, durable: bool = True) -> Path:
        """Write a file of the folder whole: a reader never sees half of it, nor does the next run after a power cut."""
        target = self.inside(name)
        target.parent.mkdir(parents=True, exist_ok=True)
        partial = target.with_name(target.name + ".partial")
        if partial.is_symlink():
            partial.unlink()
        partial.write_text(text, encoding="utf-8", newline="\n")
        if durable:
            flushed(partial)
        partial.replace(target)
        return target

    def peek(self, name: str) -> str:
        """Read a file of the folder; empty if it is missing or unreadable."""
        try:
            return self.read(name)
        except InputError:
            return ""

    def read(self, name: str) -> str:
        """Read a file of the folder; ``InputError`` that says what to do if it is missing, or no plain file in it."""
        try:
            place = (self.path / name).resolve(strict=True)
            if not place.is_relative_to(self.path.resolve()):
                raise InputError(_linked(self.path / name))
            # A pipe of that name would be waited for without end.
            if not place.is_file() or place.stat().st_size > MOST_READ:
                raise InputError(f"{self.path / name} is no plain file of at most {MOST_READ} bytes")
            return place.read_text(encoding="utf-8")
        except (OSError, RuntimeError, UnicodeDecodeError):  # RuntimeError: links in a circle
            raise InputError(f"{self.path / name} is missing or unreadable: run the study again") from None

    def discard(self, name: str) -> None:
        """Remove a file or folder of ours, if it is there."""
        target = self.path / name
        if target.is_dir() and not target.is_symlink():
            shutil.rmtree(target)
        else:
            target.unlink(missing_ok=True)

    def points(self, oracle: Oracle, cache: Path | None = None, retry: Sequence[Status] = ()) -> PointStore:
        """The store of evaluated points for `oracle`.

        Parameters
        ----------
        oracle : Oracle
        cache : Path, optional
            Folder of points that studies share; it is made if it is not there.
        retry : collection of Status
            Failures that are tried again.

        Raises
        ------
        InputError
            If a store is damaged or cannot be used.
        """
        shared = None
        if cache is not None:
            try:
                cache.mkdir(parents=True, exist_ok=True)
            except OSError as error:
                raise InputError(f"cannot use the cache {cache}: {error.strerror}; name a folder") from None
            if (cache / POINTS).is_symlink():
                raise InputError(_linked(cache / POINTS))
            shared = PointStore(cache / POINTS, oracle, shared=True)
        try:
            return PointStore(self.path / POINTS, oracle, shared, retry)
        except BaseException:
            if shared is not None:
                shared.close()
            raise


class SweepFolder(RunFolder):
    """The folder of a sweep: the config with its grid, a run folder for each member, and what compares them."""

    kind = "sweep's folder"
    config_name = SWEEP
    ours = (TABLE, PAGE)
    left_over = frozenset({LOCK, f"{SWEEP}.partial"})

    @classmethod
    def is_at(cls, path: Path) -> bool:
        """Whether a sweep's folder lies there."""
        return (path / cls.config_name).is_file()

    def note(self, config: Config) -> None:
        """Keep the grid of this time: another value added to a key makes no other sweep."""
        if self.peek(SWEEP) != dump_config(config):
            self.write(SWEEP, dump_config(config))


def _linked(place: Path) -> str:
    return f"{place} is a link: a run folder holds its own files; remove the link, or move what it points to there"
