"""Properties of designs: closed forms, and what the summary says."""

from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_allclose, assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import (
    DefinitiveScreening,
    Design,
    DOptimal,
    FractionalFactorial,
    FullFactorial,
    LatinHypercube,
    PlackettBurman,
    Random,
    centred_discrepancy_squared,
    hadamard,
    properties,
)
from experiments.designs.measures import box_moments
from experiments.terms import Terms, model_matrix


def space(k: int) -> FactorSpace:
    return FactorSpace(tuple(Factor("ABCDEFGHIJKLMNOPQRSTUVWXYZ"[i], "1", 0, 1) for i in range(k)))


def given(rows) -> Design:
    return Design(space(len(rows[0])), rows, "given")


NINE = FullFactorial(3).generate(space(2))


@pytest.mark.parametrize("design", [PlackettBurman(28).generate(space(6)), FractionalFactorial(16).generate(space(6))])
def test_orthogonal_two_level_designs_are_fully_efficient(design):
    found = properties(design)
    assert found.orthogonal
    assert all(found.balanced)
    for value in (found.d_efficiency, found.a_efficiency, found.g_efficiency, found.i_efficiency, *found.vif.values()):
        assert value == pytest.approx(1.0, rel=1e-12)
    assert_allclose(found.correlation, np.eye(6), atol=1e-15)
    assert found.average_variance == pytest.approx((1 + 6 / 3) / len(design), rel=1e-12)


def test_efficiencies_of_nine_runs_under_the_quadratic_model():
    """3 × 3 factorial in closed form: det XᵀX = 6·6·4·(9·2·2), var ŷ at a corner 29/36.

    The diagonal of (XᵀX)⁻¹ is 5/9 for the constant, 1/6 linear, 1/2 squares, 1/4 the interaction.
    """
    found = properties(NINE, "quadratic")
    assert found.d_efficiency == pytest.approx(5184 ** (1 / 6) / 9, rel=1e-12)
    assert found.g_efficiency == pytest.approx(6 / (9 * 29 / 36), rel=1e-12)
    trace = 5 / 9 + 2 / 6 + 2 / 2 + 1 / 4
    assert found.a_efficiency == pytest.approx(6 / (9 * trace), rel=1e-12)
    # ∫ of 5/9 + x²/6·2 + x²y²/4 + x⁴/2·2 − 2·(1/3)(x² + y²), each averaged over the square
    average = 5 / 9 + 2 / 6 / 3 + 1 / 4 / 9 + 2 / 2 / 5 - 2 * (1 / 3) * (2 / 3)
    assert found.average_variance == pytest.approx(average, rel=1e-12)
    assert found.i_efficiency == pytest.approx((1 + 2 / 3 + 1 / 9 + 2 / 5) / (9 * average), rel=1e-12)


@pytest.mark.parametrize("k", [2, 10])
def test_largest_variance_of_a_first_order_model_is_at_a_run(k):
    """On orthogonal columns every corner has variance (k + 1)/n; ten factors are sampled instead of listed."""
    design = PlackettBurman(12).generate(space(k))
    assert properties(design).g_efficiency == pytest.approx(1.0, rel=1e-12)


def test_average_variance_is_the_mean_over_random_points():
    design = LatinHypercube(20).generate(space(3))
    found = properties(design, "quadratic")
    rows = model_matrix(found.terms, Random(200_000).generate(space(3)).coded)
    inverse = np.linalg.inv(found.matrix.T @ found.matrix)
    assert found.average_variance == pytest.approx(np.einsum("ij,jk,ik->i", rows, inverse, rows).mean(), rel=0.02)


def test_box_moments_by_quadrature():
    terms = Terms.polynomial(("A", "B"), 3)
    nodes, weights = np.polynomial.legendre.leggauss(8)
    grid = np.array([(a, b) for a in nodes for b in nodes])
    weight = np.outer(weights, weights).ravel() / 4.0
    rows = model_matrix(terms, grid)
    assert_allclose(box_moments(terms), rows.T @ (weight[:, None] * rows), atol=1e-14)


