"""Numbers read from what a program leaves."""

import re
import tempfile
from contextlib import suppress
from importlib.metadata import EntryPoint
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from experiments.oracles.command import parsers, register_parser
from experiments.oracles.command.folder import WorkFolder
from experiments.oracles.command.parsers import Reader, Unparsed

CSV = "node, uz ,name\n1,0.5,base\n17,1.5D-03,tip\n\n17, 2e-3,tip\n18,,end\n"
JSON = '{"steps": [{"uz": 1}, {"uz": 2.5, "note": "x", "ok": true, "big": %s}], "a b": {"c": -1e-3}}' % ("9" * 400)
TEXT = "iteration 1 u = 1.0\niteration 2 u = -.25E+01\nend u = oops\n"


@pytest.fixture
def folder(tmp_path):
    place = WorkFolder(tmp_path)
    for name, text in (("r.csv", CSV), ("r.json", JSON), ("stdout.txt", TEXT), ("bad.json", '{"a": '), ("empty", "")):
        place.write(name, text)
    place.write("table", "  t    u\n  0    1\n  1    4.5\n")
    place.write("semi", "t;u\n1;3.0\n")
    place.write("deep.json", "[" * 100_000)
    place.write("twice.csv", "u,u\n1,2\n")
    return place


def read(folder, **keys):
    return Reader(response="y", unit="m", **keys).read(folder, {})


@pytest.mark.parametrize(
    ("keys", "expected"),
    [
        ({"regex": r"iteration \d+ u = (\S+)"}, -2.5),
        ({"regex": r"iteration \d+ u = (\S+)", "take": "first"}, 1.0),
        ({"regex": r"^iteration 1 u = (.*)$"}, 1.0),
        ({"file": "r.csv", "column": "uz", "where": {"name": "tip"}}, 2e-3),
        ({"file": "r.csv", "column": "uz", "where": {"name": "tip"}, "take": "first"}, 1.5e-3),
        ({"file": "r.csv", "column": "uz", "where": {"node": 17}, "take": "first"}, 1.5e-3),
        ({"file": "r.csv", "column": "uz", "take": "first"}, 0.5),
        ({"file": "r.csv", "column": "node"}, 18.0),
        ({"file": "table", "column": "u", "delimiter": " "}, 4.5),
        ({"file": "semi", "column": "u", "delimiter": ";"}, 3.0),
        ({"file": "r.json", "json_path": "steps.-1.uz"}, 2.5),
        ({"file": "r.json", "json_path": "steps.0.uz"}, 1.0),
        ({"file": "r.json", "json_path": "a b.c"}, -1e-3),
        ({"file": "r.json", "json_path": "steps.1.big"}, float("inf")),
        ({"file": "r.json", "json_path": "steps.0.uz", "file_unit": "um", "scale": 2.0}, 2e-6),
    ],
    ids=str,
)
def test_the_number_is_found(keys, expected, folder):
    assert read(folder, **keys) == expected


@pytest.mark.parametrize(
    ("keys", "said"),
    [
        ({"regex": r"v = (\S+)"}, r"y: nothing in stdout.txt matches 'v = (\\S+)'"),
        ({"regex": r"end u = (\S+)"}, "y: 'oops' in stdout.txt is no number"),
        ({"regex": r"iteration(x)? 2"}, "y: nothing in stdout.txt matches"),
        ({"file": "nowhere", "regex": "(x)"}, "y: there is no file nowhere"),
        ({"file": "r.csv", "column": "ux"}, "y: r.csv has 0 columns 'ux'; its header is 'node, uz, name'"),
        ({"file": "twice.csv", "column": "u"}, "y: twice.csv has 2 columns 'u'"),
        ({"file": "r.csv", "column": "uz", "where": {"nme": "tip"}}, "r.csv has 0 columns 'nme'"),
        ({"file": "r.csv", "column": "uz", "where": {"node": 99}}, "y: r.csv has no row where node = 99"),
        ({"file": "r.csv", "column": "uz"}, "y: '' in r.csv is no number"),
        ({"file": "r.csv", "column": "name"}, "y: 'end' in r.csv is no number"),
        ({"file": "empty", "column": "u"}, "y: empty has 0 columns 'u'"),
        ({"file": "bad.json", "json_path": "a"}, "y: bad.json is no JSON"),
        ({"file": "deep.json", "json_path": "a"}, "y: deep.json is no JSON"),
        ({"file": "r.json", "json_path": "steps.2.uz"}, "y: r.json has nothing at 'steps.2.uz' (no '2')"),
        ({"file": "r.json", "json_path": "steps.uz"}, "y: r.json has nothing at 'steps.uz' (no 'uz')"),
        ({"file": "r.json", "json_path": "steps.1.note"}, "y: r.json has no number at 'steps.1.note', but 'x'"),
        ({"file": "r.json", "json_path": "steps.1.ok"}, "y: r.json has no number at 'steps.1.ok', but 'True'"),
        ({"file": "r.json", "json_path": "steps.1.ok.x"}, "y: r.json has nothing at 'steps.1.ok.x'"),
    ],
    ids=str,
)
def test_or_a_sentence_says_what_was_looked_for_and_where(keys, said, folder):
    with pytest.raises(Unparsed, match=re.escape(said)):
        read(folder, **keys)


