"""A program as an oracle: good answers, every kind of failure with its reason, folders, retries, and many at once."""

import json
import multiprocessing
import os
import re
import sys
from concurrent.futures import ProcessPoolExecutor, ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Status, oracles
from experiments.oracles.command import folder as folders
from experiments.oracles.command import process
from tests.experiments.command_cases import SUM, at, made, once, settings


def folders_in(tmp_path):
    work = tmp_path / "work"
    return sorted(work.iterdir()) if work.is_dir() else []


class TestAnswers:
    def test_numbers_go_in_and_come_out_to_the_last_bit(self, tmp_path):
        oracle = made(tmp_path)
        points = [(0.1 + 0.2, 1 / 3), (0.0, -1.0), (2.0, 1e-17)]
        runs = oracle(at(oracle, *points))
        assert runs.failures() == ""
        assert_array_equal(runs.values[:, 0], [a + 2.0 * b for a, b in runs.design.physical])

    def test_an_answer_does_not_depend_on_order_or_company(self, tmp_path):
        oracle = made(tmp_path, keep="none")
        design = at(oracle, *[(0.1 * i, 0.3 - 0.05 * i) for i in range(5)])
        together = oracle(design).values
        assert_array_equal(oracle(design.take([4, 0, 2])).values, together[[4, 0, 2]])
        assert_array_equal(oracle(design.take([3])).values, together[[3]])

    def test_no_points_no_answers(self, tmp_path):
        assert made(tmp_path).evaluate(np.empty((0, 2))).values.shape == (0, 1)

    def test_threads_and_processes_give_the_same(self, tmp_path):
        oracle = made(tmp_path)
        points = [np.array([[0.25 * i, 0.5]]) for i in range(4)]
        expected = [float(p[0, 0] + 1.0) for p in points]
        with ThreadPoolExecutor(4) as pool:
            assert [float(a.values[0, 0]) for a in pool.map(oracle.evaluate, points)] == expected
        with ProcessPoolExecutor(2, mp_context=multiprocessing.get_context("spawn")) as pool:
            assert [float(a.values[0, 0]) for a in pool.map(oracle.evaluate, points)] == expected

    def test_the_same_point_twice_at_once_has_two_folders(self, tmp_path):
        oracle = made(tmp_path, "time.sleep(0.2)\n" + SUM)
        with ThreadPoolExecutor(3) as pool:
            answers = list(pool.map(oracle.evaluate, [np.array([[1.0, 0.5]])] * 3))
        assert [float(a.values[0, 0]) for a in answers] == [2.0] * 3
        names = [p.name for p in folders_in(tmp_path)]
        assert len(names) == 3
        assert len({n.rpartition("-")[0] for n in names}) == 1

    def test_contract_of_what_an_oracle_says_of_itself(self, tmp_path):
        oracle = made(tmp_path, resolution=1e-6, source="a page")
        assert oracle.name == "command"
        assert type(oracle) is oracles.oracle_class("command")
        assert (oracle.resolution, oracle.source, oracle.batch) == (1e-6, "a page", 1)
        assert oracle.summary
        assert all(f.source for f in oracle.factors)
        json.dumps(oracle.parameters, allow_nan=False)
        assert "command" not in oracles.names(), "names() lists what can be had without settings"

    def test_nothing_is_added_to_what_the_program_sees(self, tmp_path, monkeypatch):
        monkeypatch.setenv("SECRET_TOKEN", "1")
        monkeypatch.setenv("LICENCE_SERVER", "here")
        script = "print(sorted(os.environ))\nprint(os.getcwd() == sys.argv[3], os.environ['MODE'])\n" + SUM
        oracle = made(
            tmp_path,
            script,
            argv=["{{python}}", "-I", "-S", "program.py", "{{a}}", "{{b}}", "{{folder}}"],
            environment={"MODE": "a b; $HOME"},
            inherit=["LICENCE_SERVER"],
        )
        assert once(oracle)[0] == "ok"
        names, cwd = (folders_in(tmp_path)[0] / "stdout.txt").read_text().splitlines()[:2]
        assert cwd == "True a b; $HOME"
        assert "'LICENCE_SERVER'" in names
        assert "SECRET" not in names
        seen = set(json.loads(names.replace("'", '"')))
        assert seen <= {*process.INHERITED, "LICENCE_SERVER", "MODE", process.MARK, "LC_CTYPE"}

    def test_standard_input_is_empty(self, tmp_path):
        assert once(made(tmp_path, "assert sys.stdin.read() == ''\n" + SUM))[0] == "ok"

    def test_arguments_are_not_for_a_shell(self, tmp_path):
        script = "print(sys.argv[3:])\n" + SUM
        words = ["$(touch x)", "; touch x", "*", "a b", "'\""]
        oracle = made(tmp_path, script, argv=["{{python}}", "-I", "-S", "program.py", "{{a}}", "{{b}}", *words])
        assert once(oracle)[0] == "ok"
        (folder,) = folders_in(tmp_path)
        assert (folder / "stdout.txt").read_text().splitlines()[0] == str(words)
        assert not (folder / "x").exists()


