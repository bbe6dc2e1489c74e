"""Paths stay inside the folders they were given: links, pipes and folders in place of files, wherever we write."""

import os
import shutil
from pathlib import Path

import pytest

from pipeline import InputError, read_run
from pipeline.cli import main
from pipeline.lock import LOCK, FolderLock, holder
from pipeline.store import FOLDERS, OURS, RunFolder
from tests.pipeline.cases import config_text, contents
from tests.pipeline.hostile import within

pytestmark = pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="NO LINKS: attacks by links and pipes were not tried")

SET = ["--set", "fit.design.budget=100", "--set", "validation.n_runs=20", "--set", "export.verify=false"]


@pytest.fixture
def run(counted, tmp_path, no_report, capsys):
    config = tmp_path / "study.toml"
    config.write_text(config_text(), encoding="utf-8")

    def call(folder: Path, *more: str) -> tuple[int, str]:
        with within(20.0):
            code = main(["run", str(config), "--out", str(folder), *SET, *more])
        err = capsys.readouterr().err
        assert "Traceback" not in err
        return code, err.splitlines()[-1] if err else ""

    return call


@pytest.fixture(scope="module")
def folder_once(tmp_path_factory):
    """Filled by the first test that needs it."""
    return tmp_path_factory.mktemp("once") / "run"


@pytest.fixture
def folder(run, folder_once, tmp_path) -> Path:
    """A finished run folder that a test may attack."""
    if not folder_once.exists():
        assert run(folder_once)[0] == 0
    return Path(shutil.copytree(folder_once, tmp_path / "run"))


@pytest.fixture
def outside(tmp_path) -> Path:
    """A folder of somebody else, with a file; what a test does must leave both alone."""
    place = tmp_path / "outside"
    place.mkdir()
    (place / "mine.txt").write_text("mine", encoding="utf-8")
    return place


def swapped(place: Path, target: Path) -> None:
    """A link to `target` at `place`, whatever was there."""
    if place.is_dir() and not place.is_symlink():
        shutil.rmtree(place)
    place.unlink(missing_ok=True)
    place.parent.mkdir(exist_ok=True)
    place.symlink_to(target)


MEMBERS = ["config.toml", LOCK, *OURS]


class TestLinksInARunFolder:
    @pytest.mark.parametrize("name", MEMBERS)
    def test_are_refused_and_not_written_through(self, name, run, folder, outside):
        target = outside if name in FOLDERS else outside / "mine.txt"
        if name == "config.toml":
            shutil.copy(folder / name, target)
        swapped(folder / name, target)
        before = contents(outside)
        code, said = run(folder)
        assert code == 2
        assert f"{folder / name} is a link" in said
        assert contents(outside) == before

    @pytest.mark.parametrize("name", ["points.sqlite", "log.txt", "model.json", "screening", "exports"])
    def test_fresh_removes_the_link_and_not_what_it_points_to(self, name, run, folder, outside):
        swapped(folder / name, outside if name in FOLDERS else outside / "mine.txt")
        before = contents(outside)
        assert run(folder, "--fresh")[0] == 0
        assert contents(outside) == before
        assert not (folder / name).is_symlink()

    def test_a_linked_export_is_refused(self, run, folder, outside):
        swapped(folder / "exports" / "c99", outside)
        before = contents(outside)
        code, said = run(folder)
        assert (code, contents(outside)) == (2, before)
        assert "exports/c99 is a link" in said

    @pytest.mark.parametrize("name", ["model.json.partial", "screening/runs.csv.partial", "state.json.partial"])
    def test_a_link_for_the_file_that_is_begun_is_replaced(self, name, run, folder, outside):
        swapped(folder / name, outside / "mine.txt")
        assert run(folder)[0] == 0
        assert (outside / "mine.txt").read_text(encoding="utf-8") == "mine"

    def test_a_linked_file_of_a_stage_is_replaced(self, run, folder, outside):
        swapped(folder / "screening" / "runs.csv", outside / "mine.txt")
        assert run(folder)[0] == 0
        assert (outside / "mine.txt").read_text(encoding="utf-8") == "mine"
        assert not (folder / "screening" / "runs.csv").is_symlink()

    @pytest.mark.parametrize("name", ["../x", "a/../../x", "/tmp/x"])
    def test_names_that_leave_the_folder_are_a_bug_of_ours(self, name, tmp_path):
        with pytest.raises(ValueError, match="not inside"):
            RunFolder(tmp_path / "run").inside(name)

    def test_the_lock_is_not_looked_for_behind_a_link(self, tmp_path, outside):
        swapped(tmp_path / LOCK, outside / "mine.txt")
        assert holder(tmp_path) is None
        with pytest.raises(OSError, match="symbolic links"):
            FolderLock(tmp_path)
        assert (outside / "mine.txt").read_text(encoding="utf-8") == "mine"


