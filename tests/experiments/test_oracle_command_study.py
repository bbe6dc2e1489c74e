"""Studies of a program: docs/command-oracle.md as it stands, and configs that must be refused or shown openly."""

import json
import re
import shutil
import subprocess
import sys
import tomllib
from pathlib import Path

import pytest
from numpy.testing import assert_allclose

import pipeline
import pipeline.runner
from experiments import oracles
from pipeline.cli import main
from pipeline.config import dump_config, parse_config
from pipeline.executors.worker import SharedOracle, prepare
from pipeline.points import identity
from pipeline.resolving import ready

PAGE = (Path(__file__).parents[2] / "docs" / "command-oracle.md").read_text(encoding="utf-8")
BLOCKS = re.findall(r"^```(\w+)\n(.*?)^```", PAGE, re.MULTILINE | re.DOTALL)
LIMIT = "time_limit = 60.0"
SMALL = ("fit.design.budget=200", "export.verify=false")


def block(language, word=""):
    return next(text for name, text in BLOCKS if name == language and word in text)


@pytest.fixture
def leaf(tmp_path):
    """The files of the page's example, in a folder of their own."""
    folder = tmp_path / "leaf"
    folder.mkdir()
    (folder / "leaf.py").write_text(block("python", "leaf.py"), encoding="utf-8")
    (folder / "leaf.template.inp").write_text(block("text"), encoding="utf-8")
    (folder / "leaf.toml").write_text(block("toml"), encoding="utf-8")
    return folder / "leaf.toml"


def changed(leaf, old, new):
    text = leaf.read_text(encoding="utf-8")
    assert text.count(old) == 1, old
    leaf.write_text(text.replace(old, new), encoding="utf-8")
    return leaf


