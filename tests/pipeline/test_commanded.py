"""The report's box of targets: what is shown lies within what is proven."""

from decimal import ROUND_CEILING, ROUND_FLOOR
from fractions import Fraction

import numpy as np
import pytest

from pipeline import read_run, run
from pipeline.errors import InputError
from pipeline.report.commanded import boxes, inwards
from surrogates import certify, exports, load


@pytest.mark.parametrize("value", [1.23456, -1.23456, 9.99999e-7, -9.99999e-7, 123456.7, 0.0, 5e-324, 2.0, 1 / 3])
def test_ends_are_rounded_inwards_to_four_digits(value):
    low, high = inwards(value, ROUND_CEILING), inwards(value, ROUND_FLOOR)
    assert Fraction(high) <= Fraction(value) + abs(Fraction(value)) / 10**15
    assert Fraction(low) >= Fraction(value) - abs(Fraction(value)) / 10**15
    assert low - high <= 1.001e-3 * abs(value)


def test_the_report_shows_the_box_of_the_certificate(hexflex):
    shown, certificate = boxes(hexflex, hexflex.model), hexflex.model.certificate
    assert shown["whole"]
    assert [f["name"] for f in shown["factors"]] == list(hexflex.study.space.names)
    for row, response, (low, high) in zip(
        shown["responses"], hexflex.model.responses, certificate.response_box, strict=True
    ):
        ends = [float(row[end].replace("−", "-")) / response.shown_scale for end in ("low", "high")]
        assert low <= ends[0] <= low + 2e-3 * abs(low)
        assert high >= ends[1] >= high - 2e-3 * abs(high)
    page = (hexflex.path / "report.html").read_text(encoding="utf-8")
    assert "You may command any target in here" in page
    assert shown["responses"][0]["low"] in page


def test_runs_within_the_box_are_counted(hexflex):
    count = boxes(hexflex, hexflex.model)["inside"]
    values = hexflex.validation_runs.values
    box = hexflex.model.certificate.response_box
    inside = [all(low <= v <= high for v, (low, high) in zip(row, box, strict=True)) for row in values]
    assert count == {"n": sum(inside), "of": len(values)}


COMMAND = """
name = "commanded"
[oracle]
name = "cantilever"
[fit]
degree = 2
design = { method = "uniform", n_runs = 30, levels = 5, budget = 100 }
[validation]
n_runs = 20
[export]
targets = []
[command]
responses = ["deflection"]
given = ["length", "width", "thickness"]
"""


@pytest.fixture(scope="module")
def commanded(tmp_path_factory):
    folder = tmp_path_factory.mktemp("commanded")
    (folder / "config.toml").write_text(COMMAND, encoding="utf-8")
    return run(folder / "config.toml", folder / "run")


def test_a_square_model_is_written_and_inverts(commanded):
    """Load from deflection, the dimensions being given."""
    square = load(commanded.path / "command.json")
    assert [r.name for r in square.responses] == ["deflection", "length", "width", "thickness"]
    assert square.certificate == certify(square)
    settings = square.factors.decode([[0.3, -0.2, 0.1, 0.4]])
    answer = square.invert(square.predict(settings))
    assert answer.ok.all()
    np.testing.assert_allclose(answer.settings, settings, rtol=1e-9)
    assert "static" in exports.get("c99").render(square, "commanded")["commanded.c"]


def test_the_report_and_a_folder_read_back_show_it(commanded):
    page = (commanded.path / "report.html").read_text(encoding="utf-8")
    assert "The model to be commanded" in page
    assert "With length, width, thickness given, you may command any target in here" in page
    again = read_run(commanded.path)
    assert again.commanded.certificate == commanded.commanded.certificate


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ('command.responses=["slop"]', "command: unknown response 'slop'; did you mean 'slope'"),
        ('command.given=["load"]', "command: responses to command: 1; factors .*: 3 .* make the numbers equal"),
        ('command.given=["lenght", "width", "load"]', "command: unknown factor 'lenght'"),
    ],
)
def test_names_that_make_no_square_model_are_refused(override, message, tmp_path):
    (tmp_path / "config.toml").write_text(COMMAND, encoding="utf-8")
    with pytest.raises(InputError, match=message):
        run(tmp_path / "config.toml", tmp_path / "run", [override])
    assert not (tmp_path / "run").exists()
