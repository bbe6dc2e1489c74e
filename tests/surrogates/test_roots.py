"""The search for all roots of a map: its arithmetic against rationals, and what it does not decide."""

from fractions import Fraction
from math import comb

import numpy as np
import pytest
from numpy.testing import assert_allclose

from surrogates.multistart import NEAR, distinct
from surrogates.roots import REACH, SMALLEST, _expanded, _halved, _system, _with_pinned, find_roots
from tests.surrogates.cases import surrogate, unit_box
from tests.surrogates.test_preimages import one, random_map, same_settings


def test_expansions_hold_the_exact_coefficients():
    model, target = random_map(3, 2, 4, 1.0)
    system = _system(model, target)
    rng = np.random.default_rng(0)
    middle, half = rng.uniform(-1.0, 1.0, (20, 2)), rng.uniform(0.0, 1.0, (20, 2)) * [[1.0, 1e-6]]
    found = _expanded(system, middle, half)
    for p, (c, h) in enumerate(zip(middle.tolist(), half.tolist(), strict=True)):
        for row, beta in enumerate(system.lower.tolist()):
            for r in range(2):
                exact = -Fraction(float(system.target[r])) * (sum(beta) == 0)
                for alpha, coefficient in zip(system.exponents.tolist(), system.coefficients[:, r], strict=True):
                    part = Fraction(float(coefficient))
                    for a, b, m, w in zip(alpha, beta, c, h, strict=True):
                        part *= comb(a, b) * Fraction(m) ** (a - b) * Fraction(w) ** b if a >= b else 0
                    exact += part
                assert abs(exact - Fraction(float(found.mid[p, row, r]))) <= Fraction(float(found.rad[p, row, r]))
    assert found.rad.max() < 1e-12


def test_halves_cover_their_part_exactly_down_to_the_smallest():
    middle, half, final = np.zeros((1, 2)), np.full((1, 2), REACH), 0
    rng = np.random.default_rng(0)
    for _ in range(60):
        (middles, halves), final = _halved(middle, half, rng.permuted(np.arange(2))[None])
        if final:
            break
        for k in range(2):
            ends = sorted((Fraction(m[k]) - Fraction(h[k]), Fraction(m[k]) + Fraction(h[k]))
                          for m, h in zip(middles, halves, strict=True))  # fmt: skip
            parent = Fraction(middle[0, k]) - Fraction(half[0, k]), Fraction(middle[0, k]) + Fraction(half[0, k])
            assert (ends[0][0], ends[-1][1]) == parent
            assert ends[0] == ends[1] or ends[0][1] == ends[1][0]
        pick = rng.integers(2)
        middle, half = middles[[pick]], halves[[pick]]
    assert final == 1
    assert (half <= SMALLEST).all()


@pytest.mark.parametrize(("middle", "half", "accepted"), [(0.45, 0.1, True), (0.1, 0.05, False), (0.0, 0.1, False)])
def test_a_root_counts_only_where_the_part_has_it(middle, half, accepted):
    """x² = 1/4: from 0.1 Newton's method goes far beyond the part, from 0 nowhere."""
    model = one(0.0, 0.0, 1.0)
    system = _system(model, np.array([0.25]))
    part = np.array([[middle]]), np.array([[half]])
    found, settled = _with_pinned(model, system, np.empty((0, 1)), *part, np.array([True]))
    assert settled.tolist() == [accepted]
    assert_allclose(found[:, 0], [0.5] * accepted, atol=1e-12)


@pytest.mark.parametrize(("apart", "decided"), [(1e-4, True), (1e-6, False), (1e-10, False)])
def test_what_rounding_leaves_open_is_not_decided(apart, decided):
    """Two responses that are nearly one: a setting is known to about 1e-15 over the difference, and 1e-9 is wanted."""
    model = surrogate(unit_box(2), ["f0", "f1", "f0^2"], [[1.0, 1.0, 0.1], [1.0, 1.0 + apart, 0.1]])
    roots = find_roots(model, model.predict([[0.2, 0.3]])[0], 3000)
    assert roots.complete == decided
    assert same_settings(roots.coded, np.array([[0.2, 0.3]])) == decided


def test_distinct_keeps_the_first_of_those_that_are_near():
    rows = np.array([[0.1, 0.2], [np.nan, 0.0], [0.1, 0.2 + 0.5 * NEAR], [0.1, 0.2 + 2.0 * NEAR]])
    assert_allclose(distinct(rows), rows[[0, 3]])
    assert distinct(np.empty((0, 2))).shape == (0, 2)
