"""Quadratic programming within a box, by projected Gauss–Seidel: ½ x'G x + x'F s, with the same bounds for each x.

Every coordinate in turn is put where the objective is smallest with the others as they are, and cut at its bounds:
Hildreth's method (1957), of which Luo and Tseng (1992, J. Optim. Theory Appl. 72:7) show that it converges linearly to
the solution for every positive definite G: after finitely many sweeps the bounds that are met are the right ones, and
what is left is Gauss–Seidel on the free coordinates. It needs no memory but the solution.
"""

from typing import Any

from spherical_wrist.control.contract import Array
from spherical_wrist.so3 import Vector3

SWEEPS, ACCURACY = 400, 1e-10
"""Most sweeps, and the largest change in one that counts as none, as a share of the width of the box."""


def solve_box(G: Array, F: Array, start: Vector3, lower: float, upper: float, x: Any) -> int:
    """Minimise ½ x'G x + x'F s within the bounds.

    Args:
        G: symmetric and positive definite, (n, n).
        F: (n, 3).
        start: s (3,).
        lower: lower bound of each x.
        upper: upper bound, above the lower one.
        x: first guess (n,), and the solution, written.

    Returns:
        The number of sweeps that were needed.
    """
    for sweep in range(SWEEPS):
        settled = True
        for i in range(len(x)):
            slope = F[i, 0] * start[0] + F[i, 1] * start[1] + F[i, 2] * start[2]
            for j in range(len(x)):
                slope += G[i, j] * x[j]
            now = min(upper, max(lower, x[i] - slope / G[i, i]))
            settled = settled and abs(now - x[i]) <= ACCURACY * (upper - lower)
            x[i] = now
        if settled:
            return sweep + 1
    return SWEEPS
