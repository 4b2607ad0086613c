"""Where things are in a recording: what writer, reader and blueprint agree on."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

JSON: TypeAlias = "bool | int | float | str | Sequence[JSON] | Mapping[str, JSON] | None"
"""What a property may be."""

APPLICATION = "spherical_wrist"
FORMAT = 1
"""Version of this layout, raised with every change that an older reader would misread."""

TIMELINE = "sim_time"

WORLD = "world"
BASE = f"{WORLD}/base"
WRIST = f"{WORLD}/wrist"
DESIRED = f"{WORLD}/desired"
TIPS = {"tip": f"{WORLD}/tip/actual", "desired_tip": f"{WORLD}/tip/desired"}
"""Entities of the trails, by the array that they are drawn from."""

PLOTTED = {
    "error": ("Attitude error", "e"),
    "surface": ("Sliding surface", "S"),
    "torque": ("Motor torque", "τ"),
    "rate_error": ("Rate error", "ė"),
    "disturbance": ("Disturbance", "d"),
    "slope": ("Slope", "λα"),
}
"""Arrays with an entity, and so a plot, of their own; the most telling first. With title and symbol.

The other arrays share an entity: every one costs 16 bytes a row more.
"""

HARDWARE = {
    "sensed_attitude": ("Attitude fault", "Δq", "rad"),
    "sensed_rate": ("Rate fault", "Δω", "rad/s"),
    "made_torque": ("Torque fault", "Δτ", "N·m"),
    "current": ("Currents", "i", "A"),
    "condition": ("Condition number", "κ", ""),
}
"""Plots of sensors and motors that are not ideal: title, symbol and unit.

Those that are named like an array are that array; the others follow from several, and are not read back.
"""

SERIES = "series"
"""Entity of all arrays that have none of their own, one component each."""

EXPERIMENT_TEXT, METRICS_TEXT = "summary/experiment", "summary/metrics"

ABOUT, ARCHIVE, SEAL = "recording", "archive", "seal"
"""Groups of properties in which the recording describes itself."""

ZIP = "zip"
"""Component of the archive: the files that the run depends on."""


def plot_entity(name: str) -> str:
    """Entity of one plotted array."""
    return f"plots/{name}"
