"""Run folders and tables that somebody else wrote: a report, numbers, or one printable sentence; never more."""

import json
import random
import shutil
import sqlite3
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments import Response, oracles
from pipeline import InputError, read_run
from pipeline.cli import main
from pipeline.errors import one_line
from pipeline.log import Log
from pipeline.monitor import State
from pipeline.provenance import read_provenance
from pipeline.reading import Table, read_points
from pipeline.status import read_status
from pipeline.store import RunFolder
from tests.pipeline.cases import SMALL, Counted, config_text
from tests.pipeline.hostile import PIECES, TEXTS, VALUES, fuzzed, is_one_line, within
from tests.pipeline.test_report import Page

SECONDS = 20.0
FILES = ("model.json", "screening/design.csv", "screening/runs.csv", "fit/design.csv", "fit/runs.csv",
         "validation/runs.csv", "inversion/runs.csv", "provenance.json", "config.toml")  # fmt: skip


def mangled(text: str, dice: random.Random) -> str:
    """The text with a few pieces cut, doubled, or replaced by ones that hurt."""
    for _ in range(dice.randint(1, 4)):
        at = dice.randrange(len(text) + 1)
        end = min(len(text), at + dice.choice([0, 1, 3, 40]))
        text = (
            text[:at] + dice.choice(["", dice.choice(PIECES), "1e308", "nan", "9" * 50, text[at:end] * 2]) + text[end:]
        )
    return text


class TestFolder:
    @fuzzed(15)
    @given(seed=st.integers(0, 2**32), name=st.sampled_from(FILES))
    def test_a_file_of_it_is_changed(self, smoke, tmp_path_factory, seed, name):
        folder = Path(shutil.copytree(smoke.path, tmp_path_factory.mktemp("mangled") / "run"))
        place = folder / name
        text = mangled(place.read_text(encoding="utf-8"), random.Random(seed))
        place.write_text(text, encoding="utf-8", errors="replace", newline="")
        with within(SECONDS):
            try:
                read_run(folder)
                read_provenance(RunFolder(folder).read("provenance.json"))
                said = "read"
            except InputError as error:
                said = str(error)
        assert is_one_line(said), repr(said)
        shutil.rmtree(folder.parent)

    @fuzzed(40)
    @given(
        document=st.dictionaries(st.sampled_from([*State.__dataclass_fields__, "other"]), VALUES) | VALUES,
        sound=st.booleans(),
    )
    def test_any_state_is_told(self, smoke, tmp_path_factory, document, sound):
        whole = json.loads((smoke.path / "state.json").read_text(encoding="utf-8"))
        told = {**whole, **document} if sound and isinstance(document, dict) else document
        folder = tmp_path_factory.mktemp("state")
        (folder / "state.json").write_text(json.dumps(told, default=str), encoding="utf-8")
        with within(SECONDS):
            lines = read_status(RunFolder(folder)).lines()
        assert all(is_one_line(line) for line in lines)

    @pytest.mark.parametrize(
        ("script", "match"),
        [
            ("DROP TABLE points; CREATE VIEW points AS WITH RECURSIVE n(status, reason) AS (SELECT 'ok', '' UNION ALL "
             "SELECT status, reason FROM n) SELECT * FROM n", "the view 'points'"),
            ("CREATE TRIGGER t AFTER INSERT ON points BEGIN DELETE FROM points; END", "the trigger 't'"),
        ],
    )  # fmt: skip
    def test_a_store_that_computes_is_refused(self, script, match, smoke_copy, capsys):
        """The view has rows without end."""
        db = sqlite3.connect(smoke_copy / "points.sqlite")
        db.executescript(script)
        db.close()
        with within(SECONDS):
            assert main(["status", str(smoke_copy)]) == 0
            assert match in capsys.readouterr().out
            assert main(["run", str(smoke_copy / "config.toml"), "--out", str(smoke_copy)]) == 2
            assert match in capsys.readouterr().err

    def test_a_store_with_values_of_other_kinds_is_told(self, smoke_copy, capsys):
        db = sqlite3.connect(smoke_copy / "points.sqlite")
        db.execute("UPDATE points SET status = x'00', reason = 7 WHERE rowid = 1")
        db.execute("UPDATE points SET status = char(27) || '[2J', reason = x'1b' WHERE rowid = 2")
        db.commit()
        db.close()
        with within(SECONDS):
            assert main(["status", str(smoke_copy)]) == 0
        assert all(c.isprintable() or c == "\n" for c in capsys.readouterr().out)