class TestFailures:
    @pytest.mark.parametrize(
        ("script", "status", "reason"),
        [
            ("print('working')\nsys.exit(3)", "crashed", r"exit code 3; last lines: working"),
            ("raise RuntimeError('mesh is tangled')", "crashed", r"exit code 1; .*RuntimeError: mesh is tangled"),
            ("os.kill(os.getpid(), signal.SIGSEGV)", "crashed", r"signal 11; it printed nothing"),
            ("print('nothing of use')", "crashed", r"y: nothing in stdout.txt matches .*last lines: nothing of use"),
            ("print('y = *****')", "crashed", r"y: '\*\*\*\*\*' in stdout.txt is no number"),
            ("print('y = 1_0')", "crashed", r"y: '1_0' in stdout.txt is no number"),
            ("print('y = nan')", "non_finite", r"y not finite; last lines: y = nan"),
            ("print('y = -Infinity')", "non_finite", r"y not finite"),
            ("print('y = 1e999')", "non_finite", r"y not finite"),
            ("print('NO CONVERGENCE at 7')\n" + SUM, "not_converged", r"it printed 'NO CONVERGENCE'"),
            ("print('NO CONVERGENCE')\nsys.exit(1)", "not_converged", r"it printed 'NO CONVERGENCE'"),
            ("sys.stderr.write('bad geometry 9')\n" + SUM, "rejected", r"it printed 'bad geometry 9'"),
            ("os.write(1, bytes(range(256)))\nsys.exit(2)", "crashed", r"exit code 2; last lines: "),
        ],
    )
    def test_is_data_with_a_reason(self, script, status, reason, tmp_path):
        oracle = made(tmp_path, script, rejected_if=r"bad geometry \d+", not_converged_if="NO CONVERGENCE")
        runs = oracle(at(oracle, (1.0, 0.5)))
        assert runs.status == (Status(status),)
        assert np.isnan(runs.values).all()
        assert runs.reasons[0].isprintable(), "one line, for a CSV cell and a terminal"
        assert re.search(reason, runs.reasons[0]), runs.reasons[0]

    def test_the_last_twenty_lines_are_in_the_reason(self, tmp_path):
        _, reason, _ = once(made(tmp_path, "for i in range(30): print('line', i)\nsys.exit(1)"))
        assert "line 9 " not in reason
        assert reason.count("line 1") == 10
        assert "line 10 | line 11" in reason
        assert "line 29" in reason

    def test_other_points_are_answered_all_the_same(self, tmp_path):
        oracle = made(tmp_path, "if a == 1.0: sys.exit(9)\n" + SUM)
        runs = oracle(at(oracle, (0.5, 0.0), (1.0, 0.0), (1.5, 0.0)))
        assert runs.status == (Status.OK, Status.CRASHED, Status.OK)
        assert_array_equal(runs.values[:, 0], [0.5, np.nan, 1.5])

    def test_a_program_that_is_not_there(self, tmp_path):
        oracle = made(tmp_path, argv=["no-such-solver", "{{a}}", "{{b}}"], files={})
        status, reason, _ = once(oracle)
        assert status == "crashed"
        assert reason.startswith(
            "the program 'no-such-solver' was not found on this machine; install it, put it on PATH or"
        )
        assert any("NOT FOUND" in line for line in oracle.openly((1.0, 0.5)))

    def test_a_program_that_cannot_be_started(self, tmp_path):
        text = tmp_path / "notes"
        text.write_text("no program")
        text.chmod(0o700)
        status, reason, _ = once(made(tmp_path, argv=[str(text), "{{a}}", "{{b}}"], files={}))
        assert status == "crashed"
        assert "could not be started" in reason

    def test_other_exit_codes_can_mean_success(self, tmp_path):
        assert once(made(tmp_path, SUM + "sys.exit(8)", exit_codes=[0, 8]))[0] == "ok"

    def test_a_number_too_wide_for_its_columns_is_rejected_before_anything_runs(self, tmp_path):
        oracle = made(tmp_path, argv=["{{python}}", "-I", "-S", "program.py", "{{a:5.3f}}", "{{b}}"])
        assert once(oracle, 2.0, 0.0)[0] == "ok"
        status, reason, _ = once(oracle, 12.0, 0.0)
        assert status == "rejected"
        assert "a = 12.0 does not fit in 5 characters as '5.3f': 12.000" in reason

    def test_output_without_end_is_ended(self, tmp_path, monkeypatch):
        monkeypatch.setattr(process, "MOST_PRINTED", 100_000)
        status, reason, _ = once(made(tmp_path, "while True: print('x' * 1000)"))
        assert status == "crashed"
        assert "it printed more than 100000 bytes and was ended" in reason

    def test_a_result_that_is_too_large_is_not_read(self, tmp_path, monkeypatch):
        script = "open('big', 'w').write('y = 1' + ' ' * 5000)"
        responses = {"y": {"unit": "m", "file": "big", "regex": r"y = (\S+)"}}
        assert once(made(tmp_path, script, responses=responses))[2] == 1.0
        monkeypatch.setattr(folders.read_inside, "__defaults__", (1000,))
        assert "big has 5005 bytes; at most 1000 are read" in once(made(tmp_path, script, responses=responses))[1]


