"""Oracles in files: found, run once, hashed; and one sentence for whatever is wrong with them."""

import pickle
import re
import subprocess
import sys

import pytest

from experiments import oracles
from experiments.designs import Random
from experiments.oracles import files

HEAD = """from dataclasses import dataclass
from experiments import Factor, FactorSpace, Response
from experiments.oracles import Oracle, PointOracle, point_oracle
"""
SPRING = (
    HEAD
    + """
@dataclass(frozen=True)
class Spring(PointOracle):
    name = "spring"
    preload: float = 0.0

    @property
    def factors(self):
        return FactorSpace((Factor("force", "N", 0.5, 1.0), Factor("stiffness", "N/m", 90.0, 110.0)))

    @property
    def responses(self):
        return (Response("displacement", "m"),)

    def respond(self, point):
        return [(point[0] - self.preload) / point[1]]
"""
)


@pytest.fixture
def written(tmp_path):
    """Write ``spring.py`` and give what names it."""

    def write(text: str | bytes, what: str = "Spring") -> str:
        path = tmp_path / "spring.py"
        path.write_bytes(text if isinstance(text, bytes) else text.encode())
        return f"{path}:{what}"

    yield write
    for name in [n for n in sys.modules if n.startswith(files._PREFIX)]:
        del sys.modules[name]


def test_one_that_refuses_its_own_parameters_is_told(written):
    """Workers make it of them."""
    changing = SPRING.replace(
        "    @property\n    def factors",
        """    def __post_init__(self):
        if self.preload > 0.3:
            raise ValueError("the preload is 0.3 N at most")
        object.__setattr__(self, "preload", self.preload + 0.25)

    @property
    def factors""",
    )
    with pytest.raises(AssertionError, match=r"'spring' cannot be made anew of its own parameters: .*0\.3 N at most"):
        oracles.check_oracle(oracles.get(written(changing), preload=0.1))


@pytest.mark.parametrize("what", ["Spring", "spring"], ids=["the class", "the oracle's name"])
def test_a_file_is_an_oracle(what, written):
    spring = oracles.get(written(SPRING, what), preload=0.1)
    runs = spring(Random(3).generate(spring.factors))
    force, stiffness = runs.design.physical.T
    assert (runs.values[:, 0] == (force - 0.1) / stiffness).all()
    assert spring.parameters == {"preload": 0.1}
    assert spring.origin.endswith(f"spring.py:{what}")


def test_it_is_run_once_as_long_as_it_stays_the_same(written):
    name = written(SPRING)
    assert oracles.oracle_class(name) is oracles.oracle_class(name)
    first = oracles.oracle_class(name)
    # Of the same length, in the same second: bytecode by date and size would not tell them apart.
    second = oracles.oracle_class(written(SPRING.replace("preload) /", "preload) *")))
    assert first is not second
    assert (len(first.code), len(second.code)) == (16, 16)
    assert first.code != second.code
    point = Random(1).generate(second().factors)
    assert first()(point).values != second()(point).values


def test_it_leaves_nothing_beside_the_file(written, tmp_path):
    oracles.get(written(SPRING))
    assert [p.name for p in tmp_path.iterdir()] == ["spring.py"]


def test_a_class_that_the_file_imports_keeps_to_itself(written):
    ours = oracles.get(written("from experiments.oracles.cantilever import Cantilever\n", "Cantilever"), young=60e9)
    assert ours.code
    assert ours.parameters == {"young": 60e9}
    assert oracles.oracle_class("cantilever").code == oracles.oracle_class("cantilever").origin == ""


def test_a_relative_path_is_relative_to_where_one_is(written, tmp_path, monkeypatch):
    written(SPRING)
    monkeypatch.chdir(tmp_path)
    assert oracles.get("spring.py:Spring").origin == f"{tmp_path.resolve()}/spring.py:Spring"


LACKING = HEAD + "class Spring(PointOracle):\n    name = 'spring'\n"


