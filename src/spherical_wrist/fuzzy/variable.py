"""Linguistic variables: a quantity whose values are words, each of which is a fuzzy set over its universe."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from types import MappingProxyType

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.fuzzy.antecedent import Is
from spherical_wrist.fuzzy.membership import Membership, Shape, around

ERROR_VALUES = ("NB", "NM", "NS", "Z", "PS", "PM", "PB")
"""Linguistic values of the error in the paper: negative big, medium, small, zero, positive small, medium, big."""

RATE_VALUES = ("N", "Z", "P")
"""Linguistic values of the rate error in the paper: negative, zero, positive."""


@dataclass(frozen=True)
class Variable:
    """Linguistic variable: named fuzzy sets, eq. (26), over the universe of discourse [low, high].

    Numbers outside the universe count as its nearest end.

    Attributes:
        name: name in rules.
        low: lower end of the universe.
        high: upper end.
        sets: its linguistic values, keyed by name.
        unit: unit of the numbers, for pictures.

    Raises:
        ParameterError: the universe is empty or not finite, or there is no set.
    """

    name: str
    low: float
    high: float
    sets: Mapping[str, Membership]
    unit: str = ""

    def __post_init__(self) -> None:
        if not (np.isfinite(self.low) and np.isfinite(self.high) and self.low < self.high):
            raise ParameterError(f"variable {self.name!r}: universe [{self.low}, {self.high}]: low < high is needed")
        if not self.sets:
            raise ParameterError(f"variable {self.name!r} has no set: give it at least one linguistic value")
        for value, membership in self.sets.items():
            if not isinstance(membership, Membership):
                raise ParameterError(f"variable {self.name!r}: {value} = {membership!r} is no membership function")
        object.__setattr__(self, "sets", MappingProxyType(dict(self.sets)))

    @classmethod
    def even(
        cls,
        name: str,
        values: Sequence[str],
        shape: Shape = "triangular",
        low: float = -1.0,
        high: float = 1.0,
        unit: str = "",
    ) -> "Variable":
        """Create sets of one shape, centred evenly from ``low`` to ``high``, neighbours crossing at ½.

        Raises:
            ParameterError: there are fewer than two values, or two of the same name.
        """
        if len(values) < 2 or len(set(values)) < len(values):
            raise ParameterError(f"variable {name!r}: values {list(values)}: two or more different names are needed")
        centres = np.linspace(low, high, len(values))
        reach = (high - low) / (len(values) - 1)
        sets = {v: around(shape, float(c), reach) for v, c in zip(values, centres, strict=True)}
        return cls(name, low, high, sets, unit)

    def within(self, x: npt.ArrayLike) -> Array:
        """Limit numbers to the universe."""
        return np.clip(np.asarray(x, dtype=np.float64), self.low, self.high)

    def degrees(self, x: npt.ArrayLike) -> dict[str, Array]:
        """Fuzzify numbers: compute their degree in every set, keyed by name, each of the shape of x."""
        inside = self.within(x)
        return {value: membership(inside) for value, membership in self.sets.items()}

    def grid(self, points: int) -> Array:
        """Return elements U_i of the universe, evenly spaced from end to end."""
        return np.linspace(self.low, self.high, points)

    def is_(self, value: str) -> Is:
        """Return the statement "x is A" of eq. (27).

        Raises:
            UnknownNameError: the variable has no such value.
        """
        if value not in self.sets:
            raise UnknownNameError(f"value of {self.name}", value, self.sets)
        return Is(self.name, value)
