"""Sensors of attitude and rate: ideal ones, and their faults."""

from spherical_wrist.sensing.description import Ideal, Realistic, Sensing

__all__ = ["Ideal", "Realistic", "Sensing"]
