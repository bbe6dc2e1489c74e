"""An oracle in a file, from the command line: nothing is run unasked, and no answer of old code is used."""

import json
import shutil
import sys
import textwrap
from pathlib import Path

import pytest

import pipeline
import pipeline.runner
from experiments.oracles import files
from pipeline import InputError
from pipeline.cli import main
from pipeline.points import PointStore
from tests.pipeline.cases import contents, reproducible

CODE = textwrap.dedent(
    """
    from pathlib import Path
    from experiments import Factor, Response
    from experiments.oracles import point_oracle
    Path(__file__).with_name("run.txt").open("a").write("x")

    @point_oracle(
        [Factor("a", "N", 1.0, 2.0), Factor("b", "m", 0.5, 1.0)],
        [Response("u", "Nm"), Response("v", "N")],
        resolution=1e-12,
    )
    def product(a, b, *, k=1.0):
        "two sums"
        return k * a + 2.0 * b, a + b
    """
)
CONFIG = 'name = "study"\noracle = "in/ours.py:product"\nvalidation.n_runs = 4\nexport.targets = []\n'
SMALL = ["--set", "fit.design.budget=0"]


@pytest.fixture(scope="module")
def finished(tmp_path_factory) -> Path:
    """A folder with a config, its oracle, and a run of it; nobody may write to it."""
    place = tmp_path_factory.mktemp("finished") / "home"
    (place / "in").mkdir(parents=True)
    (place / "study.toml").write_text(CONFIG)
    (place / "in" / "ours.py").write_text(CODE)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(pipeline.runner, "write_report", lambda folder, outcome: folder.path / "report.html")
        assert main(["run", str(place / "study.toml"), "--out", str(place / "runs" / "study"), *SMALL]) == 0
    return place


@pytest.fixture
def home(finished, tmp_path, monkeypatch, no_report):
    """A copy of its own, not the current folder, and nothing loaded yet; what the report says is of no interest."""
    place = Path(shutil.copytree(finished, tmp_path / "home"))
    (place / "in" / "run.txt").unlink()
    note = place / "runs" / "study" / "oracle.json"
    note.write_text(note.read_text().replace(str(finished.resolve()), str(place.resolve())))
    elsewhere = tmp_path / "elsewhere"
    elsewhere.mkdir()
    monkeypatch.chdir(elsewhere)
    fresh_process()
    yield place
    fresh_process()


@pytest.fixture
def done(home) -> Path:
    """The run folder in it."""
    return home / "runs" / "study"


def times_run(home: Path) -> int:
    note = home / "in" / "run.txt"
    return len(note.read_text()) if note.is_file() else 0


def refused(capsys, *argv: str | Path) -> str:
    capsys.readouterr()
    assert main([str(a) for a in argv]) == 2
    out, err = capsys.readouterr()
    assert out == ""
    assert "Traceback" not in err
    *_, last = err.splitlines()
    return last


def fresh_process() -> None:
    """As if nothing had been loaded yet."""
    for name in [n for n in sys.modules if n.startswith(files._PREFIX)]:
        del sys.modules[name]


class TestCheck:
    def test_shows_the_file_and_does_not_run_it(self, home, capsys):
        before = contents(home)
        assert main(["check", str(home / "study.toml")]) == 0
        out = capsys.readouterr().out
        code = home / "in" / "ours.py"
        assert f"# {code.resolve()}\n# SHA-256 {files.digest(code.read_bytes())}\n" in out
        assert "# Not checked: what it holds" in out
        assert pipeline.config.parse_config(out).oracle.name == "in/ours.py:product"
        assert contents(home) == before

    def test_load_runs_it(self, home, capsys):
        assert main(["check", str(home / "study.toml"), "--load"]) == 0
        assert times_run(home) == 1
        assert f"# The oracle is from {(home / 'in/ours.py').resolve()}:product" in capsys.readouterr().out
        (home / "in" / "ours.py").write_text("1 / 0\n")
        assert main(["check", str(home / "study.toml")]) == 0
        assert refused(capsys, "check", home / "study.toml", "--load").endswith(
            "line 1: ZeroDivisionError: division by zero"
        )

    def test_what_does_not_need_the_file_is_checked_without_it(self, home, capsys):
        assert "did you mean 'seed'" in refused(capsys, "check", home / "study.toml", "--set", "sed=1")

    def test_set_is_relative_to_the_config_too(self, home, capsys):
        (home / "other.py").write_text(CODE)
        for word in ("oracle=other.py:product", "oracle.name=other.py:product"):
            assert main(["check", str(home / "study.toml"), "--set", word]) == 0
            assert f"# {(home / 'other.py').resolve()}\n" in capsys.readouterr().out
        assert main(["check", str(home / "study.toml"), "--set", "oracle.parameters.k=2.0", "--load"]) == 0
        assert "k = 2.0" in capsys.readouterr().out


