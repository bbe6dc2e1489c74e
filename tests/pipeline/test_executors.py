"""Executors: the same answers wherever they are found, and what a lost worker or scheduler costs."""

import os
import shutil
import signal
import subprocess
import sys
import threading
import time
from collections import Counter
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from experiments import Status, oracles
from experiments.designs import Sobol
from experiments.oracles import OracleError
from pipeline import InputError, executors, resolve
from pipeline.cli import main
from pipeline.config import load_config, parse_config
from pipeline.executors import Answered, execute
from pipeline.executors.in_process import InProcess
from pipeline.executors.processes import AHEAD
from pipeline.points import PointStore
from tests.pipeline.cases import reproducible
from tests.pipeline.fragile import HOLD, KILL_ONCE, LINGER, POISON, SLOW, SPOILT, STILLBORN, asked

ROOT = Path(__file__).parents[2]
SOURCE = Path(__file__).with_name("fragile.py")
POSIX = pytest.mark.skipif(os.name != "posix", reason="NO SIGKILL HERE: no worker was killed")
PARALLEL = ("processes", "dask")
N = 24


def text(folder: Path, executor: str, pause: float = 0.0) -> str:
    """A config of the fragile oracle."""
    return f"""
name = "study"
seed = 3
[oracle]
name = "fragile.py:Fragile"
parameters = {{ folder = "{folder}", pause = {pause} }}
max_failed_fraction = 0.5
[fit]
design = {{ method = "sobol", n_runs = 16 }}
[validation]
n_runs = {N}
[export]
verify = false
[executor]
{executor}
"""


class Bench:
    """One design on one executor, with a store."""

    def __init__(self, folder: Path, executor: str, pause: float = 0.0) -> None:
        self.folder, self.notes = folder, []
        self.config = parse_config(text(folder, executor, pause))
        self.oracle = oracles.get(f"{SOURCE}:Fragile", folder=str(folder), pause=pause)
        self.design = Sobol(N).generate(self.oracle.factors, rng=0)

    def run(self, tell=lambda tally: None):
        with (
            PointStore(self.folder / "points.sqlite", self.oracle) as store,
            executors.make(self.config, self.oracle, self.notes.append) as executor,
        ):
            return execute(self.oracle, self.design, store, "fit", tell, executor)


@pytest.fixture(autouse=True)
def _parent(monkeypatch):
    monkeypatch.setenv("FRAGILE_PARENT", str(os.getpid()))


def expected(design) -> np.ndarray:
    a, b, c = design.physical.T
    return np.column_stack([a + 0.1 * a * b, b - 0.05 * c**2])


@pytest.mark.parametrize("name", PARALLEL)
def test_a_worker_that_is_killed_costs_what_it_had(name, tmp_path):
    bench = Bench(tmp_path, f'name = "{name}"\nworkers = 2', pause=0.01)
    (tmp_path / KILL_ONCE).touch()
    told = []
    runs = bench.run(told.append)
    np.testing.assert_array_equal(runs.values, expected(bench.design))
    assert runs.ok.all()
    assert told[-1].done == told[-1].total == N
    times = Counter(point for _, point in asked(tmp_path))
    assert set(times) == {tuple(row) for row in bench.design.physical.tolist()}
    # One was being answered; of Dask's worker the next one, which it had too, may have begun elsewhere.
    assert sum(times.values()) - N in ({1} if name == "processes" else {1, 2})
    pids = {pid for pid, _ in asked(tmp_path)}
    assert os.getpid() not in pids
    assert len(pids) >= 2
    if name == "processes":
        (note,) = bench.notes
        assert "ended while it had 1 point: they are run again" in note