class TestTables:
    @fuzzed(60)
    @given(
        text=st.lists(
            st.sampled_from([*PIECES, ",", "\n", "load", "load[N]", "length[m]", "1.5", "nan", "1e999"]), max_size=20
        )
    )
    def test_any_text(self, smoke, text):
        with within(SECONDS):
            try:
                assert read_points("".join(text), smoke.model.factors, "in.csv").shape[1] == len(smoke.model.factors)
            except InputError as error:
                assert is_one_line(str(error))  # noqa: PT017 - either is good

    @pytest.mark.parametrize(
        ("text", "match"),
        [
            ("a,b\n1\n", "row 1 has 1 cells"),
            ("a,b\n1,2,3\n", "row 1 has 3 cells"),
            ("a,a\n1,2\n", "'a' appears twice"),
            ("a,b\n" + "9" * 200_000 + ",1\n", "field larger than field limit"),
            ("a,b\n" + "9" * 100_000 + "x,1\n", "column a is not a number"),
            ("a,b\n" + " " * 100_000 + "x,1\n", "column a is not a number"),
            ("a,b\n=1+1,1\n", "column a is not a number: '=1\\+1'"),
            ("a,b\n1,0x10\n", "column b is not a number"),
            ("a,b\n1,1e999\n", "column b is not a finite number"),
            ('a,b\n"1,2\n', "not a CSV table"),
            (",".join(f"c{i}" for i in range(100_000)) + "\n", "wrong columns: a missing"),
        ],
    )
    def test_refusals_come_at_once(self, text, match):
        with within(SECONDS), pytest.raises(InputError, match=match) as caught:
            Table.parse(text, "in.csv").numbers(["a", "b"])
        assert is_one_line(str(caught.value))

    @pytest.mark.parametrize("verb", ["predict", "invert"])
    def test_a_byte_order_mark_is_read_and_a_null_refused(self, verb, smoke, tmp_path, capsys):
        names = smoke.model.factors.labels if verb == "predict" else [r.label for r in smoke.model.responses]
        row = (
            smoke.model.factors.centre
            if verb == "predict"
            else smoke.model.predict(smoke.model.factors.centre[None])[0]
        )
        text = ",".join(names) + "\n" + ",".join(map(repr, row.tolist())) + "\n"
        (tmp_path / "in.csv").write_text("\ufeff" + text, encoding="utf-8")
        code = main([verb, str(smoke.path / "model.json"), str(tmp_path / "in.csv")])
        assert code == 0 or "has no inverse" in capsys.readouterr().err
        (tmp_path / "in.csv").write_text(text.replace(",", "\0,"), encoding="utf-8")
        assert main([verb, str(smoke.path / "model.json"), str(tmp_path / "in.csv")]) == 2


class TestTerminal:
    @fuzzed(60)
    @given(text=TEXTS)
    def test_errors_and_log_lines_are_printable(self, tmp_path_factory, text):
        assert InputError(text).args[0].isprintable()
        folder = tmp_path_factory.mktemp("log")
        log = Log(folder)
        log.write(text)
        log.close()
        (line,) = (folder / "log.txt").read_text(encoding="utf-8").split("\n")[:-1]
        assert line.isprintable()

    def test_what_is_printable_stays(self):
        assert one_line("θx is 3 µm: 𝒳") == "θx is 3 µm: 𝒳"
        assert one_line("a\x1b[2Jb\n\u202ec") == "a [2Jb c"
        assert len(one_line("x" * 10**6)) < 5000


HOSTILE = "<script>alert(1)</script>\x1b[31m$\\frac{$ [bold]x[/bold] [/] \u202e\x07 {{ 7 * 7 }}"


@dataclass(frozen=True)
class Hostile(Counted):
    """Free text of every kind that does harm somewhere."""

    name: ClassVar[str] = "hostile_texts"
    summary: ClassVar[str] = HOSTILE
    source: ClassVar[str] = HOSTILE
    trouble: ClassVar[Callable] = staticmethod(lambda point: None)

    @property
    def responses(self) -> tuple[Response, ...]:
        return Response("u", "m", "$mu_", 1e6, HOSTILE), Response("v", "rad", "<b>$$</b>", 1.0, "[/]$_$")


class TestHostileTexts:
    def test_in_report_terminal_and_log(self, tmp_path, capsys, monkeypatch):
        """Names, units, symbols, sources and the reasons of failures, all at once, through the whole study."""
        monkeypatch.setattr(oracles, "_REGISTERED", {**oracles._REGISTERED})
        oracles.register(Hostile)

        def trouble(point):
            if point[0] > 0.9 and point[3] not in (10.0, 20.0):
                raise RuntimeError(HOSTILE)

        monkeypatch.setattr(Hostile, "trouble", staticmethod(trouble))
        config = tmp_path / "study.toml"
        title = json.dumps(HOSTILE)
        config.write_text(
            f"title = {title}\n" + config_text("hostile_texts", "max_failed_fraction = 0.9\n"), encoding="utf-8"
        )
        settings = [part for one in SMALL for part in ("--set", one)]
        assert main(["run", str(config), "--out", str(tmp_path / "run"), *settings]) == 0
        assert main(["check", str(config)]) == 0
        assert main(["status", str(tmp_path / "run")]) == 0
        said = capsys.readouterr()
        log = (tmp_path / "run" / "log.txt").read_text(encoding="utf-8")
        html = (tmp_path / "run" / "report.html").read_text(encoding="utf-8")
        assert "alert(1)" in log, "no failure was noted"
        for text in (said.out, said.err, log, html):
            assert not {"\x1b", "\x07", "\u202e"} & set(text)
        assert "[bold]x[/bold]" in said.out, "markup of a name was interpreted"
        page = Page(html)
        assert "alert(1)" in page.text
        assert "alert(1)" not in page.parts["script"]
        assert "{{ 7 * 7 }}" in page.text
        assert sum(tag == "script" for tag, _ in page.elements) == 2
