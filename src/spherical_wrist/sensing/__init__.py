"""What the controller sees of the wrist: ideal sensors, and sensors with their faults."""

from spherical_wrist.sensing.description import Ideal, Realistic, Sensing

__all__ = ["Ideal", "Realistic", "Sensing"]