class TestHostile:
    @pytest.mark.parametrize("command", ["check", "plan", "run"])
    @pytest.mark.parametrize("kind", ["file", "folder"])
    def test_links_that_lead_out_are_refused(self, kind, command, home, capsys):
        outside = home.parent / "outside"
        outside.mkdir()
        (outside / "evil.py").write_text(CODE)
        link = home / "evil.py" if kind == "file" else home / "way"
        link.symlink_to(outside / "evil.py" if kind == "file" else outside)
        name = "evil.py:product" if kind == "file" else "way/evil.py:product"
        sentence = refused(capsys, command, home / "study.toml", "--set", f"oracle={name}")
        assert sentence.startswith(f"flexdoce: oracle.name: {name.partition(':')[0]} leads out of its folder")
        assert not (outside / "run.txt").exists()

    def test_what_is_no_plain_file_is_refused(self, home, capsys):
        (home / "folder.py").mkdir()
        assert "is no plain file" in refused(capsys, "run", home / "study.toml", "--set", "oracle=folder.py:x")
        (home / "latin.py").write_bytes(b"# \xe9\n")
        assert "latin.py is not UTF-8 text" in refused(capsys, "run", home / "study.toml", "--set", "oracle=latin.py:x")

    def test_a_note_cannot_make_other_code_run(self, done, home, capsys):
        """A run folder that somebody sent: its note may name any folder, but only the code that it knows is found."""
        outside = home.parent / "outside"
        (outside / "in").mkdir(parents=True)
        (outside / "in" / "ours.py").write_text(CODE + "# mine\n")
        sent = Path(shutil.copytree(done, home.parent / "sent"))
        note = json.loads((sent / "oracle.json").read_text())
        (sent / "oracle.json").write_text(json.dumps({**note, "folder": str(outside), "from_here": "../outside"}))
        shutil.rmtree(home)
        assert "ours.py has changed since this run folder was made" in refused(
            capsys, "run", sent / "config.toml", "--out", sent
        )
        assert not (outside / "in" / "run.txt").exists()

    def test_text_alone_has_no_folder(self):
        with pytest.raises(InputError, match=r"'in/ours.py:product' is relative to a config's folder, and this config"):
            pipeline.resolve(pipeline.config.parse_config(CONFIG))