def test_variance_inflation_of_two_correlated_factors():
    """Marquardt (1970): 1/(1 − r²)."""
    design = given(np.random.default_rng(0).uniform(-1, 1, (9, 2)))
    r = np.corrcoef(design.coded.T)[0, 1]
    found = properties(design)
    assert found.correlation[0, 1] == pytest.approx(r, rel=1e-12)
    assert found.vif == pytest.approx({"A": 1 / (1 - r**2), "B": 1 / (1 - r**2)}, rel=1e-9)
    assert not found.orthogonal


def test_aliased_terms_inflate_without_bound_and_have_no_efficiency():
    design = FractionalFactorial(generators="C=AB").generate(space(3))
    found = properties(design, "interactions")
    assert found.vif["A"] == np.inf
    assert (found.estimable, found.d_efficiency, found.a_efficiency) == (False, 0.0, 0.0)
    assert (found.g_efficiency, found.i_efficiency) == (0.0, 0.0)
    with pytest.raises(ValueError, match="4 runs of this design do not tell the 7 terms of the model apart"):
        _ = found.alias_matrix


def test_alias_matrix_of_a_half_fraction():
    """Box and Wilson (1951): A + BC, B + AC, C + AB."""
    found = properties(FractionalFactorial(generators="C=AB").generate(space(3)))
    assert found.omitted.labels == ("A:B", "A:C", "B:C")
    assert_allclose(found.alias_matrix, [[0, 0, 0], [0, 0, 1], [0, 1, 0], [1, 0, 0]], atol=1e-15)


def test_alias_matrix_of_twelve_runs():
    """Lin and Draper (1992), Technometrics 34, 423–428: ±1/3 of every interaction of two other factors."""
    found = properties(PlackettBurman(12).generate(space(5)))
    for label, column in zip(found.omitted.labels, found.alias_matrix.T, strict=True):
        own = [i + 1 for i, name in enumerate("ABCDE") if name in label.split(":")]
        assert_allclose(column[[0, *own]], 0.0, atol=1e-15)
        assert_allclose(np.abs(np.delete(column, [0, *own])), 1 / 3, rtol=1e-12)


def test_squares_are_omitted_terms_where_a_third_level_is():
    assert properties(NINE).omitted.labels == ("A^2", "A:B", "B^2")
    assert properties(NINE, "quadratic").omitted.labels == ()
    assert properties(NINE).alias_matrix[0] == pytest.approx([2 / 3, 0, 2 / 3])


@pytest.mark.parametrize(
    ("design", "strength"),
    [
        (FullFactorial(2).generate(space(3)), 3),
        (FullFactorial("2, 3, 2, 2, 2").generate(space(5)), 4),
        (FractionalFactorial(16).generate(space(5)), 4),
        (FractionalFactorial(16).generate(space(6)), 3),
        (FractionalFactorial(8).generate(space(5)), 2),
        (PlackettBurman(12).generate(space(6)), 2),
        (PlackettBurman(12, True, 1).generate(space(6)), 3),
        (LatinHypercube(10).generate(space(3)), 1),
        (DefinitiveScreening().generate(space(6)), 0),
    ],
)
def test_strength_is_resolution_less_one(design, strength):
    """Rao (1947): an array of strength t is a fraction of resolution t + 1."""
    assert properties(design).strength == strength


def test_balance_levels_and_repeated_runs():
    found = properties(given([[-1, -1], [-1, 0], [-1, 0], [1, 1], [0, -1]]))
    assert found.levels == (3, 3)
    assert found.balanced == (False, False)
    assert found.distinct_runs == 4
    assert found.minimum_distance == 0.0
    assert properties(NINE).balanced == (True, True)
    assert properties(PlackettBurman(12, n_centre=3).generate(space(2))).balanced == (True, True)


def test_minimum_distance():
    found = properties(given([[-1, -1], [0.5, -1], [0.5, 1]]))
    assert found.minimum_distance == pytest.approx(1.5)
    assert properties(given([[0.0, 0.0]])).minimum_distance == np.inf
    coded = Random(30).generate(space(3)).coded
    brute = min(np.linalg.norm(a - b) for a, b in combinations(coded, 2))
    assert properties(given(coded)).minimum_distance == pytest.approx(brute, rel=1e-12)