@pytest.mark.parametrize(
    ("keys", "match"),
    [
        ({}, r"needs one of regex, column, json_path, function; got none"),
        ({"regex": "(x)", "column": "u"}, r"got regex, column"),
        ({"regex": "(x)", "take": "third"}, r"take must be one of last, first"),
        ({"regex": "(x)", "where": {"a": 1}}, r"where belongs to column"),
        ({"column": "u", "delimiter": ", "}, r"delimiter must be one of ',', ';'"),
        ({"column": "u", "scale": 0.0}, r"scale must not be 0"),
        ({"column": "u", "file_unit": "N"}, r"response 'y': 'N' and 'm' measure different things"),
    ],
    ids=str,
)
def test_what_is_refused(keys, match):
    with pytest.raises(ValueError, match=match):
        Reader(response="y", unit="m", **keys)


@given(st.text(alphabet="u=1.eEdD+-,\n {}[]\"'nai:0", max_size=60))
def test_whatever_is_printed_gives_a_number_or_a_sentence(text):
    with tempfile.TemporaryDirectory() as name:
        place = WorkFolder(Path(name))
        place.write("stdout.txt", text)
        for keys in ({"regex": r"u=(\S+)"}, {"column": "u"}, {"column": "u", "where": {"e": 1}}, {"json_path": "u.0"}):
            with suppress(Unparsed):  # anything else that is raised is an error of ours
                assert isinstance(read(place, **keys), float)


class TestFunctions:
    @pytest.mark.parametrize("name", ["os:system", "shutil:rmtree", "subprocess:run", "builtins:eval", "antigravity:x"])
    def test_a_config_cannot_import_what_it_likes(self, name):
        with pytest.raises(ValueError, match=f"no installed package offers the parser function '{name}'"):
            Reader(response="y", unit="m", function=name)

    @pytest.fixture
    def installed(self, tmp_path_factory, monkeypatch):
        """A package with an entry point, as pip would install it."""
        place = tmp_path_factory.mktemp("site")
        info = place / "beamreader-1.0.dist-info"
        info.mkdir()
        (info / "METADATA").write_text("Metadata-Version: 2.1\nName: beamreader\nVersion: 1.0\n")
        (info / "entry_points.txt").write_text(f"[{parsers.GROUP}]\nbeam = beamreader_module:read\n")
        (place / "beamreader_module.py").write_text(
            "calls = []\n"
            "def read(folder):\n"
            "    calls.append(folder)\n"
            "    return {'y': len((folder / 'stdout.txt').read_text().splitlines()), 'z': 2}\n"
        )
        monkeypatch.syspath_prepend(str(place))

    @pytest.mark.parametrize("name", ["beam", "beamreader_module:read"])
    def test_what_an_installed_package_offers(self, name, installed, folder):
        answers = {}
        y = Reader(response="y", unit="m", file_unit="mm", function=name)
        z = Reader(response="z", unit="m", function=name)
        assert (y.read(folder, answers), z.read(folder, answers)) == (3e-3, 2.0)
        import beamreader_module  # type: ignore[import-not-found]

        assert beamreader_module.calls[-1] == folder.path
        assert len(set(beamreader_module.calls)) == len(beamreader_module.calls), "asked once for all responses"
        with pytest.raises(Unparsed, match=r"x: the function .* failed: KeyError: 'x'"):
            Reader(response="x", unit="m", function=name).read(folder, answers)

    def test_one_registered_in_this_process(self, folder, monkeypatch):
        monkeypatch.setattr(parsers, "_REGISTERED", {})
        register_parser("mine", lambda place: {"y": 4.0})
        assert read(folder, function="mine") == 4.0
        register_parser("mine", lambda place: 1 / 0)
        with pytest.raises(Unparsed, match="y: the function 'mine' failed: ZeroDivisionError: "):
            read(folder, function="mine")

    def test_entry_points_are_those_of_the_group(self):
        assert parsers.GROUP == "flexdoce.parsers"
        assert EntryPoint("a", "b:c", parsers.GROUP).value == "b:c"
