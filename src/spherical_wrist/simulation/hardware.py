"""What lies between the controller and the plant."""

from typing import NamedTuple

from spherical_wrist.actuation import Actuation
from spherical_wrist.actuation import Ideal as IdealActuation
from spherical_wrist.sensing import Ideal as IdealSensing
from spherical_wrist.sensing import Sensing


class Hardware(NamedTuple):
    """Sensors and motors.

    Attributes:
        sensing: the sensors.
        actuation: the motors.
        seed: of their random faults.
    """

    sensing: Sensing = IdealSensing()
    actuation: Actuation = IdealActuation()
    seed: int = 0
