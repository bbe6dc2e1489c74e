"""An oracle in a file beside the config: which file that is, and what a run folder says of it afterwards.

Nothing here runs the file. A run folder gets a note (`NOTE`: where the file lay, its SHA-256, what the oracle says of
itself) and a copy of the file to read (`COPY`), which is never run.
"""

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from experiments.oracles import Oracle, Recorded, described
from experiments.oracles.command.checks import plain_relative
from experiments.oracles.command.folder import Unreadable, read_inside
from experiments.oracles.files import DIGITS, LONGEST_CODE, Place, digest, is_file, split

from .config import Config
from .errors import InputError
from .store import RunFolder

NOTE, COPY = "oracle.json", "oracle.py"


@dataclass(frozen=True)
class Code:
    """A file that a run would load.

    Parameters
    ----------
    file, attribute : str
        As the config names them.
    home : Path
        Folder that `file` is relative to, absolute, links resolved.
    text : str
    sha256 : str
        Of the file, all 64 digits.
    """

    file: str
    attribute: str
    home: Path
    text: str
    sha256: str

    @property
    def path(self) -> Path:
        """Where it lies, absolute, links resolved."""
        return (self.home / self.file).resolve()

    @property
    def name(self) -> str:
        """What ``oracles.get`` takes."""
        return f"{self.path}:{self.attribute}"

    @property
    def code(self) -> str:
        """The digits that the oracle carries."""
        return self.sha256[:DIGITS]


def code_of(config: Config) -> Code | None:
    """The file that the config's oracle lies in, read and hashed but not run; None if it goes by name alone.

    It is looked for below the config's folder. For the config of a run folder also where it lay when the study was run,
    as the folder's note says: there only if it has not changed since.

    Raises
    ------
    InputError
        If the path is not allowed, leads out of the folder, or there is no such file.
    """
    name = config.oracle.name
    if not is_file(name):
        return None
    if config.home is None:
        raise InputError(f"oracle.name: {name!r} is relative to a config's folder, and this config is from no file")
    try:
        place = split(name)
        plain_relative("the path", place.file)
        try:
            return _read(config.home, place)
        except Unreadable as error:
            return _elsewhere(config.home, place, str(error))
    except ValueError as error:
        raise InputError(f"oracle.name: {error}") from None


def not_loaded(code: Code) -> list[str]:
    """What ``flexdoce check`` says instead of loading a file, a line each."""
    return [
        "",
        f"Nothing was loaded. A run would run this file, and take {code.attribute!r} from it:",
        f"{code.path}",
        f"SHA-256 {code.sha256}",
        "Not checked: what it holds, and with it factors, parameters and designs; flexdoce check --load does that.",
    ]


def noted(folder: RunFolder, oracle: Oracle, code: Code | None) -> list[str]:
    """Note in a claimed run folder where somebody's own oracle is from; what the log says of it, a line each."""
    if code is None:
        return [f"the oracle {oracle.name} is from {oracle.origin}"] if oracle.origin else []
    before = noted_sum(folder.path)
    folder.write(NOTE, _text(code, oracle, folder.path))
    folder.write(COPY, code.text)
    told = [f"the oracle {oracle.name} was loaded from {code.path}, SHA-256 {code.sha256}"]
    return told + ([f"that file has changed: its SHA-256 was {before}"] if before not in ("", code.sha256) else [])


def _text(code: Code, oracle: Oracle, folder: Path) -> str:
    """``oracle.json``: where the code lay, seen from everywhere and from the run folder, and what the oracle says."""
    document = {
        "file": code.file,
        "sha256": code.sha256,
        "folder": str(code.home),
        "from_here": os.path.relpath(code.home, folder.resolve()),
        "oracle": described(oracle),
    }
    return json.dumps(document, indent=2, ensure_ascii=False) + "\n"


def noted_sum(folder: Path) -> str:
    """SHA-256 of the code that a run folder's answers were got with; empty if its note does not say."""
    found = _note(folder).get("sha256")
    return found if isinstance(found, str) else ""


def recorded(folder: Path) -> Oracle:
    """The oracle as a run folder describes it, without its code.

    Raises
    ------
    InputError
        If the note is missing or damaged.
    """
    try:
        return Recorded(_note(folder).get("oracle", {}))
    except ValueError as error:
        raise InputError(f"{folder / NOTE} is missing or damaged: {error}; run the study again") from None


def unchanged(config: Config, folder: Path) -> None:
    """Refuse code that is not what the folder's answers were got with; :class:`InputError` says what to do."""
    code, before = code_of(config), noted_sum(folder)
    if code is not None and code.sha256 != before:
        raise InputError(
            f"{code.path} is not the code of this run (SHA-256 {code.code}…, was {before[:DIGITS] or '?'}…): put the "
            f"copy {folder / COPY} back, or run the study again"
        )


def _read(folder: Path, place: Place) -> Code:
    file, attribute = place
    content = read_inside(folder, file, LONGEST_CODE)
    try:
        text = content.decode("utf-8")
    except UnicodeDecodeError:
        raise ValueError(f"{file} is not UTF-8 text") from None
    return Code(file, attribute, folder.resolve(), text, digest(content))


def _note(folder: Path) -> dict[str, Any]:
    try:
        found = json.loads(read_inside(folder, NOTE, LONGEST_CODE))
    except (ValueError, RecursionError):
        return {}
    return found if isinstance(found, dict) else {}


def _elsewhere(home: Path, wanted: Place, trouble: str) -> Code:
    """The code where the note of a run folder says that it lay, if it is the same; else refuse."""
    note, changed = _note(home), []
    for place in (home / str(note.get("from_here", ".")), Path(str(note.get("folder", home)))):
        try:
            code = _read(place, wanted)
        except ValueError:
            continue
        if code.sha256 == note.get("sha256"):
            return code
        changed.append(code)
    if not note:
        raise InputError(f"oracle.name: {trouble} in {home.resolve()}; the path is relative to the config's folder")
    if changed:
        raise InputError(
            f"oracle.name: {changed[0].path} has changed since this run folder was made; run the study with its own "
            "config, or put the code of this run back"
        )
    raise InputError(
        f"oracle.name: {wanted.file} lies neither in {home.resolve()} nor where it was ({note.get('folder')}); "
        f"{home / COPY} is a copy of it: look at it, and save it as {home / wanted.file}"
    )
