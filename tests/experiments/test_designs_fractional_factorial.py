"""Two-level fractions: aberration against published tables, aliases against the columns themselves."""

from itertools import combinations

import numpy as np
import pytest
from numpy.testing import assert_array_equal

from experiments import Factor, FactorSpace
from experiments.designs import Fraction, FractionalFactorial
from experiments.designs.aberration import minimum_aberration
from experiments.designs.fractions import krawtchouk

LETTERS = "ABCDEFGHJKLMNOPQRSTUVWXYZabcdefghijklmnop"

# Generators of the table in Box, Hunter and Hunter (2005), 2nd ed., Table 6.22, also NIST/SEMATECH e-Handbook
# 5.3.3.4.7, those of resolution IV and above: runs, generators.
PUBLISHED = [
    (8, "D=ABC"),
    (16, "E=ABCD"),
    (16, "E=ABC; F=BCD"),
    (16, "E=ABC; F=BCD; G=ACD"),
    (16, "E=BCD; F=ACD; G=ABC; H=ABD"),
    (32, "F=ABCDE"),
    (32, "F=ABCD; G=ABDE"),
    (32, "F=ABC; G=ABD; H=BCDE"),
    (32, "F=BCDE; G=ACDE; H=ABDE; J=ABCE"),
    (32, "F=ABCD; G=ABCE; H=ABDE; J=ACDE; K=BCDE"),
    (32, "F=ABC; G=BCD; H=CDE; J=ACD; K=ADE; L=BDE"),
    (64, "G=ABCDEF"),
    (64, "G=ABCD; H=ABEF"),
    (64, "G=ABCD; H=ACEF; J=CDEF"),
    (64, "G=BCDF; H=ACDF; J=ABDE; K=ABCE"),
    (64, "G=CDE; H=ABCD; J=ABF; K=BDEF; L=ADEF"),
    (128, "H=ABCDEFG"),
    (128, "H=ACDFG; J=BCEFG"),
    (128, "H=ABCG; J=BCDE; K=ACDF"),
    (128, "H=ABCG; J=BCDE; K=ACDF; L=ABCDEFG"),
]

# Numbers of words of length 3, 4, …: Chen, Sun and Wu (1993), Int. Statist. Rev. 61, 131–145, Tables 2 and 3, first
# design of each size.
PATTERNS = {
    (5, 8): (2, 1, 0),
    (6, 8): (4, 3, 0, 0),
    (7, 8): (7, 7, 0, 0, 1),
    (9, 16): (4, 14, 8, 0, 4, 1, 0),
    (10, 16): (8, 18, 16, 8, 8, 5, 0, 0),
    (11, 16): (12, 26, 28, 24, 20, 13, 4, 0, 0),
    (12, 16): (16, 39, 48, 48, 48, 39, 16, 0, 0, 1),
    (12, 32): (0, 38, 0, 52, 0, 33, 0, 4, 0, 0),
    (13, 32): (0, 55, 0, 96, 0, 87, 0, 16, 0, 1, 0),
    (16, 32): (0, 140, 0, 448, 0, 870, 0, 448, 0, 140, 0, 0, 0, 1),
}


def space(k: int) -> FactorSpace:
    return FactorSpace(tuple(Factor(LETTERS[i], "1", 0, 1) for i in range(k)))


def brute_pattern(coded: np.ndarray) -> tuple[int, ...]:
    """Words by trying every product of columns."""
    k = coded.shape[1]
    return tuple(
        sum(abs(coded[:, list(chosen)].prod(axis=1).sum()) == len(coded) for chosen in combinations(range(k), size))
        for size in range(3, k + 1)
    )


@pytest.mark.parametrize(("n_runs", "generators"), PUBLISHED)
def test_search_reaches_the_published_aberration(n_runs, generators):
    k = n_runs.bit_length() - 1 + generators.count("=")
    published = FractionalFactorial(generators=generators).fraction(space(k))
    ours = FractionalFactorial(n_runs).fraction(space(k))
    assert ours.word_length_pattern == published.word_length_pattern
    assert ours.resolution == published.resolution >= 4


@pytest.mark.parametrize(("k", "n_runs"), PATTERNS)
def test_published_word_length_patterns(k, n_runs):
    assert FractionalFactorial(n_runs).fraction(space(k)).word_length_pattern == PATTERNS[k, n_runs]


