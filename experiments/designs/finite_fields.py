"""Squares of finite fields, and the conference matrices that they give."""

from functools import lru_cache
from itertools import product

import numpy as np
from numpy.typing import NDArray


def prime_power(q: int) -> tuple[int, int] | None:
    """The prime p and the exponent k of q = p^k; ``None`` if `q` is no power of a prime."""
    p = next((d for d in range(2, int(q**0.5) + 1) if q % d == 0), q)
    k, rest = 0, q
    while p > 1 and rest % p == 0:
        rest, k = rest // p, k + 1
    return (p, k) if rest == 1 and k else None


def quadratic_characters(q: int) -> NDArray[np.int64]:
    """Jacobsthal matrix of the field of `q` elements, shape (q, q): +1 where a − b is a square, −1 where not, or 0.

    Raises
    ------
    ValueError
        If `q` is no power of an odd prime.

    Notes
    -----
    Paley (1933), "On orthogonal matrices", J. Math. Phys. 12, 311–320, Lemma 2. Element number a is
    the polynomial whose coefficients are the digits of a in base p. Nonzero squares are the even
    powers of a generator, which is found by trying x modulo one polynomial of degree k after the other.
    """
    found = prime_power(q)
    if found is None or q % 2 == 0:
        raise ValueError(f"squares are told apart in fields of odd prime-power order only, got {q}; use 3, 5, 7, 9, …")
    p, k = found
    digits = np.array(list(product(range(p), repeat=k)))[:, ::-1]
    weights = p ** np.arange(k)
    character = np.full(q, -1)
    character[_powers_of_generator(p, k)[::2] @ weights] = 1
    character[0] = 0
    return character[((digits[:, None] - digits[None, :]) % p) @ weights]


def _powers_of_generator(p: int, k: int) -> NDArray[np.int64]:
    """All nonzero elements of the field as the powers 0, 1, 2, … of one, shape (p^k − 1, k), constant term first."""
    for polynomial in product(range(p), repeat=k):
        element = tuple(int(i == 0) for i in range(k))
        powers = {element: 0}
        while True:
            shifted = (0, *element[:-1])
            element = tuple((s - element[-1] * c) % p for s, c in zip(shifted, polynomial, strict=True))
            if element in powers or not any(element):
                break
            powers[element] = len(powers)
        if len(powers) == p**k - 1:
            return np.array(list(powers))
    raise AssertionError("every finite field has a generator")


@lru_cache(maxsize=64)
def conference_matrix(n: int) -> NDArray[np.int64] | None:
    """A conference matrix C, shape (n, n): zero diagonal, ±1 elsewhere, CᵀC = (n − 1)I; ``None`` if none is known here.

    Notes
    -----
    Orders q + 1 of odd prime powers q: Paley (1933), symmetric for q ≡ 1 and skew for q ≡ 3 (mod 4).
    Twice a skew order: Williamson (1944), "Hadamard's determinant theorem and the sum of four
    squares", Duke Math. J. 11, 65–81; there C + I is a Hadamard matrix. For odd n > 1 there is none, and for
    n ≡ 2 (mod 4) only if n − 1 is a sum of two squares (so none for 22, 34, 58, …).
    """
    if n < 2 or n % 2:
        return None
    matrix: NDArray[np.int64] | None = None
    if n == 2 or prime_power(n - 1):
        core = quadratic_characters(n - 1) if n > 2 else np.zeros((1, 1), dtype=np.int64)
        sign = 1 if n % 4 == 2 and n > 2 else -1
        border = np.ones((1, n - 1), dtype=np.int64)
        matrix = np.block([[np.zeros((1, 1), dtype=np.int64), border], [sign * border.T, core]])
    elif n % 4 == 0:
        half = conference_matrix(n // 2)
        if half is not None and np.array_equal(half, -half.T):
            eye = np.eye(n // 2, dtype=np.int64)
            matrix = np.block([[half, half + eye], [half - eye, -half]])
    if matrix is not None:
        matrix.setflags(write=False)
    return matrix
