"""What the documents show is run: configs resolve, code blocks execute."""

import ast
import re
import tomllib
from pathlib import Path

import pytest

import pipeline
from experiments import oracles
from pipeline.cli import main
from pipeline.config import parse_config

ROOT = Path(__file__).parents[1]
BLOCK = re.compile(r"^```(\w+)\n(.*?)^```", re.MULTILINE | re.DOTALL)


def blocks(name, language):
    return [code for lang, code in BLOCK.findall((ROOT / name).read_text(encoding="utf-8")) if lang == language]


@pytest.fixture
def registry(monkeypatch):
    monkeypatch.setattr(oracles, "_REGISTERED", {})


def named_tests(page):
    """File, class and name of every test that a page names; ``…`` stands for what was left out."""
    text = (ROOT / page).read_text(encoding="utf-8")
    return re.findall(r"`(test_\w+\.py)((?:::[\w…]+)*)`", text)


def has_test(file, parts):
    """Whether there is such a test."""
    (place,) = (ROOT / "tests").rglob(file)
    tree = ast.parse(place.read_text(encoding="utf-8"))
    found = {n.name for n in tree.body if isinstance(n, (ast.ClassDef, ast.FunctionDef))}
    inner = {f"{c.name}::{f.name}" for c in tree.body if isinstance(c, ast.ClassDef)
             for f in c.body if isinstance(f, ast.FunctionDef)}  # fmt: skip
    wanted = re.escape(parts.removeprefix("::")).replace("…", ".*")
    return not parts or any(re.fullmatch(wanted, name) for name in found | inner)


def test_every_test_that_the_page_on_reliability_names_is_there():
    named = named_tests("docs/reliability.md")
    assert len(named) > 40
    assert [f"{file}{parts}" for file, parts in named if not has_test(file, parts)] == []
    assert not has_test("test_faults_disk.py", "::TestDiskFull::test_that_is_not_there")
    rows = [
        line
        for line in (ROOT / "docs/reliability.md").read_text(encoding="utf-8").splitlines()
        if line.startswith("| ")
    ]
    faults = [
        row
        for row in rows
        if row.count("|") == 4 and "---" not in row and not row.startswith(("| column", "| fault", "| attack"))
    ]
    assert [row for row in faults if "test_" not in row] == []


def test_readme_config_resolves():
    (text,) = blocks("README.md", "toml")
    study = pipeline.resolve(parse_config(text, "README.md"))
    assert study.space.factors[0].high == 0.5


def test_readme_example_without_a_config_runs():
    code = next(code for code in blocks("README.md", "python") if "PlackettBurman" in code)
    names = {}
    exec(compile(code, "README.md", "exec"), names)
    assert names["screen"](names["runs"], resolution=1e-9).active_on("x") == ("T1D1", "T2D1", "T3D1")


def test_readme_model_example_runs(tmp_path, monkeypatch):
    settings = ["fit.design.budget=500", "validation.n_runs=20"]
    pipeline.run(ROOT / "configs" / "hexflex.toml", tmp_path / "runs" / "hexflex", settings)
    monkeypatch.chdir(tmp_path)
    code = next(code for code in blocks("README.md", "python") if "model.invert" in code)
    names = {}
    exec(compile(code, "README.md", "exec"), names)
    assert names["answer"].ok.all()


def test_readme_test_command_is_what_ci_runs():
    assert "make test" in (ROOT / "README.md").read_text(encoding="utf-8")
    assert "make test" in (ROOT / ".ci" / "run").read_text(encoding="utf-8")


@pytest.fixture
def oracle_page(registry, tmp_path, monkeypatch):
    """The files of the page on oracles, in a folder that is the current one; gives its blocks of Python."""
    for language, name in (("python", "spring.py"), ("toml", "spring.toml")):
        (text,) = [code for code in blocks("docs/add-an-oracle.md", language) if code.startswith(f"# {name}\n")]
        (tmp_path / name).write_text(text, encoding="utf-8")
    monkeypatch.chdir(tmp_path)
    return blocks("docs/add-an-oracle.md", "python")


def test_add_an_oracle_page_runs(oracle_page, tmp_path):
    """The file and the config as they stand there, by the command line; a spring is no polynomial, but nearly one."""
    assert (
        len((tmp_path / "spring.py").read_text().splitlines() + (tmp_path / "spring.toml").read_text().splitlines())
        < 30
    )
    assert main(["check", "spring.toml"]) == main(["check", "spring.toml", "--load"]) == 0
    few = [f"--set={key}" for key in ("validation.n_runs=20", "fit.design.budget=200", "export.targets=[]")]
    assert main(["run", "spring.toml", *few]) == 0
    outcome = pipeline.read_run("runs/spring")
    assert outcome.kept == ("force", "stiffness")
    assert outcome.study.oracle.parameters == {"preload": 0.1}
    assert max(e.max_relative for e in outcome.model.validation) < 0.01
    force, stiffness = outcome.fit_runs.design.physical.T
    assert (outcome.fit_runs.values[:, 0] == (force - 0.1) / stiffness).all()


def test_every_other_block_of_that_page_runs(oracle_page, capsys):
    names = {}
    for code in oracle_page:
        exec(compile(code, "docs/add-an-oracle.md", "exec"), names)
    assert capsys.readouterr().out.count("\n") == 5, "the centre and four corners"
    assert len(oracle_page) == 4


def test_the_package_of_that_page_is_found(oracle_page, tmp_path, monkeypatch):
    (text,) = [code for code in blocks("docs/add-an-oracle.md", "toml") if code.startswith("# pyproject.toml\n")]
    ((group, entries),) = tomllib.loads(text)["project"]["entry-points"].items()
    info, package = tmp_path / "springs-1.0.dist-info", tmp_path / "springs"
    info.mkdir()
    package.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: springs\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(f"[{group}]\n" + "".join(f"{k} = {v}\n" for k, v in entries.items()))
    (package / "__init__.py").write_text("")
    (tmp_path / "spring.py").rename(package / "oracles.py")
    monkeypatch.syspath_prepend(str(tmp_path))
    config = parse_config('name = "spring"\noracle = "spring"\n')
    assert pipeline.resolve(config).oracle.origin == "springs 1.0, springs.oracles:spring"


def test_nonlinear_beams_page_runs():
    names = {}
    for code in blocks("docs/nonlinear-beams.md", "python"):
        exec(compile(code, "docs/nonlinear-beams.md", "exec"), names)
    assert names["found"].ok.all()
    deflection = names["found"].at("tip")[:, 2]
    assert 4 * deflection[0] < deflection[1] < deflection[0] < 0  # four times the load, less than four times the way


def test_every_claim_of_the_page_on_designs_holds():
    names = {}
    code = blocks("docs/choosing-a-design.md", "python")
    assert len(code) > 10
    for block in code:
        assert "assert" in block
        exec(compile(block, "docs/choosing-a-design.md", "exec"), names)
