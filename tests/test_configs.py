"""Every example config resolves, and the schema beside them is the one that the code makes."""

import json
import tomllib
from pathlib import Path

import jsonschema
import pytest

import pipeline
import pipeline.runner
from pipeline.config import json_schema

CONFIGS = Path(__file__).parents[1] / "configs"
EXAMPLES = sorted(CONFIGS.glob("*.toml"))
HOW = "run: python -m pipeline.schema > configs/schema.json"


@pytest.fixture(scope="module")
def schema() -> dict:
    return json.loads((CONFIGS / "schema.json").read_text(encoding="utf-8"))


def test_there_are_examples():
    assert {"hexflex", "smoke"} <= {path.stem for path in EXAMPLES}


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example_resolves(path):
    study = pipeline.resolve(pipeline.load_config(path))
    assert study.config.name == path.stem
    assert study.config.title
    assert len(study.screening_design) > len(study.space)


SMALL = ("fit.degree=2", "fit.design.n_runs=42", "fit.design.budget=200", "validation.n_runs=20", "export.verify=false")


def test_flexure_3rrr_runs_in_small(tmp_path):
    """From config to report, with few runs; what the model is worth is not asked here."""
    outcome = pipeline.run(CONFIGS / "flexure_3rrr.toml", tmp_path, SMALL)
    assert outcome.obstacle.startswith("7 responses follow from 6 factors")
    assert outcome.round_trip is None
    report = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "polynomial of degree 2" in report
    assert '"planar":true' in report


def test_hexflex_nonlinear_runs_in_small(tmp_path, monkeypatch):
    """Without the report, which compiles the solver once more to draw the mechanism; with a limit that nothing comes
    near, as which the solver has been compiled for tests/experiments/test_oracle_hexflex_nonlinear.py."""
    monkeypatch.setattr(pipeline.runner, "write_report", lambda folder, outcome: folder.path)
    settings = [*SMALL, "require.max_relative_error=0.1", "oracle.parameters.stress_limit=1e9"]
    outcome = pipeline.run(CONFIGS / "hexflex_nonlinear.toml", tmp_path, settings)
    assert outcome.shortfalls == ()
    assert not outcome.model.is_affine
    assert outcome.round_trip is not None
    assert outcome.study.oracle.is_nonlinear


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example_begins_with_a_comment_that_says_what_it_is(path):
    assert path.read_text(encoding="utf-8").startswith("# ")


def test_schema_is_up_to_date():
    file = CONFIGS / "schema.json"
    assert file.is_file(), f"{file} is missing; {HOW}"
    expected = json.dumps(json_schema(), indent=2) + "\n"
    assert file.read_text(encoding="utf-8") == expected, f"configs/schema.json is out of date; {HOW}"


def test_schema_is_a_schema(schema):
    jsonschema.Draft202012Validator.check_schema(schema)


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda p: p.stem)
def test_example_validates(path, schema):
    jsonschema.validate(tomllib.loads(path.read_text(encoding="utf-8")), schema)


@pytest.mark.parametrize(
    ("table", "bad"),
    [
        ("", {"sed": 1}), ("", {"seed": "1"}), ("", {"name": "a b"}), ("oracle", {"nmae": "x"}),
        ("fit", {"degree": 13}), ("validation", {"n_runs": 1}), ("screening", {"alpha": 1.0}),
        ("export", {"targets": "c99"}),
    ],
)  # fmt: skip
def test_schema_refuses_what_the_config_refuses(table, bad, schema):
    document = tomllib.loads((CONFIGS / "smoke.toml").read_text(encoding="utf-8"))
    (document.setdefault(table, {}) if table else document).update(bad)
    with pytest.raises(jsonschema.ValidationError):
        jsonschema.validate(document, schema)


def test_every_key_is_explained(schema):
    """An editor shows the description of the key under the cursor."""
    tables = [schema, *schema["$defs"].values()]
    silent = [
        f"{t['title']}.{name}"
        for t in tables
        for name, key in t.get("properties", {}).items()
        if "description" not in key and "$ref" not in key
    ]
    assert silent in ([], ["Config.oracle"]), silent
