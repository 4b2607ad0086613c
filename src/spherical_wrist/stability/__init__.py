"""Stability margins of laws, from the linear response of the compiled loop."""

from spherical_wrist.stability.law_margins import LawMargins, margins

__all__ = ["LawMargins", "margins"]