class TestFolders:
    @pytest.mark.parametrize(("keep", "left"), [("all", 2), ("failed", 1), ("none", 0)])
    def test_what_is_kept(self, keep, left, tmp_path):
        oracle = made(tmp_path, "if a == 1.0: sys.exit(9)\n" + SUM, keep=keep)
        runs = oracle(at(oracle, (0.5, 0.0), (1.0, 0.0)))
        assert len(folders_in(tmp_path)) == left
        if keep != "none":
            name = runs.reasons[1].rpartition("(folder ")[2].rstrip(")")
            (kept,) = (tmp_path / "work").glob(name)
            assert (kept / "program.py").is_file()

    def test_a_folder_that_is_removed_takes_nothing_else_with_it(self, tmp_path):
        (tmp_path / "precious").mkdir()
        (tmp_path / "precious" / "file").write_text("still here")
        script = f"os.symlink({str(tmp_path / 'precious')!r}, 'link')\n" + SUM
        assert once(made(tmp_path, script, keep="none"))[0] == "ok"
        assert folders_in(tmp_path) == []
        assert (tmp_path / "precious" / "file").read_text() == "still here"

    def test_a_temporary_place_where_none_is_given(self, tmp_path, monkeypatch):
        monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
        assert once(made(None, keep="none"))[0] == "ok"
        assert list(tmp_path.iterdir()) == []
        _, reason, _ = once(made(None, "sys.exit(1)", keep="failed"))
        assert (Path(reason.rpartition("(folder ")[2].rstrip(")")) / "program.py").is_file()

    def test_working_in_gives_the_place_but_not_over_a_given_one(self, tmp_path):
        oracle = made(None).working_in(tmp_path / "work")
        assert oracle.parameters == made(None).parameters
        assert once(oracle)[0] == "ok"
        assert len(folders_in(tmp_path)) == 1
        assert oracle.working_in(tmp_path / "other").settings.program.work_folder == str(tmp_path / "work")

    def test_what_an_interrupted_try_left_does_not_show_in_the_reason(self, tmp_path):
        """A run that goes on ends with the same bytes as one that was never stopped."""
        oracle = made(tmp_path, "sys.exit(9)\n", keep="failed")
        first, again = once(oracle), once(oracle)
        assert len(folders_in(tmp_path)) == 2
        assert first[1] == again[1]

    def test_a_machine_may_have_a_place_of_its_own(self, tmp_path, monkeypatch):
        """And the reason then names all of it, for nobody would look there."""
        monkeypatch.setenv("FLEXDOCE_WORK", str(tmp_path / "scratch"))
        _, reason, _ = once(made(tmp_path, "sys.exit(1)", keep="failed"))
        (folder,) = (tmp_path / "scratch").iterdir()
        assert reason.endswith(f"(folder {folder})")
        assert not (tmp_path / "work").exists()

    def test_the_folder_is_named_by_settings_and_point(self, tmp_path):
        for oracle, point in (
            (made(tmp_path), (1.0, 0.0)), (made(tmp_path), (1.0, -0.0)), (made(tmp_path), (1.0, 0.1)),
            (made(tmp_path, SUM + "#\n"), (1.0, 0.0)),
        ):  # fmt: skip
            assert once(oracle, *point)[0] == "ok"
        names = [p.name.rpartition("-")[0] for p in folders_in(tmp_path)]
        assert len(names) == 4
        assert len(set(names)) == 3

    @pytest.mark.skipif(os.geteuid() == 0, reason="ROOT MAY WRITE EVERYWHERE: not checked")
    def test_no_place_for_folders_is_a_failure(self, tmp_path):
        (tmp_path / "work").mkdir(mode=0o500)
        assert "no working folder can be made" in once(made(tmp_path))[1]

    def test_a_file_where_the_folder_should_be(self, tmp_path):
        (tmp_path / "work").write_text("a file")
        assert "no working folder can be made" in once(made(tmp_path))[1]


