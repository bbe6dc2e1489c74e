"""The report's box of targets: what is shown lies within what is proven."""

from decimal import ROUND_CEILING, ROUND_FLOOR
from fractions import Fraction

import pytest

from pipeline.report.commanded import boxes, inwards


@pytest.mark.parametrize("value", [1.23456, -1.23456, 9.99999e-7, -9.99999e-7, 123456.7, 0.0, 5e-324, 2.0, 1 / 3])
def test_ends_are_rounded_inwards_to_four_digits(value):
    low, high = inwards(value, ROUND_CEILING), inwards(value, ROUND_FLOOR)
    assert Fraction(high) <= Fraction(value) + abs(Fraction(value)) / 10**15
    assert Fraction(low) >= Fraction(value) - abs(Fraction(value)) / 10**15
    assert low - high <= 1.001e-3 * abs(value)


def test_the_report_shows_the_box_of_the_certificate(hexflex):
    shown, certificate = boxes(hexflex), hexflex.model.certificate
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
    count = boxes(hexflex)["inside"]
    values = hexflex.validation_runs.values
    box = hexflex.model.certificate.response_box
    inside = [all(low <= v <= high for v, (low, high) in zip(row, box, strict=True)) for row in values]
    assert count == {"n": sum(inside), "of": len(values)}