class TestOddFiles:
    @pytest.mark.parametrize("name", ["points.sqlite", "log.txt", "model.json", LOCK])
    @pytest.mark.parametrize("make", [os.mkfifo, os.mkdir], ids=["pipe", "folder"])
    def test_in_place_of_ours_are_refused_without_waiting(self, name, make, run, folder):
        (folder / name).unlink(missing_ok=True)
        make(folder / name)
        code, said = run(folder)
        assert code == 2
        assert f"{folder / name} is no plain file" in said
        with within(10.0):
            assert main(["status", str(folder)]) == 0

    def test_a_file_in_place_of_a_folder(self, run, folder):
        shutil.rmtree(folder / "fit")
        (folder / "fit").write_text("x", encoding="utf-8")
        code, said = run(folder)
        assert code == 2
        assert "fit is no plain folder" in said

    @pytest.mark.parametrize("name", ["model.json", "screening/runs.csv", "fit/design.csv", "validation/runs.csv"])
    @pytest.mark.parametrize("kind", ["pipe", "folder", "link", "circle", "sparse"])
    def test_are_not_read_back(self, kind, name, folder, outside):
        place = folder / name
        content = place.read_bytes()
        place.unlink()
        if kind == "pipe":
            os.mkfifo(place)
        elif kind == "folder":
            place.mkdir()
        elif kind == "link":
            (outside / "copy").write_bytes(content)
            place.symlink_to(outside / "copy")
        elif kind == "circle":
            place.symlink_to(place)
        else:
            with place.open("wb") as file:
                file.truncate(10 * 2**30)
        words = {"link": "is a link", "circle": "missing or unreadable"}.get(kind, "no plain file")
        with within(10.0), pytest.raises(InputError, match=words):
            read_run(folder)


class TestCache:
    def test_that_is_a_link_to_a_file(self, run, tmp_path, outside):
        (tmp_path / "cache").symlink_to(outside / "mine.txt")
        code, said = run(tmp_path / "out", "--cache", str(tmp_path / "cache"))
        assert code == 2
        assert f"cannot use the cache {tmp_path / 'cache'}" in said
        assert (outside / "mine.txt").read_text(encoding="utf-8") == "mine"

    def test_whose_store_is_a_link(self, run, tmp_path, outside):
        (tmp_path / "cache").mkdir()
        (tmp_path / "cache" / "points.sqlite").symlink_to(outside / "new.sqlite")
        code, said = run(tmp_path / "out", "--cache", str(tmp_path / "cache"))
        assert code == 2
        assert "points.sqlite is a link" in said
        assert not (outside / "new.sqlite").exists()

    def test_that_is_a_link_to_a_folder_is_that_folder(self, run, tmp_path, outside):
        """The user's own words, as with --out."""
        (tmp_path / "cache").symlink_to(outside)
        assert run(tmp_path / "out", "--cache", str(tmp_path / "cache"))[0] == 0
        assert (outside / "points.sqlite").is_file()


class TestExports:
    @pytest.mark.parametrize("name", ["model.json", "verification.csv", "export.json", "study.c"])
    def test_a_pipe_is_not_waited_for(self, name, folder, capsys):
        place = folder / "exports" / "c99" / name
        place.unlink(missing_ok=True)
        os.mkfifo(place)
        with within(20.0):
            read_run(folder)
            main(["verify", str(place.parent)])
        assert "Traceback" not in capsys.readouterr().err
