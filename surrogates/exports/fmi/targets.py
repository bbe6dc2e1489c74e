"""FMI 2.0 and 3.0 co-simulation FMUs around the C99 export: sources, and a library where a C compiler is at hand."""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from html import escape
from pathlib import Path
from string import Template
from typing import TYPE_CHECKING, ClassVar
from uuid import UUID

from ...inversion import obstacle
from ..base import about, number
from ..c99.target import C99
from . import common_text as fmi_text
from . import fmi2_text, fmi3_text
from .archive import NotCompiled, pack, version_and_identifier, with_library
from .description import Interface, Variable, build_description, interface, model_description

if TYPE_CHECKING:
    from ...model import Surrogate

HEADERS = Path(__file__).parent / "headers"
"""The standards' own headers, unchanged; see the README there."""


class _Fmi:
    """What both versions share; `version` tells them apart."""

    version: ClassVar[str]

    def render(self, model: "Surrogate", prefix: str) -> dict[str, str | bytes]:
        """``<prefix>_forward.fmu`` and, where the model has an inverse, ``<prefix>_inverse.fmu``, as sources.

        Raises
        ------
        ValueError
            If `prefix` is not allowed in C, or a number of the model overflows.
        """
        c99 = {name: str(text) for name, text in C99().render(model, prefix).items()}
        kinds = ("forward",) if obstacle(model) else ("forward", "inverse")
        shown = [interface(model, prefix, kind) for kind in kinds]
        return {f"{s.identifier}.fmu": pack(_files(model, prefix, c99, s, self.version)) for s in shown}

    def complete(self, files: Mapping[str, str | bytes]) -> tuple[dict[str, str | bytes], list[str]]:
        """`files` with a library for this machine in every FMU of this version, and notes for the user.

        Compiled with the machine's ``cc``, ``gcc`` or ``clang``; without one the files come back as they were and
        the note says so.
        """
        done, notes = dict(files), []
        for name, content in files.items():
            if not isinstance(content, bytes) or not name.endswith(".fmu"):
                continue
            if version_and_identifier(content)[0] != self.version:
                continue
            try:
                done[name] = with_library(content)
            except NotCompiled as error:
                notes.append(f"{name} holds sources and no library: {error}.")
        return done, notes


@dataclass(frozen=True)
class FMI2(_Fmi):
    """Co-simulation FMUs of FMI 2.0: the forward map and, where there is one, the inverse.

    Inputs are the factors, outputs the responses and the integer ``status`` of the C function; of the inverse FMU
    the other way round. No states: outputs are computed when they are gotten, and keep the last good values where the
    status says that there are none. The instance is on the heap, as FMI wants it; the algebra in it uses none.
    """

    name: ClassVar[str] = "fmi2"
    summary: ClassVar[str] = "FMI 2.0 co-simulation FMUs: forward and inverse, C sources and a library where possible"
    version: ClassVar[str] = "2.0"


@dataclass(frozen=True)
class FMI3(_Fmi):
    """Co-simulation FMUs of FMI 3.0, otherwise as :class:`FMI2`."""

    name: ClassVar[str] = "fmi3"
    summary: ClassVar[str] = "FMI 3.0 co-simulation FMUs: forward and inverse, C sources and a library where possible"
    version: ClassVar[str] = "3.0"


def _files(model: "Surrogate", prefix: str, c99: Mapping[str, str], shown: Interface, version: str) -> dict[str, bytes]:
    """All files of one FMU by path; its token is a hash of them."""
    major = version[0]
    files = {f"sources/{name}": c99[name].encode("ascii") for name in (f"{prefix}.h", f"{prefix}.c")}
    for header in sorted(HEADERS.glob(f"fmi{major}*.h")):
        files[f"sources/fmi_headers/{header.name}"] = header.read_bytes()
    licence = (HEADERS / "LICENSE").read_text(encoding="ascii")
    files["documentation/licenses/license.txt"] = _fill(fmi_text.LICENSE, license=licence)
    files["documentation/index.html"] = _documentation(model, shown, version)
    if version == "3.0":
        files["sources/buildDescription.xml"] = build_description(shown)
    public = re.findall(rf"^\w+ ({prefix}_\w+)\(", c99[f"{prefix}.h"], re.MULTILINE)
    token = _token({**files, **_named(model, prefix, public, shown, version, "")})
    return {**files, **_named(model, prefix, public, shown, version, token)}


def _named(
    model: "Surrogate", prefix: str, public: list[str], shown: Interface, version: str, token: str
) -> dict[str, bytes]:
    """The two files that hold the token."""
    return {
        "modelDescription.xml": model_description(shown, version, token),
        f"sources/{shown.identifier}.c": _wrapper(model, prefix, public, shown, version, token),
    }


def _wrapper(model: "Surrogate", prefix: str, public: list[str], shown: Interface, version: str, token: str) -> bytes:
    """The C file to compile; the C99 export's `public` functions are renamed in it."""
    names = {name: f"{shown.identifier}_map{name.removeprefix(prefix)}" for name in public}
    return _fill(
        fmi_text.COMMON + (fmi2_text.WRAPPER if version == "2.0" else fmi3_text.WRAPPER),
        id=shown.identifier,
        p=prefix,
        p_call=f"{prefix}_{shown.kind}",
        renamed=names[f"{prefix}_{shown.kind}"],
        renames="\n".join(f"#define {a} {b}" for a, b in names.items()),
        version=version,
        major=version[0],
        about="\n".join(f" * {line}".rstrip() for line in about(model)),
        n_inputs=str(len(shown.inputs)),
        n_outputs=str(len(shown.outputs)),
        start=_starts(shown.inputs),
        first=_starts(shown.outputs),
        token=token,
        **_words(shown),
    )


def _documentation(model: "Surrogate", shown: Interface, version: str) -> bytes:
    return _fill(
        fmi_text.DOCUMENTATION,
        id=shown.identifier,
        version=version,
        major=version[0],
        status=shown.status,
        kept=fmi_text.FORWARD_KEPT if shown.kind == "forward" else fmi_text.INVERSE_KEPT,
        about=escape("\n".join(about(model))),
        **_words(shown),
    )


def _words(shown: Interface) -> dict[str, str]:
    words = ("factors", "responses") if shown.kind == "forward" else ("responses", "factors")
    return dict(zip(("inputs", "outputs"), words, strict=True))


def _starts(variables: tuple[Variable, ...]) -> str:
    return ", ".join(number(v.start) for v in variables)


def _token(files: Mapping[str, bytes]) -> str:
    """A GUID that changes with the content."""
    digest = hashlib.sha256()
    for path in sorted(files):
        digest.update(f"{path}\0{len(files[path])}\0".encode("ascii") + files[path])
    return "{" + str(UUID(bytes=digest.digest()[:16])) + "}"


def _fill(template: str, **words: str) -> bytes:
    return Template(template).substitute(words).encode("ascii")
