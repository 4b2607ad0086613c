"""Rules, eq. (27)–(29), and rule bases with their firing strengths."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
import numpy.typing as npt

from spherical_wrist.arrays import Array
from spherical_wrist.errors import ParameterError, UnknownNameError
from spherical_wrist.fuzzy.antecedent import (
    CONJUNCTIONS,
    DISJUNCTIONS,
    And,
    Antecedent,
    Conjunction,
    Disjunction,
    Norms,
)
from spherical_wrist.fuzzy.variable import Variable


class Linear(NamedTuple):
    """Then-part of a Sugeno rule of first order: z = offset + Σ slopes · inputs.

    Attributes:
        offset: z for inputs of zero.
        slopes: one per variable of the rule base, in its order.
    """

    offset: float
    slopes: tuple[float, ...]

    def __str__(self) -> str:
        return " ".join([f"{self.offset:g}", *(f"{slope:+g}·x{i + 1}" for i, slope in enumerate(self.slopes))])


Consequent = str | float | Linear
"""Then-part, eq. (29): the name of an output set (Mamdani), a number (Sugeno), or a linear function (first order)."""


@dataclass(frozen=True)
class Rule:
    """Rule "if antecedent then consequent", eq. (27)–(29).

    Attributes:
        antecedent: the if-part.
        then: the then-part.
        label: a short name, such as "NB N" for the rule of these values; by default the if-part in words.
    """

    antecedent: Antecedent
    then: Consequent
    label: str = ""

    def __post_init__(self) -> None:
        object.__setattr__(self, "label", self.label or str(self.antecedent))

    def __str__(self) -> str:
        then = f"{self.then:g}" if isinstance(self.then, float | int) else str(self.then)
        return f"if {self.antecedent} then {then}"


@dataclass(frozen=True)
class RuleBase:
    """Rules over linguistic variables.

    Attributes:
        variables: the inputs, in the order in which they are given.
        rules: at least one.
        conjunction: operator AND; see :mod:`spherical_wrist.fuzzy.antecedent`.
        disjunction: operator OR.

    Raises:
        ParameterError: there is no rule, or two variables or rules have the same name or label.
        UnknownNameError: a rule names an unknown variable or value, or AND or OR is unknown.
    """

    variables: tuple[Variable, ...]
    rules: tuple[Rule, ...]
    conjunction: Conjunction = "min"
    disjunction: Disjunction = "max"

    def __post_init__(self) -> None:
        values = {variable.name: variable.sets for variable in self.variables}
        if not self.rules:
            raise ParameterError("a rule base without rules infers nothing: give at least one rule")
        if len(values) < len(self.variables):
            raise ParameterError(f"variables {[v.name for v in self.variables]}: their names must differ")
        labels = [rule.label for rule in self.rules]
        if len(set(labels)) < len(labels):
            twice = next(label for label in labels if labels.count(label) > 1)
            raise ParameterError(f"two rules are labelled {twice!r}: give each a label of its own")
        for rule in self.rules:
            for statement in rule.antecedent.statements():
                if statement.variable not in values:
                    raise UnknownNameError("variable", statement.variable, values, f" in rule {rule.label!r}")
                if statement.value not in values[statement.variable]:
                    kind, valid = f"value of {statement.variable}", values[statement.variable]
                    raise UnknownNameError(kind, statement.value, valid, f" in rule {rule.label!r}")
        if self.conjunction not in CONJUNCTIONS:
            raise UnknownNameError("conjunction", self.conjunction, CONJUNCTIONS)
        if self.disjunction not in DISJUNCTIONS:
            raise UnknownNameError("disjunction", self.disjunction, DISJUNCTIONS)

    @classmethod
    def table(
        cls,
        rows: Variable,
        columns: Variable,
        then: Sequence[Sequence[Consequent]],
        conjunction: Conjunction = "min",
    ) -> "RuleBase":
        """Create a rule "row value AND column value", eq. (28), for every cell of a table: 21 rules in the paper.

        Args:
            rows: first input.
            columns: second input.
            then: the then-parts, by the values of rows and columns in their order. Labels are "row column".
            conjunction: operator AND.

        Raises:
            ParameterError: the table has not one cell for every pair of values.
        """
        if [len(row) for row in then] != [len(columns.sets)] * len(rows.sets):
            shape = f"{len(rows.sets)} × {len(columns.sets)}"
            raise ParameterError(f"a rule table over {rows.name} and {columns.name} needs {shape} then-parts")
        rules = [
            Rule(And((rows.is_(row), columns.is_(column))), then[i][j], f"{row} {column}")
            for i, row in enumerate(rows.sets)
            for j, column in enumerate(columns.sets)
        ]
        return cls((rows, columns), tuple(rules), conjunction)

    def inside(self, inputs: Sequence[npt.ArrayLike]) -> tuple[Array, ...]:
        """Limit the inputs to their universes, and broadcast them to one shape.

        Raises:
            ParameterError: there is not one input per variable.
        """
        if len(inputs) != len(self.variables):
            names = ", ".join(variable.name for variable in self.variables)
            raise ParameterError(f"{len(inputs)} inputs given, {len(self.variables)} needed: {names}")
        return np.broadcast_arrays(*(v.within(x) for v, x in zip(self.variables, inputs, strict=True)))

    def strengths(self, *inputs: npt.ArrayLike) -> Array:
        """Compute the firing strength μ_R of every rule in [0, 1]: fuzzification, then the operators of the if-part.

        Args:
            inputs: one per variable, numbers or arrays that broadcast together.

        Returns:
            Array of the shape of the inputs, with the rules as an axis before it.
        """
        inside = self.inside(inputs)
        degrees = {v.name: v.degrees(x) for v, x in zip(self.variables, inside, strict=True)}
        norms = Norms(CONJUNCTIONS[self.conjunction], DISJUNCTIONS[self.disjunction])
        return np.array([rule.antecedent.strength(degrees, norms) for rule in self.rules])


class Inference(Protocol):
    """Inference of a number from the inputs of a rule base: ``Sugeno`` or ``Mamdani``."""

    @property
    def rules(self) -> RuleBase:
        """Rule base of the inference."""

    @property
    def name(self) -> str:
        """Name of the output."""

    def __call__(self, *inputs: npt.ArrayLike) -> Array:
        """Compute the crisp output, of the shape of the inputs; not-a-number where no rule fires."""
