"""Folders of generated code: written whole, with the model they come from, and verified then and later."""

import csv
import errno
import hashlib
import io
import json
import os
import zipfile
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from pathlib import Path, PurePath
from tempfile import NamedTemporaryFile
from typing import Any

from surrogates import Surrogate, exports, loads
from surrogates.exports.verification import Finding, Outcome, verify

from .errors import InputError
from .tables import findings_csv
from .version import __version__

SCHEMA = "flexdoce-export/1"
MANIFEST, MODEL, FINDINGS = "export.json", "model.json", "verification.csv"
OURS = (MANIFEST, MODEL, FINDINGS)


@dataclass(frozen=True)
class Manifest:
    """``export.json``: what lies in a folder of generated code.

    Parameters
    ----------
    schema : str
    target : str
    prefix : str
    settings : dict
        Of the target.
    flexdoce : str
        Version that wrote it.
    files : dict
        SHA-256 in hexadecimal by file name, ``model.json`` among them.
    """

    schema: str
    target: str
    prefix: str
    settings: dict[str, Any]
    flexdoce: str
    files: dict[str, str]


def generate(
    model_text: str, target: str, prefix: str, settings: Mapping[str, Any]
) -> tuple[dict[str, bytes], list[str]]:
    """Files of an export by name, its manifest and the model among them; and notes on what could not be added.

    Raises
    ------
    InputError
        If the target is unknown, refuses the prefix or a setting, or cannot express the model.
    """
    try:
        chosen = exports.get(target, settings)
        exports.check_size(model := loads(model_text))
        files = {n: _bytes(content) for n, content in chosen.render(model, prefix).items()}
        complete, notes = getattr(chosen, "complete", None), []
        if complete is not None:
            completed, notes = complete(files)
            files = {n: _bytes(content) for n, content in completed.items()}
    except ValueError as error:
        raise InputError(str(error)) from None
    files[MODEL] = model_text.encode()
    digests = {name: hashlib.sha256(content).hexdigest() for name, content in sorted(files.items())}
    manifest = Manifest(SCHEMA, target, prefix, dict(settings), __version__, digests)
    files[MANIFEST] = (json.dumps(asdict(manifest), indent=2) + "\n").encode()
    return files, notes


def write(folder: Path, files: Mapping[str, bytes], force: bool = False) -> list[Path]:
    """Write an export into `folder`, each file whole; what an export before left there is removed if forced.

    Raises
    ------
    InputError
        If a file is there already and not `force`, or the folder cannot be written.
    """
    there = [name for name in (*files, FINDINGS) if (folder / name).exists()]
    if there and not force:
        raise InputError(f"{folder} already holds {', '.join(there)}; use --force to overwrite, or another --out")
    try:
        for name in _left_over(folder, files):
            (folder / name).unlink()
        folder.mkdir(parents=True, exist_ok=True)
        for name, content in files.items():
            _put(folder / name, content)
    except OSError as error:
        raise InputError(f"cannot write to {folder}: {error.strerror}") from None
    return [folder / name for name in files]


def _put(path: Path, content: bytes) -> None:
    """Write a file whole, under a name of its own first: what a link of either name points to is not touched."""
    with NamedTemporaryFile(dir=path.parent, prefix=".", suffix=".partial", delete=False) as partial:
        partial.write(content)
    Path(partial.name).chmod(0o666 & ~_umask())
    Path(partial.name).replace(path)


def _umask() -> int:
    mask = os.umask(0)
    os.umask(mask)
    return mask


def verified(folder: Path) -> list[Finding]:
    """Whether the files of an export are those that were written, come from its model, and do what that does.

    Nothing in the folder is compiled or run unless it is, byte for byte, what this version generates from the model;
    libraries inside FMUs never are.
    The findings are also written to ``verification.csv`` there, if the folder can be written.

    Raises
    ------
    InputError
        If it is not a folder of generated code, or its model or manifest cannot be read.
    """
    manifest, model = _read(folder)
    findings = _unchanged(folder, manifest)
    if all(f.outcome is Outcome.AGREES for f in findings):
        findings.append(_regenerated(folder, manifest))
        if findings[-1].outcome is Outcome.AGREES:
            findings += verify(manifest.target, model, manifest.prefix, folder)
        else:
            findings.append(Finding("at reference points", Outcome.NOT_CHECKED, "code of unknown origin is not run"))
    _keep(folder, findings)
    return findings


def told(folder: Path) -> str:
    """What the last verification of an export found, in words; empty if there was none."""
    try:
        outcomes = [row["outcome"] for row in csv.DictReader(io.StringIO(_text(folder / FINDINGS)))]
    except (OSError, ValueError, KeyError, csv.Error):
        return ""
    words = {Outcome.AGREES: "checks agree", Outcome.DIFFERS: "differ", Outcome.NOT_CHECKED: "not checked"}
    return ", ".join(f"{n} {word}" for outcome, word in words.items() if (n := outcomes.count(outcome)))


def folders(path: Path) -> list[Path]:
    """Folders of generated code at `path`: itself, or those in it, or in its ``exports``.

    Raises
    ------
    InputError
        If there is none.
    """
    for root in (path, path / "exports"):
        if (root / MANIFEST).is_file():
            return [root]
        if found := sorted(child.parent for child in root.glob(f"*/{MANIFEST}")):
            return found
    raise InputError(f"{path} holds no generated code: no {MANIFEST} in it, in its folders or in its exports")


