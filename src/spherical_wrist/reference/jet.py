"""Functions of time that carry their first two derivatives along."""

from dataclasses import dataclass

import numpy as np

from spherical_wrist.arrays import Array


@dataclass(frozen=True)
class Jet:
    """A function f of time at some instants, with ḟ and f̈ there: sums, products and f(g) by the rules of calculus.

    Attributes:
        value: f, (n,).
        rate: ḟ, per second.
        acceleration: f̈, per second squared.
    """

    value: Array
    rate: Array
    acceleration: Array

    def __add__(self, other: "Jet") -> "Jet":
        """The sum."""
        return Jet(self.value + other.value, self.rate + other.rate, self.acceleration + other.acceleration)

    def __sub__(self, other: "Jet") -> "Jet":
        """The difference."""
        return Jet(self.value - other.value, self.rate - other.rate, self.acceleration - other.acceleration)

    def __mul__(self, other: "Jet") -> "Jet":
        """The product: (f g)¨ = f̈ g + 2 ḟ ġ + f g̈."""
        return Jet(
            self.value * other.value,
            self.rate * other.value + self.value * other.rate,
            self.acceleration * other.value + 2.0 * self.rate * other.rate + self.value * other.acceleration,
        )

    def scaled(self, factor: float, offset: float = 0.0) -> "Jet":
        """Return ``factor`` f + ``offset``."""
        return Jet(factor * self.value + offset, factor * self.rate, factor * self.acceleration)

    def through(self, value: Array, first: Array, second: Array) -> "Jet":
        """Return G(f), from G and its first two derivatives at f: (G(f))¨ = G″ ḟ² + G′ f̈."""
        return Jet(value, first * self.rate, second * self.rate**2 + first * self.acceleration)


def wave(time: Array, frequency: float) -> Jet:
    """Return sin(2π f t) at ``time`` [s], (n,)."""
    omega = 2.0 * np.pi * frequency
    value = np.sin(omega * time)
    return Jet(value, omega * np.cos(omega * time), -(omega**2) * value)
