"""Oracles of installed packages: found by entry point, imported when asked for, and harmless when broken."""

import sys

import pytest

from experiments import oracles
from experiments.oracles import plugins

GOOD = """from experiments import Factor, Response
from experiments.oracles import point_oracle

@point_oracle([Factor("a", "N", 0.0, 1.0)], [Response("u", "m")])
def plugged(a, *, k=2.0):
    "a spring of a package"
    return a / k
"""


@pytest.fixture
def install(tmp_path, monkeypatch):
    """Put a distribution on the path, as pip would install it; its module is named after it."""
    monkeypatch.syspath_prepend(str(tmp_path))
    made = []

    def put(name: str, entries: str, module: str = GOOD, group: str = oracles.GROUP) -> None:
        info = tmp_path / f"{name}-1.2.dist-info"
        info.mkdir()
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
        (info / "entry_points.txt").write_text(f"[{group}]\n{entries}\n")
        (tmp_path / f"{name}_module.py").write_text(module)
        made.append(f"{name}_module")

    yield put
    for name in made:
        sys.modules.pop(name, None)


def test_an_oracle_is_found_and_imported_only_when_asked_for(install):
    install("springs", "plugged = springs_module:plugged")
    assert "plugged" in oracles.names()
    assert oracles.origin_of("plugged") == "springs 1.2, springs_module:plugged"
    oracles.get("cantilever")
    assert "springs_module" not in sys.modules
    oracle = oracles.get("plugged", k=4.0)
    assert oracle.evaluate(oracle.factors.decode([[1.0]])).values == 0.25
    assert oracles.all_oracles()["plugged"] is type(oracle)
    assert oracles.recipe(oracle).make() == oracle
    assert oracle.code == ""
    with pytest.raises(ValueError, match=r"oracle 'plugged' has no setting 'kk'; did you mean 'k'\?"):
        oracles.get("plugged", kk=1.0)
    with pytest.raises(ValueError, match=r"unknown oracle 'pluged'; did you mean 'plugged'\?"):
        oracles.get("pluged")


BROKEN = [
    ("import nowhere_to_be_found\n", r"cannot be imported: ModuleNotFoundError: No module named 'nowhere_to_be_found'"),
    ("import sys\nsys.exit()\n", r"cannot be imported: SystemExit"),
    ("plugd = 1\n", r"cannot be imported: AttributeError: .* has no attribute 'plugged'"),
    ("plugged = 1\n", r"is an object of type int, not a class of oracles"),
    ("class plugged: pass\n", r"is a class, but none of oracles"),
    (
        "from experiments.oracles import PointOracle\nclass plugged(PointOracle): name = 'plugged'\n",
        r"lacks factors, resp",
    ),
    (
        GOOD.replace("def plugged", "def other") + "plugged = other\n",
        r"calls itself 'other'; the entry point and the class",
    ),
    (GOOD.replace('[Response("u", "m")]', "[]"), r"it has no responses; declare at least one"),
    (GOOD.replace('Factor("a"', 'Factor("b"'), r"ValueError: the arguments of plugged are \(a\), its factors \(b\)"),
]


@pytest.mark.parametrize(("module", "match"), BROKEN, ids=range(len(BROKEN)))
def test_a_broken_one_is_one_sentence_with_its_distribution_and_no_other_suffers(module, match, install):
    install("broken", "plugged = broken_module:plugged", module)
    with pytest.raises(ValueError, match=match) as caught:
        oracles.get("plugged")
    assert "broken 1.2" in str(caught.value)
    assert "\n" not in str(caught.value)
    (offer,) = [o for o in oracles.offers() if o.name == "plugged"]
    cls, flaw = plugins.tried(offer)
    assert cls is None
    assert flaw
    assert "plugged" not in oracles.all_oracles()
    assert oracles.get("cantilever")


@pytest.mark.parametrize("name", ["cantilever", "command"])
def test_a_name_of_ours_stays_ours(name, install):
    install("thief", f"{name} = thief_module:plugged")
    assert oracles.oracle_class(name).__module__.startswith("experiments.oracles")
    assert oracles.names().count(name) == (name == "cantilever")
    (offer,) = [o for o in oracles.offers() if o.name == name]
    assert offer.flaw == f"the name {name!r} is taken by a built-in oracle"
    assert plugins.tried(offer) == (None, offer.flaw)


def test_one_name_of_two_distributions_is_nobodys(install):
    install("one", "plugged = one_module:plugged")
    install("two", "plugged = two_module:plugged")
    with pytest.raises(ValueError, match=r"offered more than once, by one 1\.2 .* and two 1\.2 .*; uninstall one$"):
        oracles.get("plugged")
    assert "plugged" not in oracles.names()
    assert not {"one_module", "two_module"} & set(sys.modules)


@pytest.mark.parametrize("entries", ["no sign of equality", "two words = springs_module:plugged", "x = not a value!"])
def test_damaged_metadata_hides_nobody_else(entries, install):
    install("damaged", entries)
    install("springs", "plugged = springs_module:plugged")
    assert oracles.get("plugged")
    assert "cantilever" in oracles.names()
    for offer in oracles.offers():
        if offer.distribution == "damaged 1.2":
            assert plugins.tried(offer)[0] is None


def test_flexdoce_list_tells_all_and_why(install, capsys):
    from pipeline.cli import main

    install("springs", "plugged = springs_module:plugged", GOOD.replace("a spring", "[bold]a:B:spring"))
    install("broken", "gone = broken_module:gone", "")
    install("readers", "odb = readers_module:read", "", "flexdoce.parsers")
    assert main(["list"]) == 0
    out = " ".join(capsys.readouterr().out.split())
    assert "plugged [bold]a:B:spring of a package (springs 1.2, springs_module:plugged) k = 2.0" in out
    assert "gone broken (broken 1.2, broken_module:gone): " in out
    assert "has no attribute 'gone'" in out
    assert "cantilever tip-loaded leaf spring, small displacements, closed form (built in)" in out
    assert "odb readers_module:read (readers 1.2)" in out
    assert "E = A:B:C" in out, "what stands between colons is no picture"
    for word in ("oracles", "designs", "exports", "parsers", "hexflex_shells"):
        assert word in out
