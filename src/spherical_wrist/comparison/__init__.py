"""Comparison of laws: on a suite of cases, and by the deviation from the nominal wrist at which each misses a bound."""

from spherical_wrist.comparison.cases import DEFAULT, Case
from spherical_wrist.comparison.compare import compare
from spherical_wrist.comparison.law_selection import laws_from_texts, registered
from spherical_wrist.comparison.results import Cell, Comparison, Standing

__all__ = ["DEFAULT", "Case", "Cell", "Comparison", "Standing", "compare", "laws_from_texts", "registered"]
