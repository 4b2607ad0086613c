"""Values of experiments that belong together, by name."""

from collections.abc import Mapping
from typing import Any

from spherical_wrist.errors import UnknownNameError

HARDWARE: Mapping[str, Mapping[str, Any]] = {
    "ideal": {"sensing": "ideal", "actuation": "ideal", "friction": 0.0},
    "realistic": {"sensing": "realistic", "actuation": "realistic", "friction": 1e-3},
}
"""Values of an experiment's parameters, by the name of the hardware.

``realistic``: sensors and motors as their own descriptions say, and 1e-3 N·m of dry friction in the ball's bearing: a
preload of 3.3 N, an assumption, on a plain bearing of 30 mm radius and a friction coefficient of 0.01, the least that
JTEKT's catalogue of Koyo bearings gives for plain ones.
"""


def hardware(name: str) -> Mapping[str, Any]:
    """The values that stand for a kind of hardware.

    Raises:
        UnknownNameError: there is none of that name.
    """
    if name not in HARDWARE:
        raise UnknownNameError("hardware", name, HARDWARE)
    return HARDWARE[name]
