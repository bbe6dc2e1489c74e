"""The store of points: what is known is not asked again, across stages, reruns and studies; failures are answers."""

import json
import sqlite3
import threading

import numpy as np
import pytest
from numpy.testing import assert_array_equal

import pipeline
from experiments import Status, oracles
from experiments.designs import Sobol
from experiments.oracles import Answers
from pipeline import InputError, TooManyFailures, database
from pipeline.cli import main
from pipeline.executors import execute
from pipeline.points import FAILURES, PointStore
from tests.pipeline.cases import A, Counted, D, config_text, contents, reproducible

FAST = ("fit.design={method='sobol', n_runs=16}", "validation.n_runs=20", "export.verify=false")


@pytest.fixture
def oracle(counted):
    return oracles.get("counted")


@pytest.fixture
def design(oracle):
    return Sobol(n_runs=8).generate(oracle.factors)


def answers(*status: Status, values=(1.0, 2.0), reason="why") -> Answers:
    rows = [list(values) if s is Status.OK else [np.nan, np.nan] for s in status]
    return Answers(np.array(rows), list(status), ["" if s is Status.OK else reason for s in status])


def fails_in_the_fit(point) -> None:
    if point[D] == 15.0 and point[A] > 0.7:
        raise ArithmeticError("the solver gave up")


@pytest.fixture
def study(counted, tmp_path, no_report):
    def run(name="out", *overrides, oracle="counted", **settings) -> pipeline.Outcome:
        config = tmp_path / f"{oracle}.toml"
        config.write_text(config_text(oracle), encoding="utf-8")
        return pipeline.run(config, tmp_path / name, [*FAST, *overrides], **settings)

    return run


class TestStore:
    def test_gives_back_what_it_was_given_to_the_last_bit(self, oracle, tmp_path):
        values = np.array([[0.1 + 0.2, -5e-324], [1.7976931348623157e308, -0.0]])
        points = np.array([[1 / 3, 2.0, 0.0, 15.0], [-1 / 3, 2.0, 0.0, 15.0]])
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            keys = store.keys(points)
            told = store.add(keys, points, Answers(values, [Status.OK] * 2, ["", ""]))
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            known = store.known(keys)
        assert known == told
        assert [np.array(known[k].values).tobytes() for k in keys] == [row.tobytes() for row in values]

    def test_is_durable_before_the_next_point_is_asked(self, oracle, design, tmp_path):
        """Read by another connection, from within the oracle."""
        seen = []

        def look(point):
            with sqlite3.connect(tmp_path / "p.sqlite") as db:
                seen.append(db.execute("SELECT COUNT(*) FROM points").fetchone()[0])

        Counted.trouble = staticmethod(look)
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            execute(oracle, design, store, "fit")
        assert seen == list(range(8))

    def test_keeps_wall_time_and_worker(self, oracle, design, tmp_path):
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            execute(oracle, design, store, "fit")
            worker = store._worker
        with sqlite3.connect(tmp_path / "p.sqlite") as db:
            rows = db.execute("SELECT seconds, worker FROM points").fetchall()
        assert len(rows) == 8
        assert all(0.0 <= seconds < 10.0 for seconds, _ in rows)
        assert {w for _, w in rows} == {worker}

    def test_leaves_one_file_that_needs_nothing_beside_it(self, oracle, design, tmp_path):
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            execute(oracle, design, store, "fit")
            assert (tmp_path / "p.sqlite-wal").exists()
        assert [p.name for p in tmp_path.iterdir()] == ["p.sqlite"]
        db = sqlite3.connect(f"{(tmp_path / 'p.sqlite').as_uri()}?mode=ro&immutable=1", uri=True)
        assert db.execute("PRAGMA journal_mode").fetchone() == ("delete",)
        db.close()

    def test_a_good_answer_is_never_replaced(self, oracle, tmp_path):
        points = oracle.factors.centre[None]
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            keys = store.keys(points)
            store.add(keys, points, answers(Status.CRASHED))
            store.add(keys, points, answers(Status.OK))
            store.add(keys, points, answers(Status.TIMED_OUT))
            assert store.known(keys)[keys[0]].values == [1.0, 2.0]

    def test_zeros_of_either_sign_are_one_setting(self, oracle, tmp_path):
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            one, other = store.keys(np.array([[0.0, 1.0, -0.0, 1.0], [-0.0, 1.0, 0.0, 1.0]]))
        assert one == other

    def test_a_reason_that_is_no_text_comes_back_as_it_is_told(self, oracle, tmp_path):
        points = oracle.factors.centre[None]
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            keys = store.keys(points)
            told = store.add(keys, points, answers(Status.CRASHED, reason="a file named \udcff, \x00 and ü\n"))
            assert store.known(keys)[keys[0]].reason == told[keys[0]].reason == "a file named ?, \x00 and ü\n"

    def test_ctrl_c_while_it_stores_loses_nothing(self, oracle, tmp_path, monkeypatch):
        points, write, calls = oracle.factors.centre[None], database.write, []

        def interrupted(db, rows):
            calls.append(1)
            if len(calls) == 1:
                raise KeyboardInterrupt
            write(db, rows)

        monkeypatch.setattr(database, "write", interrupted)
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            keys = store.keys(points)
            with pytest.raises(KeyboardInterrupt):
                store.add(keys, points, answers(Status.OK))
            assert store.known(keys).keys() == set(keys)


