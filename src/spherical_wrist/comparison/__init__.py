"""Laws compared: on a suite of cases, and by how far from the nominal wrist each holds a bound."""

from spherical_wrist.comparison.cases import DEFAULT, Case
from spherical_wrist.comparison.compare import compare
from spherical_wrist.comparison.contestants import contestants, registered
from spherical_wrist.comparison.results import Cell, Comparison, Standing

__all__ = ["DEFAULT", "Case", "Cell", "Comparison", "Standing", "compare", "contestants", "registered"]
