"""Inspection of recordings: consistency, pictures, tables, and differences of two of them."""

from spherical_wrist.inspection.consistency import Inspection, inspect
from spherical_wrist.inspection.difference import Difference, difference

__all__ = ["Difference", "Inspection", "difference", "inspect"]
