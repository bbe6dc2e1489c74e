"""The exported C99 of a model, compiled on this machine and called through ctypes."""

import ctypes
import platform
import subprocess
import time
from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path
from shutil import which

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surrogates import Surrogate
from surrogates.exports import get

PREFIX = "stage"
COMPILERS = ("cc", "gcc", "clang")
FLAGS = ("-std=c99", "-O2", "-Wall", "-Wextra", "-pedantic", "-shared", "-fPIC")
OK = 0
"""The status that says that settings were found; the others are in the generated header."""

_DOUBLES = ctypes.POINTER(ctypes.c_double)
_TIMING = Path(__file__).with_name("timing.c")


class CompiledInverse:
    """``<prefix>_inverse`` of a compiled export.

    Parameters
    ----------
    library : Path
        Shared library with the export and the timing of `timing.c` in it.
    compiler : str
        What made it, for the record.
    """

    def __init__(self, library: Path, compiler: str) -> None:
        self.library, self.compiler = library, compiler
        loaded = ctypes.CDLL(str(library.resolve()))
        self._inverse = getattr(loaded, f"{PREFIX}_inverse")
        self._inverse.argtypes, self._inverse.restype = [_DOUBLES, _DOUBLES], ctypes.c_int
        self._time = loaded.time_inverse
        self._time.argtypes = [_DOUBLES, ctypes.c_int, ctypes.c_int, _DOUBLES, _DOUBLES]
        self._time.restype = ctypes.c_int

    def __call__(self, poses: ArrayLike) -> tuple[NDArray[np.float64], NDArray[np.bool_]]:
        """Forces (n, 6) [N] for poses (n, 6) [m, rad], one C call for each; False where the C refuses."""
        poses = np.ascontiguousarray(poses, dtype=np.float64)
        forces = np.zeros_like(poses)
        status = [
            self._inverse(pose.ctypes.data_as(_DOUBLES), row.ctypes.data_as(_DOUBLES))
            for pose, row in zip(poses, forces, strict=True)
        ]
        return forces, np.array(status, dtype=int) == OK

    def timing(self, poses: ArrayLike, repeats: int) -> "Timing":
        """Time every pose of (n, 6) `repeats` times, in C, and once from Python.

        Raises
        ------
        RuntimeError
            If a pose was refused: a refusal's time says nothing of control.
        """
        poses = np.ascontiguousarray(poses, dtype=np.float64)
        calls, empty = np.empty((2, repeats, len(poses)))
        pointers = [a.ctypes.data_as(_DOUBLES) for a in (poses, calls, empty)]
        if refused := self._time(pointers[0], len(poses), repeats, *pointers[1:]):
            raise RuntimeError(f"{refused} of {repeats * len(poses)} timed calls were refused by the exported inverse")
        return Timing(calls, empty, self._from_python(poses), self.compiler)

    def _from_python(self, poses: NDArray[np.float64]) -> NDArray[np.float64]:
        """Nanoseconds of single calls through ctypes with the pointers at hand, shape (n,)."""
        forces = np.zeros(6)
        given, taken = [pose.ctypes.data_as(_DOUBLES) for pose in poses], forces.ctypes.data_as(_DOUBLES)
        spent = np.empty(len(poses))
        for i, pointer in enumerate(given):
            begin = time.perf_counter_ns()
            self._inverse(pointer, taken)
            spent[i] = time.perf_counter_ns() - begin
        return spent


@dataclass(frozen=True, eq=False)
class Timing:
    """Time of single calls of the inverse, nanoseconds, the clock's own reading included.

    Parameters
    ----------
    calls : ndarray, shape (repeats, n)
        Timed in C.
    empty : ndarray, shape (repeats, n)
        Two readings of the clock with nothing between them: its own cost, and what else the machine does.
    from_python : ndarray, shape (n,)
        Through ctypes.
    compiler : str
    """

    calls: NDArray[np.float64]
    empty: NDArray[np.float64]
    from_python: NDArray[np.float64]
    compiler: str

    def summary(self) -> dict[str, float]:
        """Microseconds by what they are.

        The worst pose is the slowest by the median of its calls: what the code needs. The worst call is whatever
        happened, interrupts of an operating system that is not of real time included.
        """
        return {
            "median": 1e-3 * float(np.median(self.calls)),
            "99.9 % of calls": 1e-3 * float(np.quantile(self.calls, 0.999)),
            "worst pose": 1e-3 * float(np.median(self.calls, axis=0).max()),
            "worst call": 1e-3 * float(self.calls.max()),
            "clock alone, median": 1e-3 * float(np.median(self.empty)),
            "clock alone, worst": 1e-3 * float(self.empty.max()),
            "through ctypes, median": 1e-3 * float(np.median(self.from_python)),
        }


def compiled(model: Surrogate, folder: Path) -> CompiledInverse:
    """Write the model's C99 export into `folder` and compile it there into a shared library.

    Raises
    ------
    RuntimeError
        If there is no C compiler, or it refuses the code.
    """
    compiler = next((found for name in COMPILERS if (found := which(name))), None)
    if compiler is None:
        raise RuntimeError(
            f"no C compiler: looked for {', '.join(COMPILERS)} on PATH. The exported C is what controls here; install "
            "one (gcc or clang)"
        )
    folder.mkdir(parents=True, exist_ok=True)
    digest = sha256()
    for name, text in sorted(get("c99").render(model, PREFIX).items()):
        content = text if isinstance(text, bytes) else text.encode("ascii")
        (folder / name).write_bytes(content)
        digest.update(content)
    # A process loads a path only once: without a name of its own, another model would be answered for by the first.
    library = folder / f"{PREFIX}_{digest.hexdigest()[:16]}.so"
    sources, new = [f"{PREFIX}.c", str(_TIMING.resolve())], library.with_suffix(".new")
    command = [compiler, *FLAGS, f"-DSTAGE_INVERSE={PREFIX}_inverse", *sources, "-o", new.name, "-lm"]
    done = subprocess.run(command, cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode:
        raise RuntimeError(f"{compiler} refused the exported C in {folder}: {done.stderr.strip()[:500]}")
    new.replace(library)
    return CompiledInverse(library, _version(compiler))


def _version(compiler: str) -> str:
    said = subprocess.run([compiler, "--version"], capture_output=True, text=True, check=False).stdout
    return f"{said.splitlines()[0] if said else compiler}, {' '.join(FLAGS[:2])}, {platform.machine()}"
