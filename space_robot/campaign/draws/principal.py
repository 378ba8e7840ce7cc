"""Principal axes of 3x3 tensors in plain IEEE arithmetic: the same bits on every machine.

LAPACK and BLAS choose their code, and so their last digits, by the processor.
"""

from __future__ import annotations

import math

Rows = list[list[float]]
"""A 3x3 matrix."""
_SWEEPS = 12
_PAIRS = ((0, 1), (0, 2), (1, 2))


def product(a: Rows, b: Rows) -> Rows:
    """Return ``a b``."""
    return [
        [a[i][0] * b[0][j] + a[i][1] * b[1][j] + a[i][2] * b[2][j] for j in range(3)]
        for i in range(3)
    ]


def transposed(a: Rows) -> Rows:
    """Return the transpose."""
    return [list(row) for row in zip(*a, strict=True)]


def principal(tensor: Rows) -> tuple[list[float], Rows]:
    """Return moments in ascending order, and axes as columns, of a symmetric tensor.

    Jacobi's method: each rotation makes one element beside the diagonal zero.
    """
    a = [list(row) for row in tensor]
    axes: Rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
    for _ in range(_SWEEPS):
        for p, q in _PAIRS:
            if a[p][q] == 0.0:
                continue
            ratio = (a[q][q] - a[p][p]) / (2.0 * a[p][q])
            root = math.sqrt(ratio * ratio + 1.0) if abs(ratio) < 1e150 else abs(ratio)
            t = math.copysign(1.0 / (abs(ratio) + root), ratio)
            c = 1.0 / math.sqrt(t * t + 1.0)
            turn: Rows = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
            turn[p][p] = turn[q][q] = c
            turn[p][q], turn[q][p] = t * c, -t * c
            a = product(product(transposed(turn), a), turn)
            a[p][q] = a[q][p] = 0.0
            axes = product(axes, turn)
    order = sorted(range(3), key=lambda i: a[i][i])
    return [a[i][i] for i in order], [[row[i] for i in order] for row in axes]


def rotation(turn: list[float]) -> Rows:
    """Return a rotation about a vector, by 2 atan of half its length, rad: Cayley's form."""
    x, y, z = (0.5 * component for component in turn)
    cross: Rows = [[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]
    square, scale = product(cross, cross), 2.0 / (1.0 + (x * x + y * y + z * z))
    return [
        [float(i == j) + scale * (cross[i][j] + square[i][j]) for j in range(3)] for i in range(3)
    ]


def spread(inertia: Rows, factors: list[float], turn: list[float]) -> Rows:
    """Return the inertia of a body whose mass is spread otherwise, and turned.

    The second moments of the mass, ``tr(I)/2 E - I``, are positive for every body there is. Each
    along its principal axes is multiplied by a positive factor, so the inertia that they make is
    again one that a body can have, whatever the factors.

    Args:
        inertia: kg m2, about the centre of mass.
        factors: above 0, of the second moments in ascending order.
        turn: rad, see `rotation`.
    """
    half = 0.5 * (inertia[0][0] + inertia[1][1] + inertia[2][2])
    second = [[half * (i == j) - inertia[i][j] for j in range(3)] for i in range(3)]
    moments, axes = principal(second)
    # of a plate or a rod some are 0, and may be less by rounding
    scaled = [max(moment, 0.0) * factor for moment, factor in zip(moments, factors, strict=True)]
    axes = product(rotation(turn), axes)
    weighted = [[axes[i][k] * scaled[k] for k in range(3)] for i in range(3)]
    covariance = product(weighted, transposed(axes))
    trace = covariance[0][0] + covariance[1][1] + covariance[2][2]
    return [
        [trace * (i == j) - 0.5 * (covariance[i][j] + covariance[j][i]) for j in range(3)]
        for i in range(3)
    ]
