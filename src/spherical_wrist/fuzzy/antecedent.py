"""If-part of a rule: statements "x is A", eq. (27), joined by AND, eq. (28), and OR.

The truth value of a statement is the degree of x in A. AND is a t-norm and OR a t-conorm of the degrees a and b:

=====================  ===  =========================================================
``min``                AND  min(a, b), Zadeh's and Mamdani's
``product``            AND  a b, which is smooth, and adds up to one where a and b do
``max``                OR   max(a, b)
``probabilistic_sum``  OR   a + b − a b
=====================  ===  =========================================================

``min`` and ``max``, and ``product`` and ``probabilistic_sum``, belong together: each is the other's De Morgan dual.
"""

from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import reduce
from typing import Literal, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array

Degrees = Mapping[str, Mapping[str, Array]]
"""Degrees of membership, keyed by variable and value."""

Conjunction = Literal["min", "product"]
Disjunction = Literal["max", "probabilistic_sum"]


class Norms(NamedTuple):
    """Operators AND (``both``) and OR (``either``) on two degrees."""

    both: Callable[[Array, Array], Array]
    either: Callable[[Array, Array], Array]


def _probabilistic_sum(a: Array, b: Array) -> Array:
    return a + b - a * b


CONJUNCTIONS: dict[str, Callable[[Array, Array], Array]] = {"min": np.minimum, "product": np.multiply}
DISJUNCTIONS: dict[str, Callable[[Array, Array], Array]] = {"max": np.maximum, "probabilistic_sum": _probabilistic_sum}


class Antecedent(ABC):
    """Statement about linguistic variables; ``&`` and ``|`` join two of them."""

    def __and__(self, other: "Antecedent") -> "And":
        return And((self, other))

    def __or__(self, other: "Antecedent") -> "Or":
        return Or((self, other))

    @abstractmethod
    def strength(self, degrees: Degrees, norms: Norms) -> Array:
        """Compute the truth value of the statement in [0, 1], of the shape of the degrees."""

    @abstractmethod
    def statements(self) -> Iterator["Is"]:
        """Yield every "x is A" in the statement."""


@dataclass(frozen=True)
class Is(Antecedent):
    """Statement "variable is value", eq. (27)."""

    variable: str
    value: str

    def strength(self, degrees: Degrees, norms: Norms) -> Array:
        """See :meth:`Antecedent.strength`."""
        return degrees[self.variable][self.value]

    def statements(self) -> Iterator["Is"]:
        """See :meth:`Antecedent.statements`."""
        yield self

    def __str__(self) -> str:
        return f"{self.variable} is {self.value}"


@dataclass(frozen=True)
class And(Antecedent):
    """Conjunction of the parts, eq. (28)."""

    parts: tuple[Antecedent, ...]

    def strength(self, degrees: Degrees, norms: Norms) -> Array:
        """See :meth:`Antecedent.strength`."""
        return reduce(norms.both, (part.strength(degrees, norms) for part in self.parts))

    def statements(self) -> Iterator[Is]:
        """See :meth:`Antecedent.statements`."""
        for part in self.parts:
            yield from part.statements()

    def __str__(self) -> str:
        return " and ".join(f"({part})" if isinstance(part, Or) else str(part) for part in self.parts)


@dataclass(frozen=True)
class Or(Antecedent):
    """Disjunction of the parts."""

    parts: tuple[Antecedent, ...]

    def strength(self, degrees: Degrees, norms: Norms) -> Array:
        """See :meth:`Antecedent.strength`."""
        return reduce(norms.either, (part.strength(degrees, norms) for part in self.parts))

    def statements(self) -> Iterator[Is]:
        """See :meth:`Antecedent.statements`."""
        for part in self.parts:
            yield from part.statements()

    def __str__(self) -> str:
        return " or ".join(str(part) for part in self.parts)
