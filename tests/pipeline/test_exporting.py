"""Folders of generated code: what verification sees, and what it refuses to run."""

import json
import shutil
import zipfile

import pytest

from pipeline import exporting
from pipeline.cli import main
from pipeline.errors import InputError
from surrogates import dumps
from surrogates.exports import TARGETS
from surrogates.exports.verification import MODULES, Outcome
from tests.surrogates.cases import square_quadratic

COMPILER = next((c for c in ("gcc", "clang", "cc") if shutil.which(c)), None)
needs_compiler = pytest.mark.skipif(
    COMPILER is None, reason="NO C COMPILER: looked for gcc, clang and cc on PATH. Exported C was not verified."
)


@pytest.fixture(scope="module")
def text():
    return dumps(square_quadratic())


@pytest.fixture
def folder(text, tmp_path):
    files, notes = exporting.generate(text, "c99", "dev", {})
    assert notes == []
    exporting.write(tmp_path / "code", files)
    return tmp_path / "code"


def outcomes(folder):
    return {f.what: f.outcome for f in exporting.verified(folder)}


@needs_compiler
def test_what_was_written_agrees(folder):
    found = outcomes(folder)
    assert set(found.values()) == {Outcome.AGREES}
    assert any("forward at" in what for what in found)
    assert "checks agree" in exporting.told(folder)


@pytest.mark.parametrize("name", ["dev.c", "dev.h", "dev_selftest.c", "model.json"])
def test_a_file_that_was_changed_is_named_and_nothing_runs(folder, name, monkeypatch):
    monkeypatch.setattr(exporting, "verify", lambda *_: pytest.fail("changed code was run"))
    path = folder / name
    path.write_text(path.read_text(encoding="utf-8") + "\n", encoding="utf-8")
    assert outcomes(folder) == {f"{name} as written": Outcome.DIFFERS}
    path.unlink()
    if name != "model.json":
        assert outcomes(folder) == {f"{name} as written": Outcome.DIFFERS}


def test_code_that_the_model_does_not_give_is_not_run_even_if_the_manifest_agrees(folder, monkeypatch):
    monkeypatch.setattr(exporting, "verify", lambda *_: pytest.fail("foreign code was run"))
    import hashlib

    source = (folder / "dev.c").read_text(encoding="ascii").replace("coded[0]", "coded[1]", 1)
    (folder / "dev.c").write_text(source, encoding="ascii")
    manifest = json.loads((folder / "export.json").read_text(encoding="utf-8"))
    manifest["files"]["dev.c"] = hashlib.sha256(source.encode()).hexdigest()
    (folder / "export.json").write_text(json.dumps(manifest), encoding="utf-8")
    found = exporting.verified(folder)
    assert [f.outcome for f in found] == [Outcome.AGREES, Outcome.DIFFERS, Outcome.NOT_CHECKED]
    assert "not what the model gives: dev.c" in found[1].detail
    manifest["flexdoce"] = "0.0.1"
    (folder / "export.json").write_text(json.dumps(manifest), encoding="utf-8")
    found = exporting.verified(folder)
    assert [f.outcome for f in found] == [Outcome.AGREES, Outcome.NOT_CHECKED, Outcome.NOT_CHECKED]
    assert "written by flexdoce 0.0.1" in found[1].detail


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "flexdoce-export/9"}, "expected schema 'flexdoce-export/1', found 'flexdoce-export/9'"),
        ({"target": "c98"}, "this version has no export 'c98'"),
        ({"files": {"../dev.c": "0"}}, "'../dev.c' is not the name of a file in this folder"),
        ({"files": {"a\\b": "0"}}, "is not the name of a file in this folder"),
        ({"files": {"dev.c": 3}}, "'dev.c' is not the name of a file in this folder with its SHA-256"),
        ({"settings": 3}, "settings must be a table, got 3"),
        ({"prefix": None}, "prefix must be a text, got None"),
    ],
)
def test_a_manifest_that_is_none_is_refused(folder, change, message):
    manifest = json.loads((folder / "export.json").read_text(encoding="utf-8")) | change
    (folder / "export.json").write_text(json.dumps(manifest), encoding="utf-8")
    with pytest.raises(InputError, match=message.replace("\\", "\\\\")):
        exporting.verified(folder)


