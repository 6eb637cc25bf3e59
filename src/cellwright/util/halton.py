"""Halton points: they fill a box evenly, and are the same for each call."""

import numpy as np
from numpy.typing import NDArray

_PRIMES = (2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37, 41, 43, 47, 53, 59, 61, 67, 71)


def halton(count: int, dimensions: int) -> NDArray[np.float64]:
    """Return `count` points of the unit cube, shape (count, dimensions), without the corner at 0.

    A coordinate of point k has the digits of k in the base of a prime, mirrored at the point. (J. H. Halton, 1960.)

    Args:
        count: number of points.
        dimensions: 20 at most; with more of them the last ones would fill the cube too slowly.

    Example:
        >>> halton(3, 2).round(3).tolist()
        [[0.5, 0.333], [0.25, 0.667], [0.75, 0.111]]
    """
    points = np.zeros((count, dimensions))
    for column, base in zip(points.T, _PRIMES[:dimensions], strict=True):
        numbers, place = np.arange(1, count + 1), 1.0 / base
        while numbers.any():
            column += numbers % base * place
            numbers //= base
            place /= base
    return points
