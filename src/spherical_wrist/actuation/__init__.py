"""Motors: ideal ones, motors with faults, and a spherical motor."""

from spherical_wrist.actuation.description import Actuation, Ideal, Realistic, SphericalMotor

__all__ = ["Actuation", "Ideal", "Realistic", "SphericalMotor"]
