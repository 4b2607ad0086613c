"""Gains from a stated criterion: constraints that every law shall meet, one objective, and a search with a seed."""

from spherical_wrist.design.criterion import CONSTRAINTS, FIGURES, Assessment, constraints_of, judge
from spherical_wrist.design.record import TRIALS, Design, shipped
from spherical_wrist.design.search import designed, find_gains

__all__ = [
    "CONSTRAINTS",
    "FIGURES",
    "TRIALS",
    "Assessment",
    "Design",
    "constraints_of",
    "designed",
    "find_gains",
    "judge",
    "shipped",
]