class TestViews:
    def test_the_csvs_are_views_of_the_store(self, study, counted):
        """Whatever was deleted or scribbled over is written again, and the oracle is asked for nothing."""
        folder = study().path
        expected, n = reproducible(folder), len(counted.asked)
        for i, path in enumerate(sorted(folder.rglob("*.csv"))):
            path.unlink() if i % 2 else path.write_text("scribble")
        (folder / "model.json").unlink()
        assert reproducible(study().path) == expected
        assert len(counted.asked) == n


class TestOldStore:
    OLD = (
        "CREATE TABLE points (key TEXT PRIMARY KEY, oracle TEXT NOT NULL, settings TEXT NOT NULL, "
        "responses TEXT NOT NULL, status TEXT NOT NULL, reason TEXT NOT NULL)"
    )

    def test_is_read_and_gets_the_new_columns(self, oracle, design, tmp_path, counted):
        """Written as version 0.1.0 did, by hand."""
        runs = oracle(design)
        with PointStore(tmp_path / "other.sqlite", oracle) as store:
            keys, identity = store.keys(design.physical), store._identity
        db = sqlite3.connect(tmp_path / "p.sqlite")
        with db:
            db.execute(self.OLD)
            for key, point, values in zip(keys, design.physical.tolist(), runs.values.tolist(), strict=True):
                row = (key, identity, json.dumps(point), json.dumps(values), "ok", "")
                db.execute("INSERT OR REPLACE INTO points VALUES (?, ?, ?, ?, ?, ?)", row)
        db.close()
        counted.asked.clear()
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            again = execute(oracle, design, store, "fit")
            assert {row[1] for row in store._db.execute("PRAGMA table_info(points)")} >= {"seconds", "worker"}
        assert counted.asked == []
        assert_array_equal(again.values, runs.values)

    def test_the_keys_are_those_of_before(self, oracle, tmp_path):
        """A changed key would make everybody pay again: this one was computed by version 0.1.0."""
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            (key,) = store.keys(np.array([[0.5, 2.0, -0.1, 15.0]]))
        assert key == "13af4359b77af4354a6e7b13e630b3e25c620f108a6398f88ff54b80b23d60fb"


