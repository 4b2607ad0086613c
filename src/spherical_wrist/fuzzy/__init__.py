"""Fuzzy inference: sets, linguistic variables, rule bases, Mamdani and Sugeno inference, eq. (26)–(33) and (47).

Example of a user-defined rule base::

    from spherical_wrist.fuzzy import RuleBase, Sugeno, Variable
    from spherical_wrist.fuzzy.picture import picture

    e, rate = Variable.even("e", ("N", "Z", "P")), Variable.even("ė", ("N", "Z", "P"))
    rules = RuleBase.table(e, rate, [[1, 2, 1], [3, 4, 3], [1, 2, 1]])
    alpha = Sugeno(rules)
    alpha(0.2, -0.4)
    picture(alpha, "rules.svg")

Rule base of the paper's law: ``FuzzySlidingComputedTorque().tuner.system()``.
"""

from spherical_wrist.fuzzy.analysis import Report, report
from spherical_wrist.fuzzy.antecedent import And, Antecedent, Is, Or
from spherical_wrist.fuzzy.interpolation import fuzzify, sugeno
from spherical_wrist.fuzzy.mamdani import Mamdani
from spherical_wrist.fuzzy.membership import Bell, Gaussian, Membership, Trapezoidal, Triangular, around
from spherical_wrist.fuzzy.rules import Inference, Linear, Rule, RuleBase
from spherical_wrist.fuzzy.table import table_error, tabulate
from spherical_wrist.fuzzy.takagi_sugeno import Sugeno
from spherical_wrist.fuzzy.tuner import Tuner
from spherical_wrist.fuzzy.variable import ERROR_VALUES, RATE_VALUES, Variable

__all__ = [
    "ERROR_VALUES",
    "RATE_VALUES",
    "And",
    "Antecedent",
    "Bell",
    "Gaussian",
    "Inference",
    "Is",
    "Linear",
    "Mamdani",
    "Membership",
    "Or",
    "Report",
    "Rule",
    "RuleBase",
    "Sugeno",
    "Trapezoidal",
    "Triangular",
    "Tuner",
    "Variable",
    "around",
    "fuzzify",
    "report",
    "sugeno",
    "table_error",
    "tabulate",
]
