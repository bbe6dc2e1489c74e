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
    assert [f.outcome for f in found] == [Outcome.AGREES, Outcome.DIFFERS, Outcome.NOT_CHECKED]
    assert "written by flexdoce 0.0.1" in found[1].detail


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"schema": "flexdoce-export/9"}, "expected schema 'flexdoce-export/1', found 'flexdoce-export/9'"),
        ({"target": "c98"}, "this version has no export 'c98'"),
        ({"files": {"../dev.c": "0"}}, "'../dev.c' is not the name of a file in this folder"),
        ({"files": {"a\\b": "0"}}, "is not the name of a file in this folder"),
        ({"files": {"a\x00b": "0"}}, "is not the name of a file in this folder"),
        ({"files": {"\ud800": "0"}}, "is not the name of a file in this folder"),
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
    monkeypatch.setattr(exporting, "_put", _no_space)
    assert set(outcomes(folder).values()) == {Outcome.AGREES}


def _no_space(*_, **__):
    raise OSError(28, "No space left on device")


def test_archives_may_hold_binaries_more_and_nothing_else(tmp_path):
    path = tmp_path / "a.fmu"

    def archive(*members):
        with zipfile.ZipFile(path, "w") as file:
            for name, content in members:
                file.writestr(name, content)
        return path.read_bytes()

    described, library = ("modelDescription.xml", "<a/>"), ("binaries/x/a.so", "b")
    source = archive(described)
    for members, same in (
        ([described, library], True),
        ([described, ("resources/a", "b")], False),
        ([("modelDescription.xml", "<b/>")], False),
        ([("modelDescription.xml", "<a/>" + 10**6 * " ")], False),
        ([library], False),
    ):
        archive(*members)
        assert exporting._same(path, source) is same, members
    with pytest.warns(UserWarning, match="Duplicate name"):
        archive(described, described)
    assert not exporting._same(path, source)
    path.write_bytes(b"no archive")
    assert not exporting._same(path, source)


def test_a_manifest_without_files_is_no_proof(folder):
    manifest = json.loads((folder / "export.json").read_text(encoding="utf-8")) | {"files": {}}
    (folder / "export.json").write_text(json.dumps(manifest), encoding="utf-8")
    found = exporting.verified(folder)
    assert found[1].outcome is Outcome.DIFFERS
    assert "not what the model gives: dev.c, dev.h, dev_selftest.c" in found[1].detail


def test_force_removes_only_what_an_export_left(text, folder):
    (folder / "thesis.tex").write_text("mine", encoding="utf-8")
    manifest = json.loads((folder / "export.json").read_text(encoding="utf-8"))
    manifest["files"]["thesis.tex"] = "00"
    (folder / "export.json").write_text(json.dumps(manifest), encoding="utf-8")
    (folder / "dev.h").write_text("changed by hand", encoding="utf-8")
    exporting.write(folder, exporting.generate(text, "c99", "stem", {})[0], force=True)
    left = {p.name for p in folder.iterdir()}
    assert left == {"thesis.tex", "dev.h", "stem.c", "stem.h", "stem_selftest.c", "model.json", "export.json"}


def test_links_are_replaced_not_followed(text, folder, tmp_path):
    victim = tmp_path / "victim"
    victim.write_text("mine", encoding="utf-8")
    for name in ("verification.csv", "dev.h", "dev.h.partial"):
        (folder / name).unlink(missing_ok=True)
        (folder / name).symlink_to(victim)
    exporting.write(folder, exporting.generate(text, "c99", "dev", {})[0], force=True)
    (folder / "verification.csv").unlink(missing_ok=True)
    (folder / "verification.csv").symlink_to(victim)
    exporting._keep(folder, [])
    assert victim.read_text(encoding="utf-8") == "mine"
    assert not (folder / "dev.h").is_symlink()


def test_a_pipe_in_place_of_a_file_does_not_hang(folder):
    import os

    (folder / "dev.c").unlink()
    os.mkfifo(folder / "dev.c")
    assert outcomes(folder) == {"dev.c as written": Outcome.DIFFERS}


@needs_compiler
def test_a_foreign_library_in_an_fmu_is_not_loaded(text, tmp_path):
    pytest.importorskip("fmpy", reason="FMPY IS NOT INSTALLED: FMUs were not verified")
    import hashlib

    files, _ = exporting.generate(text, "fmi3", "dev", {})
    exporting.write(tmp_path, files)
    path = tmp_path / "dev_forward.fmu"
    with zipfile.ZipFile(path) as archive:
        members = {m.filename: archive.read(m) for m in archive.infolist()}
    binary = next(name for name in members if name.startswith("binaries/"))
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in members.items():
            archive.writestr(name, b"no library at all" if name == binary else content)
    manifest = json.loads((tmp_path / "export.json").read_text(encoding="utf-8"))
    manifest["files"][path.name] = hashlib.sha256(path.read_bytes()).hexdigest()
    (tmp_path / "export.json").write_text(json.dumps(manifest), encoding="utf-8")
    found = {f.what: f for f in exporting.verified(tmp_path)}
    assert found["dev_forward.fmu: its library"].outcome is Outcome.NOT_CHECKED
    assert found["dev_forward.fmu: responses"].outcome is Outcome.AGREES
    assert found["dev_inverse.fmu: its library"].outcome is Outcome.AGREES


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
