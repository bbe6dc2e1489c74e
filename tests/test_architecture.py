"""The shape of the house: which package imports which, who touches the disk, and how large a room may be."""

import ast
import importlib
import importlib.metadata
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
PACKAGES = ("experiments", "surrogates", "pipeline")
MAY_IMPORT = {"experiments": set(), "surrogates": {"experiments"}, "pipeline": {"experiments", "surrogates"}}
LONGEST_MODULE, LONGEST_FUNCTION = 400, 50


def module_name(path: Path) -> str:
    parts = path.relative_to(ROOT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


FILES = {module_name(p): p for package in PACKAGES for p in sorted((ROOT / package).rglob("*.py"))}
TREES = {name: ast.parse(path.read_text(encoding="utf-8")) for name, path in FILES.items()}


def imported(name: str, node: ast.Import | ast.ImportFrom) -> set[str]:
    """Full names of the modules that an import statement of module `name` asks for."""
    if isinstance(node, ast.Import):
        return {alias.name for alias in node.names}
    base = node.module or ""
    if node.level:
        package = name if FILES[name].name == "__init__.py" else name.rpartition(".")[0]
        parents = package.split(".")[: len(package.split(".")) - node.level + 1]
        base = ".".join([*parents, *([node.module] if node.module else [])])
    # ``from . import store`` asks for the module store, ``from .store import X`` for the module that holds X.
    below = {f"{base}.{alias.name}" for alias in node.names}
    modules = below & FILES.keys()
    return modules | ({base} if modules != below else set())


def all_imports(name: str) -> set[str]:
    """Modules that `name` imports anywhere, functions and type checking included."""
    return {m for n in ast.walk(TREES[name]) if isinstance(n, (ast.Import, ast.ImportFrom)) for m in imported(name, n)}


def is_type_checking(node: ast.AST) -> bool:
    return isinstance(node, ast.If) and "TYPE_CHECKING" in ast.dump(node.test)


def import_time_nodes(body: list[ast.stmt]) -> Iterator[ast.stmt]:
    """Statements that run when the module is imported: not in functions, not for the type checker only."""
    for node in body:
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)) or is_type_checking(node):
            continue
        yield node
        for part in ("body", "orelse", "finalbody"):
            yield from import_time_nodes(getattr(node, part, []))
        for handler in getattr(node, "handlers", []):
            yield from import_time_nodes(handler.body)


def import_time_imports(name: str) -> set[str]:
    nodes = import_time_nodes(TREES[name].body)
    found = {m for n in nodes if isinstance(n, (ast.Import, ast.ImportFrom)) for m in imported(name, n)}
    return found & FILES.keys()


def in_fresh_python(code: str) -> str:
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False, cwd=ROOT)
    assert done.returncode == 0, done.stderr
    return done.stdout.strip()


def test_the_source_was_found():
    assert len(FILES) > 40
    assert {"experiments.oracles.base", "surrogates.artefact", "pipeline.runner"} <= FILES.keys()
    assert "surrogates.model" in all_imports("surrogates.artefact")
    assert "pipeline.store" in all_imports("pipeline.runner")


