"""``fit.transform``: a study that fits logarithms, from the config to the report; and one that cannot."""

import json

import numpy as np
import pytest
from numpy.testing import assert_allclose

import pipeline
from pipeline.cli import main
from surrogates import load
from tests.pipeline.cases import CONFIGS, SMALL, config_text


@pytest.fixture(scope="module")
def logged(tmp_path_factory):
    """The cantilever's deflection and slope are products of powers."""
    folder = tmp_path_factory.mktemp("logged") / "run"
    return pipeline.run(CONFIGS / "smoke.toml", folder, [*SMALL, "fit.transform=log"])


def test_the_model_gives_responses_and_the_file_says_that_it_holds_logarithms(logged, smoke):
    document = json.loads((logged.path / "model.json").read_text(encoding="utf-8"))
    assert document["links"] == {"deflection": "log", "slope": "log"}
    runs = logged.validation_runs.completed()
    model = load(logged.path / "model.json")
    wrong = np.abs(model.predict(runs.design.physical) - runs.values).max(axis=0)
    assert_allclose([e.max_abs for e in model.validation], wrong, rtol=1e-12)
    # Validation: the logarithm of a product of powers is the easier function.
    for ours, theirs in zip(logged.model.validation, smoke.model.validation, strict=True):
        assert ours.max_relative < theirs.max_relative


def test_what_is_inverted_is_the_response(logged):
    trip = logged.round_trip
    assert trip.n_refused == 0
    assert trip.worst < 2.0 * max(e.max_relative for e in logged.model.validation)


def test_the_report_heads_coefficients_by_logarithms(logged):
    page = (logged.path / "report.html").read_text(encoding="utf-8")
    assert "[ln(deflection / m)]" in page
    assert "Under a logarithm stand coefficients" in page


def test_a_response_without_a_logarithm_is_the_config_s_fault(counted, tmp_path, capsys):
    config = tmp_path / "study.toml"
    config.write_text(config_text("counted"), encoding="utf-8")
    told = [part for override in (*SMALL, "fit.transform=log") for part in ("--set", override)]
    assert main(["run", str(config), "--out", str(tmp_path / "out"), *told]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "fit.transform: 'log' needs responses that are positive in every run: the smallest value of 'v' is -" in said