def _bytes(content: str | bytes) -> bytes:
    return content.encode() if isinstance(content, str) else content


def _left_over(folder: Path, files: Mapping[str, bytes]) -> list[str]:
    """Files of the export before, unchanged since, that this one does not write."""
    try:
        before = _manifest(folder).files
    except InputError:
        before = {}
    ours = [name for name, digest in before.items() if name not in files and _digest(folder / name) == digest]
    return [*ours, FINDINGS] if (folder / FINDINGS).is_file() else ours


def _text(path: Path) -> str:
    """A plain file's text; a pipe of that name would be waited for without end."""
    if not path.is_file():
        raise FileNotFoundError(errno.ENOENT, "there is no plain file of that name", str(path))
    return path.read_text(encoding="utf-8")


def _digest(path: Path) -> str:
    """SHA-256 of a file; empty if there is none or it cannot be read."""
    try:
        return hashlib.sha256(path.read_bytes()).hexdigest() if path.is_file() else ""
    except OSError:
        return ""


def _manifest(folder: Path) -> Manifest:
    path = folder / MANIFEST
    try:
        document = json.loads(_text(path))
    except (OSError, ValueError, RecursionError) as error:
        raise InputError(f"cannot read {path}: {getattr(error, 'strerror', None) or error}") from None
    found = document.get("schema") if isinstance(document, dict) else type(document).__name__
    if found != SCHEMA:
        raise InputError(f"{path} is not a manifest this version reads: expected schema {SCHEMA!r}, found {found!r}")
    kinds = {"target": str, "prefix": str, "settings": dict, "flexdoce": str, "files": dict}
    for key, kind in kinds.items():
        if not isinstance(document.get(key), kind):
            raise InputError(
                f"{path}: {key} must be {'a text' if kind is str else 'a table'}, got {document.get(key)!r}"
            )
    if document["target"] not in exports.TARGETS:
        raise InputError(f"{path}: this version has no export {document['target']!r}")
    manifest = Manifest(SCHEMA, **{key: document[key] for key in kinds})
    for name, digest in manifest.files.items():
        odd = PurePath(name).name != name or not name.isprintable() or "\\" in name
        if odd or name in ("", ".", "..") or not isinstance(digest, str):
            raise InputError(f"{path}: {name!r} is not the name of a file in this folder with its SHA-256")
    return manifest


def _read(folder: Path) -> tuple[Manifest, Surrogate]:
    manifest = _manifest(folder)
    try:
        return manifest, loads(_text(folder / MODEL))
    except (OSError, ValueError) as error:
        raise InputError(f"{folder / MODEL}: {getattr(error, 'strerror', None) or error}") from None


def _unchanged(folder: Path, manifest: Manifest) -> list[Finding]:
    findings = []
    for name, digest in manifest.files.items():
        found = _digest(folder / name)
        if found != digest:
            said = "it was changed after it was written: export it again" if found else "it is missing or unreadable"
            findings.append(Finding(f"{name} as written", Outcome.DIFFERS, said))
    return findings or [Finding("files as written", Outcome.AGREES, f"{len(manifest.files)} files")]


def _regenerated(folder: Path, manifest: Manifest) -> Finding:
    """Whether the model gives these files once more; of an archive, every member that is not a binary."""
    what = f"files generated once more from {MODEL}"
    try:
        target = exports.get(manifest.target, manifest.settings)
        texts = target.render(loads(_text(folder / MODEL)), manifest.prefix)
    except ValueError as error:
        return Finding(what, Outcome.DIFFERS, f"they cannot be: {error}")
    differing = sorted(set(texts) ^ (set(manifest.files) - {MODEL}))
    if not differing:
        differing = [n for n, content in texts.items() if not _same(folder / n, _bytes(content))]
    if not differing:
        return Finding(what, Outcome.AGREES, "byte for byte")
    why = f"not what the model gives: {', '.join(differing)}"
    if manifest.flexdoce != __version__:
        why += f" (written by flexdoce {manifest.flexdoce}, this is {__version__}: export it again)"
    return Finding(what, Outcome.DIFFERS, why)


def _same(path: Path, rendered: bytes) -> bool:
    """Whether a file is as rendered; an archive may hold binaries more."""
    delivered = path.read_bytes()
    if delivered == rendered:
        return True
    try:
        with zipfile.ZipFile(io.BytesIO(rendered)) as mine, zipfile.ZipFile(io.BytesIO(delivered)) as theirs:
            sizes = {m.filename: m.file_size for m in theirs.infolist()}
            wanted = {m.filename: m.file_size for m in mine.infolist()}
            # Sizes first: an archive may unpack to far more than it is.
            return (
                len(sizes) == len(theirs.infolist())
                and all(sizes.get(n) == size for n, size in wanted.items())
                and all(n.startswith("binaries/") for n in sizes.keys() - wanted.keys())
                and all(theirs.read(n) == mine.read(n) for n in wanted)
            )
    except (zipfile.BadZipFile, KeyError, OSError, ValueError):
        return False


def _keep(folder: Path, findings: list[Finding]) -> None:
    try:
        _put(folder / FINDINGS, findings_csv(findings).encode())
    except OSError:
        return  # a folder that cannot be written is still verified