class TestDirection:
    @pytest.mark.parametrize("package", PACKAGES)
    def test_no_import_points_upward(self, package):
        found = {
            f"{name} imports {other}"
            for name in FILES
            if name.split(".")[0] == package
            for other in all_imports(name)
            if other.split(".")[0] in set(PACKAGES) - {package} - MAY_IMPORT[package]
        }
        assert found == set()

    @pytest.mark.parametrize("package", PACKAGES)
    def test_imports_are_relative_inside_and_absolute_across(self, package):
        found = set()
        for name in (n for n in FILES if n.split(".")[0] == package):
            for node in ast.walk(TREES[name]):
                if isinstance(node, ast.Import):
                    found |= {f"{name}: import {a.name}" for a in node.names if a.name.split(".")[0] == package}
                elif (
                    isinstance(node, ast.ImportFrom) and not node.level and (node.module or "").split(".")[0] == package
                ):
                    found.add(f"{name}: from {node.module} import")
                elif isinstance(node, ast.ImportFrom) and node.level:
                    found |= {f"{name}: {m}" for m in imported(name, node) if m.split(".")[0] != package}
        assert found == set()

    def test_nothing_imports_the_tests(self):
        found = {n for n in FILES if {m.split(".")[0] for m in all_imports(n)} & {"tests", "pytest", "benchmarks"}}
        assert found == set()

    def test_fea_knows_nothing_of_factors(self):
        allowed = ("experiments.fea", "experiments.naming")
        found = {
            f"{name} imports {other}"
            for name in FILES
            if name.startswith("experiments.fea")
            for other in all_imports(name)
            if other.startswith("experiments") and not other.startswith(allowed)
        }
        assert found == set()

    def test_no_cycle_at_import_time(self):
        graph = {name: sorted(import_time_imports(name) - {name}) for name in FILES}
        done: set[str] = set()

        def walk(name: str, path: tuple[str, ...]) -> None:
            assert name not in path, " → ".join([*path[path.index(name) :], name])
            if name not in done:
                for other in graph[name]:
                    walk(other, (*path, name))
                done.add(name)

        for name in graph:
            walk(name, ())
        assert done == FILES.keys()


WRITES = {
    "write_text", "write_bytes", "mkdir", "makedirs", "unlink", "rmdir", "rmtree", "touch", "rename", "removedirs",
    "symlink_to", "hardlink_to", "chmod", "copyfile", "copytree", "move", "to_pickle", "to_parquet", "savetxt", "savez",
    "tofile", "memmap", "FileHandler", "NamedTemporaryFile", "mkdtemp", "mkstemp", "TemporaryDirectory",
}  # fmt: skip
READS = {"read_text", "read_bytes", "loadtxt", "genfromtxt", "iterdir", "glob", "rglob"}
MAY_WRITE = {
    "pipeline.store",
    "pipeline.runner",
    "pipeline.commands",
    "pipeline.exporting",
    "pipeline.lock",  # the lock of a run folder
    "pipeline.log",  # log.txt
}
MAY_READ = MAY_WRITE | {
    "pipeline.database",  # what file system it is on
    "pipeline.config",  # the config
    "pipeline.report.build",  # its own template
    "pipeline.executors.dask_cluster",  # the scheduler's file
    "surrogates.artefact",  # load("model.json")
    "experiments.oracles.hexflex",  # its own geometry
    "surrogates.exports.fmi.targets",  # the standard's headers
}
NEED_DESCRIPTORS = {"pipeline.lock", "experiments.oracles.command.folder"}
"""A lock and a flush are calls to the system with a descriptor; reading and writing are not."""
IN_TEMPORARY_FOLDERS = (
    "surrogates.exports.verification.", "surrogates.exports.fmi.archive", "experiments.oracles.command.",
    "experiments.shells.results",
)  # fmt: skip
"""Compilers, simulators and other tools take files and leave files: in folders that go afterwards, if not kept."""
LASTING = [n for n in FILES if not n.startswith(IN_TEMPORARY_FOLDERS)]


def calls(name: str) -> Iterator[tuple[str, int]]:
    """Names of what a module calls, attributes by their last part, with the line."""
    for node in ast.walk(TREES[name]):
        if isinstance(node, ast.Call):
            if isinstance(node.func, ast.Name):
                yield node.func.id, node.lineno
            elif isinstance(node.func, ast.Attribute):
                yield node.func.attr, node.lineno


