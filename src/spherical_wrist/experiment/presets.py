"""Presets of hardware: values of several parameters of an experiment, by name."""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.errors import UnknownNameError

HARDWARE: Mapping[str, Mapping[str, Any]] = {
    "ideal": {"sensing": "ideal", "actuation": "ideal", "friction": 0.0},
    "realistic": {"sensing": "realistic", "actuation": "realistic", "friction": 1e-3},
}
"""Values of an experiment's parameters, by name of the hardware.

``realistic``: realistic sensors and motors, as their classes describe them, and 1e-3 N·m of dry friction in the bearing
of the ball. The friction assumes a preload of 3.3 N on a plain bearing of 30 mm radius with a friction coefficient of
0.01, the smallest value for plain bearings in JTEKT's catalogue of Koyo bearings.
"""


def hardware(name: str) -> Mapping[str, Any]:
    """Return the values of a preset.

    Raises:
        UnknownNameError: the preset is unknown.
    """
    if name not in HARDWARE:
        raise UnknownNameError("hardware", name, HARDWARE)
    return HARDWARE[name]