class TestRetries:
    SECOND = "n = len(os.listdir('..'))\nprint('try', n)\n"

    def test_a_crash_is_tried_again_in_a_new_folder(self, tmp_path):
        script = self.SECOND + "if n < 3: sys.exit(1)\n" + SUM
        assert once(made(tmp_path, script, retries=2))[::2] == ("ok", 2.0)
        assert len(folders_in(tmp_path)) == 3

    def test_and_given_up(self, tmp_path):
        status, reason, _ = once(made(tmp_path, self.SECOND + "sys.exit(1)", retries=2))
        assert status == "crashed"
        assert reason.startswith("3 tries failed, the last: exit code 1; last lines: try 3")

    @pytest.mark.parametrize("word", ["diverged", "nonsense"])
    def test_what_would_come_out_the_same_is_not_tried_again(self, word, tmp_path):
        oracle = made(tmp_path, f"print('{word}')", retries=5, rejected_if="nonsense", not_converged_if="diverged")
        once(oracle)
        assert len(folders_in(tmp_path)) == 1


class TestIdentity:
    """A point store asks for name, version, parameters and labels: what changes answers must change them."""

    @pytest.mark.parametrize(
        "change",
        [
            {"argv": ["{{python}}", "-I", "-S", "program.py", "{{a:.3e}}", "{{b}}"]},
            {"files": settings(SUM + "# another\n")["files"]},
            {"templates": {"x.inp": {"text": "{{a}}"}}},
            {"environment": {"MODE": "2"}},
            {"exit_codes": [0, 1]},
            {"version": "2"},
            {"rejected_if": "x"},
            {"responses": {"y": {"unit": "m", "regex": r"y = (\S+)", "scale": -1.0}}},
            {"responses": {"y": {"unit": "m", "regex": r"y = (\S+)", "take": "first"}}},
        ],
        ids=str,
    )
    def test_what_changes_answers(self, change):
        assert made(None, **change).parameters != made(None).parameters

    @pytest.mark.parametrize("change", [{"time_limit": 5.0}, {"keep": "none"}, {"retries": 1}, {"grace": 1.0}], ids=str)
    def test_what_does_not(self, change):
        assert made(None, **change).parameters == made(None).parameters


def test_openly_says_what_would_run_and_runs_nothing(tmp_path):
    oracle = made(tmp_path, argv=["{{python}}", "program.py", "{{a}}", "{{b [mN]:.1f}}", "x\ny"])
    lines = oracle.openly((1.0, 0.5))
    assert lines[0] == f"argv: {json.dumps([sys.executable, 'program.py', '1.0', '500.0', chr(120) + chr(10) + 'y'])}"
    assert all(line.isprintable() for line in lines), "none may break out of its comment"
    assert any("program.py" in line and oracle.settings.sums["program.py"] in line for line in lines)
    assert folders_in(tmp_path) == []