class TestDisk:
    def test_only_the_runner_the_store_and_the_commands_write(self):
        found = [f"{n}:{line} {c}" for n in LASTING if n not in MAY_WRITE for c, line in calls(n) if c in WRITES]
        assert found == []

    def test_what_tools_need_lies_in_temporary_folders(self):
        writing = [n for n in set(FILES) - set(LASTING) if any(c in WRITES for c, _ in calls(n))]
        assert writing
        # A module that writes makes the folder itself or is given one by a module that does.
        assert all("tempfile" in all_imports(n) or n.endswith(("_run", ".edges")) for n in writing), writing

    def test_few_read(self):
        found = [f"{n}:{line} {c}" for n in LASTING if n not in MAY_READ for c, line in calls(n) if c in READS]
        assert found == []

    def test_nobody_opens_files_by_hand(self):
        found = [f"{n}:{line}" for n in FILES for c, line in calls(n) if c == "open" and n not in NEED_DESCRIPTORS]
        assert found == []

    def test_one_room_knows_sqlite_and_one_its_points(self):
        assert [n for n in FILES if "pipeline.database" in all_imports(n)] == ["pipeline.points", "pipeline.status"]
        knowing = [n for n in FILES if "sqlite3" in all_imports(n)]
        assert knowing == ["pipeline.database", "pipeline.points"], "points sees its errors only"

    def test_the_stages_touch_no_disk(self):
        assert not all_imports("pipeline.stages") & {
            "pathlib",
            "os",
            "io",
            "shutil",
            "pipeline.store",
            "pipeline.runner",
        }

    def test_no_pickle(self):
        found = [n for n in FILES if all_imports(n) & {"pickle", "cPickle", "dill", "joblib", "shelve", "marshal"}]
        assert found == []


class TestNamesAreOurs:
    @pytest.mark.parametrize("package", PACKAGES)
    def test_no_other_distribution_owns_them(self, package):
        owners = set(importlib.metadata.packages_distributions().get(package, []))
        assert owners <= {"flexdoce"}

    @pytest.mark.parametrize("package", PACKAGES)
    def test_they_are_imported_from_here(self, package):
        assert Path(importlib.import_module(package).__file__ or "") == ROOT / package / "__init__.py"

    def test_the_distribution_is_private(self):
        told = importlib.metadata.metadata("flexdoce")
        assert "Private :: Do Not Upload" in (told.get_all("Classifier") or [])


class TestImportCost:
    LOADED = "import sys; print(' '.join(sorted({m.split('.')[0] for m in sys.modules})))"

    @pytest.mark.parametrize("modules", ["experiments", "surrogates", "experiments.oracles", "pipeline.cli"])
    def test_no_jax_at_import(self, modules):
        loaded = set(in_fresh_python(f"import {modules}\n{self.LOADED}").split())
        assert modules.split(".")[0] in loaded
        assert not loaded & {"jax", "jaxlib"}

    def test_a_model_loads_predicts_and_inverts_with_numpy_alone(self, smoke_model):
        code = (
            "from surrogates import load\n"
            f"model = load({str(smoke_model)!r})\n"
            "X = model.factors.centre[None]\n"
            "Y = model.predict(X)\n"
            "model.jacobian(X)\n"
            "assert model.invert(Y).ok.all()\n"
        )
        loaded = set(in_fresh_python(code + self.LOADED).split())
        assert {"numpy", "surrogates", "experiments"} <= loaded
        others = {"jax", "jaxlib", "sklearn", "matplotlib", "pandas", "pydantic", "pyDOE3", "rich", "jinja2", "scipy"}
        assert not loaded & others
        assert "pipeline" not in loaded

    @pytest.fixture
    def smoke_model(self, tmp_path) -> Path:
        """A small quadratic, written by ``dumps``."""
        import numpy as np

        from experiments import Factor, FactorSpace, Response, Terms
        from surrogates import Surrogate, dumps

        space = FactorSpace((Factor("a", "N", -1.0, 1.0), Factor("b", "m", 1.0, 2.0)))
        terms = Terms.polynomial(space.names, 2)
        coefficients = np.zeros((len(terms), 2))
        for label, column in (("a", 0), ("b", 1), ("a:b", 0)):
            coefficients[terms.labels.index(label), column] = 1.0 if ":" not in label else 0.1
        path = tmp_path / "model.json"
        path.write_text(dumps(Surrogate(space, (Response("u", "m"), Response("v", "m")), terms, coefficients)))
        return path


def functions(name: str) -> Iterator[ast.FunctionDef | ast.AsyncFunctionDef]:
    for node in ast.walk(TREES[name]):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node


