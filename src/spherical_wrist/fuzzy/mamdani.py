"""Mamdani inference, eq. (29)–(33): the then-parts are fuzzy sets, cut off, aggregated and defuzzified.

The output's universe is taken at discrete elements U_i. A rule R of strength μ_R and then-set μ_p contributes the set
min(μ_R, μ_p(U_i)): the set, cut off at the strength of the rule.

* ``max_min``, eq. (30): the aggregated set is the largest contribution, μ_U(U_i) = max_R min(μ_R, μ_p(U_i)).
* ``sum_min``, eq. (31): it is the sum of them, μ_U(U_i) = Σ_R min(μ_R, μ_p(U_i)). It may exceed one, and is then no
  fuzzy set in the sense of eq. (26); only ratios of it are used.
* ``coa``, eq. (33): z = Σ_i U_i μ_U(U_i) / Σ_i μ_U(U_i), the centre of the *aggregated* set.
* ``cog``, eq. (32): z = Σ_i U_i Σ_j μ_j(U_i) / Σ_i Σ_j μ_j(U_i), with j over the rules that fire: the centre of all
  contributions *before* they are aggregated, so that overlapping ones count several times.

As printed, the μ_u of eq. (32) carries no index j. Read literally, as the aggregated set, the inner sums would be the
factor r above and below, and COG would be COA; it is therefore read as the contribution of rule j. It follows that COG
does not depend on the aggregation, and that it equals COA after ``sum_min``: of the four combinations two are distinct,
COA after ``max_min`` and the other three. Both are discrete sums as the equations have them, not integrals.
"""

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.fuzzy.rules import RuleBase
from spherical_wrist.fuzzy.variable import Variable

Aggregation = Literal["max_min", "sum_min"]
Defuzzification = Literal["coa", "cog"]

_CHUNK = 256  # inputs at a time: their aggregated sets then stay in the processor's cache


def max_min(strengths: Array, sets: Array) -> Array:
    """Aggregate by max-min, eq. (30).

    Args:
        strengths: μ_R, (rules, n).
        sets: then-set μ_p of each rule at the elements U_i, (rules, m).

    Returns:
        μ_U, (n, m).
    """
    return _gathered(np.maximum, strengths, sets)


def sum_min(strengths: Array, sets: Array) -> Array:
    """Aggregate by sum-min, eq. (31); see :func:`max_min`."""
    return _gathered(np.add, strengths, sets)


def coa(elements: Array, aggregated: Array) -> Array:
    """Compute the centre of area, eq. (33): not-a-number if the aggregated set is empty.

    Args:
        elements: U_i, (m,).
        aggregated: μ_U, (n, m).
    """
    total = aggregated.sum(axis=1)
    return np.asarray(np.divide(aggregated @ elements, total, out=np.full(total.shape, np.nan), where=total > 0.0))


def cog(elements: Array, strengths: Array, sets: Array) -> Array:
    """Compute the centre of gravity, eq. (32), with the inner sum over the rules; arguments as of :func:`max_min`."""
    summed_over_rules = _gathered(np.add, strengths, sets)
    return coa(elements, summed_over_rules)


AGGREGATIONS = {"max_min": max_min, "sum_min": sum_min}
DEFUZZIFICATIONS = ("coa", "cog")


def _gathered(join: Any, strengths: Array, sets: Array) -> Array:
    gathered = np.zeros((strengths.shape[1], sets.shape[1]))
    clipped = np.empty_like(gathered)
    for strength, then in zip(strengths, sets, strict=True):
        fires = np.flatnonzero(strength)  # rules that do not fire contribute nothing to a maximum or a sum
        if len(fires) == len(strength):  # without the copies that an index makes
            join(gathered, np.minimum(strength[:, None], then, out=clipped), out=gathered)
        else:
            gathered[fires] = join(gathered[fires], np.minimum(strength[fires, None], then))
    return gathered


@dataclass(frozen=True)
class Mamdani:
    """Mamdani inference, eq. (29)–(33); see the module for the equations.

    The output lies within the universe of the output variable, and is not-a-number where no rule fires.

    Attributes:
        rules: a rule base whose then-parts are names of values of ``output``.
        output: the output variable.
        aggregation: ``max_min`` or ``sum_min``.
        defuzzification: ``coa`` or ``cog``.
        points: number of elements U_i, evenly spaced over the universe of the output.

    Raises:
        ParameterError: a then-part is not a name, or its set contains no element U_i.
        UnknownNameError: a then-part, the aggregation or the defuzzification is unknown.
    """

    rules: RuleBase
    output: Variable
    aggregation: Aggregation = "max_min"
    defuzzification: Defuzzification = "coa"
    points: int = 241

    def __post_init__(self) -> None:
        if self.aggregation not in AGGREGATIONS:
            raise UnknownNameError("aggregation", self.aggregation, AGGREGATIONS)
        if self.defuzzification not in DEFUZZIFICATIONS:
            raise UnknownNameError("defuzzification", self.defuzzification, DEFUZZIFICATIONS)
        if self.points < 2:
            raise ParameterError(f"points = {self.points}: at least 2 elements of the universe are needed")
        for rule in self.rules.rules:
            if not isinstance(rule.then, str):
                raise ParameterError(f"rule {rule.label!r}: a Mamdani rule needs the name of a set, not {rule.then}")
            if rule.then not in self.output.sets:
                kind = f"value of {self.output.name}"
                raise UnknownNameError(kind, rule.then, self.output.sets, f" in rule {rule.label!r}")
        for name, degrees in self.output.degrees(self.elements).items():
            if not degrees.any():
                advice = f"widen it or take more than {self.points} points"
                raise ParameterError(f"the set {name} of {self.output.name} lies between two elements U_i: {advice}")

    @property
    def name(self) -> str:
        """Name of the output."""
        return self.output.name

    @property
    def elements(self) -> Array:
        """Elements U_i, (points,)."""
        return self.output.grid(self.points)

    def aggregated(self, *inputs: npt.ArrayLike) -> Array:
        """Compute the aggregated output set μ_U at the elements U_i, eq. (30)–(31): ``(*inputs, points)``."""
        strengths, sets = self.rules.strengths(*inputs), self._then_sets()
        flat = AGGREGATIONS[self.aggregation](strengths.reshape(len(strengths), -1), sets)
        return flat.reshape(*strengths.shape[1:], self.points)

    def __call__(self, *inputs: npt.ArrayLike) -> Array:
        """Compute the crisp output, of the shape of the inputs; not-a-number where no rule fires."""
        strengths = self.rules.strengths(*inputs)
        flat, sets, elements = strengths.reshape(len(strengths), -1), self._then_sets(), self.elements
        parts = [self._defuzzified(flat[:, k : k + _CHUNK], sets, elements) for k in range(0, flat.shape[1], _CHUNK)]
        return np.concatenate([np.empty(0), *parts]).reshape(strengths.shape[1:])

    def _defuzzified(self, strengths: Array, sets: Array, elements: Array) -> Array:
        if self.defuzzification == "cog":
            return cog(elements, strengths, sets)
        return coa(elements, AGGREGATIONS[self.aggregation](strengths, sets))

    def _then_sets(self) -> Array:
        degrees = self.output.degrees(self.elements)
        return np.array([degrees[str(rule.then)] for rule in self.rules.rules])
