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


def with_hardware(values: Mapping[str, Any]) -> dict[str, Any]:
    """Replace ``hardware`` among the values of an experiment by those that it stands for; other values override them.

    A table of parameters without a name belongs to the part of that hardware: with ``hardware = "realistic"``,
    ``sensing = {"delay": 0.002}`` is the realistic sensors with another delay.

    Raises:
        UnknownNameError: the preset is unknown.
    """
    rest = dict(values)
    if "hardware" not in rest:
        return rest
    preset = hardware(rest.pop("hardware"))
    for part, name in preset.items():
        if isinstance(rest.get(part), Mapping):
            rest[part] = {"name": name, **rest[part]}
    return {**preset, **rest}


def hardware(name: str) -> Mapping[str, Any]:
    """Return the values of a preset.

    Raises:
        UnknownNameError: the preset is unknown.
    """
    if name not in HARDWARE:
        raise UnknownNameError("hardware", name, HARDWARE)
    return HARDWARE[name]
