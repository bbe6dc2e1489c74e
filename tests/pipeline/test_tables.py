"""Tables of errors and predictions, cell by cell."""

import csv
import io
from dataclasses import replace

import numpy as np

from pipeline import tables
from surrogates.intervals import Interval
from surrogates.validation import compare
from tests.surrogates.cases import box, surrogate


def rows_of(text):
    return list(csv.DictReader(io.StringIO(text)))


def small_model():
    return surrogate(box(("a", 0.0, 2.0), ("b", 10.0, 30.0)), ["1", "a"], [[1.0, 2.0], [0.0, 1.0]], ["m", "rad"])


def errors():
    found = compare(
        small_model().responses,
        [[0.0, 0.0], [2.0, 0.0]],
        [[0.5, 0.0], [2.0, 1.0]],
        settings=[[0.5, 12.0], [2.0, 1.0 / 3.0]],
    )
    return replace(found[0], intervals=(Interval(0.9, 0.25, 10, 0.875, 8),)), found[1]


def test_errors_with_factors_say_where_the_largest_lies():
    model = small_model()
    first, second = rows_of(tables.errors_csv(errors(), model.responses, model.factors))
    assert list(first) == [
        "response", "unit", "n_runs", "max_abs", "range", "max_relative_to_range", "rmse", "rmse_relative_to_range",
        "q2", "half_width_0.9", "coverage_0.9", "worst_run", "worst_a[N]", "worst_b[N]",
    ]  # fmt: skip
    assert list(first.values()) == [
        "r0", "m", "2", "0.5", "2.0", "0.25", repr(0.125**0.5), repr(0.125**0.5 / 2.0), "0.875", "0.25", "0.875", "1",
        "0.5", "12.0",
    ]  # fmt: skip
    # Of a response that is always zero there is no relative error, and no interval was calibrated for it.
    assert list(second.values()) == [
        "r1", "rad", "2", "1.0", "0.0", "inf", repr(0.5**0.5), "inf", "-inf", "", "", "2", "2.0", repr(1.0 / 3.0),
    ]  # fmt: skip


def test_errors_without_settings_have_no_such_columns():
    model = small_model()
    plain = [replace(e, worst_point=(), intervals=()) for e in errors()]
    for text in (tables.errors_csv(plain, model.responses), tables.errors_csv(plain, model.responses, model.factors)):
        assert list(rows_of(text)[0])[-2:] == ["q2", "worst_run"]
    old = [replace(e, relative_rmse=None, q2=None) for e in plain]
    row = rows_of(tables.errors_csv(old, model.responses))[0]
    assert (row["rmse_relative_to_range"], row["q2"]) == ("", "")


def test_predictions_with_an_interval():
    intervals = (Interval(0.9, 0.25, 10, 0.875, 8),)
    model = replace(small_model(), validation=tuple(replace(e, intervals=intervals) for e in errors()))
    table = rows_of(tables.prediction_csv(model, np.array([[1.0, 20.0], [2.0, 20.0], [5.0, 20.0]]), 0.9))
    assert [r["status"] for r in table] == ["inside", "edge", "outside"]
    assert [(r["low_r0[m]"], r["r0[m]"], r["high_r0[m]"]) for r in table] == [
        ("0.75", "1.0", "1.25"), ("2.75", "3.0", "3.25"), ("", "9.0", ""),
    ]  # fmt: skip