class TestRunFolder:
    def test_says_what_was_run(self, done, home, finished):
        code = (home / "in" / "ours.py").read_bytes()
        assert (done / "oracle.py").read_bytes() == code
        assert json.loads((done / "oracle.json").read_text())["sha256"] == files.digest(code)
        log = (done / "log.txt").read_text()
        assert (
            f"the oracle product was loaded from {finished.resolve()}/in/ours.py, SHA-256 {files.digest(code)}" in log
        )
        model = json.loads((done / "model.json").read_text())
        assert model["provenance"]["oracle_code"] == files.digest(code)[:16]
        assert str(finished) not in (done / "model.json").read_text() + (done / "config.toml").read_text()

    def test_is_read_without_the_code(self, done, home, capsys):
        moved = Path(shutil.move(done, home.parent / "moved"))
        shutil.rmtree(home)
        for argv in (["report", moved], ["status", moved]):
            assert main([str(a) for a in argv]) == 0, capsys.readouterr().err
        found = pipeline.read_run(moved)
        assert (found.study.oracle.name, found.study.oracle.summary) == ("product", "two sums")
        assert found.study.oracle.parameters == {"k": 1.0}
        with pytest.raises(ValueError, match=r"read_run\(folder, load=True\)"):
            found.study.oracle(found.fit_runs.design)

    def test_reading_runs_no_code(self, done, home):
        before = times_run(home)
        main(["report", str(done)])
        assert times_run(home) == before
        loaded = pipeline.read_run(done, load=True)
        assert times_run(home) == before + 1
        assert loaded.study.oracle(loaded.fit_runs.design).ok.all()

    def test_loading_code_that_is_gone_or_changed_is_refused(self, done, home, capsys):
        code = home / "in" / "ours.py"
        code.write_text(CODE + "# changed\n")
        assert "ours.py has changed since this run folder was made" in refused(capsys, "report", done, "--load")
        code.unlink()
        sentence = refused(capsys, "report", done, "--load")
        assert f"in/ours.py lies neither in {done.resolve()} nor where it was ({home.resolve()})" in sentence
        assert f"{done / 'oracle.py'} is a copy of it: look at it, and save it as {done / 'in/ours.py'}" in sentence
        (done / "in").mkdir()
        (done / "in" / "ours.py").write_text(CODE + "# another\n")
        assert "ours.py is not the code of this run (SHA-256 " in refused(capsys, "report", done, "--load")
        shutil.copy(done / "oracle.py", done / "in" / "ours.py")
        assert main(["report", str(done), "--load"]) == 0

    @pytest.mark.parametrize("damage", [None, "", "[]", "{}", '{"oracle": {"name": 3}}'])
    def test_a_damaged_note_is_refused(self, damage, done, capsys):
        note = done / "oracle.json"
        note.unlink() if damage is None else note.write_text(damage)
        assert "oracle.json is missing or damaged: " in refused(capsys, "report", done)

    def test_goes_on_with_its_own_config_wherever_it_lies(self, done, home, monkeypatch):
        before, asked = reproducible(done), []
        monkeypatch.setattr(PointStore, "add", lambda *args: asked.append(args))
        assert main(["run", str(home / "study.toml"), "--out", str(done), *SMALL]) == 0
        whole = Path(shutil.move(home, home.parent / "renamed"))
        there = whole / "runs" / "study"
        assert main(["run", str(there / "config.toml"), "--out", str(there)]) == 0
        assert asked == []
        after = reproducible(there)
        assert {k: v for k, v in after.items() if k != "oracle.json"} == {
            k: v for k, v in before.items() if k != "oracle.json"
        }
        assert json.loads((there / "oracle.json").read_text())["folder"] == str(whole.resolve())


class TestChangedCode:
    def test_never_gets_old_answers(self, done, home, capsys):
        (home / "in" / "ours.py").write_text(CODE.replace("a + b", "a - b"))
        assert main(["run", str(home / "study.toml"), "--out", str(done), *SMALL]) == 0
        runs = pipeline.read_run(done).fit_runs
        a, b = runs.design.physical.T
        assert (runs.values[:, 1] == a - b).all()
        log = (done / "log.txt").read_text()
        assert f"that file has changed: its SHA-256 was {files.digest(CODE.encode())}" in log
        assert (
            "are answers of another oracle, version or parameters: they stay there, and everything is run anew" in log
        )

    def test_while_it_is_read(self, home, monkeypatch, capsys):
        monkeypatch.setattr(pipeline.oracle_file, "digest", lambda content: "0" * 64)
        assert "ours.py changed while it was read; try again" in refused(capsys, "plan", home / "study.toml")

    @pytest.mark.parametrize("broken", ["x = (", "raise OSError('no licence')", "import sys; sys.exit()", "x = 1"])
    def test_broken_code_leaves_the_run_as_it_was(self, broken, done, home, capsys):
        (home / "in" / "ours.py").write_text(broken)
        before = contents(done)
        sentence = refused(capsys, "run", home / "study.toml", "--out", done, *SMALL)
        assert sentence.startswith(f"flexdoce: oracle: {home.resolve()}/in/ours.py")
        assert contents(done) == before


class TestAnswering:
    def test_code_that_breaks_its_word_while_it_runs_is_one_sentence(self, home, capsys):
        code = CODE.replace("resolution=1e-12", "jax=True").replace('"two sums"', "assert a > 0")
        (home / "in" / "ours.py").write_text(code)
        sentence = refused(capsys, "run", home / "study.toml", *SMALL)
        assert sentence.startswith(
            f"flexdoce: oracle 'product' ({home.resolve()}/in/ours.py:product): evaluate raised "
        )
        assert "TracerBoolConversionError" in sentence
        assert "failed in screening" in Path("runs/study/log.txt").read_text()

    def test_what_cannot_be_prepared_is_one_sentence(self, home, capsys):
        prepare = "def prepare(self):\n        raise RuntimeError('no mesh')\n"
        (home / "in" / "ours.py").write_text(CODE + f"\nclass Heavy(product):\n    name = 'heavy'\n    {prepare}")
        sentence = refused(capsys, "plan", home / "study.toml", "--set", "oracle=in/ours.py:Heavy")
        assert sentence.endswith("prepare raised RuntimeError: no mesh")
