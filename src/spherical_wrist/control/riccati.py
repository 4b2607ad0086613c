"""Discrete algebraic Riccati equation, for gains that are designed when a law is prepared."""

import warnings

import numpy as np

from spherical_wrist.control.contract import Array
from spherical_wrist.errors import LawError


def riccati(A: Array, B: Array, Q: Array, R: Array, advice: str) -> tuple[Array, Array]:
    """Return the gain k of u = −k x that minimises Σ x'Q x + u'R u on x⁺ = A x + B u, and the cost S of x, x'S x.

    Args:
        A: (n, n).
        B: (n, m).
        Q: (n, n).
        R: (m, m).
        advice: parameters that the matrices come from, for the error.

    Raises:
        LawError: the equation cannot be solved in double precision.
    """
    from scipy.linalg import solve_discrete_are

    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            S = solve_discrete_are(A, B, Q, R)
            gain = np.linalg.solve(B.T @ S @ B + R, B.T @ S @ A)
    except (ValueError, Warning) as error:  # numpy's LinAlgError is a ValueError
        raise LawError(
            f"its Riccati equation has no solution that can be computed: give a more usual {advice}"
        ) from error
    return gain, S