@pytest.mark.parametrize("k", range(5, 12))
def test_no_fraction_of_sixteen_runs_has_less_aberration(k):
    """All choices of columns beside the four basic ones, exhaustively."""
    others = [mask for mask in range(1, 16) if mask.bit_count() > 1]
    patterns = set()
    for chosen in combinations(others, k - 4):
        columns = np.array([1, 2, 4, 8, *chosen])
        counts = np.bincount(
            (np.bitwise_count(np.arange(16)[:, None] & columns[None, :]) % 2).sum(axis=1), minlength=k + 1
        )
        patterns.add(tuple(int(counts @ row) // 16 for row in KRAWTCHOUK[k]))
    assert min(patterns) == FractionalFactorial(16).fraction(space(k)).word_length_pattern
    assert len(patterns) > 1 or k == 5


KRAWTCHOUK = {k: [[krawtchouk(j, x, k) for x in range(k + 1)] for j in range(3, k + 1)] for k in range(5, 12)}


@pytest.mark.parametrize(("k", "n_runs"), [(3, 4), (4, 8), (6, 16), (7, 8), (9, 32), (11, 16)])
def test_pattern_is_what_counting_the_columns_gives(k, n_runs):
    method = FractionalFactorial(n_runs)
    coded = method.generate(space(k)).coded
    assert method.fraction(space(k)).word_length_pattern == brute_pattern(coded)


@pytest.mark.parametrize(("k", "n_basic"), [(20, 5), (33, 6), (40, 7), (64, 7)])
def test_large_fractions_keep_the_resolution_that_is_known_to_exist(k, n_basic):
    columns = minimum_aberration(k, n_basic)
    assert len(set(columns)) == k
    fraction = Fraction(tuple(f"f{i}" for i in range(k)), columns, (1,) * k)
    assert fraction.resolution == (4 if k <= 2 ** (n_basic - 1) else 3)
    assert len(fraction.generators) == k - n_basic


@pytest.mark.parametrize(("k", "n_runs"), [(1, 4), (3, 8), (6, 16), (9, 16), (17, 32)])
def test_orthogonal_with_all_its_dummies(k, n_runs):
    design = FractionalFactorial(n_runs).generate(space(k))
    columns = np.hstack([design.coded, design.dummies])
    assert_array_equal(np.abs(columns), np.ones((n_runs, n_runs - 1)))
    assert_array_equal(columns.T @ columns, n_runs * np.eye(n_runs - 1))
    assert_array_equal(columns.sum(axis=0), np.zeros(n_runs - 1))


@pytest.mark.parametrize("settings", [{"n_runs": 16}, {"generators": "E=-ABC; F=BCD"}, {"n_runs": 8, "foldover": True}])
def test_words_generators_and_aliases_hold_in_the_columns(settings):
    method, factors = FractionalFactorial(**settings), space(6)
    fraction, coded = method.fraction(factors), method.generate(factors).coded
    columns = dict(zip(factors.names, coded.T, strict=True))

    def column(word):
        sign = -1 if word.startswith("-") else 1
        return sign * np.prod([columns[name] for name in word.lstrip("-").split(":")], axis=0)

    assert fraction.defining_relation
    for word in fraction.defining_relation:
        assert_array_equal(column(word), np.ones(len(coded)))
    for generator in fraction.generators:
        left, right = generator.split(" = ")
        assert_array_equal(column(left), column(right))
    chains = [chain.replace(" - ", " + -").split(" + ") for chain in fraction.aliases()]
    assert sorted(word.lstrip("-") for chain in chains for word in chain) == sorted(
        [*factors.names, *(f"{a}:{b}" for a, b in combinations(factors.names, 2))]
    )
    for chain in chains:
        for word in chain[1:]:
            assert_array_equal(column(chain[0]), column(word))
    for first, second in combinations(chains, 2):
        assert column(first[0]) @ column(second[0]) == 0.0


def test_aliases_of_the_half_fraction_of_five():
    """Box, Hunter and Hunter (2005), chapter 6: E = ABCD clears everything up to two-factor interactions."""
    fraction = FractionalFactorial(16).fraction(space(5))
    assert fraction.generators == ("E = A:B:C:D",)
    assert fraction.defining_relation == ("A:B:C:D:E",)
    assert fraction.resolution == 5
    assert len(fraction.aliases()) == 15
    assert "A + B:C:D:E" not in fraction.aliases(3)
    assert "A:B + C:D:E" in fraction.aliases(3)
    assert "A + B:C:D:E" in fraction.aliases(4)


def test_alias_lists_use_the_factors_names_and_signs():
    factors = FactorSpace(tuple(Factor(name, "1", 0, 1) for name in ("force", "length", "young")))
    fraction = FractionalFactorial(generators="young = -force:length").fraction(factors)
    assert fraction.aliases() == ("force - length:young", "length - force:young", "young - force:length")
    assert fraction.aliases(1) == ("force", "length", "young")
    assert fraction.aliases(3)[-1] == "1 - force:length:young"
    assert fraction.defining_relation == ("-force:length:young",)
    assert fraction.generators == ("young = -force:length",)


def test_full_factorial_has_no_words():
    fraction = FractionalFactorial(16).fraction(space(3))
    assert (fraction.generators, fraction.defining_relation, fraction.resolution) == ((), (), None)


def test_foldover_raises_resolution_three_to_four():
    """Box and Hunter (1961): words of odd length vanish."""
    plain, folded = (FractionalFactorial(8, foldover=f).fraction(space(7)) for f in (False, True))
    assert (plain.resolution, folded.resolution) == (3, 4)
    assert plain.word_length_pattern == (7, 7, 0, 0, 1)
    assert folded.word_length_pattern == (0, 7, 0, 0, 0)
    coded = FractionalFactorial(8, foldover=True, n_centre=1).generate(space(7)).coded
    assert coded.shape == (17, 7)
    assert brute_pattern(coded[:-1]) == folded.word_length_pattern
    assert_array_equal(coded[-1], np.zeros(7))


@pytest.mark.parametrize(
    ("k", "resolution", "n_runs"),
    [
        (1, 4, 2),
        (3, 4, 8),
        (4, 4, 8),
        (5, 4, 16),
        (8, 4, 16),
        (9, 4, 32),
        (7, 3, 8),
        (5, 5, 16),
        (6, 5, 32),
        (11, 5, 128),
    ],
)
def test_smallest_of_a_resolution(k, resolution, n_runs):
    """Box, Hunter and Hunter (2005), Table 6.22."""
    method = FractionalFactorial(resolution=resolution)
    assert len(method.generate(space(k))) == n_runs
    reached = method.fraction(space(k)).resolution
    assert reached is None or reached >= resolution


def test_default_resolution_is_four():
    for k in (2, 5, 8, 9, 16):
        default, four = (FractionalFactorial(resolution=r).generate(space(k)) for r in (None, 4))
        assert_array_equal(default.coded, four.coded)


def test_words_of_a_crowded_fraction_are_counted_but_not_listed():
    fraction = FractionalFactorial(32).fraction(space(31))
    assert fraction.word_length_pattern[:2] == (155, 1085)
    with pytest.raises(ValueError, match=r"the defining relation has 2\^26 - 1 words, at most 65535 are listed"):
        _ = fraction.defining_relation


@pytest.mark.parametrize(
    ("settings", "k", "message"),
    [
        ({"n_runs": 8}, 8, "8 runs has 7 columns, too few for 8 factors; use n_runs = 16"),
        ({"n_runs": 8, "resolution": 4}, 5, "5 factors in 8 runs reach resolution 3, not 4; leave n_runs"),
        ({"resolution": 9}, 12, "no fraction of resolution 9 for 12 factors was found up to 128 runs"),
        ({"n_runs": 256}, 12, "fractions are searched up to 128 runs, got 256 runs for 12 factors; give generators"),
        (
            {"generators": "D=ABC", "n_runs": 16},
            4,
            "leave 3 basic factors, which need 8 runs, not 16; leave n_runs out",
        ),
        ({"generators": "D=ABX"}, 4, "generators name an unknown factor 'X'; known are A, B, C, D"),
        ({"generators": "D ABC"}, 4, "generator 'D ABC' cannot be read; write 'E = A:B:C"),
        ({"generators": "D="}, 4, "generator 'D=' cannot be read"),
        ({"generators": "D=ABC;"}, 4, "generator '' cannot be read"),
        ({"generators": "D=AB; D=BC"}, 4, "generator 'D=BC' cannot be read"),
        (
            {"generators": "D=AA"},
            4,
            r"generator of 'D' must be a product of different basic factors \(A, B, C\), got 'A:A'",
        ),
        ({"generators": "C=AB; D=BC"}, 4, r"generator of 'D' must be .* basic factors \(A, B\), got 'B:C'"),
        ({"generators": "D=A"}, 4, "alias two main effects with one another"),
        ({"generators": "D=ABC", "resolution": 5}, 4, "4 factors in 8 runs reach resolution 4, not 5"),
    ],
)
def test_refuses_what_does_not_fit_the_factors(settings, k, message):
    with pytest.raises(ValueError, match=message):
        FractionalFactorial(**settings).generate(space(k))


@pytest.mark.parametrize("order", [0, 5, 2.5, True])
def test_refuses_other_orders_of_aliases(order):
    with pytest.raises(ValueError, match=f"the order of alias lists must be 1, 2, 3 or 4, got {order}"):
        FractionalFactorial(8).fraction(space(4)).aliases(order)
