"""Slope tuner α(e, ė) of the paper, eq. (46)–(47), with any of the inferences: 7 × 3 rules over scaled inputs."""

from functools import lru_cache
from typing import Literal, NamedTuple

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError
from spherical_wrist.fuzzy.antecedent import Conjunction
from spherical_wrist.fuzzy.mamdani import Aggregation, Defuzzification, Mamdani
from spherical_wrist.fuzzy.membership import Shape, around
from spherical_wrist.fuzzy.rules import Linear, RuleBase
from spherical_wrist.fuzzy.table import table_error, tabulate
from spherical_wrist.fuzzy.takagi_sugeno import Sugeno
from spherical_wrist.fuzzy.variable import ERROR_VALUES, RATE_VALUES, Variable

InferenceName = Literal["sugeno", "sugeno_first_order", "mamdani"]
Weights = tuple[tuple[float, float, float], ...]

FINENESS = 20  # elements U_i from the centre to the foot of an output set
MOST_ELEMENTS = 2000


class Tuner(NamedTuple):
    """Parameters from which α(e, ė) is inferred. Inputs are divided by their scales: their universes are [−1, 1].

    Attributes:
        rules: θ > 0, 7 × 3, by the values of error and rate. Of ``mamdani``, the centres of the output sets.
        inference: ``sugeno``: z = θ. ``sugeno_first_order``: z = θ + p (x − x_l) + q (y − y_l) of the scaled inputs
            x, y; (x_l, y_l) is the peak of the rule, where its output is θ. ``mamdani``: z is the set around θ.
        membership: shape of the sets of inputs and output; neighbouring input sets cross at ½.
        conjunction: AND.
        aggregation: of ``mamdani``, eq. (30)–(31).
        defuzzification: of ``mamdani``, eq. (32)–(33).
        output_width: of ``mamdani``, distance from the centre of an output set to the feet of its triangle.
        error_tilts: of ``sugeno_first_order``, p, 7 × 3.
        rate_tilts: of ``sugeno_first_order``, q, 7 × 3.
    """

    rules: Weights
    inference: InferenceName
    membership: Shape
    conjunction: Conjunction
    aggregation: Aggregation
    defuzzification: Defuzzification
    output_width: float
    error_tilts: Weights
    rate_tilts: Weights

    @property
    def exact(self) -> bool:
        """True if bilinear interpolation between the rule weights is the inference itself."""
        return (self.inference, self.membership, self.conjunction) == ("sugeno", "triangular", "product")

    def system(self) -> Sugeno | Mamdani:
        """Return the inference, to be evaluated directly: ``tuner.system()(e, rate)``.

        Raises:
            ParameterError: the output sets of ``mamdani`` reach zero or are too narrow for its universe.
        """
        return _system(self)

    def table(self) -> Array:
        """Return α on a grid over [−1, 1]²; the rule weights if these are exact. Read-only.

        Raises:
            ParameterError: α is not positive everywhere.
        """
        return _table(self)

    def table_error(self) -> float:
        """Return the largest difference between the interpolated table and the inference; see :func:`table_error`."""
        return _error(self)


@lru_cache(maxsize=64)
def _system(tuner: Tuner) -> Sugeno | Mamdani:
    e = Variable.even("e", ERROR_VALUES, tuner.membership, unit="error_scale")
    rate = Variable.even("ė", RATE_VALUES, tuner.membership, unit="rate_scale")
    if tuner.inference == "mamdani":
        output, points = _output(tuner)
        names = [[_name(weight) for weight in row] for row in tuner.rules]
        rules = RuleBase.table(e, rate, names, tuner.conjunction)
        return Mamdani(rules, output, tuner.aggregation, tuner.defuzzification, points)
    if tuner.inference == "sugeno":
        return Sugeno(RuleBase.table(e, rate, tuner.rules, tuner.conjunction))
    x, y = np.linspace(-1.0, 1.0, len(ERROR_VALUES)), np.linspace(-1.0, 1.0, len(RATE_VALUES))
    theta, p, q = (np.array(table) for table in (tuner.rules, tuner.error_tilts, tuner.rate_tilts))
    offsets = theta - p * x[:, None] - q * y
    then = [[Linear(offsets[i, j], (p[i, j], q[i, j])) for j in range(len(y))] for i in range(len(x))]
    return Sugeno(RuleBase.table(e, rate, then, tuner.conjunction))


def _output(tuner: Tuner) -> tuple[Variable, int]:
    """Create the output variable: a set around every different rule weight, over a universe that ends at their feet."""
    peaks, width = sorted({weight for row in tuner.rules for weight in row}), tuner.output_width
    if width >= peaks[0]:
        raise ParameterError(
            f"output_width = {width:g}: the output sets must stay positive: "
            f"less than the smallest rule weight, {peaks[0]:g}, is needed"
        )
    low, high = peaks[0] - width, peaks[-1] + width
    points = round((high - low) / width * FINENESS) + 1
    if points > MOST_ELEMENTS:
        raise ParameterError(
            f"output_width = {width:g} is too narrow for rule weights from {peaks[0]:g} to {peaks[-1]:g}: "
            f"at least {FINENESS * (peaks[-1] - peaks[0]) / (MOST_ELEMENTS - 2 * FINENESS - 1):.2g} is needed"
        )
    return Variable("α", low, high, {_name(p): around(tuner.membership, p, width) for p in peaks}), points


def _name(weight: float) -> str:
    return repr(weight).removesuffix(".0")


@lru_cache(maxsize=64)
def _table(tuner: Tuner) -> Array:
    table = np.array(tuner.rules) if tuner.exact else tabulate(tuner.system())
    if not (table > 0.0).all():
        i, j = np.unravel_index(np.argmin(table), table.shape)
        where = (2.0 * np.array([i, j]) / (np.array(table.shape) - 1.0) - 1.0).round(3)
        raise ParameterError(
            f"α = {table.min():.3g} at e = {where[0]:g} of its scale, ė = {where[1]:g}: a negative slope makes the "
            "surface unstable: α > 0 is needed: raise the rule weights or lower the tilts"
        )
    table.flags.writeable = False
    return table


@lru_cache(maxsize=64)
def _error(tuner: Tuner) -> float:
    return 0.0 if tuner.exact else table_error(tuner.system(), tuner.table())