@pytest.mark.parametrize("junk", ["", "[]", "{", "null", "\ud800"])
def test_a_manifest_of_junk_is_refused(folder, junk):
    (folder / "export.json").write_bytes(junk.encode("utf-8", "surrogatepass"))
    with pytest.raises(InputError, match=r"export\.json"):
        exporting.verified(folder)


def test_a_model_of_another_schema_or_changed_is_refused(folder):
    document = json.loads((folder / "model.json").read_text(encoding="utf-8"))
    (folder / "model.json").write_text(json.dumps(document | {"schema": "flexdoce-model/9"}), encoding="utf-8")
    with pytest.raises(InputError, match=r"model\.json: not a model this version reads: expected schema"):
        exporting.verified(folder)
    document["coefficients"]["r0"][1] += 1e-9
    (folder / "model.json").write_text(json.dumps(document), encoding="utf-8")
    with pytest.raises(InputError, match=r"model\.json: the model was changed after it was written"):
        exporting.verified(folder)


def test_a_read_only_folder_is_verified_all_the_same(folder, monkeypatch):
    monkeypatch.setattr(exporting, "verify", lambda *_: [])
    monkeypatch.setattr("pathlib.Path.write_text", _no_space)
    assert set(outcomes(folder).values()) == {Outcome.AGREES}


def _no_space(*_, **__):
    raise OSError(28, "No space left on device")


def test_archives_may_hold_binaries_more_and_nothing_else(tmp_path):
    def archive(members):
        path = tmp_path / "a.fmu"
        with zipfile.ZipFile(path, "w") as file:
            for name, content in members.items():
                file.writestr(name, content)
        return path.read_bytes()

    source = archive({"modelDescription.xml": "<a/>"})
    assert exporting._same(archive({"modelDescription.xml": "<a/>", "binaries/x/a.so": "b"}), source)
    assert not exporting._same(archive({"modelDescription.xml": "<a/>", "resources/a": "b"}), source)
    assert not exporting._same(archive({"modelDescription.xml": "<b/>"}), source)
    assert not exporting._same(archive({"binaries/x/a.so": "b"}), source)
    assert not exporting._same(b"no archive", source)


def test_every_target_has_a_verifier():
    assert set(MODULES) == set(TARGETS)


class TestCommand:
    def test_ends_with_4_if_anything_differs(self, folder, capsys):
        (folder / "dev.c").write_text("int main(void) { return 0; }", encoding="ascii")
        assert main(["verify", str(folder)]) == 4
        captured = capsys.readouterr()
        assert "differs" in captured.out
        assert "dev.c as written: it was changed after it was written" in captured.err

    @needs_compiler
    def test_finds_the_folders_of_a_run_and_says_what_it_checked(self, folder, tmp_path, capsys):
        (tmp_path / "run" / "exports").mkdir(parents=True)
        shutil.move(folder, tmp_path / "run" / "exports" / "c99")
        for place in (tmp_path / "run", tmp_path / "run" / "exports", tmp_path / "run" / "exports" / "c99"):
            assert main(["verify", str(place)]) == 0
            assert ": forward at " in capsys.readouterr().out

    def test_a_folder_without_code_is_refused(self, tmp_path, capsys):
        assert main(["verify", str(tmp_path)]) == 2
        assert "holds no generated code: no export.json in it" in capsys.readouterr().err

    def test_without_a_compiler_it_says_so_and_the_files_are_there(self, text, tmp_path, capsys, monkeypatch):
        monkeypatch.setattr("surrogates.exports.verification.base.shutil.which", lambda *_: None)
        (tmp_path / "model.json").write_text(text, encoding="utf-8")
        out = tmp_path / "o"
        argv = ["export", str(tmp_path / "model.json"), "--to", "c99", "--prefix", "dev", "--out", str(out)]
        assert main(argv) == 0
        assert "no C compiler on PATH" in capsys.readouterr().out
        assert (out / "dev.c").is_file()
