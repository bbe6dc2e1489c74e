"""FMUs as ZIP archives with the same bytes for the same files, and the libraries that a compiler makes of them."""

import io
import platform
import shutil
import subprocess
import sys
import zipfile
from collections.abc import Mapping
from pathlib import Path
from tempfile import TemporaryDirectory
from xml.etree import ElementTree as ET

COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-std=c99", "-O2", "-shared", "-fPIC", "-fvisibility=hidden")
TIME_LIMIT = 120.0
"""Seconds after which a compiler is stopped."""

_EARLIEST = (1980, 1, 1, 0, 0, 0)
"""The first time that a ZIP archive can hold."""


class NotCompiled(RuntimeError):
    """A library that could not be made; the message says why."""


def pack(files: Mapping[str, bytes]) -> bytes:
    """A ZIP archive of `files` by path: sorted, without times, compressed by deflate as FMI 2.0 wants it.

    The same bytes for the same files and the same zlib; another zlib may compress to other bytes.
    """
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        for path in sorted(files):
            entry = zipfile.ZipInfo(path, _EARLIEST)
            entry.create_system = 3  # Unix, on Windows too
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, files[path], compresslevel=9)
    return stream.getvalue()


def unpack(fmu: bytes) -> dict[str, bytes]:
    """The files of an FMU by path."""
    with zipfile.ZipFile(io.BytesIO(fmu)) as archive:
        return {i.filename: archive.read(i) for i in archive.infolist() if not i.is_dir()}


def version_and_identifier(fmu: bytes) -> tuple[str, str]:
    """FMI version and modelIdentifier of a co-simulation FMU.

    Raises
    ------
    ValueError
        If there is no co-simulation in it.
    """
    root = ET.fromstring(unpack(fmu)["modelDescription.xml"])
    simulation = root.find("CoSimulation")
    if simulation is None:
        raise ValueError("this FMU holds no co-simulation: give one that the FMI export wrote")
    return root.attrib["fmiVersion"], simulation.attrib["modelIdentifier"]


def library_path(version: str, identifier: str) -> str:
    """Where in an FMU the library for this machine lies: ``binaries/linux64/<identifier>.so`` and so on.

    FMI 3.0 (section 2.5.1.4.2) joins architecture and system. FMI 2.0 (section 2.3) names folders for x86 alone and
    lets vendors add names: macOS has one folder, ARM elsewhere gets the name of FMI 3.0.
    """
    system = {"darwin": "darwin", "win32": "windows", "cygwin": "windows"}.get(sys.platform, "linux")
    ending = {"darwin": "dylib", "windows": "dll"}.get(system, "so")
    wide, machine = sys.maxsize > 2**32, platform.machine().lower()
    arm = machine.startswith(("arm", "aarch"))
    architecture = ("aarch64" if wide else "aarch32") if arm else ("x86_64" if wide else "x86")
    if not arm and machine not in ("x86_64", "amd64", "i386", "i586", "i686", "x86", "x86pc"):
        architecture = machine
    folder = f"{architecture}-{system}"
    if version == "2.0" and (system == "darwin" or architecture in ("x86_64", "x86")):
        folder = {"windows": "win"}.get(system, system) + ("64" if wide else "32")
    return f"binaries/{folder}/{identifier}.{ending}"


def with_library(fmu: bytes) -> bytes:
    """The same FMU with a library for this machine, replaced if it holds one.

    Raises
    ------
    NotCompiled
        If there is no C compiler, or it fails.
    """
    version, identifier = version_and_identifier(fmu)
    files = unpack(fmu)
    return pack({**files, library_path(version, identifier): compiled(files, version, identifier)})


def compiled(files: Mapping[str, bytes], version: str, identifier: str) -> bytes:
    """The shared library of an FMU's `files`, made with this machine's C compiler; :class:`NotCompiled` if it fails."""
    compiler = next((found for name in COMPILERS if (found := shutil.which(name))), None)
    if compiler is None:
        raise NotCompiled(f"there is no C compiler: install one of {', '.join(COMPILERS)}")
    with TemporaryDirectory() as temporary:
        folder = Path(temporary)
        for path, content in files.items():
            if path.startswith("sources/"):
                target = folder / Path(path).relative_to("sources")
                target.parent.mkdir(parents=True, exist_ok=True)
                target.write_bytes(content)
        override = f"-DFMI{version[0]}_OVERRIDE_FUNCTION_PREFIX"
        command = [compiler, *FLAGS, override, "-Ifmi_headers", f"{identifier}.c", "-o", "library", "-lm"]
        _run(command, folder)
        return (folder / "library").read_bytes()


def _run(command: list[str], folder: Path) -> None:
    try:
        done = subprocess.run(
            command, cwd=folder, capture_output=True, text=True, errors="replace", timeout=TIME_LIMIT, check=False
        )
    except (OSError, subprocess.TimeoutExpired) as error:
        raise NotCompiled(f"the C compiler {command[0]} could not be run: {error}") from error
    if done.returncode:
        said = next((line for line in done.stderr.splitlines() if "error" in line), done.stderr.strip())
        raise NotCompiled(f"the C compiler {command[0]} failed: {said}")