@POSIX
def test_a_point_that_ends_every_worker_is_a_failed_point(tmp_path):
    bench = Bench(tmp_path, 'name = "processes"\nworkers = 1\nbatch = 8')
    (tmp_path / POISON).touch()
    runs = bench.run()
    fatal = bench.design.physical[:, 0] > 1.9
    assert 0 < fatal.sum() < 3
    np.testing.assert_array_equal(runs.ok, ~fatal)
    np.testing.assert_array_equal(runs.values[~fatal], expected(bench.design)[~fatal])
    i = int(np.flatnonzero(fatal)[0])
    assert runs.status[i] is Status.CRASHED
    assert "3 workers ended while they had this point" in runs.reasons[i]


@pytest.mark.parametrize("name", PARALLEL)
def test_workers_that_cannot_make_the_oracle(name, tmp_path):
    bench = Bench(tmp_path, f'name = "{name}"\nworkers = 1')
    (tmp_path / SPOILT).touch()
    with pytest.raises(InputError, match=r"worker .*:\d+ cannot make the oracle: no licence on this machine"):
        bench.run()


@POSIX
def test_a_worker_that_is_killed_before_it_is_ready_costs_no_point(tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.executors.worker.GRACE", 0.2)
    bench = Bench(tmp_path, 'name = "processes"\nworkers = 1')
    for name in (STILLBORN, LINGER):  # and one whose oracle leaves a thread behind does not keep the study waiting
        (tmp_path / name).touch()
    began = time.monotonic()
    runs = bench.run()
    assert runs.ok.all()
    assert bench.notes == ["a worker was killed before it was ready: another one is started"]
    assert time.monotonic() - began < 40.0
    assert not any(is_running(pid) for pid, _ in asked(tmp_path))


@POSIX
def test_ctrl_c_before_any_worker_is_ready(tmp_path):
    bench = Bench(tmp_path, 'name = "processes"\nworkers = 1')
    (tmp_path / SLOW).touch()

    def stop():
        until((tmp_path / SLOW).read_text)
        os.kill(os.getpid(), signal.SIGINT)

    threading.Thread(target=stop, daemon=True).start()
    with pytest.raises(KeyboardInterrupt):
        bench.run()
    assert not is_running(int((tmp_path / SLOW).read_text()))


def test_what_others_answered_is_kept_when_one_cannot(tmp_path):
    bench = Bench(tmp_path, "")
    points = bench.design.physical

    class OneOfTwo(InProcess):
        """Batches of two workers: the second fails while the answer of the first has come in."""

        def run(self, batches):
            self.found = [Answered(next(iter(batches)), self.oracle.answer(points[:1]), 0.0, "a:1")]
            raise OracleError("b:2 cannot")
            yield

        def arrived(self):
            return self.found

    with PointStore(tmp_path / "points.sqlite", bench.oracle) as store:
        with pytest.raises(OracleError):
            execute(bench.oracle, bench.design, store, "fit", executor=OneOfTwo(bench.oracle))
        assert len(store.known(store.keys(points))) == 1


def test_an_answer_whose_keeper_was_killed_is_waited_for(tmp_path):
    pytest.importorskip("distributed", reason="NO distributed: the Dask executor was not tried")
    bench, asked_again = Bench(tmp_path, 'name = "dask"\naddress = "tcp://x:1"'), []
    cluster = executors.make(bench.config, bench.oracle, bench.notes.append)
    cluster._client = SimpleNamespace(status="running")
    # So a future looks between the end of the worker that kept its answer, and the answer of another one.
    cluster._told.put(SimpleNamespace(status="lost", add_done_callback=asked_again.append))
    assert not cluster.arrived()
    assert cluster._failure is None
    assert len(asked_again) == 1


def test_workers_that_have_another_oracle(tmp_path, monkeypatch):
    bench = Bench(tmp_path, 'name = "processes"\nworkers = 1')
    monkeypatch.setattr(type(bench.oracle), "version", "2")
    with pytest.raises(InputError, match="has another version of the oracle 'fragile'"):
        bench.run()


def test_what_came_in_is_kept_when_one_is_interrupted(tmp_path):
    bench = Bench(tmp_path, 'name = "processes"\nworkers = 2', pause=0.005)

    def stop(tally):
        if tally.done >= 5:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        bench.run(stop)
    stored = PointStore(tmp_path / "points.sqlite", bench.oracle)
    known = len(stored.known(stored.keys(bench.design.physical)))
    stored.close()
    assert 5 <= known < N
    pids = {pid for pid, _ in asked(tmp_path)}
    assert not any(map(is_running, pids))
    bench.run()
    assert len(asked(tmp_path)) <= N + 2 * AHEAD  # what the two workers had


def is_running(pid: int) -> bool:
    try:
        return "Z" not in Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[:1]
    except OSError:
        return False


class TestWholeStudy:
    """Through the command line, in a process of its own."""

    @pytest.fixture(scope="class")
    @staticmethod
    def by_itself(tmp_path_factory):
        folder = tmp_path_factory.mktemp("by_itself")
        assert main(["run", str(written(folder, "")), "--out", str(folder / "run")]) == 0
        return reproducible(folder / "run")

    @POSIX
    def test_killed_it_leaves_no_worker_and_goes_on_elsewhere(self, by_itself, tmp_path):
        config = written(tmp_path, 'name = "processes"\nworkers = 2')
        with begun(config, tmp_path) as process:
            until(lambda: len(asked(tmp_path)) >= 20)
            process.kill()
            process.wait()
            pids = {pid for pid, _ in asked(tmp_path)}
            assert len(pids) == 2
            until(lambda: not any(map(is_running, pids)))
        assert main(["run", str(config), "--out", str(tmp_path / "run"), "--set", 'executor={name="in_process"}']) == 0
        assert same(by_itself, tmp_path)
        points = [point for _, point in asked(tmp_path)]
        assert len(points) - len(set(points)) <= 2 * AHEAD  # what the two workers had

    @POSIX
    def test_ctrl_c_for_the_whole_terminal(self, tmp_path):
        config = written(tmp_path, 'name = "processes"\nworkers = 2')
        (tmp_path / HOLD).touch()
        with begun(config, tmp_path) as process:
            until(lambda: len(asked(tmp_path)) == 2)
            os.killpg(process.pid, signal.SIGINT)
            _, said = process.communicate(timeout=30)
        assert process.returncode == 130
        assert "Traceback" not in said
        assert "stopped; run the same command to continue" in said
        assert not any(is_running(pid) for pid, _ in asked(tmp_path))

    @POSIX
    def test_a_scheduler_that_goes_away(self, by_itself, tmp_path):
        pytest.importorskip("distributed", reason="NO distributed: the Dask executor was not tried")
        with scheduler(tmp_path) as (file, process):
            config = written(tmp_path, f'name = "dask"\naddress = "{file}"')
            (tmp_path / HOLD).touch()
            threading.Thread(target=lambda: (until(lambda: asked(tmp_path)), process.kill()), daemon=True).start()
            with begun(config, tmp_path) as study:
                _, said = study.communicate(timeout=60)
        assert study.returncode == 1
        assert "Traceback" not in said
        assert f"executor {file}: the Dask scheduler went away; what was answered is stored" in " ".join(said.split())
        (tmp_path / HOLD).unlink()
        assert main(["run", str(config), "--out", str(tmp_path / "run"), "--set", 'executor={name="in_process"}']) == 0
        assert same(by_itself, tmp_path)


def written(folder: Path, executor: str) -> Path:
    path = folder / "study.toml"
    shutil.copy(SOURCE, folder)
    path.write_text(text(folder, executor), encoding="utf-8")
    return path


def same(expected: dict[str, bytes], folder: Path) -> bool:
    """Whether two run folders agree in all that does not name the oracle's folder."""
    found = reproducible(folder / "run")
    skip = {"config.toml", "model.json", "oracle.json"} | {name for name in expected if name.startswith("exports/")}
    assert found.keys() == expected.keys()
    return all(found[name] == data for name, data in expected.items() if name not in skip)


@contextmanager
def begun(config: Path, folder: Path):
    """``flexdoce run`` in a process group of its own."""
    arguments = ["run", str(config), "--out", str(folder / "run")]
    code = f"import sys\nfrom pipeline.cli import main\nsys.exit(main({arguments!r}))"
    process = subprocess.Popen(
        [sys.executable, "-c", code], cwd=ROOT, start_new_session=True, stdout=subprocess.DEVNULL,
        stderr=subprocess.PIPE, text=True, env={**os.environ, "PYTHONPATH": str(ROOT)},
    )  # fmt: skip
    try:
        yield process
    finally:
        with suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()


@contextmanager
def scheduler(folder: Path):
    """A Dask scheduler and one worker, as a cluster has them; gives the scheduler's file and process."""
    file = folder / "scheduler.json"
    environment = {**os.environ, "PYTHONPATH": str(ROOT), "DASK_DISTRIBUTED__DASHBOARD__LINK": ""}
    quiet = {"stdout": subprocess.DEVNULL, "stderr": subprocess.DEVNULL, "cwd": ROOT, "env": environment}
    dask = [sys.executable, "-m", "dask"]
    head = subprocess.Popen(
        [*dask, "scheduler", "--scheduler-file", str(file), "--host", "127.0.0.1", "--port", "0", "--no-dashboard"],
        **quiet,
    )
    hand = subprocess.Popen(
        [
            *dask,
            "worker",
            "--scheduler-file",
            str(file),
            "--nthreads",
            "1",
            "--no-dashboard",
            "--no-nanny",
            "--death-timeout",
            "20",
        ],
        **quiet,
    )
    try:
        until(file.exists)
        yield file, head
    finally:
        for process in (hand, head):
            process.kill()
            process.wait()


def until(holds, seconds: float = 40.0) -> None:
    end = time.monotonic() + seconds
    while not holds():
        assert time.monotonic() < end, "it did not come"
        time.sleep(0.01)


@pytest.mark.parametrize(
    ("executor", "sentence"),
    [
        ('workers = 2', "executor.workers and executor.batch belong to executor.name = 'processes' or 'dask'"),
        ('name = "processes"\naddress = "tcp://x:1"', "executor.address belongs to executor.name = 'dask'"),
        ('name = "dask"\naddress = "tcp://x:1"\nworkers = 2', "a cluster that has an address has its own workers"),
        ('name = "proceses"', "executor.name should be 'in_process', 'processes' or 'dask', got 'proceses'"),
        ('name = "processes"\nworkers = 0', "executor.workers should be greater than or equal to 1, got 0"),
    ],
)  # fmt: skip
def test_settings_that_do_not_go_together(executor, sentence, tmp_path):
    with pytest.raises(InputError, match=sentence):
        resolve(load_config(written(tmp_path, executor)))


def test_a_missing_package_is_named(tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.resolving.find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"needs the package distributed; install flexdoce\[dask\]"):
        resolve(load_config(written(tmp_path, 'name = "dask"')))


def test_nobody_at_the_address(tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.executors.dask_cluster.PATIENCE", 1.0)
    bench = Bench(tmp_path, 'name = "dask"\naddress = "tcp://127.0.0.1:9"')
    with pytest.raises(InputError, match=r"no Dask scheduler answers at tcp://127\.0\.0\.1:9"):
        bench.run()


@pytest.mark.parametrize(
    ("address", "sentence"),
    [
        ("x", "missing port number"),
        ("tcp://", "missing port number"),
        ("http://localhost:1", "unknown address scheme 'http'"),
        ("garbage.json", "it is not the file of a Dask scheduler"),
        ("missing.json", "No such file"),
    ],
)
def test_an_address_that_is_none(address, sentence, tmp_path, monkeypatch):
    monkeypatch.setattr("pipeline.executors.dask_cluster.PATIENCE", 0.2)
    monkeypatch.chdir(tmp_path)
    Path("garbage.json").write_text("{}", encoding="utf-8")
    with pytest.raises(InputError, match=f"no Dask scheduler answers at {address} .*{sentence}"):
        Bench(tmp_path, f'name = "dask"\naddress = "{address}"').run()
