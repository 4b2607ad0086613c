"""Sugeno inference of order zero and one: the then-parts are numbers or linear functions, eq. (29) and (47)."""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.fuzzy.rules import Linear, RuleBase


@dataclass(frozen=True)
class Sugeno:
    """Sugeno inference z = Σ θ_l ζ_l(x), ζ_l = w_l / Σ w, eq. (47): mean of then-parts, weighted by firing strength.

    A then-part is a number θ_l (order zero) or a linear function of the inputs (order one), for which the paper's
    eq. (29) writes "then f(x, y)". The inputs of the function, too, are taken within their universes, so that z is
    bounded. z lies between the smallest and the largest then-part of the rules that fire, and is not-a-number where
    none does.

    Attributes:
        rules: a rule base whose then-parts are numbers or :class:`.Linear`.
        name: name of the output.

    Raises:
        ParameterError: a then-part is neither, is not finite, or has not one slope per variable.
    """

    rules: RuleBase
    name: str = "α"

    def __post_init__(self) -> None:
        for rule in self.rules.rules:
            if isinstance(rule.then, str):
                raise ParameterError(f"rule {rule.label!r}: a Sugeno rule needs a number or Linear, not {rule.then!r}")
            offset, slopes = rule.then if isinstance(rule.then, Linear) else (rule.then, ())
            if isinstance(rule.then, Linear) and len(slopes) != len(self.rules.variables):
                needed = len(self.rules.variables)
                raise ParameterError(
                    f"rule {rule.label!r}: {len(slopes)} slopes given, {needed} needed (one per input)"
                )
            if not np.isfinite([offset, *slopes]).all():
                raise ParameterError(f"rule {rule.label!r}: then-part {rule.then}: finite numbers are needed")

    @property
    def order(self) -> int:
        """Order: 1 if any then-part is a linear function, else 0."""
        return int(any(isinstance(rule.then, Linear) for rule in self.rules.rules))

    def consequents(self, *inputs: npt.ArrayLike) -> Array:
        """Evaluate the then-part of every rule: the rules are the first axis."""
        inside = self.rules.inside(inputs)
        values = []
        for rule in self.rules.rules:
            value = np.zeros(inside[0].shape)
            if isinstance(rule.then, Linear):
                for slope, x in zip(rule.then.slopes, inside, strict=True):
                    value = value + slope * x
                value = value + rule.then.offset
            else:
                value += float(rule.then)
            values.append(value)
        return np.array(values)

    def __call__(self, *inputs: npt.ArrayLike) -> Array:
        """Compute the crisp output z, of the shape of the inputs; not-a-number where no rule fires."""
        strengths = self.rules.strengths(*inputs)
        total = strengths.sum(axis=0)
        above = (strengths * self.consequents(*inputs)).sum(axis=0)
        return np.asarray(np.divide(above, total, out=np.full(total.shape, np.nan), where=total > 0.0))
