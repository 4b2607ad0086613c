"""Layout of a recording: entities, properties and format, shared by writer, reader and blueprint."""

from collections.abc import Mapping, Sequence
from typing import TypeAlias

from spherical_wrist.channels import CHANNELS
from spherical_wrist.measure.metrics import METRICS

JSON: TypeAlias = "bool | int | float | str | Sequence[JSON] | Mapping[str, JSON] | None"
"""Value of a property."""

APPLICATION = "spherical_wrist"
FORMAT = max(3, *(metric.since for metric in METRICS.values()), *(channel.since for channel in CHANNELS.values()))
"""Number of the format, raised with every change that an older reader would misread, and by new metrics and channels.

1: the shapes of the arrays are known to the reader only; a channel that a run does not have is missing or not-a-number.
2: channels that a run does not have are absent, and the recording describes those that it has.
3: the bound on the tip error, and metrics that follow from it and from the motors' limits.
"""

TIMELINE = "sim_time"

WORLD = "world"
BASE = f"{WORLD}/base"
WRIST = f"{WORLD}/wrist"
DESIRED = f"{WORLD}/desired"
TIPS = {"tip": f"{WORLD}/tip/actual", "desired_tip": f"{WORLD}/tip/desired"}
"""Entities of the trails, by the array that they are drawn from."""

SERIES = "series"
"""Entity of all channels without a plot, one component each: an entity of its own costs 16 bytes a row more."""

EXPERIMENT_TEXT, METRICS_TEXT = "summary/experiment", "summary/metrics"

ABOUT, ARCHIVE, SEAL = "recording", "archive", "seal"
"""Groups of properties in which a recording describes itself."""

ZIP = "zip"
"""Component of the archive: the files that the run depends on."""


TIP_PLOT = "tip_error"
"""Name of the plot of the tip error, which has its bound beside it."""


def plot_entity(name: str) -> str:
    """Return the entity of a plot."""
    return f"plots/{name}"
