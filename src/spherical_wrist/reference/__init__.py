"""Desired motions of the wrist with exact attitude, rate and acceleration."""

from spherical_wrist.reference.angles import Lissajous, Sinusoid
from spherical_wrist.reference.base import Reference
from spherical_wrist.reference.slew import Hold, Step

__all__ = ["Hold", "Lissajous", "Reference", "Sinusoid", "Step"]
