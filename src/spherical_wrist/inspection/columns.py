"""The arrays of a series as plain columns: one number a row each, with a name that says its unit."""

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np
import numpy.typing as npt

from spherical_wrist.simulation.series import COLUMNS, EXTRAS, WXYZ, XYZ, Series

Array = npt.NDArray[np.float64]

_OF_EXTRAS: dict[str, tuple[str, str, tuple[str, ...] | None]] = {
    "law_state": ("", "state of the law, in units of its own", None),
    "measured_attitude": ("", "measured attitude", WXYZ),
    "measured_rate": ("rad/s", "measured rate, body frame", XYZ),
    "commanded_torque": ("N·m", "torque asked of the motors, body frame", XYZ),
    "current": ("A", "current of a coil", None),
    "condition": ("", "condition number of the torque map", ()),
}
"""Unit, meaning and axes of the arrays that not every series has; None for axes with numbers from 0."""

INFO = {
    **{name: (info["unit"], info["meaning"], info["axes"]) for name, info in COLUMNS.items()},
    **{name: _OF_EXTRAS[name] for name in EXTRAS},
}
"""Unit, meaning and axes of every array, in the order of the columns."""

_SPELLED = {"": "", "rad/s": "_rad_per_s", "1/s": "_per_s", "N·m": "_Nm"}
_SPELLED |= {plain: f"_{plain}" for plain in ("s", "rad", "m", "A")}
"""Units at the end of a name."""


class Column(NamedTuple):
    """One column.

    Attributes:
        name: such as ``error_x_rad``.
        unit: such as ``rad``; empty for none.
        meaning: in words.
        values: float64, (n,); a view.
    """

    name: str
    unit: str
    meaning: str
    values: Array


def columns(series: Series) -> Iterator[Column]:
    """Every column that a series has, in a fixed order: ``time_s``, ``attitude_w``, … ``condition``."""
    for name, array in series.arrays().items():
        unit, meaning, axes = INFO[name]
        if array.ndim == 1:
            yield Column(name + _SPELLED[unit], unit, meaning, array)
            continue
        count = array.shape[1]
        marks = [""] if axes == () else [f"_{mark}" for mark in axes or range(count)]
        for mark, values in zip(marks, array.T, strict=count > 0):
            yield Column(name + mark + _SPELLED[unit], unit, f"{meaning}{mark.replace('_', ', ')}", values)
