"""Time series of a run: its channels by name, one row per control instant."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from itertools import groupby
from typing import NamedTuple, Self

import numpy as np

from spherical_wrist.arrays import Array
from spherical_wrist.channels import CHANNELS, XYZ, Channel, Condition, Effect, Place
from spherical_wrist.so3 import attitude_errors


class Plot(NamedTuple):
    """Curves of one plot.

    Attributes:
        name: name of the plot, unique in a run.
        channel: the channel that it shows.
        title: title.
        heading: title of the panel in the inspection sheet.
        symbol: symbol.
        unit: unit; empty for none.
        curves: values, (n, m).
        axes: names of the m components; one empty name for a scalar.
    """

    name: str
    channel: Channel
    title: str
    heading: str
    symbol: str
    unit: str
    curves: Array
    axes: list[str]

    @property
    def is_stored(self) -> bool:
        """True if the curves are components of the channel itself, and not computed from several."""
        return self.channel.fault is None

    @property
    def labels(self) -> list[str]:
        """Names of the curves."""
        return [f"{self.symbol} {axis}".strip() for axis in self.axes]


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class Series:
    """Channels of a run, as attributes and by name: ``run.error`` is ``run.channels["error"]``.

    A channel that a run does not have is absent: ``"surface" in run.channels`` is False, and ``run.surface`` raises an
    AttributeError that says why. ``wrist guide conventions`` lists all channels.

    Attributes:
        channels: float64 arrays (n,), (n, 3), (n, 4) or (n, m), all with the same number n of rows.
        described: descriptions of channels where they are not those of :data:`spherical_wrist.channels.CHANNELS`, such
            as the state of a law with the names of its components.
    """

    channels: Mapping[str, Array]
    described: Mapping[str, Channel] = field(default_factory=dict, repr=False)

    def __getattr__(self, name: str) -> Array:
        """Return a channel.

        Raises:
            AttributeError: the run does not have it.
        """
        channels: Mapping[str, Array] = self.__dict__.get("channels", {})
        if name in channels:
            return channels[name]
        if name in CHANNELS:
            raise AttributeError(
                f"this run has no channel {name!r}, which exists for {CHANNELS[name].when}; "
                f"it has: {', '.join(channels)}"
            )
        raise AttributeError(f"{type(self).__name__!r} object has no attribute {name!r}")

    def __dir__(self) -> list[str]:
        """List attributes, channels among them."""
        return [*super().__dir__(), *self.channels]

    def __repr__(self) -> str:
        """Return the number of rows, and the names of the channels."""
        return f"<{type(self).__name__} of {len(self)} rows: {', '.join(self.channels)}>"

    def __len__(self) -> int:
        """Return the number of rows."""
        return len(self.channels["time"])

    @property
    def command(self) -> Array:
        """Torque asked of the motors, within their limits [N·m], (n, 3)."""
        return self.channels.get("commanded_torque", self.channels["torque"])

    def channel(self, name: str) -> Channel:
        """Return the description of a channel of this run."""
        return self.described.get(name) or CHANNELS[name]

    def rows(self, which: slice) -> "Series":
        """Return the rows that a slice selects, as views."""
        return Series(channels={name: array[which] for name, array in self.channels.items()}, described=self.described)

    def replaced(self, **channels: Array) -> Self:
        """Return a copy with some channels replaced or added."""
        return replace(self, channels={**self.channels, **channels})

    @classmethod
    def joined(cls, parts: Sequence["Series"]) -> "Series":
        """Concatenate series of the same channels; parts without rows are left out."""
        pieces = [part for part in parts if len(part)] or [parts[0]]
        names = pieces[0].channels
        joined = {name: np.concatenate([piece.channels[name] for piece in pieces]) for name in names}
        return Series(channels=joined, described=pieces[0].described)

    @classmethod
    def empty(cls) -> Self:
        """Return a series of no rows, with the channels that every run has."""
        kept = [channel for channel in CHANNELS.values() if channel.when is Condition.ALWAYS]
        return cls(channels={channel.name: np.empty((0, *channel.shape)) for channel in kept})

    def plots(self) -> Iterator[Plot]:
        """Return the plots of all channels that have one, in the order of their places in the viewer."""
        shown = [channel for channel in map(self.channel, self.channels) if channel.place.has_plot]
        for channel in sorted(shown, key=lambda channel: (channel.place, not channel.first)):
            yield from self._plots(channel)

    def _plots(self, channel: Channel) -> Iterator[Plot]:
        values, fault = self.channels[channel.name], channel.fault
        if fault is not None:
            curves = _difference(fault.effect, values, self.channels[fault.other])
            heading = channel.heading or fault.title
            axes = list(XYZ) if curves.shape[1] > 1 else [""]
            yield Plot(fault.name, channel, fault.title, heading, fault.symbol, fault.unit, curves, axes)
            return
        rows = values.reshape(len(values), -1)
        axes = channel.components(rows.shape[1])
        if len(channel.groups) != len(axes):
            heading = channel.heading or channel.title
            yield Plot(channel.name, channel, channel.title, heading, channel.symbol, channel.unit, rows, axes)
            return
        first = 0
        for group, members in groupby(channel.groups):
            last = first + len(list(members))
            words = group.replace("_", " ")
            title, heading = f"{channel.symbol.capitalize()}: {words}", f"{channel.title}: {words}"
            inner = [axis.removeprefix(group).strip("_").replace("_", " ") for axis in axes[first:last]]
            unit, curves = channel.unit_of(first), rows[:, first:last]
            yield Plot(f"{channel.name}/{group}", channel, title, heading, words, unit, curves, inner)
            first = last


def in_place(plots: Sequence[Plot], *places: Place) -> list[Plot]:
    """Return the plots of some places."""
    return [plot for plot in plots if plot.channel.place in places]


def _difference(effect: Effect, values: Array, other: Array) -> Array:
    """Compute the curves of a fault, (n, 3) or (n, 1). The last rows of a diverged run may hold anything."""
    with np.errstate(all="ignore"):
        if effect is Effect.ATTITUDE:
            return attitude_errors(other, values)
        if effect is Effect.DISTANCE:
            distance: Array = 1000.0 * np.linalg.norm(values - other, axis=1, keepdims=True)
            return distance
        return values - other if effect is Effect.SURPLUS else other - values
