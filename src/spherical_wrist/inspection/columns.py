"""Channels of a series as plain columns: one number a row each, with a name that says its unit."""

from collections.abc import Iterator
from typing import NamedTuple

from spherical_wrist.arrays import Array
from spherical_wrist.measure.series import Series

_PLAIN = str.maketrans({"·": "_", "²": "2", "³": "3", "Ω": "Ohm", "µ": "u", "°": "deg", "%": "percent", " ": "_"})


class Column(NamedTuple):
    """One column.

    Attributes:
        name: such as ``error_x_rad``.
        unit: such as ``rad``; empty for none.
        meaning: meaning in words.
        values: float64, (n,); a view.
    """

    name: str
    unit: str
    meaning: str
    values: Array


def columns(series: Series) -> Iterator[Column]:
    """Return every column of a series, in a fixed order: ``time_s``, ``attitude_w``, … ``condition``."""
    for name, array in series.channels.items():
        channel = series.channel(name)
        rows = array.reshape(len(array), -1) if array.size else array.reshape(len(array), *(channel.shape or (1,)))
        for k, component in enumerate(channel.components(rows.shape[1])):
            unit = channel.unit_of(k)
            words = f"{channel.meaning}, {component.replace('_', ' ')}" if component else channel.meaning
            parts = (name, component, _spelled(unit))
            yield Column("_".join(filter(None, parts)), unit, words, rows[:, k])


def _spelled(unit: str) -> str:
    """Return a unit as the end of a name: N·m as ``Nm``, rad·s as ``rad_s``, 1/s as ``per_s``."""
    above, *below = unit.replace("N·m", "Nm").translate(_PLAIN).split("/")
    return "_per_".join([above, *below]).removeprefix("1_")
