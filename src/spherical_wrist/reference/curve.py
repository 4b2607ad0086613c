"""Motions given by a curve of quaternions that need not be of unit norm."""

from typing import Any

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.reference.base import motion_of


def motion_of_curve(curve: Array, first: Array, second: Array) -> npt.NDArray[Any]:
    """Return the motion of the attitude p/|p| along a curve p(t) of quaternions (w, x, y, z).

    With the vector part Im and the conjugate p*, the body rate is ω = 2 Im(p* ṗ) / |p|², and its derivative
    ω̇ = (2 Im(p* p̈) − 2 (p·ṗ) ω) / |p|², since ṗ* ṗ has no vector part and d|p|²/dt = 2 p·ṗ. The length of p and its
    changes have no part in the motion.

    Args:
        curve: p, (n, 4); nowhere zero.
        first: ṗ, per second.
        second: p̈, per second squared.
    """
    square = _dot(curve, curve)[:, None]
    rate = 2.0 * _turning(curve, first) / square
    acceleration = (2.0 * _turning(curve, second) - 2.0 * _dot(curve, first)[:, None] * rate) / square
    return motion_of(curve / np.sqrt(square), rate, acceleration)


def _dot(p: Array, q: Array) -> Array:
    """Return products p·q (n,), spelt out so that they do not depend on how many there are."""
    return p[:, 0] * q[:, 0] + p[:, 1] * q[:, 1] + p[:, 2] * q[:, 2] + p[:, 3] * q[:, 3]


def _turning(p: Array, q: Array) -> Array:
    """Return the vector parts of p* q, (n, 3)."""
    w, x, y, z = p.T
    a, b, c, d = q.T
    return np.stack(
        [w * b - x * a - y * d + z * c, w * c - y * a - z * b + x * d, w * d - z * a - x * c + y * b], axis=1
    )
