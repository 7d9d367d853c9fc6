"""Functions that operate on polynomials, used to analyse the stability of steady sliding.

The coefficients of all polynomials are in ascending order of the powers.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import zip_longest
from operator import mul

import numpy as np

from rsfstudy.slider.evolution_derivatives import NestedListMatrix

#: Number of Newton iterations for the roots of a polynomial in which one root is much larger than
#: the other roots.
_ROOT_NEWTON_ITERATION_COUNT = 2

PolynomialCoefficients = list[float]


def compute_dot_product(first: Sequence[float], second: Sequence[float]) -> float:
    """Compute the scalar product of two sequences."""
    return sum(map(mul, first, second))


def compute_resolvent_polynomials(
    matrix: NestedListMatrix,
) -> tuple[PolynomialCoefficients, list[NestedListMatrix]]:
    """Compute the resolvent of a matrix by the Faddeev-LeVerrier algorithm.

    The resolvent :math:`(p - M)^{-1}` is the adjugate matrix of :math:`p - M`, divided by the
    characteristic polynomial of :math:`M`.

    Parameters
    ----------
    matrix : list of list of float
        Square matrix :math:`M`.

    Returns
    -------
    coefficients : list of float
        Coefficients of the characteristic polynomial, in ascending order.
    adjugate : list of list of list of float
        Coefficients of the adjugate matrix, which is a polynomial in :math:`p`, in ascending order.
        Each coefficient is a matrix.
    """
    places = range(len(matrix))
    coefficients, terms = [1.0], [[[float(i == j) for j in places] for i in places]]
    for order in range(1, len(matrix) + 1):
        columns = list(zip(*terms[0], strict=True))
        term = [[compute_dot_product(row, column) for column in columns] for row in matrix]
        coefficients.insert(0, -sum(term[i][i] for i in places) / order)
        for i in places:
            term[i][i] += coefficients[0]
        terms.insert(0, term)
    return coefficients, terms[1:]


def find_roots_with_one_very_large_root(polynomial: PolynomialCoefficients) -> np.ndarray:
    """Find the roots of a polynomial that has one very large root.

    If the mass of the slider is small, one root is about 1e20 times larger than the other roots. If
    all roots were computed together, the small roots would lose accuracy. The function therefore
    computes the small roots from the polynomial without the leading term. Finally, the function
    refines all roots by Newton iterations.
    """
    falling = polynomial[::-1]
    roots = np.append(np.roots(falling[1:]), -falling[1] / falling[0]).astype(complex)
    for _ in range(_ROOT_NEWTON_ITERATION_COUNT):
        off, slope = np.polyval(falling, roots), np.polyval(np.polyder(falling), roots)
        roots -= np.divide(off, slope, out=np.zeros_like(roots), where=slope != 0.0)
    return roots


def split_even_and_odd_powers(
    polynomial: PolynomialCoefficients,
) -> tuple[PolynomialCoefficients, PolynomialCoefficients]:
    """Return the real and imaginary parts of a polynomial at p = i omega.

    The function returns two polynomials in omega**2: the real part, and the imaginary part divided
    by omega.
    """
    even = [x * (-1.0) ** n for n, x in enumerate(polynomial[0::2])]
    odd = [x * (-1.0) ** n for n, x in enumerate(polynomial[1::2])]
    return even, odd


def multiply_polynomials(
    first: PolynomialCoefficients, second: PolynomialCoefficients
) -> PolynomialCoefficients:
    """Multiply two polynomials."""
    product = [0.0] * (len(first) + len(second) - 1)
    for i, x in enumerate(first):
        for j, y in enumerate(second):
            product[i + j] += x * y
    return product


def add_polynomials(
    first: PolynomialCoefficients, second: PolynomialCoefficients
) -> PolynomialCoefficients:
    """Add two polynomials."""
    return [x + y for x, y in zip_longest(first, second, fillvalue=0.0)]


def evaluate_polynomial(polynomial: PolynomialCoefficients, argument: float) -> float:
    """Evaluate a polynomial at a real argument."""
    return math.fsum([x * argument**n for n, x in enumerate(polynomial)])


def find_positive_real_roots(polynomial: PolynomialCoefficients) -> list[float]:
    """Find the positive real roots of a polynomial."""
    while polynomial and polynomial[-1] == 0.0:
        polynomial = polynomial[:-1]
    if len(polynomial) == 2:
        roots = [-polynomial[0] / polynomial[1]]
    else:
        every = np.roots(polynomial[::-1])
        roots = every.real[np.abs(every.imag) <= 1e-12 * np.abs(every)].tolist()
    return [root for root in roots if root > 0.0]