class TestFailures:
    def test_are_answers_and_are_not_run_again(self, study, counted):
        tries = []

        def trouble(point):
            if point[D] == 15.0 and point[A] > 0.7:
                tries.append(1)
                raise ArithmeticError("the solver gave up")

        Counted.trouble = staticmethod(trouble)
        first = study("out", "oracle.max_failed_fraction=0.4")
        n, asked = len(tries), len(counted.asked)
        assert n == (~first.fit_runs.ok).sum() > 0
        again = study("out", "oracle.max_failed_fraction=0.4")
        assert (len(tries), len(counted.asked)) == (n, asked)
        assert again.fit_runs.reasons == first.fit_runs.reasons

    @pytest.mark.parametrize("retry", [FAILURES, [Status.CRASHED]], ids=["all", "crashed"])
    def test_are_run_again_if_asked(self, retry, study, counted):
        Counted.trouble = staticmethod(fails_in_the_fit)
        first = study("out", "oracle.max_failed_fraction=0.4")
        failed, asked = int((~first.fit_runs.ok).sum()), len(counted.asked)
        Counted.trouble = staticmethod(lambda point: None)
        assert study("out", "oracle.max_failed_fraction=0.4", retry=[Status.TIMED_OUT]).fit_runs.ok.sum() < 16
        assert len(counted.asked) == asked
        again = study("out", "oracle.max_failed_fraction=0.4", retry=retry)
        assert again.fit_runs.ok.all()
        assert counted.asked[asked : asked + failed] == [
            tuple(p) for p in first.fit_runs.design.physical[~first.fit_runs.ok].tolist()
        ]
        assert reproducible(again.path) == reproducible(study("other", "oracle.max_failed_fraction=0.4").path)

    def test_are_run_again_once_and_not_in_every_stage(self, oracle, design, tmp_path):
        tries = []

        def trouble(point):
            tries.append(1)
            raise ArithmeticError("no")

        Counted.trouble = staticmethod(trouble)
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            execute(oracle, design, store, "fit")
        with PointStore(tmp_path / "p.sqlite", oracle, retry=FAILURES) as store:
            execute(oracle, design, store, "fit")
            execute(oracle, design, store, "validation")
        assert len(tries) == 16

    def test_exit_code_3_says_how_to_run_them_again(self, counted, tmp_path, no_report, capsys):
        Counted.trouble = staticmethod(fails_in_the_fit)
        config = tmp_path / "study.toml"
        config.write_text(config_text(), encoding="utf-8")
        argv = ["run", str(config), "--out", str(tmp_path / "o"), *(w for o in FAST for w in ("--set", o))]
        assert main(argv) == 3
        assert capsys.readouterr().err.endswith("they are kept as answers: --retry-failed runs them again\n")
        Counted.trouble = staticmethod(lambda point: None)
        assert main([*argv, "--retry", "not_converged"]) == 3
        assert main([*argv, "--retry", "crashed"]) == 0

    def test_an_unknown_kind_is_refused(self, tmp_path, capsys):
        with pytest.raises(SystemExit) as stopped:
            main(["run", "x.toml", "--retry", "ok"])
        assert stopped.value.code == 2
        assert "not_converged" in capsys.readouterr().err

    def test_too_many_end_the_study(self, study):
        Counted.trouble = staticmethod(fails_in_the_fit)
        with pytest.raises(TooManyFailures, match=r"fit: \d of 16 runs failed"):
            study("out", "oracle.max_failed_fraction=0.05")


