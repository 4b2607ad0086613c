"""The recorded arrays of a run, one row per control instant."""

from collections.abc import Sequence
from dataclasses import dataclass, field, fields
from typing import Any, Self

import numpy as np
import numpy.typing as npt

Array = npt.NDArray[np.float64]

WXYZ, XYZ = ("w", "x", "y", "z"), ("x", "y", "z")


def _column(unit: str, meaning: str, axes: tuple[str, ...] = XYZ) -> Any:
    return field(metadata={"unit": unit, "meaning": meaning, "axes": axes})


def _extra() -> Any:
    return field(default_factory=lambda: np.empty((0, 0)))


@dataclass(frozen=True, kw_only=True)
class Series:
    """Time series of a run, float64, all with the same number n of rows.

    Attributes:
        time: control instants [s], (n,).
        attitude: actual attitude, quaternion (w, x, y, z), body → world, (n, 4); of a wrist whose model starts turned,
            body → mount, the frame in which it starts.
        rate: actual angular velocity ω [rad/s], body frame, (n, 3).
        desired_attitude: desired attitude, (n, 4).
        desired_rate: desired angular velocity [rad/s], desired frame, (n, 3).
        error: true attitude error e = log(q⁻¹ q_d) [rad], body frame, (n, 3).
        rate_error: true ė = R_e ω_d − ω [rad/s], body frame, (n, 3).
        surface: sliding surface S = slope · e + ė [rad/s] of the measured errors, (n, 3); NaN for laws without one.
        slope: slope λα of the surface [1/s], (n, 3); NaN for laws without one.
        torque: torque that the motors deliver [N·m], body frame, the mean over the period that begins here, (n, 3).
        disturbance: torque added to the joint from this instant on [N·m], body frame, (n, 3).
        tip: tool tip in the world [m], (n, 3).
        desired_tip: where the tip would be at the desired attitude [m], (n, 3).
        saturated: 1 where a limit of motors or coils cut the torque that the law asked for, else 0, (n,).
        law_state: what the law keeps from step to step, before this instant's step. This and all that follows not every
            run has; of shape (n, m), with m = 0 where there is none.
        measured_attitude: what the sensors said, m = 4; of ideal sensors none, since it is ``attitude``.
        measured_rate: likewise [rad/s], m = 3.
        commanded_torque: torque asked of the motors, within their limits [N·m], m = 3; of ideal motors none, since it
            is ``torque``.
        current: of every coil of a spherical motor, at the end of the period [A], m = number of coils.
        condition: condition number of the torque map for which the currents were found, m = 1.
    """

    time: Array = _column("s", "control instant", ())
    attitude: Array = _column("", "actual attitude", WXYZ)
    rate: Array = _column("rad/s", "actual rate ω, body frame")
    desired_attitude: Array = _column("", "desired attitude", WXYZ)
    desired_rate: Array = _column("rad/s", "desired rate ω_d, desired frame")
    error: Array = _column("rad", "attitude error e, body frame")
    rate_error: Array = _column("rad/s", "rate error ė, body frame")
    surface: Array = _column("rad/s", "sliding surface S")
    slope: Array = _column("1/s", "slope λα of the sliding surface")
    torque: Array = _column("N·m", "torque τ of the motors, body frame")
    disturbance: Array = _column("N·m", "disturbance torque, body frame")
    tip: Array = _column("m", "tool tip, world frame")
    desired_tip: Array = _column("m", "desired tool tip, world frame")
    saturated: Array = _column("", "a motor limit cut the torque", ())
    law_state: Array = _extra()
    measured_attitude: Array = _extra()
    measured_rate: Array = _extra()
    commanded_torque: Array = _extra()
    current: Array = _extra()
    condition: Array = _extra()

    def __post_init__(self) -> None:
        """Gives what the run has not, or has one number of, its two dimensions."""
        for name in EXTRAS:
            array = getattr(self, name)
            if array.ndim != 2 or not array.size:
                object.__setattr__(self, name, array.reshape(len(self.time), -1 if array.size else 0))

    @property
    def command(self) -> Array:
        """Torque asked of the motors, within their limits [N·m], (n, 3)."""
        return self.commanded_torque if self.commanded_torque.size else self.torque

    def __len__(self) -> int:
        """The number of rows."""
        return len(self.time)

    def arrays(self) -> dict[str, Any]:
        """Every array by name: the columns and the extras."""
        return {name: getattr(self, name) for name in (*COLUMNS, *EXTRAS)}

    def rows(self, which: slice) -> "Series":
        """The rows that a slice selects, as views."""
        return Series(**{name: array[which] for name, array in self.arrays().items()})

    @classmethod
    def joined(cls, parts: Sequence["Series"]) -> Self:
        """Several series, one after the other."""
        pieces = [part.arrays() for part in parts if len(part)] or [parts[0].arrays()]
        return cls(**{name: np.concatenate([piece[name] for piece in pieces]) for name in pieces[0]})

    @classmethod
    def empty(cls) -> Self:
        """A series of no rows."""
        return cls(**{name: np.empty((0, width) if width else 0) for name, width in WIDTHS.items()})


EXTRAS = ("law_state", "measured_attitude", "measured_rate", "commanded_torque", "current", "condition")
"""Arrays that not every run has."""

COLUMNS = {column.name: column.metadata for column in fields(Series) if column.metadata}
"""Unit, meaning and axes of every array of a series, by name."""

WIDTHS = {name: len(info["axes"]) for name, info in COLUMNS.items()}
"""Components per row; 0 where the array has one number per row."""
