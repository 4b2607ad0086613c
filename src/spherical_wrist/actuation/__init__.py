"""What becomes of the torque that the controller asks for: ideal motors, motors with faults, a spherical motor."""

from spherical_wrist.actuation.description import Actuation, Ideal, Realistic, SphericalMotor

__all__ = ["Actuation", "Ideal", "Realistic", "SphericalMotor"]
