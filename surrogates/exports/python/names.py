"""Prefixes that files for Python cannot have: a module of that name could not be imported, or would hide another."""

import keyword
import sys

DEVICES = frozenset({"aux", "con", "nul", "prn", *(f"{port}{i}" for port in ("com", "lpt") for i in range(1, 10))})
"""Files that Windows cannot have, with any extension (Microsoft, "Naming Files, Paths, and Namespaces")."""

PACKAGES = frozenset({"casadi", "numpy", "onnx", "onnxruntime", "scipy", "experiments", "pipeline", "surrogates"})
"""What users of an export are likely to import beside it, flexdoce's own packages too."""

RESERVED = DEVICES | PACKAGES | frozenset(word.lower() for word in (*keyword.kwlist, *sys.stdlib_module_names))
"""In lower case, as :func:`.check_prefix` wants it: some disks tell no capitals from small letters."""
