"""Membership functions: fuzzy sets over the real numbers, eq. (26), in the paper's four shapes."""

from typing import Literal

import numpy as np
import numpy.typing as npt
from pydantic import model_validator

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.parameters import Parameters, Positive

Shape = Literal["triangular", "trapezoidal", "bell", "gaussian"]


class Membership(Parameters):
    """Fuzzy set A = {x, μ_A(x)} with 0 ≤ μ_A ≤ 1, eq. (26). Call it for the degrees of numbers or arrays of them."""

    def __call__(self, x: npt.ArrayLike) -> Array:
        """Compute μ_A(x), of the shape of x."""
        # far away from a narrow set quotients and powers overflow to infinity, whose degree is the right one, 0 or 1
        with np.errstate(over="ignore"):
            return self._degree(np.asarray(x, dtype=np.float64))

    def _degree(self, x: Array) -> Array:
        raise NotImplementedError

    def _check_order(self, *names: str) -> None:
        corners = [getattr(self, name) for name in names]
        if corners != sorted(corners) or corners[0] == corners[-1]:
            given = ", ".join(f"{name} = {corner:g}" for name, corner in zip(names, corners, strict=True))
            order = " ≤ ".join(names)
            raise ParameterError(f"{type(self).__name__}: {given}: {order} is needed, not all of them the same")


class Triangular(Membership):
    """Triangle from 0 at ``left`` over 1 at ``peak`` to 0 at ``right``; a side may be vertical."""

    left: float
    peak: float
    right: float

    @model_validator(mode="after")
    def _ordered(self) -> "Triangular":
        self._check_order("left", "peak", "right")
        return self

    def _degree(self, x: Array) -> Array:
        return np.minimum(_rise(x, self.left, self.peak), _rise(-x, -self.right, -self.peak))


class Trapezoidal(Membership):
    """Trapezoid from 0 at ``left`` over 1 from ``first`` to ``last`` to 0 at ``right``; a side may be vertical."""

    left: float
    first: float
    last: float
    right: float

    @model_validator(mode="after")
    def _ordered(self) -> "Trapezoidal":
        self._check_order("left", "first", "last", "right")
        return self

    def _degree(self, x: Array) -> Array:
        return np.minimum(_rise(x, self.left, self.first), _rise(-x, -self.right, -self.last))


class Bell(Membership):
    """Generalised bell 1 / (1 + |(x − centre) / width|^(2 steepness)): ½ at ``width`` from the centre."""

    centre: float
    width: Positive
    steepness: Positive = 2.0

    def _degree(self, x: Array) -> Array:
        return np.asarray(1.0 / (1.0 + np.abs((x - self.centre) / self.width) ** (2.0 * self.steepness)))


class Gaussian(Membership):
    """Gaussian exp(−½ ((x − centre) / deviation)²)."""

    centre: float
    deviation: Positive

    def _degree(self, x: Array) -> Array:
        return np.asarray(np.exp(-0.5 * ((x - self.centre) / self.deviation) ** 2))


def around(shape: Shape, centre: float, reach: float) -> Membership:
    """Create the symmetric set of a shape whose degree is 1 at ``centre`` and ½ at ``reach / 2`` on either side.

    Sets of the same shape with their centres ``reach`` apart therefore cross at ½. Triangles and trapezoids (whose
    plateau is half a reach wide) then add up to one everywhere between the outermost centres; bells and Gaussians
    nearly do.

    Args:
        shape: name of the membership function.
        centre: number whose degree is 1.
        reach: distance from the centre to the feet of the triangle, > 0.

    Raises:
        ParameterError: there is no such shape.
    """
    if shape == "triangular":
        return Triangular(left=centre - reach, peak=centre, right=centre + reach)
    if shape == "trapezoidal":
        a, b = 0.75 * reach, 0.25 * reach
        return Trapezoidal(left=centre - a, first=centre - b, last=centre + b, right=centre + a)
    if shape == "bell":
        return Bell(centre=centre, width=0.5 * reach)
    if shape == "gaussian":
        return Gaussian(centre=centre, deviation=0.5 * reach / np.sqrt(2.0 * np.log(2.0)))
    raise ParameterError(f"unknown shape {shape!r} (valid: triangular, trapezoidal, bell, gaussian)")


def _rise(x: Array, foot: float, top: float) -> Array:
    """Rise from 0 at ``foot`` to 1 at ``top``; a step at the top if they are the same."""
    if foot == top:
        return (x >= top).astype(np.float64)
    return np.clip((x - foot) / (top - foot), 0.0, 1.0)
