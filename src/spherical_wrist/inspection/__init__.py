"""What recordings hold: whether they are consistent, as pictures and tables, and how two of them differ."""

from spherical_wrist.inspection.consistency import Inspection, inspect
from spherical_wrist.inspection.difference import Difference, difference

__all__ = ["Difference", "Inspection", "difference", "inspect"]
