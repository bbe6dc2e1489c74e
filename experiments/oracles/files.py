"""Oracles in files: ``path/to/file.py:name``. Whoever calls this trusts the file, for it is run.

The file's SHA-256 is part of the oracle, so that changed code never takes answers of the old one for its own.
"""

import hashlib
import sys
import traceback
from collections.abc import Mapping
from importlib.machinery import SourceFileLoader
from importlib.util import module_from_spec, spec_from_file_location
from pathlib import Path
from types import CodeType, ModuleType
from typing import Any, NamedTuple

from ..naming import suggestion
from .base import Oracle, told
from .command.folder import Unreadable, read_inside
from .foreign import oracle_class

LONGEST_CODE = 4 * 2**20
"""Bytes of a file that is loaded."""

DIGITS = 16
"""Hexadecimal digits of SHA-256 in :attr:`.Oracle.code`."""

_PREFIX = "flexdoce_oracle_"


class Place(NamedTuple):
    """A file, and what in it is meant."""

    file: str
    attribute: str


def is_file(name: str) -> bool:
    """Whether an oracle's name speaks of a file, rather than of an oracle that is known by name."""
    return any(mark in name for mark in ":/\\") or name.endswith(".py")


def split(name: str) -> Place:
    """File and attribute of ``path/to/file.py:name``; ``ValueError`` if it has another form."""
    file, colon, attribute = name.rpartition(":")
    if not colon or not file.endswith(".py") or not attribute.isidentifier():
        raise ValueError(
            f"{name!r} is not of the form path/to/file.py:name; one of an installed package goes by its name alone"
        )
    return Place(file, attribute)


def digest(content: bytes) -> str:
    """SHA-256 in hexadecimal digits."""
    return hashlib.sha256(content).hexdigest()


def load(name: str) -> type[Oracle]:
    """The class behind ``path/to/file.py:name``, its `code` and `origin` set. The file is run.

    The same content at the same place is run once in a process; other content makes another module.

    Raises
    ------
    ValueError
        With one sentence: no such file, the line where it fails, no such name, or what is wrong with the class.
    """
    place = split(name)
    path = Path(place.file).absolute()
    try:
        path = path.resolve()
        content = read_inside(path.parent, path.name, LONGEST_CODE)
    except (Unreadable, OSError, RuntimeError) as error:
        raise ValueError(f"{path}: {error}") from None
    module = _module(path, content)
    what = f"{place.attribute!r} in {path.name}"
    cls = oracle_class(what, _found(module, path, place.attribute))
    if cls.__module__ != module.__name__:  # imported by the file: what is noted below belongs to this file alone
        derive: Any = type(cls)
        cls = derive(cls.__name__, (cls,), {"__module__": module.__name__, "__doc__": cls.__doc__})
        setattr(module, place.attribute, cls)
    cls.code, cls.origin = digest(content)[:DIGITS], f"{path}:{place.attribute}"
    return cls


def _module(path: Path, content: bytes) -> ModuleType:
    """The file as a module under a name of its own, in ``sys.modules`` as dataclasses and pickle want it."""
    name = f"{_PREFIX}{digest(str(path).encode())[:8]}_{digest(content)[:DIGITS]}"
    if name in sys.modules:
        return sys.modules[name]
    loader = _Exactly.of(name, path, content)
    spec: Any = spec_from_file_location(name, path, loader=loader)
    module = sys.modules[name] = module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        raise ValueError(_trouble(error, path)) from error
    except BaseException:
        del sys.modules[name]
        raise
    return module


class _Exactly(SourceFileLoader):
    """Runs the bytes that were read and hashed: no second reading, and no bytecode of an older file."""

    content: bytes

    @classmethod
    def of(cls, name: str, path: Path, content: bytes) -> "_Exactly":
        loader = cls(name, str(path))
        loader.content = content
        return loader

    def get_code(self, fullname: str) -> CodeType:
        return compile(self.content, self.path, "exec", dont_inherit=True)


def _trouble(error: BaseException, path: Path) -> str:
    """What went wrong while the file was run, with the line in it."""
    if isinstance(error, SyntaxError) and error.filename == str(path):
        return f"{path}, line {error.lineno}: {error.msg}"
    lines = [f.lineno for f in traceback.extract_tb(error.__traceback__) if f.filename == str(path)]
    where = f"{path}, line {lines[-1]}" if lines else str(path)
    return f"{where}: {told(error)}{_beside(error, path)}"


def _beside(error: BaseException, path: Path) -> str:
    missing = getattr(error, "name", None) if isinstance(error, ModuleNotFoundError) else None
    if not missing or not (path.parent / f"{missing}.py").is_file():
        return ""
    return f"; {missing}.py lies beside it, but only installed packages are found: put both into one file or a package"


def _found(module: ModuleType, path: Path, name: str) -> object:
    """What the module calls `name`, or the oracle in it that calls itself so."""
    here: Mapping[str, object] = vars(module)
    if name in here:
        return here[name]
    ours = {
        k: v
        for k, v in here.items()
        if isinstance(v, type) and issubclass(v, Oracle) and v.__module__ == module.__name__
    }
    for cls in ours.values():
        if getattr(cls, "name", None) == name:
            return cls
    raise ValueError(f"{path} has no {name!r}{suggestion(name, ours) or '; it holds no oracle'}")