class TestPage:
    def test_the_study_is_that_of_the_closed_form(self, leaf, tmp_path, monkeypatch):
        monkeypatch.setattr(pipeline.runner, "write_report", lambda folder, outcome: folder.path)  # takes seconds
        outcome = pipeline.run(leaf, tmp_path / "run", SMALL)
        assert outcome.kept == ("length", "width", "thickness", "load")
        exact = oracles.get("cantilever").evaluate(outcome.fit_runs.design.physical).values
        assert_allclose(outcome.fit_runs.values, exact, rtol=1e-8)
        assert max(e.max_relative for e in outcome.model.validation) < 0.02
        # The folder says all that was run: it can be read back and continued without the files beside the config.
        shutil.rmtree(leaf.parent)
        again = pipeline.read_run(tmp_path / "run")
        assert_allclose(again.fit_runs.values, outcome.fit_runs.values, rtol=0.0)
        monkeypatch.setattr(type(outcome.study.oracle), "_try", None)  # nothing may be run again
        shutil.copy(tmp_path / "run" / "config.toml", tmp_path / "copy.toml")
        repeated = pipeline.run(tmp_path / "copy.toml", tmp_path / "run")
        assert repeated.model.coefficients.tolist() == outcome.model.coefficients.tolist()

    def test_the_python_runs(self, tmp_path):
        done = subprocess.run(
            [sys.executable, "-c", block("python", "oracles.get")], capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, done.stderr
        assert '"1.0", "0.1"]' in done.stdout

    def test_every_key_that_the_config_knows_is_on_the_page(self):
        from pipeline.programs import CommandResponse, ProgramTable

        keys = {*ProgramTable.model_fields, *CommandResponse.model_fields} - {"symbol", "source"}
        assert {key for key in keys if key not in PAGE} == set()


class TestCheck:
    def test_shows_the_exact_argv_and_runs_nothing(self, leaf, capsys):
        before = sorted(leaf.parent.iterdir())
        assert main(["check", str(leaf)]) == 0
        out = capsys.readouterr().out
        assert f"# argv: {json.dumps([sys.executable, 'leaf.py', 'leaf.inp'])}\n" in out
        assert '# file from a template: "leaf.inp", SHA-256 ' in out
        assert "# environment passed on: PATH" in out
        assert sorted(leaf.parent.iterdir()) == before

    def test_what_it_prints_is_a_config_that_needs_no_other_file(self, leaf, tmp_path, capsys):
        main(["check", str(leaf)])
        out = capsys.readouterr().out
        config = parse_config(out)
        assert config == pipeline.load_config(leaf)
        program = tomllib.loads(dump_config(config))["oracle"]["command"]
        assert "{{thickness [mm]:.9e}}" in program["templates"]["leaf.inp"]["text"]
        assert (
            pipeline.resolve(config).oracle.parameters == pipeline.resolve(pipeline.load_config(leaf)).oracle.parameters
        )

    def test_an_argument_cannot_leave_its_comment(self, leaf, capsys):
        changed(leaf, '"leaf.inp"]', '"leaf.inp", "x\\nname = 1\\u001b[2J"]')
        assert main(["check", str(leaf)]) == 0
        comments = capsys.readouterr().out.partition("# Nothing was run")[2].splitlines()[1:]
        assert len(comments) >= 6
        assert all(line.startswith("# ") and line.isprintable() for line in comments)

    def test_another_template_is_another_oracle(self, leaf):
        before = pipeline.resolve(pipeline.load_config(leaf)).oracle.parameters
        (leaf.parent / "leaf.template.inp").write_text(block("text") + "** more\n", encoding="utf-8")
        assert pipeline.resolve(pipeline.load_config(leaf)).oracle.parameters != before

    def test_list_names_it_with_its_settings(self, capsys):
        assert main(["list"]) == 0
        assert "command  any program: files from templates" in capsys.readouterr().out


class TestRefused:
    @pytest.mark.parametrize(
        ("old", "new", "match"),
        [
            ('"leaf.template.inp" }', '"../leaf.toml" }', r"leaf.inp: the file name '../leaf.toml' is not allowed"),
            ('"leaf.template.inp" }', '"/etc/passwd" }', r"the file name '/etc/passwd' is not allowed"),
            ('"leaf.template.inp" }', '"link" }', r"link leads out of its folder"),
            ('"leaf.template.inp" }', '"nowhere" }', r"templates.leaf.inp: there is no file nowhere"),
            ('"leaf.template.inp" }', '"binary" }', r"binary is not UTF-8 text; name such a file by its absolute path"),
            ('{ file = "leaf.template.inp" }', "{ }", r"templates.leaf.inp needs a file or a text"),
            ('"leaf.inp" = {', '"../leaf.inp" = {', r"oracle.command: .*file name '../leaf.inp' is not allowed"),
            ("time_limit", "time_limt", r"unknown key 'oracle.command.time_limt'; did you mean 'time_limit'\?"),
            ("column =", "colum =", r"unknown key 'oracle.command.responses.slope.colum'; did you mean 'column'\?"),
            ('"drawing 12"', '"d", hihg = 1', r"'oracle.command.factors.length.hihg'; did you mean 'high'\?"),
            ("argv = [", "argvs = [", r"unknown key 'oracle.command.argvs'; did you mean 'argv'\?"),
            ("time_limit = 60.0", 'time_limit = "1"', r"oracle.command.time_limit should be a number, got '1'"),
            ("time_limit = 60.0", "time_limit = inf", r"oracle.command.time_limit should be a finite number, got inf"),
            ('"{{python}}", ', "1, ", r"oracle.command.argv.0 should be a string, got 1"),
            ('name = "command"', 'name = "cantilever"', r"'command' and a table \[oracle.command\] belong together"),
            ("max_failed_fraction = 0.05", "parameters.x = 1", r"oracle.parameters: a program has none"),
            ("resolution = 1e-8", 'environment.LD_PRELOAD = "x.so"', r"oracle.command: .* LD_PRELOAD may not be set"),
            ("where = { node = 17 }", 'where = { node = [1] }', r"oracle.command.responses.slope.where.node should be"),
            ('column = "rotation"\nwhere = { node = 17 }', 'function = "os:system"', r"parser function 'os:system'"),
        ],
    )  # fmt: skip
    def test_in_one_sentence(self, old, new, match, leaf):
        (leaf.parent / "binary").write_bytes(b"\xff\xfe\x00")
        (leaf.parent / "link").symlink_to("/etc/passwd")
        with pytest.raises(pipeline.InputError, match=match) as error:
            pipeline.resolve(pipeline.load_config(changed(leaf, old, new)))
        assert "\n" not in str(error.value)

    def test_a_name_without_its_table(self):
        with pytest.raises(pipeline.InputError, match=r"belong together; see docs/command-oracle.md"):
            pipeline.resolve(parse_config('name = "x"\n[oracle]\nname = "command"\n'))

    def test_the_command_line_says_it_without_a_traceback(self, leaf, capsys):
        assert main(["check", str(changed(leaf, "time_limit = 60.0", "time_limit = -1.0"))]) == 2
        assert "time_limit must be above 0" in capsys.readouterr().err


class TestReady:
    """What the runner asks before it begins."""

    def test_working_folders_lie_where_the_runner_says(self, leaf, tmp_path):
        study = ready(
            pipeline.resolve(pipeline.load_config(changed(leaf, LIMIT, f'{LIMIT}\nkeep = "all"'))), tmp_path / "work"
        )
        assert study.oracle(study.screening_design.take([0])).ok.all()
        (folder,) = (tmp_path / "work").iterdir()
        assert {"leaf.inp", "leaf.py", "leaf.csv", "stdout.txt", "stderr.txt"} == {p.name for p in folder.iterdir()}
        deck = (folder / "leaf.inp").read_text(encoding="utf-8")
        written = dict(line.split() for line in deck.splitlines()[1:])
        length, width, thickness, load = study.screening_design.physical[0]
        assert float(written["LENGTH"]) == pytest.approx(1000.0 * length, rel=1e-15)
        assert float(written["WIDTH"]) == pytest.approx(1000.0 * width, rel=1e-15)
        assert written["THICKNESS"] == f"{1000.0 * thickness:.9e}"
        assert float(written["FORCE"]) == load

    def test_a_program_that_only_the_workers_of_a_cluster_need_is_looked_for_there(self, leaf, tmp_path):
        changed(leaf, '"{{python}}"', '"no-such-solver"')
        study = pipeline.resolve(pipeline.load_config(leaf, ["executor.name=dask", "executor.address=tcp://head:1"]))
        assert ready(study, tmp_path).oracle.name == "command"
        shared = SharedOracle("token", oracles.recipe(study.oracle).make, identity(study.oracle), 2)
        with pytest.raises(pipeline.InputError, match=r"^worker .* cannot run the oracle: the program 'no-such"):
            prepare(shared)

    def test_a_program_that_is_not_there_is_refused_before_anything_runs(self, leaf, tmp_path):
        study = pipeline.resolve(pipeline.load_config(changed(leaf, '"{{python}}"', '"no-such-solver"')))
        with pytest.raises(
            pipeline.InputError, match=r"the program 'no-such-solver' was not found on this machine; install"
        ):
            ready(study, tmp_path / "work")

    def test_other_oracles_are_left_as_they_are(self, tmp_path):
        study = pipeline.resolve(parse_config('name = "other"\n[oracle]\nname = "cantilever"\n'))
        assert ready(study, tmp_path) is study


def test_failures_are_in_the_run_folder_with_their_reason(leaf, tmp_path):
    script = leaf.parent / "leaf.py"
    script.write_text(
        script.read_text().replace('print("STEP 1")', 'print("STEP 1")\nif force > 1.19: sys.exit("buckled")'),
        encoding="utf-8",
    )
    with pytest.raises(
        pipeline.TooManyFailures, match=r"run \d+: crashed \(exit code 1; last lines: STEP 1 \| buckled"
    ):
        pipeline.run(leaf, tmp_path / "run", SMALL)
    table = (tmp_path / "run" / "screening" / "runs.csv").read_text(encoding="utf-8")
    assert table.count("buckled") == 6, "half of a two-level design has the larger load"
    assert len(table.splitlines()) == 13