@pytest.mark.parametrize(
    ("text", "match"),
    [
        ("x = (1,\n", r"spring\.py, line 1: '\(' was never closed$"),
        (b"\xff\xfe", r"spring\.py"),
        (HEAD + "1 / 0\n", r"spring\.py, line 4: ZeroDivisionError: division by zero$"),
        ("def f():\n    raise OSError('no\\nlicence')\nf()\n", r"spring\.py, line 2: OSError: no$"),
        ("import sys\nsys.exit(3)\n", r"spring\.py, line 2: SystemExit: 3$"),
        ("import not_there\n", r"spring\.py, line 1: ModuleNotFoundError: No module named 'not_there'$"),
        (SPRING.replace("Spring", "Spirng"), r"spring\.py has no 'Spring'; did you mean 'Spirng'\?$"),
        ("x = 1\n", r"spring\.py has no 'Spring'; it holds no oracle$"),
        ("Spring = 3\n", r"'Spring' in spring\.py is an object of type int, not a class of oracles$"),
        ("class Spring: pass\n", r"'Spring' in spring\.py is a class, but none of oracles; derive it"),
        ("def Spring(a): pass\n", r"is a plain function, not a class of oracles; put @point_oracle\(.*\) before it$"),
        (
            SPRING + "Spring = Spring()\n",
            r"is an object of type Spring, not a class of oracles; name its class, Spring$",
        ),
        ("import os as Spring\n", r"is a module, not a class"),
        (LACKING, r"'Spring' in spring\.py lacks factors, respond, responses; docs/add-an-oracle\.md"),
        (SPRING.replace('name = "spring"', ""), r"'Spring' in spring\.py has no name; write name = 'spring'"),
        (SPRING.replace('"spring"', '"a b"'), r"oracle name 'a b' is not allowed"),
    ],
    ids=lambda v: v[-30:] if isinstance(v, str) else "",
)
def test_what_is_wrong_with_a_file_is_one_sentence(text, match, written):
    with pytest.raises(ValueError, match=match) as caught:
        oracles.get(written(text))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize(
    ("old", "new", "match"),
    [
        ('FactorSpace((Factor("force"', '((Factor("force"', r"factors gave an object of type tuple, not a FactorSpace"),
        ('return (Response("displacement", "m"),)', 'return (Response("displacement", "m"))', r"with a comma$"),
        ('(Response("displacement", "m"),)', '[Response("displacement", "m")]', r"type list, not a tuple of Response"),
        ('(Response("displacement", "m"),)', "()", r"it has no responses; declare at least one$"),
        ('"displacement"', '"force"', r"force: a factor and a response cannot share a name$"),
        ("0.5, 1.0", "1.0, 0.5", r"factors: ValueError: factor 'force': low must be below high"),
        ("preload: float", "batch = 0\n    preload: float", r"batch must be a whole number of at least 1, got 0$"),
        ("preload: float", "version = 2\n    preload: float", r"version must be a text, got 2$"),
        ("preload: float", "resolution = 'x'\n    preload: float", r"resolution must be a number from 0 to below 1"),
        ("preload: float = 0.0", "preload: float", r"oracle 'spring' needs the setting 'preload'$"),
        ("preload: float", "preload: Flaot", r"spring\.py, line 8: NameError: name 'Flaot'"),
        (
            "preload: float = 0.0",
            "preload: float = 0.0\n    def __post_init__(self):\n        raise RuntimeError('no mesh')",
            r"cannot be made: RuntimeError: no mesh$",
        ),
    ],
)
def test_what_is_wrong_with_a_class_is_one_sentence(old, new, match, written):
    assert old in SPRING
    with pytest.raises(ValueError, match=match):
        oracles.get(written(SPRING.replace(old, new)))


@pytest.mark.parametrize(
    "name", ["spring.py", "spring.py:", ":Spring", "spring:Spring", "a/b", "spring.py:a b", "x.py:a.b"]
)
def test_a_name_of_another_form_is_refused(name):
    assert files.is_file(name)
    with pytest.raises(ValueError, match=r"is not of the form path/to/file\.py:name"):
        oracles.get(name)


def test_a_file_that_is_not_there(tmp_path):
    with pytest.raises(ValueError, match=re.escape(f"{tmp_path.resolve()}/no.py: there is no file no.py")):
        oracles.get(f"{tmp_path}/no.py:Spring")


def test_a_module_beside_it_is_not_found_and_the_sentence_says_so(written, tmp_path):
    (tmp_path / "helper_of_spring.py").write_text("")
    with pytest.raises(ValueError, match=r"helper_of_spring\.py lies beside it, but only installed packages are found"):
        oracles.get(written("import helper_of_spring\n"))


def test_ctrl_c_is_not_swallowed(written):
    name = written("raise KeyboardInterrupt\n")
    for _ in range(2):  # nor is half a module left behind
        with pytest.raises(KeyboardInterrupt):
            oracles.get(name)


def test_a_recipe_makes_it_in_another_process(written):
    name = written(SPRING)
    recipe = oracles.recipe(oracles.get(name, preload=0.25))
    data = pickle.dumps(recipe)
    code = "import pickle, sys; o = pickle.load(sys.stdin.buffer).make(); print(o.preload, o.code, o.evaluate.__name__)"
    done = subprocess.run([sys.executable, "-c", code], input=data, capture_output=True, check=False)
    assert done.stdout.decode() == f"0.25 {recipe.code} evaluate\n", done.stderr
    written(SPRING + "# changed\n")
    with pytest.raises(ValueError, match=r"spring\.py:Spring has changed since the recipe was written"):
        recipe.make()


def test_a_batch_that_raises_or_has_another_shape_is_one_sentence(written):
    batch = SPRING.replace("PointOracle)", "Oracle)").replace("respond(self, point)", "evaluate(self, points)")
    raising = oracles.get(written(batch))
    with pytest.raises(
        oracles.OracleError, match=r"^oracle 'spring' \(/.*spring.py:Spring\): evaluate raised \w+Error"
    ):
        raising(Random(2).generate(raising.factors))
    short = oracles.get(written(batch.replace("return [(", "return [[0.0]], ['ok'], ['']; [(")))
    with pytest.raises(oracles.OracleError, match=r"evaluate raised ValueError: values must have shape \(2, 1\)"):
        short(Random(2).generate(short.factors))


def test_what_a_built_in_oracle_raises_stays_as_it_is():
    cantilever = oracles.get("cantilever")
    with pytest.raises(KeyError, match="a bug of ours"):
        oracles.asked(cantilever, "evaluate", lambda: {}["a bug of ours"])
