"""Conversion of the log of the loop to a series."""

from collections.abc import Callable, Mapping
from dataclasses import replace
from typing import Any, NamedTuple, Self

import numpy.typing as npt

from spherical_wrist.actuation import Actuation, SphericalMotor
from spherical_wrist.arrays import Array
from spherical_wrist.channels import CHANNELS, Channel, Condition
from spherical_wrist.control.contract import Law
from spherical_wrist.kinematics import tip_position
from spherical_wrist.measure.series import Series
from spherical_wrist.sensing import Sensing
from spherical_wrist.wrist import Wrist


class Logged(NamedTuple):
    """Arrays of a call of the loop, one row per control instant; the log may be used again by the next call.

    Attributes:
        time: control instants [s].
        desired: the reference, MOTION.
        disturbance: torque on the joint from each instant on [N·m], (n, 3).
        log: LOG.
        states: the law's state, (n, m).
        currents: of the coils [A], (n, coils).
    """

    time: Array
    desired: npt.NDArray[Any]
    disturbance: Array
    log: npt.NDArray[Any]
    states: Array
    currents: Array

    def first(self, count: int) -> Self:
        """The first ``count`` rows."""
        return self.rows(slice(count))

    def rows(self, which: slice) -> Self:
        """Return the rows that a slice selects, as views."""
        return type(self)(*(array[which] for array in self))

    def series(self, wrist: Wrist, channels: Mapping[str, Channel]) -> Series:
        """Return these rows as a series of their own, which keeps nothing of the log alive.

        Args:
            wrist: the plant, whose tool tip is computed.
            channels: what the run has; see :func:`channels_of`.
        """
        attitude, desired = self.log["attitude"], self.desired["attitude"]
        other: dict[str, Callable[[], Array]] = {
            "time": self.time.copy,
            "desired_attitude": desired.copy,
            "desired_rate": self.desired["rate"].copy,
            "disturbance": self.disturbance.copy,
            "tip": lambda: tip_position(attitude, wrist.anchor, wrist.mount, wrist.lever),
            "desired_tip": lambda: tip_position(desired, wrist.anchor, wrist.mount, wrist.lever),
            "law_state": self.states.copy,
            "current": self.currents.copy,
        }
        arrays = {name: other[name]() if name in other else self.log[name].copy() for name in channels}
        return Series(channels=arrays, described={n: c for n, c in channels.items() if c is not CHANNELS[n]})


def channels_of(law: Law, sensing: Sensing, actuation: Actuation) -> dict[str, Channel]:
    """Return the channels of a run, in the order of the table.

    Args:
        law: the law, which declares what it writes.
        sensing: sensors.
        actuation: motors.
    """
    holds = {
        Condition.ALWAYS: True,
        Condition.SURFACE: law.has_surface,
        Condition.STATE: law.state_size > 0,
        Condition.SENSOR_FAULTS: not sensing.ideal,
        Condition.MOTOR_FAULTS: not actuation.ideal,
        Condition.COILS: isinstance(actuation, SphericalMotor),
    }
    found = {name: each for name, each in CHANNELS.items() if holds.get(each.when, name in law.logs)}
    if "law_state" in found:
        names, groups = law.state_names(), sorted(law.State.model_fields, key=len, reverse=True)
        found["law_state"] = replace(
            found["law_state"],
            axes=names,
            units=law.state_units(),
            groups=tuple(next(group for group in groups if f"{name}_".startswith(f"{group}_")) for name in names),
        )
    return found
