"""Models with some factors given: the same polynomials, and an inverse in the factors that are left."""

import numpy as np
import pytest
from numpy.testing import assert_allclose

from surrogates import Verdict, certify
from surrogates.commanding import commanding
from tests.surrogates.cases import box, cantilever_like, points, square_quadratic, surrogate


def loaded():
    """Two drives and a load to a pose of two components and a reaction that follows from them."""
    factors = box(("u", -1.0, 3.0), ("v", 0.0, 2.0), ("load", -5.0, 1.0))
    terms = ["1", "u", "v", "load", "u^2", "u:load", "v:load"]
    rows = [[0.5, 1.0, 0.2, 0.3, 0.05, 0.02, 0.0], [0.0, -0.1, 1.0, 0.2, 0.0, 0.0, 0.04], [9.0, 1.0, 1.0, 1.0, 0, 0, 0]]
    return surrogate(factors, terms, rows)


def test_the_commanded_responses_are_unchanged_and_the_given_factors_are_themselves():
    model, X = loaded(), points(loaded(), 50)
    square = commanding(model, ["r1", "r0"], ["load"])
    assert [r.name for r in square.responses] == ["r1", "r0", "load"]
    assert [r.unit for r in square.responses] == ["m", "m", "N"]
    expected = np.column_stack([model.predict(X)[:, [1, 0]], X[:, 2]])
    assert_allclose(square.predict(X), expected, rtol=1e-14, atol=1e-14)


def test_its_inverse_gives_drives_for_a_pose_under_a_known_load():
    model, X = loaded(), points(loaded(), 200)
    square = commanding(model, ["r0", "r1"], ["load"])
    answer = square.invert(square.predict(X))
    assert answer.ok.all()
    assert_allclose(answer.settings, X, rtol=0.0, atol=1e-8)


def test_its_certificate_has_a_box_of_poses_and_loads():
    square = commanding(loaded(), ["r0", "r1"], ["load"])
    certificate = certify(square)
    assert certificate.verdict is Verdict.CERTIFIED
    low, high = np.array(certificate.response_box).T
    assert_allclose([low[2], high[2]], [-5.0, 1.0], rtol=0.0, atol=1e-3)  # every load: giving some up gains nothing
    targets = np.random.default_rng(0).uniform(low, high, (2000, 3))
    assert square.invert(targets).ok.all()


def test_terms_that_the_model_lacks_are_added():
    model = surrogate(box(("a", 0.0, 1.0), ("b", 2.0, 4.0)), ["a", "a:b"], [[1.0, 0.1]])
    X = points(model, 20)
    square = commanding(model, ["r0"], ["b"])
    assert_allclose(square.predict(X), np.column_stack([model.predict(X), X[:, 1]]), rtol=1e-14, atol=1e-14)


def test_nothing_given_selects_responses():
    model = square_quadratic()
    square = commanding(model, ["r2", "r0", "r1"])
    assert_allclose(square.predict(points(model, 9)), model.predict(points(model, 9))[:, [2, 0, 1]], rtol=1e-14)


@pytest.mark.parametrize(
    ("responses", "given", "complaint"),
    [
        (["r0", "r9"], ["length", "width"], "unknown response 'r9'"),
        (["r0", "r1"], ["length", "weight"], "unknown factor 'weight'"),
        (["r0", "r0"], ["length", "width"], "named once; got r0, r0, length, width"),
        (
            ["r0", "r1"],
            ["length"],
            r"responses to command: 2; factors to do it with: 3 \(4 less 1 given\): make the numbers",
        ),
    ],
)
def test_what_does_not_fit_is_refused(responses, given, complaint):
    with pytest.raises(ValueError, match=complaint):
        commanding(cantilever_like(), responses, given)