def test_a_constant_factor_is_not_orthogonal():
    found = properties(given([[-1, 0], [1, 0], [-1, 0]]))
    assert not found.orthogonal
    assert_array_equal(found.correlation, np.eye(2))
    assert found.strength == 0
    assert found.vif == {"A": 1.0, "B": np.inf}
    assert "does not vary: B" in str(found)


def test_discrepancies_take_the_box_as_the_unit_cube():
    found = properties(NINE).discrepancies
    assert list(found) == ["centred", "mixture", "wrap-around"]
    assert found["centred"] == centred_discrepancy_squared((NINE.coded + 1) / 2)
    assert len({round(value, 6) for value in found.values()}) == 3


def test_projections():
    found = properties(PlackettBurman(12).generate(space(4)))
    assert found.projections(1) == {(name,): 2 / 12 for name in "ABCD"}
    assert set(found.projections().values()) == {4 / 12}
    assert set(found.projections(3).values()) == {8 / 12}  # Lin and Draper (1992): 2³ and half a 2³
    for size in (0, 5, 1.5, True):
        with pytest.raises(ValueError, match=f"projections are onto 1 to 4 factors, got {size}"):
            found.projections(size)


@pytest.mark.parametrize(
    ("design", "says"),
    [
        (
            PlackettBurman(12).generate(space(6)),
            [
                "12 runs of 6 factors (plackett_burman), 12 different, 0 at the centre; 5 dummy columns",
                "levels a factor: 2; each equally often (balanced)",
                "factors are orthogonal; any 2 of them meet all combinations equally often",
                "can tell main effects only where two-factor interactions are small: A carries 0.33 of B:C; a foldover",
                "CANNOT tell all 15 two-factor interactions apart (with the main effects 22 terms, 12 runs)",
                "CANNOT see curvature in A, B, C, D and 2 more",
                "can judge the model's error by 5 runs left over",
            ],
        ),
        (
            PlackettBurman(12, True, 2).generate(space(6)),
            [
                "26 runs of 6 factors (plackett_burman), 25 different, 2 at the centre; 17 dummy columns",
                "1 run repeated: measures noise, and nothing with a deterministic simulator",
                "can tell main effects, clear of two-factor interactions",
                "can see that there is curvature, CANNOT tell of which factor",
            ],
        ),
        (
            DefinitiveScreening().generate(space(6)),
            [
                "can tell main effects, clear of two-factor interactions",
                "CANNOT tell all 15 two-factor interactions apart",
                "can tell the curvature of each factor; CANNOT fit the full quadratic model",
            ],
        ),
        (
            DOptimal(32, starts=2).generate(space(6)),
            [
                "can tell main effects, apart from two-factor interactions if both are fitted",
                "can tell all 15 two-factor interactions",
                "can tell the curvature of each factor, and fit the full quadratic model",
            ],
        ),
        (
            LatinHypercube(5).generate(space(1)),
            ["5 runs of 1 factor", "one factor", "can tell the main effect", "there are no interactions of one factor"],
        ),
        (
            given([[-1, -1], [1, 1]]),
            ["CANNOT tell the main effects apart: use more runs", "cannot be estimated, so it has no efficiency"],
        ),
        (
            Design(space(3), hadamard(4)[:, 1:], "saturated"),
            ["CANNOT judge the model's error: no run is left over", "CANNOT see curvature in A, B, C: fewer than"],
        ),
        (
            given([[-1, 0.2, 0.1], [0, 1, -0.3], [1, 0.1, 0.9]]),
            ["CANNOT see curvature: squares are aliased with the main effects"],
        ),
    ],
)
def test_summary_says_what_the_design_can_and_cannot_tell(design, says):
    text = str(properties(design))
    for words in says:
        assert words in text
    assert max(len(line) for line in text.splitlines()) <= 160


def test_refuses_a_design_without_runs():
    with pytest.raises(ValueError, match="a design without runs has no properties; give one with at least one run"):
        properties(Design(space(2), np.empty((0, 2)), "empty"))