class TestSize:
    def test_every_module_says_what_it_is(self):
        assert [name for name, tree in TREES.items() if not ast.get_docstring(tree)] == []

    def test_no_module_is_long(self):
        sizes = {name: path.read_text(encoding="utf-8").count("\n") for name, path in FILES.items()}
        assert {n: s for n, s in sizes.items() if s > LONGEST_MODULE} == {}

    def test_no_function_is_long(self):
        """Lines without the docstring, as in the hook before a session stops."""
        found = {}
        for name in FILES:
            for node in functions(name):
                doc = ast.get_docstring(node)
                size = (node.end_lineno or 0) - node.lineno + 1 - (doc.count("\n") + 1 if doc else 0)
                if size > LONGEST_FUNCTION:
                    found[f"{name}.{node.name}"] = size
        assert found == {}

    def test_the_first_docstring_says_what_experiments_are(self):
        assert "not its outputs" in (ast.get_docstring(TREES["experiments"]) or "")


EVALUATING = {"eval", "exec", "compile", "__import__", "system", "popen", "execv", "execve", "execvp", "spawnl",
              "spawnv", "getoutput", "getstatusoutput", "unsafe_load", "full_load"}  # fmt: skip
STATED = {
    "re.compile",  # patterns
    "importlib.import_module",  # names of our own modules
}


def dotted(node: ast.expr) -> str:
    """``a.b.c`` of an attribute, or a name; empty for anything else."""
    if isinstance(node, ast.Attribute):
        above = dotted(node.value)
        return f"{above}.{node.attr}" if above else node.attr
    return node.id if isinstance(node, ast.Name) else ""


def dangerous(tree: ast.AST) -> Iterator[str]:
    """What in a module could run a text: calls, and keyword arguments that turn data into code."""
    for node in ast.walk(tree):
        if not isinstance(node, ast.Call):
            continue
        name = dotted(node.func)
        if name.rpartition(".")[2] in EVALUATING and name not in STATED:
            yield f"{node.lineno} {name}"
        for word in node.keywords:
            plain = isinstance(word.value, ast.Constant) and word.value.value is False
            if word.arg in ("shell", "allow_pickle", "loader", "Loader") and not plain:
                yield f"{node.lineno} {name}({word.arg})"
        if name == "yaml.load":
            yield f"{node.lineno} {name}"
        starts = name in ("subprocess.run", "subprocess.Popen", "subprocess.check_output", "subprocess.call")
        if starts and node.args and isinstance(node.args[0], (ast.Constant, ast.JoinedStr)):
            yield f"{node.lineno} {name} of a text"


class TestDataIsNotCode:
    """A config, a model and a run folder are data: nothing in the three packages runs a text."""

    def test_nothing_evaluates_or_unpickles(self):
        found = {name for name, tree in TREES.items() if list(dangerous(tree))}
        # Somebody's own oracle is code, which a config names openly and `flexdoce check` does not run.
        assert found == {"experiments.oracles.files"}

    def test_no_module_that_loads_code_from_data(self):
        loading = {
            "pickle",
            "marshal",
            "shelve",
            "dill",
            "joblib",
            "cloudpickle",
            "yaml",
            "runpy",
            "code",
            "codeop",
            "imp",
        }
        assert {name for name in FILES if {m.split(".")[0] for m in all_imports(name)} & loading} == set()

    @pytest.mark.parametrize(
        "text",
        ["eval(x)", "builtins.exec(x)", "os.system(x)", "subprocess.run(x, shell=True)", "subprocess.run(x, shell=y)",
         "subprocess.Popen('ls')", "subprocess.run(f'ls {x}')", "np.load(x, allow_pickle=True)", "yaml.load(x)",
         "compile(x, '', 'exec')", "__import__(x)"],
    )  # fmt: skip
    def test_the_search_would_see_it(self, text):
        assert list(dangerous(ast.parse(text)))

    def test_the_search_lets_lists_and_patterns_pass(self):
        assert list(dangerous(ast.parse("subprocess.run(['git'], shell=False)\nre.compile('x')"))) == []
