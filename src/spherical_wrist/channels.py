"""The table of channels: every quantity that the closed loop logs or that follows from its log.

A channel is declared here once. Derived from it: the records COMMAND and LOG of the loop, the attributes of a run, the
layout of recordings, the plots of the viewer, the panels of the inspection sheet, exports, differences, and the tables
of the guides. To add a channel that a law writes: one entry here, and the law, which lists it in ``logs`` and writes
``command.<name>``.

This file imports no other part of the package, so that laws and loop can both stand on it.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from enum import IntEnum, StrEnum
from typing import Any

import numpy as np

WXYZ, XYZ = ("w", "x", "y", "z"), ("x", "y", "z")


class Source(StrEnum):
    """Origin of the values of a channel."""

    CLOCK = "control instants"
    LOOP = "logged by the closed loop"
    LAW = "written by the control law, logged by the closed loop"
    REFERENCE = "sampled from the reference"
    DISTURBANCE = "sampled from the disturbance"
    DERIVED = "computed from attitudes and geometry"
    STATE = "state of the control law"
    COILS = "coils of a spherical motor"


class Condition(StrEnum):
    """Part of an experiment without which a channel is absent."""

    ALWAYS = "every run"
    SURFACE = "laws with a sliding surface"
    LOGGED = "laws that log it"
    STATE = "laws that keep a state"
    SENSOR_FAULTS = "sensors with a fault"
    MOTOR_FAULTS = "motors with a fault"
    COILS = "spherical motors"


class Place(IntEnum):
    """Place of a plot in the viewer, from top to bottom. ``SCENE`` and ``STORED`` have no plot."""

    TIP = 0
    ERROR = 1
    TORQUE = 2
    SURFACE = 3
    HARDWARE = 4
    OTHER = 5
    SCENE = 6
    STORED = 7

    @property
    def has_plot(self) -> bool:
        """True if channels of this place have a plot."""
        return self < Place.SCENE


class Effect(StrEnum):
    """Curves that are plotted in place of a channel: its difference from another one."""

    ATTITUDE = "log(q⁻¹ ⊗ q_m)"
    SURPLUS = "channel − other"
    DEFICIT = "other − channel"
    DISTANCE = "1000 |channel − other|"


@dataclass(frozen=True, kw_only=True)
class Fault:
    """Plot that shows a channel as its difference from the channel that it would equal without faults or errors.

    Attributes:
        name: name of the plot.
        title: title of the plot.
        symbol: symbol of the difference.
        unit: unit of the difference.
        other: channel that it is compared with.
        effect: kind of difference.
    """

    name: str
    title: str
    symbol: str
    unit: str
    other: str
    effect: Effect


@dataclass(frozen=True, kw_only=True)
class Channel:
    """One quantity over time.

    Attributes:
        name: name of the array.
        unit: unit; empty for none.
        axes: names of the components of a row; empty for one number a row; None for numbers from 0.
        symbol: symbol in plots.
        title: title of plots.
        meaning: meaning in words, with frame.
        source: origin of the values.
        when: condition without which a run does not have it.
        place: place of its plot in the viewer. By default every channel has a plot and a panel.
        first: True for the plot that comes first in its place.
        heading: title of the panel in the inspection sheet; the title if empty.
        fault: plot of a difference that stands in for the channel.
        units: units of the components, where they differ from each other.
        groups: names of the groups of components that share a plot, one for each component; one plot if empty.
        since: format of recordings that has it first, of a channel that every run has.
    """

    name: str
    unit: str
    axes: tuple[str, ...] | None
    symbol: str
    title: str
    meaning: str
    source: Source = Source.LAW
    when: Condition = Condition.LOGGED
    place: Place = Place.OTHER
    first: bool = False
    heading: str = ""
    fault: Fault | None = None
    units: tuple[str, ...] = ()
    groups: tuple[str, ...] = ()
    since: int = 1

    @property
    def is_attitude(self) -> bool:
        """True for quaternions, which differ by an angle; other channels differ by the norm of a vector."""
        return self.axes == WXYZ

    @property
    def is_scalar(self) -> bool:
        """True if a row is one number."""
        return self.axes == ()

    @property
    def shape(self) -> tuple[int, ...]:
        """Shape of a row in LOG or COMMAND."""
        return (len(self.axes),) if self.axes else ()

    @property
    def difference_unit(self) -> str:
        """Unit of the difference of two rows."""
        return "rad" if self.is_attitude else self.unit

    def components(self, count: int) -> list[str]:
        """Return the names of the ``count`` components of a row; one empty name for a scalar."""
        if self.is_scalar:
            return [""]
        return list(self.axes) if self.axes and len(self.axes) == count else [str(k) for k in range(count)]

    def unit_of(self, component: int) -> str:
        """Return the unit of one component."""
        return self.units[component] if component < len(self.units) else self.unit


_FAULT_PLOT: Mapping[str, Any] = {"place": Place.HARDWARE, "source": Source.LOOP}

_TABLE = (
    Channel(
        name="time", unit="s", axes=(), symbol="t", title="Time", meaning="control instant",
        source=Source.CLOCK, when=Condition.ALWAYS, place=Place.STORED,
    ),
    Channel(
        name="attitude", unit="", axes=WXYZ, symbol="q", title="Attitude",
        meaning="actual attitude, body → world (body → mount where the mount is turned)",
        source=Source.LOOP, when=Condition.ALWAYS, place=Place.SCENE,
    ),
    Channel(
        name="rate", unit="rad/s", axes=XYZ, symbol="ω", title="Rate", meaning="actual angular velocity ω, body frame",
        source=Source.LOOP, when=Condition.ALWAYS, place=Place.STORED,
    ),
    Channel(
        name="desired_attitude", unit="", axes=WXYZ, symbol="q_d", title="Desired attitude",
        meaning="desired attitude, in the frame of the actual one",
        source=Source.REFERENCE, when=Condition.ALWAYS, place=Place.SCENE,
    ),
    Channel(
        name="desired_rate", unit="rad/s", axes=XYZ, symbol="ω_d", title="Desired rate",
        meaning="desired angular velocity ω_d, desired frame",
        source=Source.REFERENCE, when=Condition.ALWAYS, place=Place.STORED,
    ),
    Channel(
        name="error", unit="rad", axes=XYZ, symbol="e", title="Attitude error",
        meaning="true attitude error e = log(q⁻¹ ⊗ q_d), body frame",
        source=Source.LOOP, when=Condition.ALWAYS, place=Place.ERROR, first=True,
    ),
    Channel(
        name="rate_error", unit="rad/s", axes=XYZ, symbol="ė", title="Rate error",
        meaning="true rate error ė = R_e ω_d − ω, body frame",
        source=Source.LOOP, when=Condition.ALWAYS, place=Place.SURFACE,
    ),
    Channel(
        name="surface", unit="rad/s", axes=XYZ, symbol="S", title="Sliding surface",
        meaning="sliding surface S = λα e + ė of the measured errors",
        when=Condition.SURFACE, place=Place.SURFACE, first=True,
    ),
    Channel(
        name="slope", unit="1/s", axes=XYZ, symbol="λα", title="Slope", meaning="slope λα of the sliding surface",
        when=Condition.SURFACE, place=Place.SURFACE,
    ),
    Channel(
        name="torque", unit="N·m", axes=XYZ, symbol="τ", title="Motor torque",
        meaning="torque τ delivered by the motors, mean over the control period, body frame",
        source=Source.LOOP, when=Condition.ALWAYS, place=Place.TORQUE, first=True,
    ),
    Channel(
        name="disturbance", unit="N·m", axes=XYZ, symbol="d", title="Disturbance",
        meaning="disturbance torque on the joint, from this instant on, body frame",
        source=Source.DISTURBANCE, when=Condition.ALWAYS, place=Place.TORQUE,
    ),
    Channel(
        name="tip", unit="m", axes=XYZ, symbol="p", title="Tool tip", meaning="tool tip, world frame",
        source=Source.DERIVED, when=Condition.ALWAYS, place=Place.TIP,
        fault=Fault(
            name="tip_error", title="Tip error", symbol="|Δp|", unit="mm", other="desired_tip", effect=Effect.DISTANCE,
        ),
    ),
    Channel(
        name="desired_tip", unit="m", axes=XYZ, symbol="p_d", title="Desired tool tip",
        meaning="tool tip at the desired attitude, world frame",
        source=Source.DERIVED, when=Condition.ALWAYS, place=Place.SCENE,
    ),
    Channel(
        name="saturated", unit="", axes=(), symbol="", title="Saturated",
        meaning="1 where a limit of motors or coils cut the torque, else 0",
        source=Source.LOOP, when=Condition.ALWAYS, place=Place.STORED,
    ),
    Channel(
        name="law_state", unit="", axes=None, symbol="state", title="State of the law",
        meaning="state of the law before its step",
        source=Source.STATE, when=Condition.STATE,
    ),
    Channel(
        name="measured_attitude", unit="", axes=WXYZ, symbol="q_m", title="Measured attitude",
        meaning="measured attitude, in the frame of the actual one",
        when=Condition.SENSOR_FAULTS, heading="Sensors: from true to measured attitude",
        fault=Fault(
            name="sensed_attitude", title="Attitude fault", symbol="Δq", unit="rad",
            other="attitude", effect=Effect.ATTITUDE,
        ),
        **_FAULT_PLOT,
    ),
    Channel(
        name="measured_rate", unit="rad/s", axes=XYZ, symbol="ω_m", title="Measured rate",
        meaning="measured angular velocity, body frame",
        when=Condition.SENSOR_FAULTS, heading="Sensors: measured − true rate",
        fault=Fault(
            name="sensed_rate", title="Rate fault", symbol="Δω", unit="rad/s",
            other="rate", effect=Effect.SURPLUS,
        ),
        **_FAULT_PLOT,
    ),
    Channel(
        name="commanded_torque", unit="N·m", axes=XYZ, symbol="τ_c", title="Commanded torque",
        meaning="torque asked of the motors, within their limits, body frame",
        when=Condition.MOTOR_FAULTS, heading="Motors: delivered − commanded torque",
        fault=Fault(
            name="made_torque", title="Torque fault", symbol="Δτ", unit="N·m",
            other="torque", effect=Effect.DEFICIT,
        ),
        **_FAULT_PLOT,
    ),
    Channel(
        name="current", unit="A", axes=None, symbol="i", title="Currents",
        meaning="current of a coil at the end of the period",
        source=Source.COILS, when=Condition.COILS, place=Place.HARDWARE, heading="Currents of the coils",
    ),
    Channel(
        name="condition", unit="", axes=(), symbol="κ", title="Condition number",
        meaning="condition number of the torque map that the currents were found with",
        when=Condition.COILS, heading="Condition number of the torque map", **_FAULT_PLOT,
    ),
)  # fmt: skip

CHANNELS: Mapping[str, Channel] = {channel.name: channel for channel in _TABLE}
"""Every channel by its name, in the order of exports and recordings."""

LAW_CHANNELS = tuple(channel.name for channel in _TABLE if channel.source is Source.LAW)
"""Channels that a law writes into its command, besides the torque."""


def _record(*channels: tuple[str, tuple[int, ...]]) -> np.dtype[Any]:
    return np.dtype([(name, "f8", shape) for name, shape in channels], align=True)


COMMAND = _record(("torque", CHANNELS["torque"].shape), *((name, CHANNELS[name].shape) for name in LAW_CHANNELS))
"""Record that a law writes."""

LOG = _record(*((each.name, each.shape) for each in _TABLE if each.source in (Source.LOOP, Source.LAW)))
"""Record that the closed loop logs at every control instant."""


_LISTS, _TEXTS = ("units", "groups"), ("unit", "symbol", "title", "meaning")


def channel_of(entry: Mapping[str, Any], name: str) -> Channel:
    """Return the channel that a recording describes, completed from the table.

    Args:
        entry: entries as :func:`description_of` returns them.
        name: name of the channel.

    Raises:
        KeyError: an entry is missing.
    """
    axes = entry["axes"]
    found: dict[str, Any] = {
        **{key: str(entry[key]) for key in _TEXTS},
        **{key: tuple(map(str, entry.get(key, ()))) for key in _LISTS},
        "axes": None if axes is None else tuple(map(str, axes)),
    }
    return replace(CHANNELS[name], **found) if name in CHANNELS else Channel(name=name, **found)


def description_of(channel: Channel) -> dict[str, Any]:
    """Return the description of a channel for a recording, so that a reader needs no table."""
    texts = {key: getattr(channel, key) for key in _TEXTS}
    lists = {key: list(getattr(channel, key)) for key in _LISTS if getattr(channel, key)}
    return {"axes": None if channel.axes is None else list(channel.axes), **texts, **lists}


def markdown_table() -> str:
    """Return the table as Markdown for the documentation."""
    rows = [("channel", "symbol", "numbers", "unit", "meaning", "exists for"), ("---",) * 6]
    for name, each in CHANNELS.items():
        numbers = "m" if each.axes is None else str(len(each.axes) or 1)
        rows.append((f"`{name}`", each.symbol, numbers, each.unit, each.meaning, str(each.when)))
    return "\n".join("| {} | {} | {} | {} | {} | {} |".format(*row) for row in rows)