class TestCache:
    def test_another_study_of_the_same_oracle_pays_for_nothing(self, study, counted, tmp_path):
        first = study("one", cache=tmp_path / "cache")
        n = len(counted.asked)
        second = study("two", cache=tmp_path / "cache")
        assert len(counted.asked) == n
        assert reproducible(second.path) == reproducible(first.path)
        # Each folder is whole in itself.
        study("two")
        assert len(counted.asked) == n
        assert set(contents(tmp_path / "cache")) == {"points.sqlite"}

    def test_an_overlapping_study_pays_for_what_is_new(self, study, counted, tmp_path):
        study("one", cache=tmp_path / "cache")
        n = len(counted.asked)
        study("two", "validation.n_runs=30", cache=tmp_path / "cache")
        assert 0 < len(counted.asked) - n <= 10 + 30, "screening, fit and 20 of 30 validation runs were there"
        assert len(counted.asked) == len(set(counted.asked))

    def test_a_folder_from_before_fills_no_cache_but_uses_it(self, study, counted, tmp_path):
        study("one")
        n = len(counted.asked)
        study("one", cache=tmp_path / "cache")
        assert len(counted.asked) == n

    def test_failures_are_shared_and_a_good_answer_elsewhere_is_found_by_a_retry(self, oracle, design, tmp_path):
        def bad(point):
            raise ArithmeticError("no licence")

        def stores(name, retry=()):
            cache = PointStore(tmp_path / "c.sqlite", oracle, shared=True)
            return PointStore(tmp_path / f"{name}.sqlite", oracle, cache, retry)

        Counted.trouble = staticmethod(bad)
        with stores("one") as store:
            assert not execute(oracle, design, store, "fit").ok.any()
        Counted.trouble = staticmethod(lambda point: None)
        with stores("two") as store:
            assert execute(oracle, design, store, "fit").reasons == ("ArithmeticError: no licence",) * 8
        with stores("two", FAILURES) as store:
            assert execute(oracle, design, store, "fit").ok.all()
        assert len(Counted.asked) == 8
        with stores("one", FAILURES) as store:
            assert execute(oracle, design, store, "fit").ok.all()
        assert len(Counted.asked) == 8

    def test_several_studies_write_at_once(self, oracle, tmp_path):
        """Six connections, 40 transactions each, in one file: none is lost and nobody is turned away."""
        rng, trouble = np.random.default_rng(1), []
        blocks = [oracle.factors.decode(rng.uniform(-1, 1, (40, 4))) for _ in range(6)]

        def write(points):
            try:
                with PointStore(tmp_path / "c.sqlite", oracle, shared=True) as store:
                    for row in points:
                        store.add(store.keys(row[None]), row[None], answers(Status.OK))
            except Exception as error:
                trouble.append(error)

        threads = [threading.Thread(target=write, args=(b,)) for b in blocks]
        [t.start() for t in threads]
        [t.join() for t in threads]
        assert trouble == []
        with PointStore(tmp_path / "c.sqlite", oracle, shared=True) as store:
            assert len(store.known(store.keys(np.concatenate(blocks)))) == 240

    def test_one_that_fails_on_the_way_is_done_without(self, study, counted, tmp_path, monkeypatch):
        write = database.write

        def full(db, rows):
            place = db.execute("PRAGMA database_list").fetchone()[2]
            if "/cache/" in place and len(counted.asked) == 7:
                db.execute("PRAGMA query_only = ON")
            write(db, rows)

        monkeypatch.setattr(database, "write", full)
        outcome = study("one", cache=tmp_path / "cache")
        log = (outcome.path / "log.txt").read_text()
        assert log.count("the cache is left out from here on") == 1
        assert reproducible(outcome.path) == reproducible(study("two").path)

    @pytest.mark.parametrize("what", ["file", "garbage"])
    def test_one_that_cannot_be_used_is_refused_at_once(self, what, study, counted, tmp_path):
        if what == "file":
            (tmp_path / "cache").write_text("mine")
        else:
            (tmp_path / "cache").mkdir()
            (tmp_path / "cache" / "points.sqlite").write_bytes(b"garbage" * 200)
        with pytest.raises(InputError, match=r"cannot use the (cache|point store) .*cache"):
            study("one", cache=tmp_path / "cache")
        assert counted.asked == []

    def test_on_the_command_line(self, counted, tmp_path, no_report):
        config = tmp_path / "study.toml"
        config.write_text(config_text(), encoding="utf-8")
        more = ["--cache", str(tmp_path / "cache"), *(w for o in FAST for w in ("--set", o))]
        assert main(["run", str(config), "--out", str(tmp_path / "a"), *more]) == 0
        n = len(counted.asked)
        assert main(["run", str(config), "--out", str(tmp_path / "b"), *more]) == 0
        assert len(counted.asked) == n
        assert (tmp_path / "cache" / "points.sqlite").is_file()


class TestRemovedStore:
    @pytest.mark.parametrize("replaced", [False, True], ids=["removed", "replaced"])
    def test_is_told_at_once(self, replaced, tmp_path, counted):
        """SQLite would go on writing to a file that nobody can find any more."""
        oracle = oracles.get("counted")
        with PointStore(tmp_path / "p.sqlite", oracle) as store:
            (tmp_path / "p.sqlite").unlink()
            if replaced:
                (tmp_path / "p.sqlite").write_bytes(b"")
            with pytest.raises(InputError, match="was removed or replaced while the run was at work"):
                store.add(["key"], np.zeros((1, 4)), answers(Status.OK))

    def test_a_cache_is_done_without(self, tmp_path, counted):
        oracle, told = oracles.get("counted"), []
        cache = PointStore(tmp_path / "c.sqlite", oracle, shared=True)
        with PointStore(tmp_path / "p.sqlite", oracle, cache) as store:
            store.warn = told.append
            (tmp_path / "c.sqlite").unlink()
            assert store.add(["key"], np.zeros((1, 4)), answers(Status.OK))["key"].status is Status.OK
        assert ["the cache is left out" in sentence for sentence in told] == [True]
